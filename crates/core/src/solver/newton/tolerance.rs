//! Where Newton's method ends if the scene does not say: at a small part of what the scheme errs by in the
//! step.

use super::Newton;
use crate::solver::{Iterate, Objective};
use crate::system::System;

/// The part of the estimated error that a solve may leave.
const PART: f64 = 1e-3;
/// The part of the way of friction's threshold speed in a stage that a solve may leave. What sticks creeps
/// within that way, and what slips is beyond it: a solve that ends a whole one away takes one for the other.
const PART_OF_CREEP: f64 = 0.05;
/// Corrections that shrink by this factor or less do so evenly.
const EVEN: f64 = 0.5;
/// Up to this order of the scheme the estimate of its error is trusted to a factor: it has the power of the
/// order. Above, the margin of one correction stays.
const TRUSTED: u32 = 2;

impl<const D: usize> Newton<D> {
    /// The largest distance from the solution [m] that ends a solve, as the iterate shows it; the same
    /// everywhere in statics and where options name it.
    pub(super) fn tolerance(&self, system: &System, objective: &Objective<'_>, at: &Iterate) -> f64 {
        let least = self.options.tolerance(self.size, objective.velocity.rate);
        let tolerance = match self.followed_order(objective) {
            Some(order) => least.max(PART * scheme_error(system, objective, at, order)),
            None => least,
        };
        if self.options.tolerance.is_some() {
            return tolerance;
        }
        // The error of a scheme says nothing of that: what is stopped for no reason has a large one.
        tolerance.min(PART_OF_CREEP * self.threshold_speed / objective.velocity.rate)
    }

    /// Bound of the distance of the solution [m] after a correction that followed the one `before`: the sum
    /// of those to come if they shrink alike, `r + r^2 + ... = r / (1 - r)` of the last; Hairer, Wanner 1996,
    /// *Solving Ordinary Differential Equations II*, section IV.8. The correction itself where they do not
    /// shrink evenly, or where the tolerance does not follow an error that is trusted.
    pub(super) fn left(&self, objective: &Objective<'_>, before: f64, correction: f64) -> f64 {
        let shrink = correction / before;
        let is_even = before.is_finite() && shrink <= EVEN;
        if is_even && self.followed_order(objective).is_some_and(|order| order <= TRUSTED) {
            correction * shrink / (1.0 - shrink)
        } else {
            correction
        }
    }

    /// The order of the scheme whose error the tolerance follows.
    fn followed_order(&self, objective: &Objective<'_>) -> Option<u32> {
        self.options.order.filter(|_| self.options.follows_error() && objective.inertia > 0.0)
    }
}

/// Estimate of the error of a scheme of order `p` in a stage [m], up to a constant of the scheme: `|g^2 A|
/// min(1, g A / V)^p`.
///
/// `|g V|` and `|g^2 A|` are the lengths that velocity and acceleration take the vertices in the stage, in
/// the mean over the masses. A smooth motion has the frequency `w = A / V`, so that this is
/// `|g V| (g w)^(p + 1)`: that of the error of velocities, times `g`. Solves feel it first, for velocities
/// are quotients of increments by `g`.
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
