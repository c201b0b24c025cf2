//! Where Newton's method ends if the scene does not say: at a small part of what the scheme errs by in the
//! step.

use super::Newton;
use crate::solver::{Iterate, Objective};
use crate::system::System;

/// The part of the estimated error that a solve may leave.
const PART: f64 = 1e-3;

impl<const D: usize> Newton<D> {
    /// The largest correction [m] that ends a solve, as the iterate shows it; the same everywhere in
    /// statics and where options name it.
    pub(super) fn tolerance(&self, system: &System, objective: &Objective<'_>, at: &Iterate) -> f64 {
        let least = self.options.tolerance(self.size, objective.velocity.rate);
        match self.options.order {
            Some(order) if self.options.follows_error() && objective.inertia > 0.0 => {
                least.max(PART * scheme_error(system, objective, at, order))
            }
            _ => least,
        }
    }
}

/// Estimate of the error of a scheme of order `p` in a stage [m], up to a constant of the scheme: `|g^2 A|
/// min(1, g A / V)^p`.
///
/// `|g V|` and `|g^2 A|` are the lengths that velocity and acceleration take the vertices in the stage, in
/// the mean over the masses. A smooth motion has the frequency `w = A / V`, so that this is
/// `|g V| (g w)^(p + 1)`: that of the error of velocities, times `g`. Solves feel it first, for velocities are quotients of
/// increments by `g`.
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
