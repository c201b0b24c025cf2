//! What a kill would otherwise lose: the messages of the chunk that is still open.
//!
//! Chunks must end where the frames say, never where the clock says, or the same scene would not give the same bytes.
//! A slow run may then take hours to fill one. So each frame is also appended, uncompressed, to `<output>.part.tail`,
//! and the tail is emptied whenever a chunk closes. It never holds more than one chunk.
//! Frames that fill a chunk on their own never reach it.
//!
//! What is appended is written when somebody asks for it: where frames follow each other so fast that a write for each would be
//! felt, many go in one.
//!
//! The tail is an MCAP file without chunks and without end, so that any MCAP reader can make sense of it.

use std::fs::File;
use std::io::{Cursor, Seek, Write};
use std::path::{Path, PathBuf};

use mcap::records::op;

use super::container::{Message, create_writer};

/// The tail.
#[derive(Debug)]
pub(super) struct Journal {
    path: PathBuf,
    file: File,
    /// Magic, header, schemas and channels.
    preamble: Vec<u8>,
    /// Whether the file holds anything.
    used: bool,
    /// What has not been written.
    pending: Vec<u8>,
}

impl Journal {
    /// Empties or creates the file.
    pub(super) fn create(path: &Path) -> std::io::Result<Self> {
        let file = File::create(path)?;
        Ok(Journal { path: path.to_owned(), file, preamble: Vec::new(), used: false, pending: Vec::new() })
    }

    /// Says which channels later messages may use. The journal must be empty.
    pub(super) fn set_channels(&mut self, channels: &[mcap::Channel<'static>]) -> mcap::McapResult<()> {
        let mut writer = mcap::WriteOptions::new().use_chunks(false).library(super::LIBRARY);
        writer = writer.compression(None);
        let mut writer = create_writer(writer, Cursor::new(Vec::new()), channels)?;
        writer.flush()?;
        self.preamble = writer.into_inner().into_inner();
        Ok(())
    }

    /// Appends the messages of a group, to be written.
    pub(super) fn append(&mut self, group: &[Message<'_>]) {
        if !self.used {
            self.pending.extend_from_slice(&self.preamble);
        }
        for Message { header, data } in group {
            // Opcode, length, channel, sequence, log time, publish time, data.
            self.pending.push(op::MESSAGE);
            self.pending.extend_from_slice(&(22 + data.len() as u64).to_le_bytes());
            self.pending.extend_from_slice(&header.channel_id.to_le_bytes());
            self.pending.extend_from_slice(&header.sequence.to_le_bytes());
            self.pending.extend_from_slice(&header.log_time.to_le_bytes());
            self.pending.extend_from_slice(&header.publish_time.to_le_bytes());
            self.pending.extend_from_slice(data);
        }
        self.used = true;
    }

    /// Writes what has been appended, whole groups in one write, so that a kill leaves all of one or, rarely, a beginning.
    pub(super) fn write(&mut self) -> std::io::Result<()> {
        let written = self.file.write_all(&self.pending);
        self.pending.clear();
        written
    }

    /// Forgets all messages: they are now in a closed chunk.
    pub(super) fn clear(&mut self) -> std::io::Result<()> {
        self.pending.clear();
        if self.used {
            self.file.set_len(0)?;
            self.file.rewind()?;
            self.used = false;
        }
        Ok(())
    }

    /// Removes the file: everything is in a complete recording.
    pub(super) fn remove(mut self) -> std::io::Result<()> {
        // Or it would be written to a file without a name.
        self.pending.clear();
        std::fs::remove_file(&self.path)
    }
}

/// Whoever drops a recorder finds all of its frames.
impl Drop for Journal {
    fn drop(&mut self) {
        // There is nobody left to tell; the frames written before are readable all the same.
        let _ = self.write();
    }
}
