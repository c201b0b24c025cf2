//! Growth of energy in a simulation that is changed between its steps.

use super::{energy_scale, ensure_bounded};
use crate::diagnostics::Diagnostics;
use crate::simulation::{Simulation, StepError};

/// Judges the energy of a simulation by the test of [`run`](super::run), across changes between steps, at
/// which the balance of energy begins anew.
#[derive(Clone, Debug)]
pub struct EnergyWatch {
    /// Measurements at the start, or after the last change.
    start: Diagnostics,
    /// Energy that growth is compared with [J]: that of the start, and all that came in before the last change.
    scale: f64,
    /// Growth before the last change [J].
    grown: f64,
}

impl EnergyWatch {
    /// The watch from the present state on.
    pub fn new(simulation: &mut Simulation) -> EnergyWatch {
        let start = simulation.diagnostics();
        let scale = energy_scale(simulation, &start);
        EnergyWatch { start, scale, grown: 0.0 }
    }

    /// Growth since the start [J], and the energy to compare it with [J].
    fn growth(&self, now: &Diagnostics) -> (f64, f64) {
        let supplied = now.balance.map_or(0.0, |balance| balance.turnover());
        (self.grown + now.energy().gain(&self.start.energy()), self.scale + supplied)
    }

    /// Checks that the energy of the present state is finite, and has not grown beyond any physical cause.
    ///
    /// # Errors
    /// [`StepError::NotFinite`], [`StepError::Unstable`].
    pub fn judge(&self, simulation: &mut Simulation) -> Result<(), StepError> {
        let now = simulation.diagnostics();
        let (gain, scale) = self.growth(&now);
        ensure_bounded(simulation, [self.start.total, now.total], gain, scale)
    }

    /// Goes on after a change between two steps; `before` is measured before it. Energy that the change
    /// itself brings came in from outside.
    pub fn go_on(&mut self, before: &Diagnostics, simulation: &mut Simulation) {
        let after = simulation.diagnostics();
        let (grown, scale) = self.growth(before);
        *self = EnergyWatch { scale: scale + (after.total - before.total).abs(), grown, start: after };
    }
}
