//! Standard output and standard error: results on the one, everything else on the other.

use std::io::{self, ErrorKind, IsTerminal, Write};

use crate::arguments::{ColorChoice, CommonArguments};
use crate::failure::{Failure, label};
use crate::printable;

/// Width where it is unknown: a pipe, a file.
const DEFAULT_WIDTH: usize = 100;
/// Longer lines are tiring to read.
const LARGEST_WIDTH: usize = 120;

/// Where output goes and how much of it is wanted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Terminal {
    /// One JSON document on standard output instead of text.
    pub(crate) json: bool,
    /// Errors and warnings only.
    pub(crate) quiet: bool,
    /// More than usual.
    pub(crate) verbose: bool,
    /// True if standard error takes colours.
    pub(crate) color: bool,
}

impl Terminal {
    pub(crate) fn new(common: &CommonArguments) -> Terminal {
        let color = wants_color(common.color, io::stderr().is_terminal());
        Terminal { json: common.json, quiet: common.quiet, verbose: common.verbose, color }
    }

    /// Prints a result for a person: nothing with `--quiet` or `--json`.
    ///
    /// # Errors
    /// Standard output cannot be written, other than because its reader has had enough.
    pub(crate) fn report(self, text: &str) -> Result<(), Failure> {
        if self.quiet || self.json { Ok(()) } else { self.print(text) }
    }

    /// Prints a result that was asked for by name: even with `--quiet`.
    ///
    /// # Errors
    /// As [`report`](Self::report).
    pub(crate) fn print(self, text: &str) -> Result<(), Failure> {
        write(&printable::plain(text.trim_end()))
    }

    /// Prints the one JSON document of a command, if `--json` asks for it.
    ///
    /// # Errors
    /// As [`report`](Self::report).
    pub(crate) fn document(self, document: &serde_json::Value) -> Result<(), Failure> {
        if self.json { write(&printable::json(&format!("{document:#}"))) } else { Ok(()) }
    }

    /// Says something on standard error that is neither warning nor error: nothing with `--quiet`.
    pub(crate) fn note(self, text: &str) {
        if !self.quiet {
            self.complain(text);
        }
    }

    /// Warns on standard error.
    pub(crate) fn warn(self, message: &str) {
        self.complain(&label("warning", message, self.color));
    }

    /// Writes to standard error, whatever was asked for.
    pub(crate) fn complain(self, text: &str) {
        // There is nowhere left to report that standard error is closed.
        let text = text.trim_end();
        let shown = if self.color { printable::styled(text) } else { printable::plain(text).into_owned() };
        let _ = writeln!(io::stderr().lock(), "{shown}");
    }

    /// True if a person reads standard output, who wants the answer, and rows on request.
    pub(crate) fn is_read(self) -> bool {
        io::stdout().is_terminal()
    }

    /// Columns to fill on standard output.
    pub(crate) fn width(self) -> usize {
        let columns = console::Term::stdout().size_checked().map(|(_, columns)| usize::from(columns));
        columns.unwrap_or(DEFAULT_WIDTH).clamp(40, LARGEST_WIDTH)
    }
}

/// Writes a line to standard output.
fn write(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        // `pliant list | head -3` is no failure.
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::failed("output", format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// True if to use colours on a stream, see <https://no-color.org>.
fn wants_color(choice: ColorChoice, is_terminal: bool) -> bool {
    let set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    match choice {
        ColorChoice::Always => true,
        ColorChoice::Never => false,
        ColorChoice::Auto => {
            is_terminal && !set("NO_COLOR") && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
        }
    }
}
