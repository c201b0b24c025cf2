//! Frames of a complete file.

use std::collections::BTreeMap;
use std::path::Path;

use mcap::Summary;
use mcap::records::Record;

use super::message_series::MessageSeries;
use super::recording_file::RecordingFile;
use super::tables::{Column, GrowingColumns};
use crate::FORMAT_VERSION;
use crate::RecordError;
use crate::attachments::{MASS, METADATA, REST};
use crate::channels::elements::{BodyRows, PLACE};
use crate::channels::state::STRIDE;
use crate::channels::{contacts, energy, is_in_every_frame, last_of_frame, probe, reactions, state};
use crate::clock::seconds;
use crate::error::read_error;
use pliant::diagnostics::{Measure, RecordedField};
use pliant::energy::SurfaceContact;

/// Frames of a complete file, read on request.
#[derive(Debug)]
pub struct Trajectory {
    source: RecordingFile,
    dimension: usize,
    vertex_count: usize,
    times: Vec<f64>,
    states: Option<MessageSeries>,
    /// Channels of elements and vertices already requested, by channel number.
    fields: BTreeMap<u16, MessageSeries>,
    contacts: Option<MessageSeries>,
    /// JSON channels already requested, by topic.
    tables: BTreeMap<String, Vec<Column>>,
}

/// Field of elements or vertices in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedRows {
    /// Names of the columns of `values`.
    pub fields: Vec<String>,
    /// Unit of the values, `1` if dimensionless.
    pub unit: String,
    /// Row ranges of the bodies with elements; within a body, rows are in the order of its elements or
    /// vertices.
    pub bodies: Vec<BodyRows>,
    /// Centroids of elements or positions of vertices in this frame, flat `(rows, 3)` [m].
    pub places: Vec<f64>,
    /// Values of the field, flat `(rows, fields)`.
    pub values: Vec<f64>,
}

impl Trajectory {
    /// Opens a complete file and reads its index.
    ///
    /// # Errors
    /// [`RecordError::NotFinished`] for an unfinished file, [`RecordError::Unexpected`] for one of
    /// another program or of a newer version, [`RecordError::Read`], [`RecordError::NotMcap`],
    /// [`RecordError::Damaged`].
    pub fn open(path: &Path) -> Result<Self, RecordError> {
        let source = RecordingFile::open(path)?;
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
        if !is_that_of_attachments(vertex_count, dimension, &source.summary) {
            return Err(unexpected("the number of vertices is not that of their rest positions"));
        }
        if !is_that_of_states(vertex_count, &source.summary) {
            return Err(unexpected("the number of vertices is not that of the rows of /state"));
        }

        // Any channel with a message in every frame gives the frame times.
        let channel =
            last_of_frame(source.summary.channels.keys().copied()).filter(|id| is_in_every_frame(*id));
        let frames = channel.map_or(Ok(Vec::new()), |channel| source.messages(channel))?;
        let times = frames.iter().map(|(_, entry)| seconds(entry.log_time)).collect();
        let states =
            source.channel(state::TOPIC).map(|id| MessageSeries::new(id, STRIDE, vertex_count, frames));
        let fields = BTreeMap::new();
        let tables = BTreeMap::new();
        Ok(Trajectory { source, dimension, vertex_count, times, states, fields, contacts: None, tables })
    }

    /// File path.
    pub(crate) fn path(&self) -> &Path {
        &self.source.path
    }

    /// Names of the recorded probes.
    pub(crate) fn probes(&self) -> Vec<String> {
        let channels = self.source.summary.channels.values();
        let names = channels.filter_map(|channel| probe::name_in(&channel.topic).map(str::to_owned));
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    }

    /// Dimension, 2 or 3.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// Simulated time of each frame [s], to within half a nanosecond; the column `time` of
    /// [`energy`](Self::energy) is exact.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Positions of a frame, flat `(vertex_count, dimension)` [m].
    ///
    /// # Errors
    /// [`RecordError::NoChannel`], [`RecordError::NoFrame`], [`RecordError::Read`],
    /// [`RecordError::Damaged`].
    pub fn positions(&mut self, frame: usize) -> Result<Vec<f64>, RecordError> {
        self.state(frame, 0)
    }

    /// Velocities of a frame, flat `(vertex_count, dimension)` [m/s].
    ///
    /// # Errors
    /// The errors of [`positions`](Self::positions).
    pub fn velocities(&mut self, frame: usize) -> Result<Vec<f64>, RecordError> {
        self.state(frame, 3)
    }

    /// Reads all of `/energy`, one column per field, sorted by name.
    ///
    /// # Errors
    /// [`RecordError::NoChannel`], [`RecordError::Read`], [`RecordError::Damaged`].
    pub fn energy(&mut self) -> Result<Vec<Column>, RecordError> {
        self.columns(energy::TOPIC)
    }

    /// Reads all of `/reactions`, one column per field, sorted by name: `time`, `beam/left.force[0]`; NaN
    /// after the release of a pin.
    ///
    /// # Errors
    /// The errors of [`energy`](Self::energy).
    pub fn reactions(&mut self) -> Result<Vec<Column>, RecordError> {
        self.columns(reactions::TOPIC)
    }

