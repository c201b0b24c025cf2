//! Journal of the open chunk: messages that a kill would otherwise lose.
//!
//! Chunks end after fixed amounts of data, independent of the wall clock, so that the same scene gives
//! the same bytes. A slow run may take hours to fill one. Each frame is therefore also appended,
//! uncompressed, to `<output>.part.tail`, which is emptied whenever a chunk closes. The tail never holds
//! more than one chunk. Frames that fill a chunk on their own never reach it.
//!
//! Appended data are written on demand: where frames follow each other so fast that a write for each
//! would cost time, one write takes many.
//!
//! The tail is an MCAP file without chunks and without end, so that any MCAP reader can read it.

use std::io::{self, Cursor, ErrorKind};
use std::path::PathBuf;

use mcap::records::op;
use pliant_files::disk;

use super::container::{Message, create_writer};
use super::sink::Tail;

/// Bytes of a message in addition to its data: opcode, length, channel, sequence number, two times.
const HEADER_BYTES: usize = 1 + 8 + 22;

/// Journal file of the open chunk.
#[derive(Debug)]
pub(super) struct ChunkJournal {
    path: PathBuf,
    file: Box<dyn Tail>,
    /// Magic number, header, schemas and channels.
    preamble: Vec<u8>,
    /// True if the file is not empty.
    used: bool,
    /// Bytes not yet written.
    pending: Vec<u8>,
    /// Positions in `pending` at which frames end.
    frame_ends: Vec<usize>,
    /// Number of frames that the file holds completely.
    frames: u64,
    /// True if the file ends within a message, after which nothing can be read.
    is_cut: bool,
}

impl ChunkJournal {
    /// Journal in the empty `file` at `path`.
    pub(super) fn new(path: PathBuf, file: Box<dyn Tail>) -> Self {
        let (preamble, pending, frame_ends) = (Vec::new(), Vec::new(), Vec::new());
        ChunkJournal { path, file, preamble, used: false, pending, frame_ends, frames: 0, is_cut: false }
    }

    /// Sets the channels that later messages may use. The journal must be empty.
    pub(super) fn set_channels(&mut self, channels: &[mcap::Channel<'static>]) -> mcap::McapResult<()> {
        let mut writer = mcap::WriteOptions::new().use_chunks(false).library(super::LIBRARY);
        writer = writer.compression(None);
        let mut writer = create_writer(writer, Cursor::new(Vec::new()), channels)?;
        writer.flush()?;
        self.preamble = writer.into_inner().into_inner();
        Ok(())
    }

    /// Appends the messages of a group for writing; `ends_frame` if they complete a frame.
    pub(super) fn append(&mut self, group: &[Message<'_>], ends_frame: bool) {
        if self.is_cut {
            return;
        }
        if !self.used {
            self.pending.extend_from_slice(&self.preamble);
        }
        // A large frame may fill a chunk: reserve the memory of one, not of two.
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

    /// Number of frames that the file holds.
    pub(super) fn frames(&self) -> u64 {
        self.frames
    }

    /// Writes what has been appended, whole groups in one write, so that a kill leaves all of a group or,
    /// rarely, a beginning of it.
    pub(super) fn write(&mut self) -> io::Result<()> {
        let (written, result) = self.write_pending();
        self.frames += self.frame_ends.iter().filter(|end| **end <= written).count() as u64;
        self.is_cut |= result.is_err();
        self.pending.clear();
        self.frame_ends.clear();
        result
    }

    /// Writes what has been appended and waits until it is on the disk.
    pub(super) fn secure(&mut self) -> io::Result<()> {
        self.write()?;
        self.file.sync()
    }

    /// Writes what has been appended; returns the number of bytes that the file took.
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

    /// Discards all messages, which are now in a closed chunk.
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

    /// Removes the file once the recording is complete.
    pub(super) fn remove(mut self) -> io::Result<()> {
        // Otherwise dropping would write to a removed file.
        self.pending.clear();
        disk::remove_file(&self.path)
    }
}

/// Dropping writes what is pending.
impl Drop for ChunkJournal {
    fn drop(&mut self) {
        // An error cannot be returned; the frames written before stay readable.
        let _ = self.write();
    }
}
