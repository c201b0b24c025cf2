//! What is remembered of a run beside its end.

use pliant::observer::{Frame, Observer, ObserverError};
use pliant::scene::{Channel, Scene};

/// Extremes over the frames of a run.
pub(crate) struct Statistics {
    wants_diagnostics: bool,
    /// Smallest `det F` of any element at any frame that was measured.
    pub(crate) min_j: Option<f64>,
    /// Most elements with `det F <= 0` at any frame that was measured.
    pub(crate) most_inverted: Option<u64>,
}

impl Statistics {
    /// Frames are measured if the scene records energies: so that a run without a file is the same run.
    pub(crate) fn new(scene: &Scene) -> Statistics {
        let wants_diagnostics = scene.output.channels.contains(&Channel::Energy);
        Statistics { wants_diagnostics, min_j: None, most_inverted: None }
    }
}

impl Observer for Statistics {
    fn wants_diagnostics(&self) -> bool {
        self.wants_diagnostics
    }

    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        if let Some(diagnostics) = frame.diagnostics {
            if let Some(j) = diagnostics.min_j {
                self.min_j = Some(self.min_j.map_or(j, |smallest| smallest.min(j)));
            }
            self.most_inverted = self.most_inverted.max(diagnostics.inverted);
        }
        Ok(())
    }
}
