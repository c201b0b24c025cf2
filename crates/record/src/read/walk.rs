//! All records of a file from the beginning, as far as it goes. For files that have no index because they
//! have no end.

use std::fs::File;
use std::io::{BufReader, Read};
use std::ops::ControlFlow;
use std::path::Path;

use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::lengths::parsed;
use crate::RecordError;
use pliant_files::regular_file;

/// Hands every record of the data section to `visit`, those in chunks included, until it breaks, the section
/// ends or the file does. Chunks that are incomplete or fail their checksum are not opened.
///
/// Returns whether the end of the data section was reached.
pub(crate) fn walk(
    path: &Path,
    visit: &mut dyn FnMut(Record<'static>) -> Result<ControlFlow<()>, RecordError>,
) -> Result<bool, RecordError> {
    let failed = |source| RecordError::Read { path: path.to_owned(), source };
    let file = regular_file::open(path).map_err(failed)?;
    let size = file.metadata().map_err(failed)?.len();
    let mut source = BufReader::with_capacity(1 << 16, file);
    let options = LinearReaderOptions::default()
        .with_skip_end_magic(true)
        .with_emit_chunks(true)
        // An open chunk claims to be endless; no record is longer than its file.
        .with_record_length_limit(usize::try_from(size).unwrap_or(usize::MAX));
    let mut reader = LinearReader::new_with_options(options);
    while let Some(event) = reader.next_event() {
        let record = match event {
            Ok(LinearReadEvent::ReadRequest(need)) => {
                let read = source.read(reader.insert(need)).map_err(failed)?;
                reader.notify_read(read);
                continue;
            }
            Ok(LinearReadEvent::Record { opcode: op::DATA_END, .. }) => return Ok(true),
            Ok(LinearReadEvent::Record { opcode, data }) => parsed(opcode, data).map(Record::into_owned),
            Err(_) => return Ok(false),
        };
        match record {
            Ok(Record::Chunk { header, data }) => {
                // The whole chunk first: its checksum stands at its end.
                let Ok(records) = chunk_records(header, &data) else { return Ok(false) };
                for record in records {
                    if visit(record)?.is_break() {
                        return Ok(false);
                    }
                }
            }
            Ok(record) => {
                if visit(record)?.is_break() {
                    return Ok(false);
                }
            }
            Err(_) => return Ok(false),
        }
    }
    Ok(false)
}

/// Says if a file does not begin like MCAP.
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

/// All records of a chunk, none of them looked at before its checksum: what a damaged chunk unpacks to has
/// lengths that ask for more memory than there is.
pub(super) fn chunk_records(
    header: mcap::records::ChunkHeader,
    data: &[u8],
) -> mcap::McapResult<Vec<Record<'static>>> {
    let mut chunk = Vec::with_capacity(data.len() + 64);
    chunk.push(op::CHUNK);
    // The length follows once it is known.
    chunk.extend_from_slice(&[0; 8]);
    chunk.extend_from_slice(&header.message_start_time.to_le_bytes());
    chunk.extend_from_slice(&header.message_end_time.to_le_bytes());
    chunk.extend_from_slice(&header.uncompressed_size.to_le_bytes());
    chunk.extend_from_slice(&header.uncompressed_crc.to_le_bytes());
    chunk.extend_from_slice(&(header.compression.len() as u32).to_le_bytes());
    chunk.extend_from_slice(header.compression.as_bytes());
    chunk.extend_from_slice(&header.compressed_size.to_le_bytes());
    chunk.extend_from_slice(data);
    let length = chunk.len() as u64 - 9;
    chunk[1..9].copy_from_slice(&length.to_le_bytes());
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(MOST_COMPRESSED.saturating_mul(chunk.len()));
    let mut reader = LinearReader::new_with_options(options);
    let (mut rest, mut records) = (chunk.as_slice(), Vec::new());
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(need) => {
                let (now, later) = rest.split_at(need.min(rest.len()));
                reader.insert(now.len()).copy_from_slice(now);
                reader.notify_read(now.len());
                rest = later;
            }
            LinearReadEvent::Record { opcode, data } => {
                records.push(parsed(opcode, data)?.into_owned());
            }
        }
    }
    Ok(records)
}

/// Bytes that zstd can make of one: a block of four stands for 128 KiB at most.
const MOST_COMPRESSED: usize = 1 << 15;
