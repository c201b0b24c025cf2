//! Value and gradient of an [`Objective`] at an iterate.

use super::Newton;
use crate::solver::hessian::Weights;
use crate::solver::{Iterate, Objective, Velocity};
use crate::system::System;

impl<const D: usize> Newton<D> {
    /// Writes the gradient of the objective at `at`, zero at constrained coordinates. Returns false if it
    /// is not finite. The system holds the force there afterwards.
    pub(super) fn residual(&mut self, system: &mut System, objective: &Objective<'_>, at: &Iterate) -> bool {
        let finite = system.evaluate(&at.x).is_some();
        if system.is_damped() {
            self.velocity_at(system, objective, at);
            system.evaluate_dissipation(&at.x, &self.velocity);
        }
        self.follower.clear();
        for term in system.terms().iter().filter(|term| !term.properties().is_conservative) {
            self.follower.resize(at.x.len(), 0.0);
            term.add_rows(0, &mut self.follower);
        }
        system.accelerations(&mut self.residual);
        let (mass, weight, d) = (system.mass(), system.inverse_mass(), system.dimension());
        for (i, r) in self.residual.iter_mut().enumerate() {
            let inertia = objective.inertia * (at.u[i] - objective.target[i]);
            *r = if weight[i] == 0.0 { 0.0 } else { mass[i / d] * (inertia - objective.stiffness * *r) };
        }
        finite
    }

    /// Computes the velocities of `at`; those of constrained coordinates are prescribed.
    pub(super) fn velocity_at(&mut self, system: &System, objective: &Objective<'_>, at: &Iterate) {
        self.velocity.resize(at.u.len(), 0.0);
        let (held, Velocity { rate, drift, .. }) = (system.inverse_mass(), objective.velocity);
        for i in 0..at.u.len() {
            self.velocity[i] =
                if held[i] == 0.0 { objective.held_velocity[i] } else { rate * (at.u[i] - drift[i]) };
        }
    }

    /// Returns the objective at `at` with the iterate `last`, where dissipation and non-conservative
    /// forces are evaluated.
    pub(super) fn value(
        &mut self,
        system: &mut System,
        objective: &Objective<'_>,
        last: &Iterate,
        at: &Iterate,
    ) -> f64 {
        let (mass, weight, d) = (system.mass(), system.inverse_mass(), system.dimension());
        let square = |i: usize| {
            let away = at.u[i] - objective.target[i];
            if weight[i] == 0.0 { 0.0 } else { mass[i / d] * away * away }
        };
        let inertia: f64 = if objective.inertia == 0.0 { 0.0 } else { (0..at.u.len()).map(square).sum() };
        self.work.energies += 1;
        let potential = system.potential_energy(&at.x);
        self.conservative = 0.5 * objective.inertia * inertia + objective.stiffness * potential;
        self.conservative + self.changing_part(system, objective, last, at)
    }

    /// Returns the part of the objective at `at` that depends on the iterate `last`.
    pub(super) fn changing_part(
        &mut self,
        system: &mut System,
        objective: &Objective<'_>,
        last: &Iterate,
        at: &Iterate,
    ) -> f64 {
        let weight = system.inverse_mass();
        let work = |(i, g): (usize, &f64)| if weight[i] == 0.0 { 0.0 } else { g * (at.u[i] - last.u[i]) };
        let mut part: f64 = self.follower.iter().enumerate().map(work).sum();
        if system.is_damped() {
            self.velocity_at(system, objective, at);
            let dissipation = system.dissipation_functions(&last.x, &self.velocity);
            part += 1.0 / objective.velocity.rate * dissipation;
        }
        objective.stiffness * part
    }

    /// Sets `trial` to `at + step * direction`.
    pub(super) fn move_along(&mut self, system: &System, objective: &Objective<'_>, at: &Iterate, step: f64) {
        self.stepped_from = false;
        let held = system.inverse_mass();
        for i in 0..at.u.len() {
            let u = at.u[i] + step * self.direction[i];
            self.trial.u[i] = u;
            self.trial.x[i] = if held[i] == 0.0 { at.x[i] } else { objective.velocity.origin[i] + u };
        }
    }

    /// Computes the residual at the trial; returns whether it is finite.
    pub(super) fn residual_at_trial(&mut self, system: &mut System, objective: &Objective<'_>) -> bool {
        let trial = std::mem::take(&mut self.trial);
        let finite = self.residual(system, objective, &trial);
        self.trial = trial;
        finite
    }
}

pub(super) fn weights(objective: &Objective<'_>) -> Weights {
    Weights {
        inertia: objective.inertia,
        stiffness: objective.stiffness,
        damping: objective.stiffness * objective.velocity.rate,
    }
}
