//! Energy that walls take from the vertices that they put back.
//!
//! A scheme takes its step as if there were no wall, from `(x, v)` to `(x*, v*)`, and the wall then puts
//! vertices back, at `(x', v')`. The energy before less the energy after is no loss: part of it is what the
//! step itself has made, by falling where there is no way to fall, and the wall takes back. For a mass at
//! rest on a floor it is all there is, and `-m a^2 h^2/2` in every step of symplectic Euler.
//!
//! With the mean acceleration of the step and the mean velocity,
//!
//! ```text
//! a = (v* - v) / h      u = (x* - x) / h
//! ```
//!
//! the step without walls has done the work `m a . (x* - x)` on a vertex, and `m u . (v* - v)` is what has
//! become of it: the change of kinetic energy `m (v + v*)/2 . (v* - v)` where `u` is the mean of both
//! velocities, and otherwise that of the velocities with which positions change. (Those of symplectic Euler
//! are ahead of the positions by `h/2`: `u - (v + v*)/2 = a h/2`.) Both are equal, by definition. With a
//! wall they are not: the same forces have worked along the way `x' - x` that was left to the vertex, and
//! its velocity is `v'`. What is missing has been lost, by an impact without rebound:
//!
//! ```text
//! s = u - (v + v*)/2
//! W = m [ (v - v') . ((v + v')/2 + s) + a . (x' - x) ]
//! ```
//!
//! - A vertex at rest, `x' = x` and `v' = v`, loses nothing, to the last bit, by any scheme, whatever load
//!   lies on it and however it grows.
//! - One that falls freely from the height `y` above the plane loses `m g y`, the energy with which it
//!   arrives there.
//! - With forces that change within the step it is the energy at arrival to `O(h^2)`.
//! - Along the wall `v' = v*` and `x' = x*`: what slides loses nothing.
//! - Where several walls push a vertex to and fro, what it loses in one step comes back in another.
//!
//! A single `W` may be negative, by `O(m a^2 h^2)`: that is an error of the scheme. What is lost is the
//! largest sum of all `W` so far, which never shrinks; the rest counts as drift, not as a gift of the wall.
//!
//! Walls act at the end of a step: the motion of every scheme is of first order where they do, its energy,
//! less what is lost, of second at most.

use super::{PowerSelection, Powers, System, power_of_motion};
use crate::state::State;

/// Reckons what walls take. Memory for one step.
#[derive(Debug, Default)]
pub(crate) struct WallLosses {
    /// Positions and velocities before the walls act, flat; then, in `x`, the ways that were not gone.
    x: Vec<f64>,
    v: Vec<f64>,
    /// `dR/dv` of damping and of friction there [N], where something dissipates.
    dissipative: [Vec<f64>; 2],
    flows: Powers,
    motion: f64,
    /// Of the last step, until it is taken.
    last: Option<WallLoss>,
}

/// Action of walls in one step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WallLoss {
    /// The sum of `W` over all vertices [J].
    pub(crate) energy: f64,
    /// Power that flowed before the walls acted [W].
    pub(crate) flows: Powers,
    /// Power of prescribed motion before they did [W]: it carries forces of vertices that walls have stopped
    /// since.
    pub(crate) motion: f64,
    /// To be added to the integrals of these flows [J]: they count ways that were not gone.
    pub(crate) not_done: Powers,
}

impl WallLosses {
    /// Forgets the last step.
    pub(crate) fn forget(&mut self) {
        self.last = None;
    }

    /// The last step, once; `None` where no wall acted.
    pub(crate) fn take(&mut self) -> Option<WallLoss> {
        self.last.take()
    }

    /// Remembers the end `x`, `v` of a step, at the time last said to `system`, before walls act on it. The
    /// dissipative force last evaluated is lost, and where anything is moved the force as well.
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

    /// Reckons with the end `x`, `v` of the step of `h` [s] from the state `from`, after walls have acted.
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
                // The integral of a flow goes by velocities.
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
