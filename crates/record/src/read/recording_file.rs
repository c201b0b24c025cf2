//! A complete file: its index, and its records by position.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use mcap::records::{ChunkIndex, MessageIndexEntry, Record};
use mcap::{McapError, Summary};

use super::lengths::parsed;
use super::summary;
use super::walk::{chunk_records, ensure_mcap};
use crate::RecordError;
use crate::error::read_error;
use pliant_files::regular_file;

/// Opcode and length of a record.
pub(super) const RECORD_HEADER: usize = 9;

/// A complete file.
#[derive(Debug)]
pub(super) struct RecordingFile {
    pub(super) path: PathBuf,
    pub(super) summary: Summary,
    pub(super) size: u64,
    file: File,
}

impl RecordingFile {
    /// Reads the index; `None` if the file is an MCAP file without an end.
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
        Ok(summary.map(|summary| RecordingFile { path: path.to_owned(), summary, size, file }))
    }

    /// The number of the channel with this topic.
    pub(super) fn channel(&self, topic: &str) -> Option<u16> {
        self.summary.channels.values().find(|channel| channel.topic == topic).map(|channel| channel.id)
    }

    /// Time and position in its chunk of every message of a channel, chunk by chunk.
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

    /// All records of a chunk.
    pub(super) fn chunk(&mut self, number: usize) -> Result<Vec<Record<'static>>, RecordError> {
        let ChunkIndex { chunk_start_offset, .. } = self.summary.chunk_indexes[number];
        match self.record_at(chunk_start_offset)? {
            Record::Chunk { header, data } => {
                chunk_records(header, &data).map_err(|error| read_error(&self.path, error))
            }
            _ => Err(read_error(&self.path, McapError::BadIndex)),
        }
    }

    /// The record that begins at an offset.
    pub(super) fn record_at(&mut self, offset: u64) -> Result<Record<'static>, RecordError> {
        let failed = |error: std::io::Error| read_error(&self.path, McapError::Io(error));
        self.file.seek(SeekFrom::Start(offset)).map_err(failed)?;
        let mut header = [0; RECORD_HEADER];
        self.file.read_exact(&mut header).map_err(failed)?;
        let [opcode, length @ ..] = header;
        let length = u64::from_le_bytes(length);
        // A damaged length must not ask for more memory than the file is long.
        let body = usize::try_from(length).ok().filter(|_| length <= self.size);
        let mut body = vec![0; body.ok_or_else(|| read_error(&self.path, McapError::BadIndex))?];
        self.file.read_exact(&mut body).map_err(failed)?;
        let record = parsed(opcode, &body).map_err(|error| read_error(&self.path, error))?;
        Ok(record.into_owned())
    }
}
