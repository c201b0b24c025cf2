//! Energy growth of a simulation that is changed between steps.

use super::{energy_scale, ensure_bounded};
use crate::diagnostics::Diagnostics;
use crate::simulation::{Simulation, StepError};

/// Applies the energy check of [`run`](super::run) across changes between steps, at which the energy
/// balance starts anew.
#[derive(Clone, Debug)]
pub struct EnergyWatch {
    /// Diagnostics at the start, or after the last change.
    start: Diagnostics,
    /// Energy scale of the growth [J]: that of the start, plus the energy supplied before the last
    /// change.
    scale: f64,
    /// Growth before the last change [J].
    grown: f64,
}

impl EnergyWatch {
    /// Starts the watch at the current state.
    pub fn new(simulation: &mut Simulation) -> EnergyWatch {
        let start = simulation.diagnostics();
        let scale = energy_scale(simulation, &start);
        EnergyWatch { start, scale, grown: 0.0 }
    }

    /// Returns the growth since the start [J] and its energy scale [J].
    fn growth(&self, now: &Diagnostics) -> (f64, f64) {
        let supplied = now.balance.map_or(0.0, |balance| balance.turnover());
        (self.grown + now.energy().gain(&self.start.energy()), self.scale + supplied)
    }

    /// Checks that the energy of the current state is finite and has not grown beyond any physical cause.
    ///
    /// # Errors
    /// [`StepError::NotFinite`] or [`StepError::Unstable`] if it has.
    pub fn judge(&self, simulation: &mut Simulation) -> Result<(), StepError> {
        let now = simulation.diagnostics();
        let (gain, scale) = self.growth(&now);
        ensure_bounded(simulation, [self.start.total, now.total], gain, scale)
    }

    /// Continues after a change between two steps; `before` was measured before it. Energy added by the
    /// change counts as external supply.
    pub fn go_on(&mut self, before: &Diagnostics, simulation: &mut Simulation) {
        let after = simulation.diagnostics();
        let (grown, scale) = self.growth(before);
        *self = EnergyWatch { scale: scale + (after.total - before.total).abs(), grown, start: after };
    }
}
