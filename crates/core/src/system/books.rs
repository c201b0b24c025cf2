//! Books of a system: counts and energies that come with its forces and walls. The equations do not read
//! them.

use std::sync::Mutex;

use super::{ForceId, System, WallImpulses, WallLoss, WallLosses, WallStop};
use crate::energy::EnergyKind;

/// Counts and energies beside the equations.
#[derive(Debug, Default)]
pub(crate) struct Books {
    /// Reckons what walls take, where that is counted.
    pub(super) wall_losses: Option<Box<WallLosses>>,
    /// Impulses of walls at the end of the step last tried.
    pub(super) wall_impulses: WallImpulses,
    /// Vertices that they stop there, added by passes in any order.
    pub(super) wall_stops: Mutex<Vec<WallStop>>,
    /// Evaluations of the total force so far.
    pub(super) force_evaluations: u64,
    /// True if the next force is that of a state to be measured.
    pub(super) to_be_measured: bool,
    /// Energy of each term that came with the force that the terms hold [J]; empty if none was asked for.
    pub(super) energies: Vec<Option<f64>>,
}

impl Books {
    /// Says whether energy that walls take is counted: [`take_wall_loss`](Self::take_wall_loss) then tells.
    pub(crate) fn count_walls(&mut self, counts: bool) {
        self.wall_losses = if counts { Some(self.wall_losses.take().unwrap_or_default()) } else { None };
    }

    /// Energy that walls took in the last step, once; `None` if they did not act.
    pub(crate) fn take_wall_loss(&mut self) -> Option<WallLoss> {
        self.wall_losses.as_mut()?.take()
    }

    /// Impulses of walls at the end of the step last tried.
    pub(crate) fn wall_impulses(&self) -> &WallImpulses {
        &self.wall_impulses
    }

    /// True if energies came with the force that the terms hold.
    pub(crate) fn knows_energies(&self) -> bool {
        !self.energies.is_empty()
    }

    /// Says whether the states that come next will be measured.
    pub(crate) fn set_to_be_measured(&mut self, to_be_measured: bool) {
        self.to_be_measured = to_be_measured;
    }

    /// Evaluations of the total force so far.
    pub(crate) fn force_evaluations(&self) -> u64 {
        self.force_evaluations
    }

    /// Goes on counting evaluations of the force from `count`.
    pub(crate) fn set_force_evaluations(&mut self, count: u64) {
        self.force_evaluations = count;
    }
}

impl System {
    /// The books.
    pub(crate) fn books(&self) -> &Books {
        &self.books
    }

    /// The books, to write in.
    pub(crate) fn books_mut(&mut self) -> &mut Books {
        &mut self.books
    }

    /// Potential energy of the terms of `asked` kinds [J] at `x`, where the force is `force`: nothing that
    /// came with it is computed again.
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
