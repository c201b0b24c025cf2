//! Facts of a run that are remembered beside its end.

use pliant::observer::{Frame, Notes, Observer, ObserverError, Quantities};
use pliant_scene::{Channel, Scene};

/// Names of its notes at a checkpoint.
const MIN_J: &str = "statistics.min_j";
const MOST_INVERTED: &str = "statistics.most_inverted";

/// Extremes over the frames of a run.
pub(crate) struct Statistics {
    quantities: Quantities,
    /// Smallest `det F` of any element at any frame that was measured.
    pub(crate) min_j: Option<f64>,
    /// Most elements with `det F <= 0` at any frame that was measured.
    pub(crate) most_inverted: Option<u64>,
}

impl Statistics {
    /// Frames are measured if the scene records energies: so that a run without a file is the same run.
    pub(crate) fn new(scene: &Scene) -> Statistics {
        let measures = scene.output.channels.contains(&Channel::Energy);
        Statistics { quantities: Quantities::DIAGNOSTICS.only_if(measures), min_j: None, most_inverted: None }
    }

    /// Goes on from what was noted at a checkpoint.
    pub(crate) fn resume(&mut self, notes: &Notes) {
        let number = |name: &str| notes.get(name)?.as_slice().try_into().ok();
        self.min_j = number(MIN_J).map(f64::from_le_bytes);
        self.most_inverted = number(MOST_INVERTED).map(u64::from_le_bytes);
    }
}

impl Observer for Statistics {
    fn quantities(&self) -> Quantities {
        self.quantities
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

    fn checkpoint(&mut self, notes: &mut Notes) -> Result<(), ObserverError> {
        notes.extend(self.min_j.map(|j| (MIN_J.to_owned(), j.to_le_bytes().to_vec())));
        notes.extend(self.most_inverted.map(|n| (MOST_INVERTED.to_owned(), n.to_le_bytes().to_vec())));
        Ok(())
    }
}
