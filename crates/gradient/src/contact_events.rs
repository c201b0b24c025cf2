//! Changes of contacts between successive states of a run.

use std::collections::BTreeMap;

use pliant::energy::TouchingPair;
use pliant::system::System;

/// Changes of the pairs of closest primitives in contact, counted between successive states of a run.
///
/// The contact energy is smooth where a pair comes within the activation distance, and so is friction
/// where sliding begins: the derivatives are those of the run, on both sides. Second derivatives jump
/// there, and also where the closest point moves to another primitive, which counts as another pair. A
/// gradient with many such changes says little about perturbations that are large enough to shift them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ContactEvents {
    /// Number of pairs that have come within the activation distance.
    pub come: u64,
    /// Number of pairs that have left it.
    pub left: u64,
    /// Number of pairs that have changed from sticking to sliding, judged by the velocities of states;
    /// always 0 in statics.
    pub slid: u64,
    /// Number of pairs that have changed from sliding to sticking.
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

/// Pairs in contact in a state, by their vertices, and whether each slides.
pub(crate) struct TouchingPairs(BTreeMap<[u32; 4], Option<bool>>);

impl TouchingPairs {
    /// Pairs at `x` and `v`, flat; `None` in a system without contact.
    pub(crate) fn of(system: &System, x: &[f64], v: &[f64]) -> Option<Self> {
        let mut terms = system.terms().iter().filter_map(|term| term.touching()).peekable();
        terms.peek()?;
        let pairs = terms.flat_map(|term| term.pairs(x, v));
        Some(TouchingPairs(pairs.map(|TouchingPair { vertices, slides }| (vertices, slides)).collect()))
    }
}
