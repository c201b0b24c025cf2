//! Messages of a channel that has one per frame.

use mcap::records::MessageIndexEntry;

use super::recording_file::RecordingFile;
use crate::RecordError;
use crate::error::read_error;

/// Positions of the messages of a channel.
#[derive(Debug)]
pub(super) struct MessageSeries {
    channel: u16,
    /// Bytes of the rows of a frame.
    bytes: usize,
    /// Chunk and index entry of each message.
    messages: Vec<(usize, MessageIndexEntry)>,
}

impl MessageSeries {
    pub(super) fn new(
        channel: u16,
        stride: usize,
        rows: usize,
        messages: Vec<(usize, MessageIndexEntry)>,
    ) -> Self {
        MessageSeries { channel, bytes: stride.saturating_mul(rows), messages }
    }

    /// Rows of a frame, for messages that end with rows.
    pub(super) fn rows<'a>(
        &self,
        source: &'a mut RecordingFile,
        frame: usize,
    ) -> Result<&'a [u8], RecordError> {
        let path = source.path.clone();
        let data = self.message(source, frame)?;
        // `data` is the last field of the message, so its bytes are the last ones.
        let rows = data.len().checked_sub(self.bytes).map(|at| &data[at..]);
        rows.ok_or_else(|| read_error(&path, mcap::McapError::BadIndex))
    }

    /// Message of a frame.
    pub(super) fn message<'a>(
        &self,
        source: &'a mut RecordingFile,
        frame: usize,
    ) -> Result<&'a [u8], RecordError> {
        let count = self.messages.len();
        let Some((chunk, entry)) = self.messages.get(frame) else {
            return Err(RecordError::NoFrame { path: source.path.clone(), frame, count });
        };
        source.message(self.channel, *chunk, entry)
    }
}
