//! Summary of a file.

use std::collections::{BTreeMap, HashMap};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use mcap::records::Record;
use serde::Serialize;

use super::recording_file::RecordingFile;
use super::walk::walk;
use crate::RecordError;
use crate::attachments::{BodySummary, METADATA};
use crate::channels::last_of_frame;
use crate::clock::seconds;
use crate::outcome::{OUTCOME, RecordedOutcome};
use crate::paths;
use pliant_files::disk;

/// Summary of a file. Everything specific to files of this program is optional.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FileInfo {
    /// The file.
    pub path: PathBuf,
    /// Size, including the tail of an unfinished file.
    pub bytes: u64,
    /// Completeness of the file.
    pub state: FileState,
    /// Outcome of the run; `None` in unfinished files.
    pub outcome: Option<RecordedOutcome>,
    /// Title of the scene.
    pub title: Option<String>,
    /// Number of frames.
    pub frames: u64,
    /// Simulated time of the first message [s].
    pub start_time: f64,
    /// Simulated time of the last message [s].
    pub end_time: f64,
    /// 2 or 3.
    pub dimension: Option<usize>,
    /// Number of vertices.
    pub vertices: Option<usize>,
    /// The bodies.
    pub bodies: Vec<BodySummary>,
    /// The channels, by topic.
    pub topics: Vec<TopicSummary>,
    /// Attachments in the order of the file.
    pub attachments: Vec<AttachmentSummary>,
    /// The metadata record `pliant`.
    pub metadata: BTreeMap<String, String>,
}

/// Completeness of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FileState {
    /// The file has its end and its indexes.
    Complete,
    /// The file is truncated: being written, or its writer was killed.
    Unfinished,
}

/// Summary of one channel.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TopicSummary {
    /// Topic.
    pub topic: String,
    /// Name of the schema.
    pub schema: Option<String>,
    /// Encoding, `protobuf` or `json`.
    pub encoding: String,
    /// Number of messages.
    pub messages: u64,
}

/// Summary of one attachment.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct AttachmentSummary {
    /// Name.
    pub name: String,
    /// Size.
    pub bytes: u64,
}

/// Summarises a file. Only the index of a complete file is read; of an unfinished one every record,
/// including those in the tail.
///
/// # Errors
/// [`RecordError::Read`], [`RecordError::NotMcap`]; [`RecordError::Damaged`] if a complete file is
/// inconsistent.
pub fn info(path: &Path) -> Result<FileInfo, RecordError> {
    // A recorder that was only dropped leaves a file with an end, but its last frames are in the tail.
    let has_tail = disk::metadata(paths::tail_of(path)).is_ok_and(|tail| tail.len() > 0);
    let gathered = match RecordingFile::open(path)? {
        Some(source) if !has_tail => from_summary(source)?,
        _ => from_records(path)?,
    };
    Ok(gathered.into_info(path))
}

/// Facts gathered by either way of reading.
struct GatheredInfo {
    bytes: u64,
    state: FileState,
    /// Topics by channel number.
    topics: BTreeMap<u16, TopicSummary>,
    /// First and last time of messages [ns].
    times: Option<(u64, u64)>,
    attachments: Vec<AttachmentSummary>,
    metadata: HashMap<String, BTreeMap<String, String>>,
}

fn from_summary(mut source: RecordingFile) -> Result<GatheredInfo, RecordError> {
    let statistics = source.summary.stats.clone().unwrap_or_default();
    let counts = &statistics.channel_message_counts;
    let topic = |channel: &mcap::Channel<'_>| TopicSummary {
        topic: channel.topic.clone(),
        schema: channel.schema.as_ref().map(|schema| schema.name.clone()),
        encoding: channel.message_encoding.clone(),
        messages: counts.get(&channel.id).copied().unwrap_or(0),
    };
    let topics = source.summary.channels.values().map(|channel| (channel.id, topic(channel))).collect();
    let mut indexes = source.summary.attachment_indexes.clone();
    indexes.sort_by_key(|index| index.offset);
    let attachments =
        indexes.into_iter().map(|index| AttachmentSummary { name: index.name, bytes: index.data_size });
    let mut metadata = HashMap::new();
    for index in source.summary.metadata_indexes.clone() {
        if let Record::Metadata(record) = source.record_at(index.offset)? {
            metadata.insert(record.name, record.metadata);
        }
    }
    let times = (statistics.message_start_time, statistics.message_end_time);
    Ok(GatheredInfo {
        bytes: source.size,
        state: FileState::Complete,
        topics,
        times: (statistics.message_count > 0).then_some(times),
        attachments: attachments.collect(),
        metadata,
    })
}

