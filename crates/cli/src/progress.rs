//! The progress bar.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use pliant::observer::{Frame, Observer, ObserverError};

use crate::printable;
use crate::terminal::Terminal;
use crate::text::{self, number};

/// A line on standard error that says what is being done; none where it would not be seen.
pub(crate) fn spinner(terminal: Terminal) -> Option<ProgressBar> {
    let wanted = std::io::stderr().is_terminal() && !terminal.quiet && !terminal.json;
    wanted.then(|| {
        let bar = ProgressBar::new_spinner();
        let style = ProgressStyle::with_template("{spinner} {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    })
}

/// Does `work`, which says what it begins: in a line that changes, or with `--verbose` in lines of their own.
pub(crate) fn announced<T>(terminal: Terminal, work: impl FnOnce(&mut (dyn FnMut(&str) + Send)) -> T) -> T {
    let bar = spinner(terminal);
    let done = work(&mut |what| match &bar {
        Some(bar) => bar.set_message(printable::plain(what).into_owned()),
        None if terminal.verbose => terminal.note(what),
        None => {}
    });
    if let Some(bar) = &bar {
        bar.finish_and_clear();
    }
    done
}

/// Shows on standard error how far a run is.
pub(crate) struct RunProgress {
    bar: ProgressBar,
    duration: f64,
    energy_scale: f64,
    first_energy: Option<f64>,
}

impl RunProgress {
    /// A bar for a run of `duration` [s] in `frames`; energy drift is shown relative to `energy_scale` [J].
    pub(crate) fn new(frames: u64, duration: f64, energy_scale: f64) -> RunProgress {
        let bar = ProgressBar::new(frames.saturating_sub(1));
        let template = "{bar:30} {percent:>3}%  {msg}  ({left} left)";
        // The template is a constant; a mistake in it costs the looks, not the run.
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        let eta = |state: &indicatif::ProgressState, out: &mut dyn std::fmt::Write| {
            // Before the first frames the rate is unknown.
            let known = state.pos() > 0;
            let _ = if known { out.write_str(&text::duration(state.eta())) } else { out.write_str("?") };
        };
        bar.set_style(style.with_key("left", eta).progress_chars("=> "));
        bar.enable_steady_tick(Duration::from_millis(200));
        RunProgress { bar, duration, energy_scale, first_energy: None }
    }

    /// Shows drift from the energy at the start of a run that goes on: this [J].
    pub(crate) fn begin_from(&mut self, energy: f64) {
        self.first_energy = Some(energy);
    }

    /// Takes the bar away, so that what follows starts on a clean line.
    pub(crate) fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

impl Observer for RunProgress {
    // Does not ask for diagnostics, only shows them: a run must not depend on being watched.
    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        self.bar.set_position(frame.index);
        let mut message = format!("t = {} of {} s", number(frame.time), number(self.duration));
        if let Some(diagnostics) = frame.diagnostics {
            let first = *self.first_energy.get_or_insert(diagnostics.conserved());
            let drift = (diagnostics.conserved() - first) / self.energy_scale;
            message += &format!(", energy drift {drift:+.1e}");
        }
        self.bar.set_message(message);
        Ok(())
    }
}
