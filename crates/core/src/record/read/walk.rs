//! All records of a file from the beginning, as far as it goes. For files that have no index because they have no end.

use std::fs::File;
use std::io::{BufReader, Read};
use std::ops::ControlFlow;
use std::path::Path;

use mcap::read::{ChunkReader, parse_record};
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::record::RecordError;

/// Hands every record of the data section to `visit`, those in chunks included, until it breaks, the section ends or
/// the file does. Chunks that are incomplete or fail their checksum are not opened.
///
/// Returns whether the end of the data section was reached.
pub(super) fn walk(
    path: &Path,
    visit: &mut dyn FnMut(Record<'static>) -> Result<ControlFlow<()>, RecordError>,
) -> Result<bool, RecordError> {
    let failed = |source| RecordError::Read { path: path.to_owned(), source };
    let file = File::open(path).map_err(failed)?;
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
            Ok(LinearReadEvent::Record { opcode, data }) => {
                parse_record(opcode, data).map(Record::into_owned)
            }
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

/// All records of a chunk, its checksum verified.
pub(super) fn chunk_records(
    header: mcap::records::ChunkHeader,
    data: &[u8],
) -> mcap::McapResult<Vec<Record<'static>>> {
    ChunkReader::new(header, data)?.map(|record| record.map(Record::into_owned)).collect()
}