fn from_records(path: &Path) -> Result<GatheredInfo, RecordError> {
    let tail = paths::tail_of(path);
    let size = |path: &Path| disk::metadata(path).map_or(0, |metadata| metadata.len());
    let mut gathered = GatheredInfo {
        bytes: size(path) + size(&tail),
        state: FileState::Unfinished,
        topics: BTreeMap::new(),
        times: None,
        attachments: Vec::new(),
        metadata: HashMap::new(),
    };
    let mut schemas = HashMap::new();
    let mut next_sequences: HashMap<u16, u32> = HashMap::new();
    let mut visit = |_: u64, record: Record<'static>| {
        match record {
            Record::Schema { header, .. } => {
                schemas.insert(header.id, header.name);
            }
            Record::Channel(channel) => {
                let schema = schemas.get(&channel.schema_id).cloned();
                let (topic, encoding) = (channel.topic, channel.message_encoding);
                let summary = TopicSummary { topic, schema, encoding, messages: 0 };
                gathered.topics.entry(channel.id).or_insert(summary);
            }
            Record::Message { header, .. } => {
                let next = next_sequences.entry(header.channel_id).or_insert(0);
                // The tail may repeat messages that have reached a chunk.
                if header.sequence >= *next
                    && let Some(topic) = gathered.topics.get_mut(&header.channel_id)
                {
                    *next = header.sequence.saturating_add(1);
                    topic.messages += 1;
                    let time = header.log_time;
                    let (start, end) = gathered.times.unwrap_or((time, time));
                    gathered.times = Some((start.min(time), end.max(time)));
                }
            }
            Record::Attachment { header, data, .. } => {
                gathered.attachments.push(AttachmentSummary { name: header.name, bytes: data.len() as u64 });
            }
            Record::Metadata(record) => {
                gathered.metadata.insert(record.name, record.metadata);
            }
            _ => {}
        }
        Ok(ControlFlow::Continue(()))
    };
    walk(path, &mut visit)?;
    if size(&tail) > 0 {
        walk(&tail, &mut visit)?;
    }
    Ok(gathered)
}

impl GatheredInfo {
    fn into_info(mut self, path: &Path) -> FileInfo {
        let metadata = self.metadata.remove(METADATA).unwrap_or_default();
        let number = |key: &str| metadata.get(key).and_then(|value| value.parse().ok());
        let bodies = metadata.get("bodies").and_then(|bodies| serde_json::from_str(bodies).ok());
        // Each frame is on every one of these channels that exists, except frames omitted from /mesh.
        let frames = last_of_frame(self.topics.keys().copied()).and_then(|id| self.topics.get(&id));
        let (start, end) = self.times.unwrap_or((0, 0));
        let mut topics: Vec<TopicSummary> = self.topics.values().cloned().collect();
        topics.sort_by(|a, b| a.topic.cmp(&b.topic));
        FileInfo {
            path: path.to_owned(),
            bytes: self.bytes,
            state: self.state,
            outcome: self.metadata.get(OUTCOME).and_then(RecordedOutcome::from_metadata),
            title: metadata.get("title").cloned(),
            frames: frames.map_or(0, |topic| topic.messages),
            start_time: seconds(start),
            end_time: seconds(end),
            dimension: number("dimension"),
            vertices: number("vertex_count"),
            bodies: bodies.unwrap_or_default(),
            topics,
            attachments: self.attachments,
            metadata,
        }
    }
}