    /// Reads the contacts of a frame, in the order of the run.
    ///
    /// # Errors
    /// The errors of [`positions`](Self::positions); [`RecordError::Unexpected`] if a message is
    /// malformed.
    pub fn contacts(&mut self, frame: usize) -> Result<Vec<SurfaceContact>, RecordError> {
        /// One message of `/contacts`.
        #[derive(serde::Deserialize)]
        struct ContactsMessage {
            contacts: Vec<SurfaceContact>,
        }
        let path = self.source.path.clone();
        let Some(id) = self.source.channel(contacts::TOPIC) else {
            return Err(RecordError::NoChannel { path, topic: contacts::TOPIC.to_owned() });
        };
        let series = match &mut self.contacts {
            Some(series) => series,
            series => series.insert(MessageSeries::new(id, 0, 0, self.source.messages(id)?)),
        };
        let message = series.message(&mut self.source, frame)?;
        let read: Result<ContactsMessage, _> = serde_json::from_slice(message);
        let what = "a message of `/contacts` is none of contacts";
        read.map(|read| read.contacts).map_err(|_| RecordError::Unexpected { path, what })
    }

    /// Reads all readings of a probe, one column per field, sorted by name: `time`, `position[0]`,
    /// `cauchy_stress[3]`.
    ///
    /// # Errors
    /// The errors of [`energy`](Self::energy).
    pub fn probe(&mut self, name: &str) -> Result<Vec<Column>, RecordError> {
        self.columns(&probe::topic(name))
    }

    /// Reads all of a JSON channel, one column per field, sorted by name.
    ///
    /// # Errors
    /// The errors of [`energy`](Self::energy); [`RecordError::Unexpected`] if a message is not JSON.
    pub fn columns(&mut self, topic: &str) -> Result<Vec<Column>, RecordError> {
        if self.source.channel(topic).is_none() {
            return Err(RecordError::NoChannel { path: self.source.path.clone(), topic: topic.to_owned() });
        }
        Ok(self.tables(&[topic])?.into_iter().flatten().collect())
    }

    /// Reads the columns of several channels, empty for a channel that was not recorded. All that have
    /// not been requested before are read in one pass, because decompressing the chunks takes longest.
    ///
    /// # Errors
    /// The errors of [`columns`](Self::columns), except for channels that were not recorded.
    pub fn tables(&mut self, topics: &[&str]) -> Result<Vec<Vec<Column>>, RecordError> {
        let mut messages = Vec::new();
        let mut missing: BTreeMap<&str, GrowingColumns> = BTreeMap::new();
        for &topic in topics.iter().filter(|topic| !self.tables.contains_key(**topic)) {
            if missing.insert(topic, GrowingColumns::default()).is_none()
                && let Some(channel) = self.source.channel(topic)
            {
                let places = self.source.messages(channel)?;
                messages.extend(places.into_iter().map(|(chunk, entry)| (chunk, topic, channel, entry)));
            }
        }
        messages.sort_by_key(|(chunk, ..)| *chunk);
        for (chunk, topic, channel, entry) in messages {
            let row = serde_json::from_slice(self.source.message(channel, chunk, &entry)?);
            let what = "a message of a channel of JSON objects is none";
            let path = || self.source.path.clone();
            let row = row.map_err(|_| RecordError::Unexpected { path: path(), what })?;
            missing.entry(topic).or_default().push(&row);
        }
        let read = missing.into_iter().map(|(topic, table)| (topic.to_owned(), table.into_columns()));
        self.tables.extend(read);
        Ok(topics.iter().map(|topic| self.tables.get(*topic).cloned().unwrap_or_default()).collect())
    }

    /// Content of an attachment; `None` if there is none with that name.
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

    /// Reference positions, flat `(vertex_count, dimension)` [m]; `None` if not recorded.
    ///
    /// # Errors
    /// The errors of [`attachment`](Self::attachment); [`RecordError::Unexpected`] if their number is
    /// wrong.
    pub fn rest_positions(&mut self) -> Result<Option<Vec<f64>>, RecordError> {
        let what = "rest.f64 has another number of coordinates";
        self.numbers(REST, self.vertex_count * self.dimension, what)
    }

    /// Masses of the vertices, of shape `(vertex_count,)` [kg]; `None` if not recorded.
    ///
    /// # Errors
    /// The errors of [`rest_positions`](Self::rest_positions).
    pub fn masses(&mut self) -> Result<Option<Vec<f64>>, RecordError> {
        self.numbers(MASS, self.vertex_count, "mass.f64 has another number of masses")
    }

    /// Doubles of an attachment, whose number must be `count`.
    fn numbers(
        &mut self,
        name: &str,
        count: usize,
        what: &'static str,
    ) -> Result<Option<Vec<f64>>, RecordError> {
        let Some(bytes) = self.attachment(name)? else { return Ok(None) };
        let (numbers, _) = bytes.as_chunks::<8>();
        if numbers.len() != count {
            return Err(RecordError::Unexpected { path: self.source.path.clone(), what });
        }
        Ok(Some(numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect()))
    }

