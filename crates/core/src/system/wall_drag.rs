//! Correction of wall reactions for drag.
//!
//! Integrators first take a step without walls, from `(x, v)` to `(x*, v*)`; the wall then moves vertices
//! back, to `(x', v')`. Drag at the rate `c` relative to fixed space (ether drag, mass-proportional
//! damping) removes momentum during the step, partly from velocities that the wall then removes: for a
//! mass at rest on a floor about `c h/2` of its load. The wall carries that part.
//!
//! Let `R` be the factor by which drag alone reduces a velocity in one step. Then a constant load `f`
//! gives
//!
//! ```text
//! v* = R v + (1 - R) f / (m c)
//! ```
//!
//! and drag removes `m c (x' - x)` over the actual displacement. The impulse of the walls is the
//! remainder:
//!
//! ```text
//! m (v' - v) - h f + m c (x' - x) = m (v' - v*) + K
//! K = m [ v* - v - (v* - R v)/M + c (x' - x) ]      M = (1 - R)/(c h)
//! ```
//!
//! `K` is exact for a vertex at rest, `x' = x` and `v' = v = 0`, with any integrator: the wall carries
//! `f`. Otherwise its error has the order at which walls act.

use super::WallStop;
use crate::algebra::dot;
use crate::constraint::Wall;

/// Sweeps over the walls that stop a vertex; one suffices unless there are several.
const SWEEPS: usize = 100;

/// End of a step in which walls have acted.
pub(super) struct WalledStep<'a> {
    pub(super) walls: &'a [Wall],
    /// Inverse mass of each coordinate, zero if it is constrained.
    pub(super) inverse_mass: &'a [f64],
    /// Step size [s].
    pub(super) h: f64,
    /// Positions [m] and velocities [m/s] before the step.
    pub(super) before: (&'a [f64], &'a [f64]),
    /// Positions [m] and velocities [m/s] after walls have acted.
    pub(super) after: (&'a [f64], &'a [f64]),
    /// `M`, a function of `c h`.
    pub(super) response: &'a dyn Fn(f64) -> f64,
}

impl WalledStep<'_> {
    /// Adds `K / m` along the walls to all stops of one vertex, for the drag rate `c` [1/s].
    pub(super) fn add_drag(&self, stops: &mut [WallStop], dimension: usize, rate: f64) {
        let rows = stops[0].vertex * dimension..(stops[0].vertex + 1) * dimension;
        let weights = &self.inverse_mass[rows.clone()];
        let normal = |stop: &WallStop| {
            let mut free = [0.0; 3];
            let parts = free.iter_mut().zip(weights).zip(self.walls[stop.wall].normal());
            parts.filter(|((_, w), _)| **w != 0.0).for_each(|((free, _), n)| *free = *n);
            free
        };
        let response = (self.response)(rate * self.h);
        let mut missing = [0.0; 3];
        for (c, row) in rows.enumerate().filter(|(c, _)| weights[*c] != 0.0) {
            let (x, v) = (self.before.0[row], self.before.1[row]);
            let taken: f64 = stops.iter().map(|stop| stop.speed * normal(stop)[c]).sum();
            let unstopped = self.after.1[row] - taken;
            let left = (1.0 - rate * self.h * response) * v;
            missing[c] = unstopped - v - (unstopped - left) / response + rate * (self.after.0[row] - x);
        }
        for _ in 0..SWEEPS {
            let mut changed = false;
            for stop in &mut *stops {
                let free = normal(stop);
                let speed = dot(&missing, &free) / dot(&free, &free);
                (0..3).for_each(|c| missing[c] -= speed * free[c]);
                stop.speed += speed;
                changed |= speed.abs() > f64::EPSILON * stop.speed.abs();
            }
            if !changed {
                break;
            }
        }
    }
}
