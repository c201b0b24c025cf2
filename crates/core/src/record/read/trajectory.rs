//! The frames of a complete file.

use std::path::Path;

use mcap::records::{MessageIndexEntry, Record};
use serde_json::Value;

use super::source::Source;
use crate::record::attachments::METADATA;
use crate::record::channel::{ENERGY, STATE};
use crate::record::clock::seconds;
use crate::record::error::read_error;
use crate::record::state::STRIDE;
use crate::record::{FORMAT_VERSION, RecordError};

/// The frames of a complete file, read one by one as they are asked for.
#[derive(Debug)]
pub struct Trajectory {
    source: Source,
    dimension: usize,
    vertex_count: usize,
    times: Vec<f64>,
    /// Chunk and entry of each message of `/state`.
    states: Vec<(usize, MessageIndexEntry)>,
    /// The chunk read last and its states: frames are mostly asked for in order.
    cached: Option<CachedChunk>,
}

/// The states of one chunk.
#[derive(Debug)]
struct CachedChunk {
    number: usize,
    /// Time and message.
    states: Vec<(u64, Vec<u8>)>,
}

/// One field of `/energy` over time, with the name that `info` and plots use: `total`, `linear_momentum[0]`,
/// `work.steps`.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name.
    pub name: String,
    /// One value per frame; NaN where a frame has none.
    pub values: Vec<f64>,
}

impl Trajectory {
    /// Opens a complete file and reads its index.
    ///
    /// # Errors
    /// [`RecordError::NotFinished`] for an unfinished file, [`RecordError::Unexpected`] for one of another program
    /// or of a newer version, [`RecordError::Read`], [`RecordError::NotMcap`], [`RecordError::Damaged`].
    pub fn open(path: &Path) -> Result<Self, RecordError> {
        let source = Source::open(path)?;
        let mut source = source.ok_or_else(|| RecordError::NotFinished { path: path.to_owned() })?;
        let unexpected = |what| RecordError::Unexpected { path: path.to_owned(), what };
        let index = source.summary.metadata_indexes.iter().find(|index| index.name == METADATA).cloned();
        let index = index.ok_or_else(|| unexpected("there is no metadata record `pliant`"))?;
        let Record::Metadata(record) = source.record_at(index.offset)? else {
            return Err(unexpected("there is no metadata record `pliant`"));
        };
        let number = |key: &str| record.metadata.get(key).and_then(|value| value.parse::<usize>().ok());
        if number("format_version").is_none_or(|version| version > FORMAT_VERSION as usize) {
            return Err(unexpected("the format version is unknown"));
        }
        let dimension = number("dimension").filter(|dimension| (1..=3).contains(dimension));
        let dimension = dimension.ok_or_else(|| unexpected("the dimension is missing"))?;
        let vertex_count =
            number("vertex_count").ok_or_else(|| unexpected("the number of vertices is missing"))?;

        let channel = [STATE.1, ENERGY.1].iter().find_map(|topic| source.channel(topic));
        let frames = channel.map_or(Ok(Vec::new()), |channel| source.messages(channel))?;
        let times = frames.iter().map(|(_, entry)| seconds(entry.log_time)).collect();
        let states = if source.channel(STATE.1).is_some() { frames } else { Vec::new() };
        Ok(Trajectory { source, dimension, vertex_count, times, states, cached: None })
    }

    /// 2 or 3.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Simulated time of each frame [s], within half a nanosecond; the column `time` of [`energy`](Self::energy) is
    /// exact.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Positions of a frame, flat `(vertex_count, dimension)` [m].
    ///
    /// # Errors
    /// [`RecordError::NoChannel`], [`RecordError::NoFrame`], [`RecordError::Read`], [`RecordError::Damaged`].
    pub fn positions(&mut self, frame: usize) -> Result<Vec<f64>, RecordError> {
        self.state(frame, 0)
    }

    /// Velocities of a frame, flat `(vertex_count, dimension)` [m/s].
    ///
    /// # Errors
    /// As [`positions`](Self::positions).
    pub fn velocities(&mut self, frame: usize) -> Result<Vec<f64>, RecordError> {
        self.state(frame, 3)
    }

