//! Facts of a run that are remembered beside its end.

use pliant::energy::SurfaceContact;
use pliant::observer::{Frame, Notes, Observer, ObserverError, Quantities};
use pliant_scene::{Channel, Scene};
use serde::{Deserialize, Serialize};

/// Names of its notes at a checkpoint.
const MIN_J: &str = "statistics.min_j";
const MOST_INVERTED: &str = "statistics.most_inverted";
const LEAST_GAP: &str = "statistics.least_gap";

/// Surfaces that were nearest to each other for the distance from which on they push.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LeastGap {
    /// Names of the two.
    pub(crate) bodies: [String; 2],
    /// Distance less the radii [m].
    pub(crate) gap: f64,
    /// Its part of the distance from which on they push.
    pub(crate) relative: f64,
    /// Time of the frame [s].
    pub(crate) time: f64,
    /// Most pairs of primitives that touched in any frame.
    pub(crate) most: u64,
}

/// Extremes over the frames of a run.
pub(crate) struct Statistics {
    quantities: Quantities,
    /// Smallest `det F` of any element at any frame that was measured.
    pub(crate) min_j: Option<f64>,
    /// Most elements with `det F <= 0` at any frame that was measured.
    pub(crate) most_inverted: Option<u64>,
    /// Least gap of surfaces that touched at any frame; in scenes with contact.
    pub(crate) least_gap: Option<LeastGap>,
}

impl Statistics {
    /// Frames are measured if the scene records energies: so that a run without a file is the same run.
    pub(crate) fn new(scene: &Scene) -> Statistics {
        let measures = scene.output.channels.contains(&Channel::Energy);
        let quantities =
            Quantities::DIAGNOSTICS.only_if(measures) | Quantities::CONTACTS.only_if(scene.contact.is_some());
        Statistics { quantities, min_j: None, most_inverted: None, least_gap: None }
    }

    /// Goes on from what was noted at a checkpoint.
    pub(crate) fn resume(&mut self, notes: &Notes) {
        let number = |name: &str| notes.get(name)?.as_slice().try_into().ok();
        self.min_j = number(MIN_J).map(f64::from_le_bytes);
        self.most_inverted = number(MOST_INVERTED).map(u64::from_le_bytes);
        self.least_gap = notes.get(LEAST_GAP).and_then(|note| serde_json::from_slice(note).ok());
    }

    fn look_at_contacts(&mut self, contacts: &[SurfaceContact], time: f64) {
        let nearest = contacts.iter().min_by(|a, b| a.relative_gap.total_cmp(&b.relative_gap));
        let Some(SurfaceContact { bodies, gap, relative_gap, .. }) = nearest else { return };
        let most = contacts.len() as u64;
        let earlier = self.least_gap.take();
        let most = earlier.as_ref().map_or(most, |earlier| earlier.most.max(most));
        let now = LeastGap { bodies: bodies.clone(), gap: *gap, relative: *relative_gap, time, most };
        self.least_gap = match earlier {
            Some(earlier) if earlier.relative <= now.relative => Some(LeastGap { most, ..earlier }),
            _ => Some(now),
        };
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
        self.look_at_contacts(frame.contacts.unwrap_or_default(), frame.time);
        Ok(())
    }

    fn checkpoint(&mut self, notes: &mut Notes) -> Result<(), ObserverError> {
        notes.extend(self.min_j.map(|j| (MIN_J.to_owned(), j.to_le_bytes().to_vec())));
        notes.extend(self.most_inverted.map(|n| (MOST_INVERTED.to_owned(), n.to_le_bytes().to_vec())));
        let least_gap = self.least_gap.as_ref().and_then(|least| serde_json::to_vec(least).ok());
        notes.extend(least_gap.map(|note| (LEAST_GAP.to_owned(), note)));
        Ok(())
    }
}
