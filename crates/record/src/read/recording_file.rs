//! Complete file: its index, and its records by position.

use std::borrow::Cow;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use mcap::records::{MessageIndexEntry, Record};
use mcap::{McapError, McapResult, Summary};

use super::chunk::{first_record, read_record, unpacked};
use super::lengths::parsed;
use super::summary;
use super::walk::{Visit, WalkStop, visit_all};
use crate::RecordError;
use crate::clock::seconds;
use crate::error::read_error;
use pliant_files::disk::File;
use pliant_files::regular_file;

/// A complete file.
#[derive(Debug)]
pub(super) struct RecordingFile {
    pub(super) path: PathBuf,
    pub(super) summary: Summary,
    pub(super) size: u64,
    file: File,
    /// Number and content of the chunk read last: most readers ask for consecutive frames, and for all
    /// channels of a frame.
    unpacked: Option<(usize, Vec<u8>)>,
}

impl RecordingFile {
    /// Reads the index; `None` for an MCAP file without an end.
    pub(super) fn open(path: &Path) -> Result<Option<Self>, RecordError> {
        let failed = |source| RecordError::Read { path: path.to_owned(), source };
        let mut file = regular_file::open(path).map_err(failed)?;
        let size = file.metadata().map_err(failed)?.len();
        ensure_mcap(&mut file, path)?;
        let summary = match summary::read(&mut file, size) {
            Ok(summary) => summary,
            Err(McapError::Io(source)) => return Err(failed(source)),
            Err(_) => None,
        };
        Ok(summary.map(|summary| RecordingFile {
            path: path.to_owned(),
            summary,
            size,
            file,
            unpacked: None,
        }))
    }

    /// Number of the channel with this topic.
    pub(super) fn channel(&self, topic: &str) -> Option<u16> {
        self.summary.channels.values().find(|channel| channel.topic == topic).map(|channel| channel.id)
    }

    /// Chunk and index entry of every message of a channel, chunk by chunk.
    pub(super) fn messages(&mut self, channel: u16) -> Result<Vec<(usize, MessageIndexEntry)>, RecordError> {
        let mut messages = Vec::new();
        for number in 0..self.summary.chunk_indexes.len() {
            let Some(&offset) = self.summary.chunk_indexes[number].message_index_offsets.get(&channel) else {
                continue;
            };
            if let Record::MessageIndex(index) = self.record_at(offset)? {
                messages.extend(index.records.into_iter().map(|entry| (number, entry)));
            }
        }
        Ok(messages)
    }

    /// Message of a channel at a position in a chunk, which is decompressed unless it was the last one.
    pub(super) fn message(
        &mut self,
        channel: u16,
        chunk: usize,
        entry: &MessageIndexEntry,
    ) -> Result<&[u8], RecordError> {
        if self.unpacked.as_ref().is_none_or(|(number, _)| *number != chunk) {
            // Frees the last chunk first, so that only one is in memory.
            self.unpacked = None;
            let content = self.chunk(chunk).map_err(|error| read_error(&self.path, error))?;
            self.unpacked = Some((chunk, content));
        }
        let content = self.unpacked.as_ref().map_or(&[][..], |(_, content)| &content[..]);
        message_at(content, channel, entry).map_err(|error| read_error(&self.path, error))
    }

    /// Content of a chunk, checked against the size in the index.
    fn chunk(&mut self, number: usize) -> McapResult<Vec<u8>> {
        let index = &self.summary.chunk_indexes[number];
        let (offset, size) = (index.chunk_start_offset, index.uncompressed_size);
        match parsed_at(&mut self.file, self.size, offset)? {
            Record::Chunk { header, data } if header.uncompressed_size == size => unpacked(&header, &data),
            _ => Err(McapError::BadIndex),
        }
    }

    /// Offsets and names of metadata, attachments and chunks, in the order of the file.
    pub(super) fn listed(&self) -> Vec<(u64, String)> {
        let summary = &self.summary;
        let metadata = summary.metadata_indexes.iter();
        let metadata = metadata.map(|index| (index.offset, format!("metadata `{}`", index.name)));
        let attachments = summary.attachment_indexes.iter();
        let attachments = attachments.map(|index| (index.offset, format!("attachment `{}`", index.name)));
        let chunks = summary.chunk_indexes.iter().map(|index| {
            let [start, end] = [index.message_start_time, index.message_end_time].map(seconds);
            (index.chunk_start_offset, format!("frames from t = {start} s to {end} s"))
        });
        let mut listed: Vec<_> = metadata.chain(attachments).chain(chunks).collect();
        listed.sort();
        listed
    }

    /// Hands the record at an offset to `visit`, or, for a chunk, its records. The inner error is damage
    /// to the record.
    pub(super) fn visit_at(
        &mut self,
        offset: u64,
        visit: &mut Visit<'_>,
    ) -> Result<McapResult<()>, RecordError> {
        let record = raw_at(&mut self.file, self.size, offset).map_err(WalkStop::Fault);
        match record.and_then(|(opcode, body)| visit_all(offset, opcode, &body, visit)) {
            Ok(_) => Ok(Ok(())),
            Err(WalkStop::Visit(error)) => Err(error),
            Err(WalkStop::Fault(error @ McapError::Io(_))) => Err(read_error(&self.path, error)),
            Err(WalkStop::Fault(error)) => Ok(Err(error)),
        }
    }

    /// Reads the record at an offset.
    pub(super) fn record_at(&mut self, offset: u64) -> Result<Record<'static>, RecordError> {
        parsed_at(&mut self.file, self.size, offset).map_err(|error| read_error(&self.path, error))
    }
}

/// Opcode and body of the record at an offset of a file of `size` bytes.
fn raw_at(file: &mut File, size: u64, offset: u64) -> McapResult<(u8, Vec<u8>)> {
    file.seek(SeekFrom::Start(offset))?;
    read_record(file, size.saturating_sub(offset))?.ok_or(McapError::BadIndex)
}

/// Record at an offset of a file of `size` bytes.
fn parsed_at(file: &mut File, size: u64, offset: u64) -> McapResult<Record<'static>> {
    let (opcode, body) = raw_at(file, size, offset)?;
    Ok(parsed(opcode, &body)?.into_owned())
}

/// Message of a channel at the position of `entry` in the content of a chunk.
fn message_at<'a>(content: &'a [u8], channel: u16, entry: &MessageIndexEntry) -> McapResult<&'a [u8]> {
    let start = usize::try_from(entry.offset).ok().and_then(|offset| content.get(offset..));
    let (opcode, body, _) = first_record(start.ok_or(McapError::BadIndex)?)?;
    match parsed(opcode, body)? {
        Record::Message { header, data: Cow::Borrowed(data) }
            if header.channel_id == channel && header.log_time == entry.log_time =>
        {
            Ok(data)
        }
        _ => Err(McapError::BadIndex),
    }
}

/// Returns an error if a file does not begin like MCAP.
pub(super) fn ensure_mcap(file: &mut File, path: &Path) -> Result<(), RecordError> {
    let mut magic = [0; mcap::MAGIC.len()];
    match file.read_exact(&mut magic) {
        Ok(()) if magic == mcap::MAGIC => Ok(()),
        Err(source) if source.kind() != std::io::ErrorKind::UnexpectedEof => {
            Err(RecordError::Read { path: path.to_owned(), source })
        }
        _ => Err(RecordError::NotMcap { path: path.to_owned() }),
    }
}
