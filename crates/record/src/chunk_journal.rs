//! Journal of the open chunk: messages that a kill would otherwise lose.
//!
//! Chunks must end where the frames say, never where the clock says, or the same scene would not give the
//! same bytes. A slow run may then take hours to fill one. So each frame is also appended, uncompressed, to
//! `<output>.part.tail`, and the tail is emptied whenever a chunk closes. It never holds more than one
//! chunk. Frames that fill a chunk on their own never reach it.
//!
//! Appended data are written on demand: where frames follow each other so fast that a write for each would
//! be felt, many go in one.
//!
//! The tail is an MCAP file without chunks and without end, so that any MCAP reader can make sense of it.

use std::io::{self, Cursor, ErrorKind};
use std::path::PathBuf;

use mcap::records::op;

use super::container::{Message, create_writer};
use super::sink::Tail;

/// Bytes of a message beside its data: opcode, length, channel, sequence number, two times.
const HEADER_BYTES: usize = 1 + 8 + 22;

/// The tail.
#[derive(Debug)]
pub(super) struct ChunkJournal {
    path: PathBuf,
    file: Box<dyn Tail>,
    /// Magic, header, schemas and channels.
    preamble: Vec<u8>,
    /// True if the file holds anything.
    used: bool,
    /// Bytes that have not been written.
    pending: Vec<u8>,
    /// Places in `pending` at which frames end.
    frame_ends: Vec<usize>,
    /// Frames that the file holds, from their first byte to their last.
    frames: u64,
    /// True if the file ends within a message, after which nothing can be read.
    is_cut: bool,
}

impl ChunkJournal {
    /// A journal in `file`, which is at `path`, and empty.
    pub(super) fn new(path: PathBuf, file: Box<dyn Tail>) -> Self {
        let (preamble, pending, frame_ends) = (Vec::new(), Vec::new(), Vec::new());
        ChunkJournal { path, file, preamble, used: false, pending, frame_ends, frames: 0, is_cut: false }
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

    /// Appends the messages of a group, all of a frame where `ends_frame`, to be written.
    pub(super) fn append(&mut self, group: &[Message<'_>], ends_frame: bool) {
        if self.is_cut {
            return;
        }
        if !self.used {
            self.pending.extend_from_slice(&self.preamble);
        }
        // A frame of many may be as large as a chunk: the memory of one, not of two.
        let bytes = group.iter().map(|message| HEADER_BYTES + message.data.len()).sum::<usize>();
        if bytes > self.pending.capacity() {
            self.pending.reserve_exact(bytes);
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
        if ends_frame {
            self.frame_ends.push(self.pending.len());
        }
    }

    /// Frames that the file holds.
    pub(super) fn frames(&self) -> u64 {
        self.frames
    }

    /// Writes what has been appended, whole groups in one write, so that a kill leaves all of one or,
    /// rarely, a beginning.
    pub(super) fn write(&mut self) -> io::Result<()> {
        let (written, result) = self.write_pending();
        self.frames += self.frame_ends.iter().filter(|end| **end <= written).count() as u64;
        self.is_cut |= result.is_err();
        self.pending.clear();
        self.frame_ends.clear();
        result
    }

    /// Writes what has been appended, and returns when it is on the disk.
    pub(super) fn secure(&mut self) -> io::Result<()> {
        self.write()?;
        self.file.sync()
    }

    /// Writes what has been appended; returns how many bytes of it the file took.
    fn write_pending(&mut self) -> (usize, io::Result<()>) {
        let mut written = 0;
        while written < self.pending.len() {
            match self.file.write(&self.pending[written..]) {
                Ok(0) => return (written, Err(ErrorKind::WriteZero.into())),
                Ok(bytes) => written += bytes,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return (written, Err(error)),
            }
        }
        (written, Ok(()))
    }

    /// Forgets all messages: they are now in a closed chunk.
    pub(super) fn clear(&mut self) -> io::Result<()> {
        self.pending.clear();
        self.frame_ends.clear();
        self.frames = 0;
        if self.used {
            self.file.empty()?;
            self.used = false;
        }
        Ok(())
    }

    /// Removes the file: everything is in a complete recording.
    pub(super) fn remove(mut self) -> io::Result<()> {
        // Or it would be written to a file without a name.
        self.pending.clear();
        std::fs::remove_file(&self.path)
    }
}

/// Drop writes what is pending.
impl Drop for ChunkJournal {
    fn drop(&mut self) {
        // An error cannot be returned; the frames written before are readable all the same.
        let _ = self.write();
    }
}
