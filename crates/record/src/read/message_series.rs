//! The messages of one channel that has one per frame.

use mcap::records::{MessageIndexEntry, Record};

use super::recording_file::RecordingFile;
use crate::RecordError;
use crate::error::read_error;

/// Places of messages, and the content of the chunk read last: frames are mostly asked for in order.
#[derive(Debug)]
pub(super) struct MessageSeries {
    channel: u16,
    /// Bytes of the rows of a frame.
    bytes: usize,
    /// Chunk and entry of each message.
    messages: Vec<(usize, MessageIndexEntry)>,
    cached: Option<CachedChunk>,
}

/// The messages of one chunk.
#[derive(Debug)]
struct CachedChunk {
    number: usize,
    /// Time and message.
    messages: Vec<(u64, Vec<u8>)>,
}

impl MessageSeries {
    pub(super) fn new(
        channel: u16,
        stride: usize,
        rows: usize,
        messages: Vec<(usize, MessageIndexEntry)>,
    ) -> Self {
        MessageSeries { channel, bytes: stride.saturating_mul(rows), messages, cached: None }
    }

    /// The rows of a frame, where messages end with rows.
    pub(super) fn rows(&mut self, source: &mut RecordingFile, frame: usize) -> Result<&[u8], RecordError> {
        let bytes = self.bytes;
        let path = source.path.clone();
        let data = self.message(source, frame)?;
        // `data` is the last field of the message, so its bytes are the last ones.
        let rows = data.len().checked_sub(bytes).map(|at| &data[at..]);
        rows.ok_or_else(|| read_error(&path, mcap::McapError::BadIndex))
    }

    /// The message of a frame.
    pub(super) fn message(&mut self, source: &mut RecordingFile, frame: usize) -> Result<&[u8], RecordError> {
        let count = self.messages.len();
        let Some((chunk, entry)) = self.messages.get(frame) else {
            return Err(RecordError::NoFrame { path: source.path.clone(), frame, count });
        };
        let first = self.messages.partition_point(|(other, _)| other < chunk);
        let (chunk, time) = (*chunk, entry.log_time);
        if self.cached.as_ref().is_none_or(|cached| cached.number != chunk) {
            let records = source.chunk(chunk)?.into_iter();
            let messages = records.filter_map(|record| match record {
                Record::Message { header, data } if header.channel_id == self.channel => {
                    Some((header.log_time, data.into_owned()))
                }
                _ => None,
            });
            self.cached = Some(CachedChunk { number: chunk, messages: messages.collect() });
        }
        let cached = self.cached.as_ref().and_then(|cached| cached.messages.get(frame - first));
        let data = cached.filter(|(other, _)| *other == time).map(|(_, data)| &data[..]);
        data.ok_or_else(|| read_error(&source.path, mcap::McapError::BadIndex))
    }
}
