//! MCAP file under construction: metadata, attachments and channels first, then groups of messages in
//! chunks.
//!
//! A group holds messages that belong together: all of one frame, or one warning. Chunks end between
//! groups, after [`CHUNK_BYTES`] of messages, a rule that depends on the messages only.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Channel, McapError, McapResult, WriteOptions, Writer};
use pliant_files::disk::File;

use super::chunk_journal::ChunkJournal;

/// Message bytes after which a chunk is closed. Large, so that compression finds the mesh of the previous
/// frame.
pub(super) const CHUNK_BYTES: u64 = 4 << 20;

/// One encoded message.
#[derive(Clone, Debug)]
pub(super) struct Message<'a> {
    /// Channel, sequence number and time.
    pub(super) header: MessageHeader,
    /// The encoded message.
    pub(super) data: Cow<'a, [u8]>,
}

impl<'a> Message<'a> {
    /// Message whose two times are the same simulated time.
    pub(super) fn new(channel_id: u16, sequence: u32, log_time: u64, data: &'a [u8]) -> Self {
        let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        Message { header, data: Cow::Borrowed(data) }
    }
}

/// MCAP file under construction.
pub(super) struct Container<W: Write + Seek> {
    writer: Writer<W>,
    journal: Option<ChunkJournal>,
    channels: Vec<Channel<'static>>,
    /// Message bytes in the open chunk.
    open_bytes: u64,
    /// Number of frames in the open chunk.
    open_frames: u64,
    /// Number of frames in closed chunks.
    closed_frames: u64,
    /// True after a write error, when nothing more is written.
    has_failed: bool,
    /// Error of that failure, until it is fetched.
    failure: Option<McapError>,
    /// File behind the writer, for syncing.
    file: Option<File>,
    /// True once a checkpoint relies on the data: it must be on the disk.
    is_secured: bool,
}

impl<W: Write + Seek> Container<W> {
    /// Begins a file. Without a journal, a kill loses the open chunk.
    pub(super) fn create(stream: W, journal: Option<ChunkJournal>) -> McapResult<Self> {
        let options = WriteOptions::new()
            .library(super::LIBRARY)
            // Chunks are closed here, between groups, never by the writer within one.
            .chunk_size(None);
        let options = compressed(options);
        let writer = create_writer(options, stream, &[])?;
        Ok(Container {
            writer,
            journal,
            channels: Vec::new(),
            open_bytes: 0,
            open_frames: 0,
            closed_frames: 0,
            has_failed: false,
            failure: None,
            file: None,
            is_secured: false,
        })
    }

    /// Writes named key-value pairs.
    pub(super) fn metadata(&mut self, name: &str, metadata: BTreeMap<String, String>) -> McapResult<()> {
        self.writer.write_metadata(&Metadata { name: name.to_owned(), metadata })
    }

    /// Attaches a file, without wall-clock times: both are 0.
    pub(super) fn attach(&mut self, name: &str, media_type: &str, data: Cow<'_, [u8]>) -> McapResult<()> {
        let (name, media_type) = (name.to_owned(), media_type.to_owned());
        self.writer.attach(&Attachment { log_time: 0, create_time: 0, name, media_type, data })
    }

