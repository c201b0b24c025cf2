//! Energy that walls take from the vertices they stop.
//!
//! Integrators first take a step without walls, from `(x, v)` to `(x*, v*)`; the wall then moves vertices
//! back, to `(x', v')`. The energy before minus the energy after is not the loss: part of it was produced
//! by the step itself, by falling below the floor, and the wall takes it back. For a mass at rest on a
//! floor that is all of it: `-m a^2 h^2/2` in each step of symplectic Euler.
//!
//! With the mean acceleration and mean velocity of the step,
//!
//! ```text
//! a = (v* - v) / h      u = (x* - x) / h
//! ```
//!
//! the step without walls has done the work `m a . (x* - x)` on a vertex, and converted it to
//! `m u . (v* - v)`: to the kinetic energy change `m (v + v*)/2 . (v* - v)` if `u` is the mean of both
//! velocities, and otherwise to that of the velocities with which positions change. (Those of symplectic
//! Euler are ahead of the positions by `h/2`: `u - (v + v*)/2 = a h/2`.) Both are equal by definition.
//! With a wall they differ: the same forces have acted along the remaining displacement `x' - x`, and the
//! velocity is `v'`. The difference is lost in an inelastic impact:
//!
//! ```text
//! s = u - (v + v*)/2
//! W = m [ (v - v') . ((v + v')/2 + s) + a . (x' - x) ]
//! ```
//!
//! - A vertex at rest, `x' = x` and `v' = v`, loses exactly nothing with any integrator, whatever its
//!   load and however the load grows.
//! - A vertex that falls freely from the height `y` above the plane loses `m g y`, the energy of its
//!   impact.
//! - With forces that vary within the step the loss is the impact energy to `O(h^2)`.
//! - Along the wall `v' = v*` and `x' = x*`: a sliding vertex loses nothing.
//! - If several walls push a vertex back and forth, its loss in one step returns in another.
//!
//! A single `W` may be negative, by `O(m a^2 h^2)`, which is an integration error. The loss is the
//! largest sum of all `W` so far, which never decreases; the rest counts as energy drift.
//!
//! Walls act at the end of a step: with walls, the motion is first-order accurate with any integrator,
//! its energy minus the losses at most second-order.

use super::{PowerSelection, Powers, System, power_of_motion};
use crate::state::State;

/// Computes wall losses. Holds scratch memory for one step.
#[derive(Debug, Default)]
pub(crate) struct WallLosses {
    /// Positions and velocities before walls act, flat; then, in `x`, the displacements that walls
    /// prevented.
    x: Vec<f64>,
    v: Vec<f64>,
    /// `dR/dv` of damping and friction there [N], with dissipation.
    dissipative: [Vec<f64>; 2],
    flows: Powers,
    motion: f64,
    /// Result of the last step, until taken.
    last: Option<WallLoss>,
}

/// Effect of walls in one step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WallLoss {
    /// Sum of `W` over all vertices [J].
    pub(crate) energy: f64,
    /// Energy flows before the walls acted [W].
    pub(crate) flows: Powers,
    /// Power of prescribed motion before the walls acted [W], including forces of vertices that walls
    /// have since stopped.
    pub(crate) motion: f64,
    /// Correction of the integrals of these flows [J] for displacements that walls prevented.
    pub(crate) not_done: Powers,
}

impl WallLosses {
    /// Discards the last step.
    pub(crate) fn forget(&mut self) {
        self.last = None;
    }

    /// Returns the last step, once; `None` if no wall acted.
    pub(crate) fn take(&mut self) -> Option<WallLoss> {
        self.last.take()
    }

    /// Stores the end `x`, `v` of a step before walls act on it, at the time last set. Overwrites the
    /// last dissipative force and, with prescribed motion, the force.
    pub(crate) fn before(&mut self, system: &mut System, x: &[f64], v: &[f64]) {
        self.flows = Powers::of(system, PowerSelection::ALL, x, v);
        self.motion = 0.0;
        if system.has_prescribed_motion() {
            system.evaluate(x);
            self.motion = power_of_motion(system, x, v).0;
        }
        if system.is_damped() {
            system.dissipative_forces(x, v, &mut self.dissipative);
        }
        for (kept, now) in [(&mut self.x, x), (&mut self.v, v)] {
            kept.resize(now.len(), 0.0);
            kept.copy_from_slice(now);
        }
    }

    /// Computes the loss from the end `x`, `v` of the step of `h` [s] from the state `from`, after walls
    /// have acted.
    pub(crate) fn after(&mut self, system: &mut System, from: &State, h: f64, x: &[f64], v: &[f64]) {
        let (d, mut energy, mut dragged) = (system.dimension(), 0.0, 0.0);
        for (vertex, m) in system.mass().iter().enumerate() {
            let rows = vertex * d..(vertex + 1) * d;
            let (x1, v1) = (&x[rows.clone()], &v[rows.clone()]);
            let (free_x, free_v) = (&mut self.x[rows.clone()], &self.v[rows.clone()]);
            if *free_x == *x1 && *free_v == *v1 {
                free_x.fill(0.0);
                continue;
            }
            let (x0, v0) = (&from.x()[rows.clone()], &from.v()[rows]);
            let mut lost = 0.0;
            for c in 0..d {
                let lead = (free_x[c] - x0[c]) / h - 0.5 * (v0[c] + free_v[c]);
                lost += (v0[c] - v1[c]) * (0.5 * (v0[c] + v1[c]) + lead)
                    + (free_v[c] - v0[c]) / h * (x1[c] - x0[c]);
                // Flow integrals use velocities.
                free_x[c] = x1[c] - x0[c] - 0.5 * h * (v0[c] + free_v[c]);
                dragged += m * free_v[c] * free_x[c];
            }
            energy += m * lost;
        }
        let along = |force: &Vec<f64>| force.iter().zip(&self.x).map(|(force, way)| force * way).sum();
        let dissipated = self.dissipative.each_ref().map(along);
        let not_done = Powers::along(system, x, &self.x, system.ether_drag() * dragged, dissipated);
        self.last = Some(WallLoss { energy, flows: self.flows, motion: self.motion, not_done });
    }
}
