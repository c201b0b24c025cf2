//! Words of a text with the line each stands in.

use std::str::FromStr;

use super::MeshError;

/// A fault and the line it is in, counted from 1.
#[derive(Debug)]
pub(super) struct Fault {
    pub line: u32,
    pub error: MeshError,
}

/// Reads a text word by word. Nothing is believed that is not there: counts that a file announces are met by reading
/// that many words, and the end of the text ends every loop.
pub(super) struct Tokens<'a> {
    rest: &'a str,
    /// Line of the word read last.
    pub line: u32,
}

/// What a message quotes of a word.
pub(super) fn excerpt(word: &str) -> String {
    const LONGEST: usize = 40;
    match word.char_indices().nth(LONGEST) {
        None => word.to_string(),
        Some((end, _)) => format!("{}...", &word[..end]),
    }
}

impl<'a> Tokens<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Tokens { rest: text, line: 1 }
    }

    pub(super) fn fault(&self, error: MeshError) -> Fault {
        Fault { line: self.line, error }
    }

    /// The next word, if there is one.
    pub(super) fn next(&mut self) -> Option<&'a str> {
        let start = self.rest.bytes().position(|b| !b.is_ascii_whitespace()).unwrap_or(self.rest.len());
        let breaks = self.rest.as_bytes()[..start].iter().filter(|&&b| b == b'\n').count();
        self.line = self.line.saturating_add(u32::try_from(breaks).unwrap_or(u32::MAX));
        // ASCII bytes are never part of a longer character: both cuts are at character boundaries.
        let word = &self.rest[start..];
        let end = word.bytes().position(|b| b.is_ascii_whitespace()).unwrap_or(word.len());
        self.rest = &word[end..];
        (end > 0).then(|| &word[..end])
    }

    /// The next word; its absence is a fault.
    pub(super) fn word(&mut self, expected: &'static str) -> Result<&'a str, Fault> {
        self.next().ok_or_else(|| self.fault(MeshError::EndOfFile { expected }))
    }

    /// The next word as a number.
    pub(super) fn number<T: FromStr>(&mut self, expected: &'static str) -> Result<T, Fault> {
        let word = self.word(expected)?;
        word.parse().map_err(|_| self.fault(MeshError::Expected { expected, found: excerpt(word) }))
    }

    /// The next word, which must be this one.
    pub(super) fn keyword(&mut self, expected: &'static str) -> Result<(), Fault> {
        let word = self.word(expected)?;
        if word == expected {
            Ok(())
        } else {
            Err(self.fault(MeshError::Expected { expected, found: excerpt(word) }))
        }
    }

    /// What is left of the current line.
    pub(super) fn rest_of_line(&mut self) -> &'a str {
        let end = self.rest.find('\n').unwrap_or(self.rest.len());
        let (line, rest) = self.rest.split_at(end);
        self.rest = rest;
        line.trim()
    }
}
