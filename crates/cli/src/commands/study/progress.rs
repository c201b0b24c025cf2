//! How far a study is.

use std::time::{Duration, Instant};

use indicatif::ProgressBar;
use pliant_lab::study::Event;

use crate::printable;
use crate::progress::spinner;
use crate::terminal::Terminal;
use crate::text::{counted, duration, number};

/// Shows on standard error what is being run.
pub(super) struct StudyProgress {
    name: String,
    bar: Option<ProgressBar>,
    verbose: Option<Terminal>,
    started: Instant,
}

impl StudyProgress {
    /// A line on a terminal; nothing elsewhere, but with `--verbose` a line for every row.
    pub(super) fn new(name: &str, terminal: Terminal) -> StudyProgress {
        let bar = spinner(terminal);
        let verbose = terminal.verbose.then_some(terminal);
        StudyProgress { name: name.to_owned(), bar, verbose, started: Instant::now() }
    }

    pub(super) fn show(&mut self, event: &Event<'_>) {
        let elapsed = duration(self.started.elapsed());
        let message = match event {
            Event::Reference { scheme, step } => {
                format!("{}: reference by {scheme}, step {} s ({elapsed})", self.name, number(*step))
            }
            Event::Found(reference) => {
                format!("{}: reference {}, its error {:.0e}", self.name, reference.how, reference.error)
            }
            Event::Begun { scheme, pace: (what, size), variant, finished, left } => {
                let left = left.map_or_else(String::new, |left| {
                    format!(", about {} left", duration(Duration::from_secs_f64(left)))
                });
                let variant = if variant.is_empty() { String::new() } else { format!(", {variant}") };
                let rows = format!("{} in {elapsed}{left}", counted(*finished as u64, "row", "rows"));
                format!("{}: {scheme}, {what} {}{variant} ({rows})", self.name, number(*size))
            }
            Event::Finished(row) => {
                if let Some(terminal) = self.verbose {
                    let error =
                        row.err_q_rms.map_or_else(|| row.status.words().to_owned(), |e| format!("{e:.2e}"));
                    let line = format!("{} {} s: {error}", row.integrator, number(row.dt));
                    match &self.bar {
                        Some(bar) => bar.println(line),
                        None => terminal.note(&line),
                    }
                }
                return;
            }
        };
        match (&self.bar, self.verbose) {
            (Some(bar), _) => bar.set_message(printable::plain(&message).into_owned()),
            // Where there is no line that changes, a reference may take long enough to be spoken of.
            (None, Some(terminal)) if !matches!(event, Event::Begun { .. }) => terminal.note(&message),
            _ => {}
        }
    }

    /// Takes the line away.
    pub(super) fn clear(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