    /// Adds channels. Closes the open chunk, so that the journal is empty and can start again with them.
    pub(super) fn add_channels(&mut self, channels: &[Channel<'static>]) -> McapResult<()> {
        self.flush()?;
        for channel in channels {
            add_channel(&mut self.writer, channel)?;
        }
        self.channels.extend_from_slice(channels);
        if let Some(journal) = &mut self.journal {
            journal.set_channels(&self.channels)?;
        }
        Ok(())
    }

    /// True if a channel with this number was added.
    pub(super) fn has_channel(&self, id: u16) -> bool {
        self.channels.iter().any(|channel| channel.id == id)
    }

    /// Writes messages that belong together; a kill loses those of the open chunk.
    pub(super) fn write(&mut self, group: &[Message<'_>]) -> McapResult<()> {
        let ends_chunk = self.is_ended_by(group);
        for Message { header, data } in group {
            self.writer.write_to_known_channel(header, data)?;
        }
        self.open_bytes += bytes_of(group);
        if ends_chunk { self.flush() } else { Ok(()) }
    }

    /// Writes the messages of a frame with [`keep`](Self::keep).
    pub(super) fn keep_frame(&mut self, group: &[Message<'_>], durable: Option<&dyn Fn()>) {
        self.keep_group(group, true, durable);
    }

    /// Writes messages that belong together, and calls `durable`, if given, once a kill cannot lose them
    /// any more. After a write error these and all later messages go to the journal only, and
    /// [`failure`](Self::failure) returns the error.
    pub(super) fn keep(&mut self, group: &[Message<'_>], durable: Option<&dyn Fn()>) {
        self.keep_group(group, false, durable);
    }

    fn keep_group(&mut self, group: &[Message<'_>], is_frame: bool, durable: Option<&dyn Fn()>) {
        let ends_chunk = !self.has_failed && self.is_ended_by(group);
        if !ends_chunk {
            self.note(group, is_frame, durable);
        }
        if self.has_failed {
            return;
        }
        self.open_frames += u64::from(is_frame);
        match self.write(group) {
            Err(error) => {
                self.fail(error);
                if ends_chunk {
                    self.note(group, is_frame, durable);
                }
            }
            Ok(()) if ends_chunk => durable.into_iter().for_each(|durable| durable()),
            Ok(()) => {}
        }
    }

    /// Sets the file behind the writer.
    pub(super) fn sync_with(&mut self, file: File) {
        self.file = Some(file);
    }

    /// Waits until all messages are on the disk, those of the open chunk in the journal; the bytes of the
    /// file do not depend on it. From then on a closed chunk is on the disk before the journal is
    /// emptied.
    pub(super) fn secure(&mut self) -> McapResult<()> {
        self.is_secured = true;
        self.journal.as_mut().map_or(Ok(()), ChunkJournal::secure)?;
        self.sync()
    }

    fn sync(&self) -> McapResult<()> {
        let file = self.file.as_ref().filter(|_| self.is_secured);
        Ok(file.map_or(Ok(()), File::sync_all)?)
    }

    /// Error that prevented writing messages given to [`keep`](Self::keep), returned once.
    pub(super) fn failure(&mut self) -> Option<McapError> {
        self.failure.take()
    }

    /// True if messages given to [`keep`](Self::keep) could not be written.
    pub(super) fn has_failed(&self) -> bool {
        self.has_failed
    }

    fn fail(&mut self, error: McapError) {
        self.has_failed = true;
        self.failure.get_or_insert(error);
    }

    /// Appends to the journal, and writes it if `durable` is to be called.
    fn note(&mut self, group: &[Message<'_>], is_frame: bool, durable: Option<&dyn Fn()>) {
        let Some(journal) = &mut self.journal else { return };
        journal.append(group, is_frame);
        if let Some(durable) = durable {
            match journal.write() {
                Ok(()) => durable(),
                Err(error) => self.fail(McapError::Io(error)),
            }
        }
    }

    /// True if the open chunk is to be closed after this group.
    fn is_ended_by(&self, group: &[Message<'_>]) -> bool {
        self.open_bytes + bytes_of(group) >= CHUNK_BYTES
    }

    /// Closes the open chunk and hands everything to the operating system.
    pub(super) fn flush(&mut self) -> McapResult<()> {
        self.writer.flush()?;
        self.open_bytes = 0;
        self.closed_frames += std::mem::take(&mut self.open_frames);
        self.sync()?;
        // Last: until then the messages are in both files, and recovery removes duplicates.
        if let Some(journal) = &mut self.journal {
            journal.clear()?;
        }
        Ok(())
    }

    /// Number of frames that recovery finds, after writing pending data to the journal: after a write
    /// error, the first frame lost.
    pub(super) fn salvage(&mut self) -> u64 {
        salvage(self.closed_frames, self.journal.as_mut())
    }

    /// Writes indexes and the end of the file.
    ///
    /// # Errors
    /// A write error, with the number of frames that recovery finds.
    pub(super) fn finish(mut self) -> Result<Finished<W>, (McapError, u64)> {
        match self.writer.finish() {
            Ok(_) => {}
            Err(error) => return Err((error, self.salvage())),
        }
        let (journal, closed_frames) = (self.journal, self.closed_frames);
        Ok(Finished { stream: self.writer.into_inner(), journal, closed_frames })
    }
}

/// Finished file, possibly not yet on the disk.
pub(super) struct Finished<W> {
    /// File to be synced.
    pub(super) stream: W,
    /// Journal to be removed.
    pub(super) journal: Option<ChunkJournal>,
    closed_frames: u64,
}

impl<W> Finished<W> {
    /// Number of frames that recovery finds, see [`Container::salvage`].
    pub(super) fn salvage(&mut self) -> u64 {
        salvage(self.closed_frames, self.journal.as_mut())
    }
}

/// Number of frames in closed chunks and, after writing its pending data, in the journal.
fn salvage(closed_frames: u64, journal: Option<&mut ChunkJournal>) -> u64 {
    closed_frames
        + journal.map_or(0, |journal| {
            // Frames that could not be written are not counted.
            let _ = journal.write();
            journal.frames()
        })
}

fn bytes_of(group: &[Message<'_>]) -> u64 {
    group.iter().map(|message| message.data.len() as u64).sum()
}

/// Options of compressed chunks.
#[cfg(not(target_family = "wasm"))]
fn compressed(options: WriteOptions) -> WriteOptions {
    // Without threads the bytes are the same on every machine.
    options.compression(Some(mcap::Compression::Zstd)).compression_level(1).compression_threads(0)
}

/// Options of chunks as they are: zstd is a library in C, which a browser does not have.
#[cfg(target_family = "wasm")]
fn compressed(options: WriteOptions) -> WriteOptions {
    options.compression(None)
}

/// Writer with these channels, under their own numbers.
pub(super) fn create_writer<W: Write + Seek>(
    options: WriteOptions,
    stream: W,
    channels: &[Channel<'static>],
) -> McapResult<Writer<W>> {
    let mut writer = options.create(stream)?;
    for channel in channels {
        add_channel(&mut writer, channel)?;
    }
    Ok(writer)
}

fn add_channel<W: Write + Seek>(writer: &mut Writer<W>, channel: &Channel<'static>) -> McapResult<()> {
    let mut schema_id = 0;
    if let Some(schema) = &channel.schema {
        schema_id = schema.id;
        writer.add_schema_with_id(schema_id, &schema.name, &schema.encoding, &schema.data)?;
    }
    let Channel { id, topic, message_encoding, metadata, .. } = channel;
    writer.add_channel_with_id(*id, schema_id, topic, message_encoding, metadata)?;
    Ok(())
}
