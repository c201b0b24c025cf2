//! Checked parsing of records: stated lengths are first compared with the bytes available. The crate
//! `mcap` reserves memory for a string of the stated length before it looks for its end, and assumes that
//! the checksum of an attachment exists.

use mcap::records::{Record, op};
use mcap::{McapError, McapResult, parse_record};

/// Parses the record in these bytes.
///
/// # Errors
/// [`McapError::UnexpectedEof`] if a length leads beyond `body`; other errors of the record.
pub(super) fn parsed(opcode: u8, body: &[u8]) -> McapResult<Record<'_>> {
    fit(opcode, body).ok_or(McapError::UnexpectedEof)?;
    parse_record(opcode, body)
}

/// `None` if a string, a table or an attachment of the record would end after `body`.
fn fit(opcode: u8, body: &[u8]) -> Option<()> {
    let mut rest = Rest(body);
    match opcode {
        // Profile, library.
        op::HEADER => rest.texts(2),
        // Number; name, encoding, content.
        op::SCHEMA => rest.skip(2)?.texts(3),
        // Numbers of channel and schema; topic, encoding; metadata.
        op::CHANNEL => rest.skip(4)?.texts(2)?.table(),
        // Two times, size, checksum; compression.
        op::CHUNK => rest.skip(28)?.texts(1),
        // Two times, position and length; offsets by channel; length; compression.
        op::CHUNK_INDEX => rest.skip(32)?.texts(1)?.skip(8)?.texts(1),
        // Two times; name, type; size; content and checksum.
        op::ATTACHMENT => rest.skip(16)?.texts(2)?.skip(8)?.skip(4),
        // Position, length, two times, size; name, type.
        op::ATTACHMENT_INDEX => rest.skip(40)?.texts(2),
        // Name; content.
        op::METADATA => rest.texts(1)?.table(),
        // Position, length; name.
        op::METADATA_INDEX => rest.skip(16)?.texts(1),
        _ => Some(&mut rest),
    }
    .map(|_| ())
}

/// Remaining bytes of a record.
struct Rest<'a>(&'a [u8]);

impl Rest<'_> {
    fn skip(&mut self, bytes: usize) -> Option<&mut Self> {
        self.0 = self.0.get(bytes..)?;
        Some(self)
    }

    /// Reads a stated length.
    fn length(&mut self) -> Option<usize> {
        let (length, rest) = self.0.split_first_chunk::<4>()?;
        self.0 = rest;
        usize::try_from(u32::from_le_bytes(*length)).ok()
    }

    /// Skips strings, or other data preceded by their length.
    fn texts(&mut self, count: usize) -> Option<&mut Self> {
        for _ in 0..count {
            let length = self.length()?;
            self.skip(length)?;
        }
        Some(self)
    }

    /// Skips pairs of strings, preceded by their total length.
    fn table(&mut self) -> Option<&mut Self> {
        let length = self.length()?;
        let end = self.0.len().checked_sub(length)?;
        while self.0.len() > end {
            self.texts(2)?;
        }
        Some(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A string of four bytes, preceded by its length.
    fn text() -> Vec<u8> {
        [&4_u32.to_le_bytes(), &b"abcd"[..]].concat()
    }

    /// Each kind of record with strings: the bytes before the first, and the number of strings and tables
    /// that follow.
    #[test]
    fn a_text_that_ends_after_its_record_is_refused_whatever_the_record() {
        let table = [&16_u32.to_le_bytes(), text().as_slice(), &text()].concat();
        let records: [(u8, Vec<Vec<u8>>); 9] = [
            (op::HEADER, vec![text(), text()]),
            (op::SCHEMA, vec![vec![1, 0], text(), text(), text()]),
            (op::CHANNEL, vec![vec![1, 0, 1, 0], text(), text(), table.clone()]),
            (op::CHUNK, vec![vec![0; 28], text(), vec![0; 8]]),
            (op::CHUNK_INDEX, vec![vec![0; 32], vec![0; 4], vec![0; 8], text(), vec![0; 16]]),
            (op::ATTACHMENT, vec![vec![0; 16], text(), text(), vec![0; 8], vec![0; 4]]),
            (op::ATTACHMENT_INDEX, vec![vec![0; 40], text(), text()]),
            (op::METADATA, vec![text(), table]),
            (op::METADATA_INDEX, vec![vec![0; 16], text()]),
        ];
        for (opcode, parts) in records {
            let body = parts.concat();
            assert!(parsed(opcode, &body).is_ok(), "record {opcode} as it should be");
            for at in 0..body.len() - 4 {
                if body[at..at + 4] == 4_u32.to_le_bytes() {
                    let mut damaged = body.clone();
                    damaged[at + 3] = 0x7F;
                    assert!(fit(opcode, &damaged).is_none(), "record {opcode}, byte {at}");
                }
            }
            let cut = &body[..body.len() - 1];
            assert!(parsed(opcode, cut).is_err(), "record {opcode} without its last byte");
        }
    }
}
