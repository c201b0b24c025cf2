//! Tokenizer: words of a text with their lines, bytes of a binary file with their offsets.

use std::str::FromStr;

use super::MeshError;
use super::file::Place;

/// An error and its position in the file.
#[derive(Debug)]
pub(super) struct FileFault {
    /// Line, from 1; 0 in a binary file.
    pub line: u32,
    /// Offset in a binary file.
    pub byte: Option<u64>,
    /// True if the error is in the second file of a pair.
    pub in_nodes: bool,
    pub error: MeshError,
}

impl FileFault {
    /// Error in a line of a text.
    pub(super) fn in_line(line: u32, error: impl Into<MeshError>) -> FileFault {
        FileFault { line, byte: None, in_nodes: false, error: error.into() }
    }

    /// Error at a position: a line of a text, an offset of a binary file.
    pub(super) fn at(place: Place, error: impl Into<MeshError>) -> FileFault {
        let byte = (place.line == 0).then_some(place.tag);
        FileFault { byte, ..FileFault::in_line(place.line, error) }
    }
}

/// Reads a file word by word. Announced counts are not trusted: the reader reads that many words or
/// bytes, and the end of the file ends every loop.
#[derive(Clone)]
pub(super) struct Tokens<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Start of the last word or block.
    start: usize,
    /// Line of the last word.
    pub line: u32,
    /// True if errors are reported by offset: lines mean nothing in a binary file.
    binary: bool,
    /// True if `#` begins a comment up to the end of the line.
    comments: bool,
}

/// Shortened word for a message.
pub(super) fn excerpt(word: &str) -> String {
    const LONGEST: usize = 40;
    match word.char_indices().nth(LONGEST) {
        None => word.to_string(),
        Some((end, _)) => format!("{}...", &word[..end]),
    }
}

/// Converts to text; names may be in any encoding.
fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap_or("\u{fffd}")
}

impl<'a> Tokens<'a> {
    /// Tokenizer of a file, which may have binary parts.
    pub(super) fn of_bytes(bytes: &'a [u8]) -> Self {
        Tokens { bytes, at: 0, start: 0, line: 1, binary: false, comments: false }
    }

    /// Tokenizer that skips comments after `#`.
    pub(super) fn with_comments(bytes: &'a [u8]) -> Self {
        Tokens { comments: true, ..Self::of_bytes(bytes) }
    }

    /// Numbers the first line `line`.
    pub(super) fn starting_at(self, line: u32) -> Self {
        Tokens { line, ..self }
    }

    /// Reports errors by their offset from here on.
    pub(super) fn set_binary(&mut self) {
        self.binary = true;
    }

    pub(super) fn fault(&self, error: impl Into<MeshError>) -> FileFault {
        let Place { tag, line } = self.place(0);
        FileFault { byte: self.binary.then_some(tag), ..FileFault::in_line(line, error) }
    }

    /// Position of the last word or block; `tag` is its number in the file, 0 for none.
    pub(super) fn place(&self, tag: u64) -> Place {
        if self.binary { Place { tag: self.start as u64, line: 0 } } else { Place { tag, line: self.line } }
    }

    fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    fn advance(&mut self, count: usize) {
        let breaks = self.rest()[..count].iter().filter(|&&b| b == b'\n').count();
        self.line = self.line.saturating_add(u32::try_from(breaks).unwrap_or(u32::MAX));
        self.at += count;
    }

    /// Next word, if any.
    pub(super) fn next(&mut self) -> Option<&'a str> {
        loop {
            let rest = self.rest();
            let blank = rest.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(rest.len());
            self.advance(blank);
            if !(self.comments && self.rest().first() == Some(&b'#')) {
                break;
            }
            self.rest_of_line();
        }
        let word = self.rest();
        let ends = |b: &u8| b.is_ascii_whitespace() || (self.comments && *b == b'#');
        let end = word.iter().position(ends).unwrap_or(word.len());
        self.start = self.at;
        self.at += end;
        (end > 0).then(|| text(&word[..end]))
    }

    /// Next word; its absence is an error.
    pub(super) fn word(&mut self, expected: &'static str) -> Result<&'a str, FileFault> {
        self.next().ok_or_else(|| self.fault(MeshError::EndOfFile { expected }))
    }

    /// Next word as a number.
    pub(super) fn number<T: FromStr>(&mut self, expected: &'static str) -> Result<T, FileFault> {
        let word = self.word(expected)?;
        word.parse().map_err(|_| self.fault(MeshError::Expected { expected, found: excerpt(word) }))
    }

    /// Reads a word, which must be `expected`.
    pub(super) fn keyword(&mut self, expected: &'static str) -> Result<(), FileFault> {
        let word = self.word(expected)?;
        if word == expected { Ok(()) } else { Err(self.expected(expected, word)) }
    }

    /// Error of an unexpected word.
    pub(super) fn expected(&self, expected: &'static str, found: &str) -> FileFault {
        self.fault(MeshError::Expected { expected, found: excerpt(found) })
    }

    /// Rest of the current line.
    pub(super) fn rest_of_line(&mut self) -> &'a str {
        text(self.rest_of_line_bytes()).trim()
    }

    /// Rest of the current line as bytes, in any encoding.
    pub(super) fn rest_of_line_bytes(&mut self) -> &'a [u8] {
        let rest = self.rest();
        let end = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        self.at += end;
        &rest[..end]
    }

    /// Skips everything up to the end of `word`; returns false if it does not occur.
    pub(super) fn skip_past(&mut self, word: &[u8]) -> bool {
        let found = self.rest().windows(word.len()).position(|window| window == word);
        let end = found.map_or(self.rest().len(), |at| at + word.len());
        self.advance(end);
        found.is_some()
    }

    /// Returns the rest of the current line and moves to the beginning of the next: binary data may start
    /// with any byte.
    pub(super) fn end_line(&mut self) -> &'a str {
        let line = self.rest_of_line();
        self.advance(usize::from(!self.rest().is_empty()));
        line
    }

    /// Next `count` bytes; their absence is an error.
    pub(super) fn take(&mut self, count: u64, expected: &'static str) -> Result<&'a [u8], FileFault> {
        self.start = self.at;
        let rest = self.rest();
        match usize::try_from(count).ok().filter(|&count| count <= rest.len()) {
            Some(count) => {
                self.at += count;
                Ok(&rest[..count])
            }
            None => Err(self.fault(MeshError::EndOfFile { expected })),
        }
    }

    /// Number of remaining bytes.
    pub(super) fn remaining(&self) -> usize {
        self.rest().len()
    }
}
