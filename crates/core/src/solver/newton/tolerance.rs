//! Default tolerance of Newton's method: a small fraction of the integration error of the step.

use super::Newton;
use crate::solver::{Iterate, Objective};
use crate::system::System;

/// Fraction of the estimated integration error that a solve may leave.
const PART: f64 = 1e-3;
/// Fraction of the creep distance, friction's regularisation velocity times the stage duration, that a
/// solve may leave. Sticking contacts creep within that distance and slipping ones exceed it: an error of
/// that size confuses the two.
const PART_OF_CREEP: f64 = 0.05;
/// Largest contraction factor that counts as even.
const EVEN: f64 = 0.5;
/// Highest order of the integrator for which the error estimate is trusted to a constant factor. For
/// higher orders one extra correction remains as a margin.
const TRUSTED: u32 = 2;

impl<const D: usize> Newton<D> {
    /// Returns the largest distance from the solution [m] that ends a solve; constant in statics and if
    /// the options specify it.
    pub(super) fn tolerance(&self, system: &System, objective: &Objective<'_>, at: &Iterate) -> f64 {
        let least = self.options.tolerance(self.size, objective.velocity.rate);
        let tolerance = match self.followed_order(objective) {
            Some(order) => least.max(PART * scheme_error(system, objective, at, order)),
            None => least,
        };
        if self.options.tolerance.is_some() {
            return tolerance;
        }
        // The integration error says nothing about sticking: abrupt stops have a large one.
        tolerance.min(PART_OF_CREEP * self.threshold_speed / objective.velocity.rate)
    }

    /// Bounds the distance to the solution [m] after a correction that followed the one `before`: the
    /// geometric sum of future corrections, `r + r^2 + ... = r / (1 - r)` times the last; Hairer, Wanner
    /// 1996, *Solving Ordinary Differential Equations II*, section IV.8. Returns the correction itself if
    /// corrections do not shrink evenly, or if the tolerance does not follow a trusted error estimate.
    pub(super) fn left(&self, objective: &Objective<'_>, before: f64, correction: f64) -> f64 {
        let shrink = correction / before;
        let is_even = before.is_finite() && shrink <= EVEN;
        if is_even && self.followed_order(objective).is_some_and(|order| order <= TRUSTED) {
            correction * shrink / (1.0 - shrink)
        } else {
            correction
        }
    }

    /// Returns the order of the integrator if the tolerance follows its error.
    fn followed_order(&self, objective: &Objective<'_>) -> Option<u32> {
        self.options.order.filter(|_| self.options.follows_error() && objective.inertia > 0.0)
    }
}

/// Estimates the error of an integrator of order `p` in a stage [m], up to a method constant:
/// `|g^2 A| min(1, g A / V)^p`.
///
/// `|g V|` and `|g^2 A|` are the mass-weighted mean displacements by velocity and by acceleration. A
/// smooth motion has the frequency `w = A / V`, so that this is `|g V| (g w)^(p + 1)`: the error of
/// velocities times `g`. Solves affect velocities first, as these are increments divided by `g`.
fn scheme_error(system: &System, objective: &Objective<'_>, at: &Iterate, order: u32) -> f64 {
    let (mass, weight, d) = (system.mass(), system.inverse_mass(), system.dimension());
    let (mut total, mut moved, mut pushed) = (0.0, 0.0, 0.0);
    for i in (0..at.u.len()).filter(|i| weight[*i] > 0.0) {
        let (by_velocity, by_force) = (at.u[i] - objective.velocity.drift[i], at.u[i] - objective.target[i]);
        total += mass[i / d];
        moved += mass[i / d] * by_velocity * by_velocity;
        pushed += mass[i / d] * by_force * by_force;
    }
    if !(pushed > 0.0 && total > 0.0) {
        return 0.0;
    }
    let ratio = (pushed / moved).sqrt().min(1.0);
    (pushed / total).sqrt() * ratio.powi(order as i32)
}
