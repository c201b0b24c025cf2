//! Numbers of the text and the binary encoding: words of a text, or bytes between lines of text.

use crate::FormatError;
use crate::MeshError;
use crate::file::Place;
use crate::number_type::{Endian, NumberType};
use crate::tokens::{FileFault, Tokens};

/// Storage of numbers in a binary file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Binary {
    endian: Endian,
    /// Size of a `size_t` [bytes]: 4 or 8.
    size: usize,
}

/// The file, read number by number. Announced counts are not trusted: the end of the file ends every
/// loop.
pub(super) struct GmshSource<'a> {
    pub tokens: Tokens<'a>,
    binary: Option<Binary>,
}

impl<'a> GmshSource<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        GmshSource { tokens: Tokens::of_bytes(bytes), binary: None }
    }

    /// Switches to binary numbers: the four bytes after this line are the integer 1, which shows the byte
    /// order.
    pub(super) fn set_binary(&mut self, size: u64) -> Result<(), FileFault> {
        let size = match size {
            4 => 4,
            8 => 8,
            _ => return Err(self.tokens.expected("4 or 8, the bytes of a number", &size.to_string())),
        };
        self.tokens.end_line();
        self.tokens.set_binary();
        let expected = "the integer 1, which shows the order of the bytes";
        let bytes = self.tokens.take(4, expected)?;
        let endian = match bytes {
            [1, 0, 0, 0] => Endian::Little,
            [0, 0, 0, 1] => Endian::Big,
            _ => return Err(self.tokens.expected(expected, &format!("{bytes:?}"))),
        };
        self.binary = Some(Binary { endian, size });
        Ok(())
    }

    pub(super) fn is_binary(&self) -> bool {
        self.binary.is_some()
    }

    /// Skips to the line on which the binary numbers of a section begin.
    pub(super) fn begin_numbers(&mut self) {
        if self.is_binary() {
            self.tokens.end_line();
        }
    }

    pub(super) fn fault(&self, error: impl Into<MeshError>) -> FileFault {
        self.tokens.fault(error)
    }

    /// Position of the last number read, for an item with this tag.
    pub(super) fn place(&self, tag: u64) -> Place {
        self.tokens.place(tag)
    }

    /// Reads an `int`.
    pub(super) fn int(&mut self, expected: &'static str) -> Result<i64, FileFault> {
        match self.binary {
            None => self.tokens.number(expected),
            Some(Binary { endian, .. }) => {
                // Exact: an f64 represents every 32-bit integer.
                Ok(NumberType::I32.decode(self.tokens.take(4, expected)?, endian) as i64)
            }
        }
    }

    /// Reads a non-negative `int`.
    pub(super) fn natural(&mut self, expected: &'static str) -> Result<u64, FileFault> {
        if self.binary.is_none() {
            return self.tokens.number(expected);
        }
        let number = self.int(expected)?;
        u64::try_from(number).map_err(|_| self.tokens.expected(expected, &number.to_string()))
    }

    /// Reads a `size_t`.
    pub(super) fn size(&mut self, expected: &'static str) -> Result<u64, FileFault> {
        let Some(Binary { endian, size }) = self.binary else { return self.tokens.number(expected) };
        let mut word = [0_u8; 8];
        word[..size].copy_from_slice(self.tokens.take(size as u64, expected)?);
        if endian == Endian::Big {
            word[..size].reverse();
        }
        Ok(u64::from_le_bytes(word))
    }

    /// Reads a `double`.
    pub(super) fn real(&mut self, expected: &'static str) -> Result<f64, FileFault> {
        match self.binary {
            None => self.tokens.number(expected),
            Some(Binary { endian, .. }) => Ok(NumberType::F64.decode(self.tokens.take(8, expected)?, endian)),
        }
    }

    /// Skips the section that `$name` began.
    pub(super) fn skip_section(&mut self, name: &str) -> Result<(), FileFault> {
        let found = self.tokens.skip_past(format!("$End{name}").as_bytes());
        if found {
            Ok(())
        } else {
            Err(self.fault(MeshError::EndOfFile { expected: "the end of a section" }))
        }
    }
}

/// Checks the `size` of a `double` [bytes], the only size that version 2.2 states: it must be 8.
pub(super) fn double_size(source: &GmshSource, size: u64) -> Result<u64, FileFault> {
    if size == 8 {
        return Ok(size);
    }
    let found = format!("a binary file with real numbers of {size} bytes");
    Err(source.fault(FormatError::Unsupported { found, supported: "write them with 8 bytes" }))
}