    /// All of `/energy`, one column per field, by name.
    ///
    /// # Errors
    /// [`RecordError::NoChannel`], [`RecordError::Read`], [`RecordError::Damaged`].
    pub fn energy(&mut self) -> Result<Vec<Column>, RecordError> {
        let no_channel = || RecordError::NoChannel { path: self.source.path.clone(), topic: ENERGY.1 };
        let channel = self.source.channel(ENERGY.1).ok_or_else(no_channel)?;
        let mut rows = Vec::new();
        for number in 0..self.source.summary.chunk_indexes.len() {
            for record in self.source.chunk(number)? {
                if let Record::Message { header, data } = record
                    && header.channel_id == channel
                {
                    let what = "a message on /energy is not JSON";
                    let row = serde_json::from_slice(&data);
                    rows.push(
                        row.map_err(|_| RecordError::Unexpected { path: self.source.path.clone(), what })?,
                    );
                }
            }
        }
        Ok(columns(&rows))
    }

    /// Content of an attachment; `None` if there is none of that name.
    ///
    /// # Errors
    /// [`RecordError::Read`], [`RecordError::Damaged`].
    pub fn attachment(&mut self, name: &str) -> Result<Option<Vec<u8>>, RecordError> {
        let index = self.source.summary.attachment_indexes.iter().find(|index| index.name == name);
        let Some(offset) = index.map(|index| index.offset) else { return Ok(None) };
        match self.source.record_at(offset)? {
            Record::Attachment { data, .. } => Ok(Some(data.into_owned())),
            _ => Err(read_error(&self.source.path, mcap::McapError::BadIndex)),
        }
    }

    fn state(&mut self, frame: usize, first_field: usize) -> Result<Vec<f64>, RecordError> {
        let path = || self.source.path.clone();
        let Some(channel) = self.source.channel(STATE.1) else {
            return Err(RecordError::NoChannel { path: path(), topic: STATE.1 });
        };
        let count = self.states.len();
        let Some((chunk, entry)) = self.states.get(frame) else {
            return Err(RecordError::NoFrame { path: path(), frame, count });
        };
        let first = self.states.partition_point(|(other, _)| other < chunk);
        let (chunk, time) = (*chunk, entry.log_time);
        if self.cached.as_ref().is_none_or(|cached| cached.number != chunk) {
            let records = self.source.chunk(chunk)?.into_iter();
            let states = records.filter_map(|record| match record {
                Record::Message { header, data } if header.channel_id == channel => {
                    Some((header.log_time, data.into_owned()))
                }
                _ => None,
            });
            self.cached = Some(CachedChunk { number: chunk, states: states.collect() });
        }
        let cached = self.cached.as_ref().and_then(|cached| cached.states.get(frame - first));
        let data = cached.filter(|(other, _)| *other == time).map(|(_, data)| data);
        // `data` is the last field of the message, so its bytes are the last ones.
        let points =
            data.and_then(|data| data.len().checked_sub(STRIDE * self.vertex_count).map(|at| &data[at..]));
        let points = points.ok_or_else(|| read_error(&self.source.path, mcap::McapError::BadIndex))?;
        let mut values = Vec::with_capacity(self.vertex_count * self.dimension);
        for point in points.as_chunks::<STRIDE>().0 {
            let (numbers, _) = point[8 * first_field..].as_chunks::<8>();
            values.extend(numbers[..self.dimension].iter().map(|bytes| f64::from_le_bytes(*bytes)));
        }
        Ok(values)
    }
}

fn columns(rows: &[Value]) -> Vec<Column> {
    let mut columns: Vec<Column> = Vec::new();
    for (number, row) in rows.iter().enumerate() {
        visit_numbers(row, String::new(), &mut |name, value| {
            let at =
                columns.binary_search_by(|column| column.name.as_str().cmp(&name)).unwrap_or_else(|at| {
                    columns.insert(at, Column { name, values: vec![f64::NAN; rows.len()] });
                    at
                });
            columns[at].values[number] = value;
        });
    }
    columns
}

fn visit_numbers(value: &Value, name: String, visit: &mut dyn FnMut(String, f64)) {
    match value {
        Value::Object(fields) => {
            for (field, value) in fields {
                let separator = if name.is_empty() { "" } else { "." };
                visit_numbers(value, format!("{name}{separator}{field}"), visit);
            }
        }
        Value::Array(items) => {
            for (i, value) in items.iter().enumerate() {
                visit_numbers(value, format!("{name}[{i}]"), visit);
            }
        }
        other => {
            if let Some(number) = other.as_f64() {
                visit(name, number);
            }
        }
    }
}
