//! Changes of contacts from one state of a run to the next.

use std::collections::BTreeMap;

use pliant::energy::TouchingPair;
use pliant::system::System;

/// Changes of the pairs of closest primitives that touch, counted from each state of a run to the next.
///
/// The energy of contact is smooth where a pair comes within reach, and so is friction where it begins to
/// slide: derivatives are those of the run, on both sides. Their second derivatives jump there, also where
/// the closest point goes from one primitive to the next, which is another pair. A gradient of many such
/// changes says little about changes that are large enough to shift them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ContactEvents {
    /// Pairs that have come within reach.
    pub come: u64,
    /// Pairs that have left it.
    pub left: u64,
    /// Pairs that stuck and slide now, by the velocities of states; statics has none.
    pub slid: u64,
    /// Pairs that slid and stick now.
    pub stuck: u64,
}

impl ContactEvents {
    /// Adds the changes from the pairs `before` to those `after`.
    pub(crate) fn add(&mut self, before: &TouchingPairs, after: &TouchingPairs) {
        self.come += after.0.keys().filter(|pair| !before.0.contains_key(*pair)).count() as u64;
        self.left += before.0.keys().filter(|pair| !after.0.contains_key(*pair)).count() as u64;
        for (pair, slides) in &after.0 {
            match (before.0.get(pair), slides) {
                (Some(Some(false)), Some(true)) => self.slid += 1,
                (Some(Some(true)), Some(false)) => self.stuck += 1,
                _ => {}
            }
        }
    }
}

/// Pairs that touch in a state, by their vertices, and whether each slides.
pub(crate) struct TouchingPairs(BTreeMap<[u32; 4], Option<bool>>);

impl TouchingPairs {
    /// Pairs at `x` and `v`, flat; `None` where nothing can touch.
    pub(crate) fn of(system: &System, x: &[f64], v: &[f64]) -> Option<Self> {
        let mut terms = system.terms().iter().filter_map(|term| term.touching()).peekable();
        terms.peek()?;
        let pairs = terms.flat_map(|term| term.pairs(x, v));
        Some(TouchingPairs(pairs.map(|TouchingPair { vertices, slides }| (vertices, slides)).collect()))
    }
}
