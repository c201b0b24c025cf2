//! Sequential reading of all records of a file, as far as it goes, for files without an end and therefore
//! without an index.

use std::io::{BufReader, Read};
use std::ops::ControlFlow;
use std::path::Path;

use mcap::records::{Record, op};
use mcap::{MAGIC, McapError};

use super::chunk::{RECORD_HEADER, first_record, read_record, unpacked};
use super::lengths::parsed;
use crate::RecordError;
use pliant_files::regular_file;

/// Visitor of records, called with the file offset of the record or of its chunk.
pub(crate) type Visit<'a> = dyn FnMut(u64, Record<'static>) -> Result<ControlFlow<()>, RecordError> + 'a;

/// Unreadable record, after which the file cannot be parsed.
#[derive(Debug)]
pub(crate) struct DamagedRecord {
    /// Offset of the record, or of its chunk.
    pub(crate) offset: u64,
    /// Error of the MCAP reader.
    pub(crate) error: McapError,
}

/// Hands every record of the data section, including those in chunks, to `visit`, until it breaks or the
/// section or the file ends. Incomplete chunks, and those with a wrong checksum, are not opened.
///
/// Returns the unreadable record, if any; the last one of a killed writer is often truncated.
pub(crate) fn walk(path: &Path, visit: &mut Visit<'_>) -> Result<Option<DamagedRecord>, RecordError> {
    let failed = |source| RecordError::Read { path: path.to_owned(), source };
    let mut file = regular_file::open(path).map_err(failed)?;
    let size = file.metadata().map_err(failed)?.len();
    let mut magic = [0; MAGIC.len()];
    if size < MAGIC.len() as u64 {
        return Ok(None);
    }
    file.read_exact(&mut magic).map_err(failed)?;
    let mut offset = MAGIC.len() as u64;
    if magic != MAGIC {
        return Ok(Some(DamagedRecord { offset: 0, error: McapError::BadMagic }));
    }
    let mut source = BufReader::with_capacity(1 << 16, file);
    loop {
        let fault = |error| match error {
            McapError::Io(source) => Err(failed(source)),
            error => Ok(Some(DamagedRecord { offset, error })),
        };
        let (opcode, body) = match read_record(&mut source, size - offset) {
            Ok(Some((op::DATA_END, _)) | None) => return Ok(None),
            Ok(Some(record)) => record,
            Err(error) => return fault(error),
        };
        match visit_all(offset, opcode, &body, visit) {
            Ok(ControlFlow::Continue(())) => {}
            Ok(ControlFlow::Break(())) => return Ok(None),
            Err(WalkStop::Visit(error)) => return Err(error),
            Err(WalkStop::Fault(error)) => return fault(error),
        }
        offset += (RECORD_HEADER + body.len()) as u64;
    }
}

/// Reason why a visit of records ended.
pub(super) enum WalkStop {
    /// The visitor failed.
    Visit(RecordError),
    /// A record cannot be read.
    Fault(McapError),
}

impl From<McapError> for WalkStop {
    fn from(error: McapError) -> Self {
        WalkStop::Fault(error)
    }
}

/// Hands a record to `visit`, or, for a chunk, its records.
pub(super) fn visit_all(
    offset: u64,
    opcode: u8,
    body: &[u8],
    visit: &mut Visit<'_>,
) -> Result<ControlFlow<()>, WalkStop> {
    let mut visit = |record: Record<'_>| visit(offset, record.into_owned()).map_err(WalkStop::Visit);
    match parsed(opcode, body)? {
        Record::Chunk { header, data } => {
            // The whole chunk first: its checksum covers all of it.
            let content = unpacked(&header, &data)?;
            let mut rest = content.as_slice();
            while !rest.is_empty() {
                let (opcode, body, after) = first_record(rest)?;
                if visit(parsed(opcode, body)?)?.is_break() {
                    return Ok(ControlFlow::Break(()));
                }
                rest = after;
            }
            Ok(ControlFlow::Continue(()))
        }
        record => visit(record),
    }
}
