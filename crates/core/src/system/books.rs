//! Counts and energies recorded with forces and walls. The equations do not depend on them.

use std::sync::Mutex;

use super::{ForceId, System, WallImpulses, WallLoss, WallLosses, WallStop};
use crate::energy::EnergyKind;

/// Records of a system.
#[derive(Debug, Default)]
pub(crate) struct Books {
    /// Computation of wall losses, if they are counted.
    pub(super) wall_losses: Option<Box<WallLosses>>,
    /// Wall impulses at the end of the last attempted step.
    pub(super) wall_impulses: WallImpulses,
    /// Vertices that the walls stop there, in any order.
    pub(super) wall_stops: Mutex<Vec<WallStop>>,
    /// Force evaluations so far.
    pub(super) force_evaluations: u64,
    /// True if the next force belongs to a state to be measured.
    pub(super) to_be_measured: bool,
    /// Energy of each term computed with the current force [J]; empty if not requested.
    pub(super) energies: Vec<Option<f64>>,
}

impl Books {
    /// Sets whether wall losses are counted, for [`take_wall_loss`](Self::take_wall_loss).
    pub(crate) fn count_walls(&mut self, counts: bool) {
        self.wall_losses = if counts { Some(self.wall_losses.take().unwrap_or_default()) } else { None };
    }

    /// Returns the energy that walls took in the last step, once; `None` if they did not act.
    pub(crate) fn take_wall_loss(&mut self) -> Option<WallLoss> {
        self.wall_losses.as_mut()?.take()
    }

    /// Returns the wall impulses at the end of the last attempted step.
    pub(crate) fn wall_impulses(&self) -> &WallImpulses {
        &self.wall_impulses
    }

    /// True if energies were computed with the current force.
    pub(crate) fn knows_energies(&self) -> bool {
        !self.energies.is_empty()
    }

    /// Sets whether the next states will be measured.
    pub(crate) fn set_to_be_measured(&mut self, to_be_measured: bool) {
        self.to_be_measured = to_be_measured;
    }

    /// Returns the number of force evaluations so far.
    pub(crate) fn force_evaluations(&self) -> u64 {
        self.force_evaluations
    }

    /// Sets the number of force evaluations.
    pub(crate) fn set_force_evaluations(&mut self, count: u64) {
        self.force_evaluations = count;
    }
}

impl System {
    /// Returns the records.
    pub(crate) fn books(&self) -> &Books {
        &self.books
    }

    /// Returns the records for writing.
    pub(crate) fn books_mut(&mut self) -> &mut Books {
        &mut self.books
    }

    /// Returns the potential energy of the terms of `asked` kinds [J] at `x`. If the terms hold `force`,
    /// reuses energies computed with it.
    pub(crate) fn potential_with_force(
        &mut self,
        asked: impl Fn(EnergyKind) -> bool,
        x: &[f64],
        force: ForceId,
    ) -> f64 {
        let known = if self.holds(force) { self.books.energies.as_slice() } else { &[] };
        let terms = self.terms.iter_mut().enumerate().filter(|(_, term)| asked(term.properties().kind));
        terms.map(|(i, t)| known.get(i).copied().flatten().unwrap_or_else(|| t.energy(x))).sum()
    }
}
