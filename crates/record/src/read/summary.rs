//! Index at the end of a complete file.

use std::collections::HashMap;
use std::io::{Read, Seek, SeekFrom};
use std::sync::Arc;

use mcap::records::{self, Record, op};
use mcap::{Channel, MAGIC, McapError, McapResult, Schema, Summary};
use pliant_files::disk::File;

use super::chunk::{RECORD_HEADER, first_record};
use super::lengths::parsed;

/// Size of the last record, which has the position of the index, and of the end marker [bytes].
const END: u64 = (RECORD_HEADER + 20 + MAGIC.len()) as u64;

/// Reads the index of a file of `size` bytes; `None` if it has an end but no index.
///
/// # Errors
/// The file has no end, or a record of the index is damaged.
pub(super) fn read(file: &mut File, size: u64) -> McapResult<Option<Summary>> {
    let Some(end) = size.checked_sub(END) else { return Err(McapError::UnexpectedEof) };
    file.seek(SeekFrom::Start(end))?;
    let mut footer = [0; END as usize];
    file.read_exact(&mut footer)?;
    let Some(body) = footer.strip_suffix(MAGIC) else { return Err(McapError::BadMagic) };
    let (header, body) = body.split_at(RECORD_HEADER);
    let Record::Footer(footer) = parsed(header[0], body)? else { return Err(McapError::BadFooter) };
    if footer.summary_start == 0 {
        return Ok(None);
    }
    let length = end.checked_sub(footer.summary_start).ok_or(McapError::BadFooter)?;
    let mut section = vec![0; usize::try_from(length).map_err(|_| McapError::BadFooter)?];
    file.seek(SeekFrom::Start(footer.summary_start))?;
    file.read_exact(&mut section)?;
    gathered(&section).map(Some)
}

/// Builds the index from its records.
fn gathered(mut section: &[u8]) -> McapResult<Summary> {
    let (mut summary, mut channels) = (Summary::default(), Vec::new());
    while section.len() >= RECORD_HEADER {
        let (opcode, body, rest) = first_record(section)?;
        section = rest;
        if opcode != op::CHUNK {
            take(parsed(opcode, body)?, &mut summary, &mut channels);
        }
    }
    // Schemas may come after their channels.
    for channel in channels {
        let channel = linked(channel, &summary.schemas);
        summary.channels.insert(channel.id, Arc::new(channel));
    }
    Ok(summary)
}

fn take(record: Record<'_>, summary: &mut Summary, channels: &mut Vec<records::Channel>) {
    match record {
        Record::Statistics(statistics) => summary.stats = Some(statistics),
        Record::ChunkIndex(index) => summary.chunk_indexes.push(index),
        Record::AttachmentIndex(index) => summary.attachment_indexes.push(index),
        Record::MetadataIndex(index) => summary.metadata_indexes.push(index),
        Record::Channel(channel) => channels.push(channel),
        Record::Schema { header, data } => {
            let (id, name, encoding) = (header.id, header.name, header.encoding);
            let data = data.into_owned().into();
            summary.schemas.insert(id, Arc::new(Schema { id, name, encoding, data }));
        }
        _ => {}
    }
}

fn linked(channel: records::Channel, schemas: &HashMap<u16, Arc<Schema<'static>>>) -> Channel<'static> {
    let schema = schemas.get(&channel.schema_id).cloned();
    let (id, topic) = (channel.id, channel.topic);
    Channel { id, topic, schema, message_encoding: channel.message_encoding, metadata: channel.metadata }
}