    /// Reads a measure of every finite element in a frame.
    ///
    /// # Errors
    /// The errors of [`positions`](Self::positions); [`RecordError::Unexpected`] if the channel has
    /// another layout than in this version.
    pub fn elements(&mut self, measure: &Measure, frame: usize) -> Result<RecordedRows, RecordError> {
        self.field(&measure.of_elements(), frame)
    }

    /// Reads a field of elements or vertices in a frame.
    ///
    /// # Errors
    /// The errors of [`elements`](Self::elements).
    pub fn field(&mut self, field: &RecordedField, frame: usize) -> Result<RecordedRows, RecordError> {
        let path = self.source.path.clone();
        let topic = field.topic();
        let Some(id) = self.source.channel(&topic) else {
            return Err(RecordError::NoChannel { path, topic });
        };
        let metadata = self.source.summary.channels[&id].metadata.clone();
        let what = "a channel about elements or vertices is not laid out as it should be";
        let unexpected = || RecordError::Unexpected { path: path.clone(), what };
        let number = |key: &str| metadata.get(key).and_then(|value| value.parse::<usize>().ok());
        let (Some(rows), Some(stride), Some(fields)) =
            (number("point_count"), number("point_stride"), metadata.get("fields"))
        else {
            return Err(unexpected());
        };
        let columns: Vec<String> = fields.split(',').map(str::to_owned).collect();
        let bodies: Option<Vec<BodyRows>> =
            metadata.get("bodies").and_then(|bodies| serde_json::from_str(bodies).ok());
        let bodies = bodies.filter(|_| stride == 8 * columns.len() && columns.len() > PLACE.len());
        let bodies = bodies.filter(|_| rows.checked_mul(stride).is_some()).ok_or_else(unexpected)?;
        if !self.fields.contains_key(&id) {
            let messages = self.source.messages(id)?;
            self.fields.insert(id, MessageSeries::new(id, stride, rows, messages));
        }
        let Some(series) = self.fields.get_mut(&id) else { return Err(unexpected()) };
        let (mut places, mut values) = (Vec::new(), Vec::new());
        for row in series.rows(&mut self.source, frame)?.chunks_exact(stride) {
            let mut numbers = row.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes));
            places.extend(numbers.by_ref().take(PLACE.len()));
            values.extend(numbers);
        }
        let unit = metadata.get("unit").cloned().unwrap_or_default();
        Ok(RecordedRows { fields: columns[PLACE.len()..].to_vec(), unit, bodies, places, values })
    }

    /// Reads all recorded fields of elements and vertices in a frame.
    ///
    /// # Errors
    /// The errors of [`field`](Self::field), except for channels that were not recorded.
    pub fn fields(&mut self, frame: usize) -> Result<Vec<(RecordedField, RecordedRows)>, RecordError> {
        let mut found = Vec::new();
        for field in RecordedField::all() {
            match self.field(&field, frame) {
                Ok(rows) => found.push((field, rows)),
                Err(RecordError::NoChannel { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(found)
    }

    fn state(&mut self, frame: usize, first_field: usize) -> Result<Vec<f64>, RecordError> {
        let Some(states) = &mut self.states else {
            return Err(RecordError::NoChannel {
                path: self.source.path.clone(),
                topic: state::TOPIC.to_owned(),
            });
        };
        let (points, _) = states.rows(&mut self.source, frame)?.as_chunks::<STRIDE>();
        let mut values = Vec::with_capacity(points.len() * self.dimension);
        for point in points {
            let (numbers, _) = point[8 * first_field..].as_chunks::<8>();
            values.extend(numbers[..self.dimension].iter().map(|bytes| f64::from_le_bytes(*bytes)));
        }
        Ok(values)
    }
}

/// Pads rows of `dimension` to rows of three; `z = 0` in 2D.
pub fn in_space(values: &[f64], dimension: usize) -> Vec<f64> {
    let mut padded = Vec::with_capacity(values.len() / dimension * 3);
    for row in values.chunks_exact(dimension) {
        padded.extend((0..3).map(|axis| row.get(axis).copied().unwrap_or(0.0)));
    }
    padded
}

/// True if the number of vertices matches the attached reference positions; without these, if it fits
/// vertex indices.
fn is_that_of_attachments(vertex_count: usize, dimension: usize, summary: &Summary) -> bool {
    let numbered = u32::try_from(vertex_count).is_ok();
    let rest = summary.attachment_indexes.iter().find(|index| index.name == REST);
    numbered && rest.is_none_or(|rest| rest.data_size == (vertex_count * dimension * 8) as u64)
}

/// True if the channel of states, if any, states this number of vertices.
fn is_that_of_states(vertex_count: usize, summary: &Summary) -> bool {
    let states = summary.channels.values().find(|channel| channel.topic == state::TOPIC);
    let rows = states.and_then(|channel| channel.metadata.get("point_count"));
    rows.is_none_or(|rows| rows.parse() == Ok(vertex_count))
}
