//! Drag on velocities that walls take back.
//!
//! A scheme takes its step as if there were no wall, from `(x, v)` to `(x*, v*)`, and the wall then puts
//! vertices back, at `(x', v')`. Drag at the rate `c` against what does not move (ether drag, damping in
//! proportion to the mass) takes momentum on that way, and part of it from velocities that the wall takes
//! back: of a mass at rest on a floor about `c h/2` of its load. That part the wall carries.
//!
//! With `R` the factor that drag alone leaves of a velocity in one step of the scheme, a constant load `f`
//! makes
//!
//! ```text
//! v* = R v + (1 - R) f / (m c)
//! ```
//!
//! and drag takes `m c (x' - x)` on the way that is gone. The impulse of the walls is what is left:
//!
//! ```text
//! m (v' - v) - h f + m c (x' - x) = m (v' - v*) + K
//! K = m [ v* - v - (v* - R v)/M + c (x' - x) ]      M = (1 - R)/(c h)
//! ```
//!
//! `K` is exact for a vertex at rest, `x' = x` and `v' = v = 0`, by every scheme: the wall carries `f`.
//! Otherwise it is of the order at which walls act.

use super::wall_impulse::{WallImpulses, WallStop};
use crate::constraint::Wall;
use crate::dissipation::DissipativeTerm;

/// Sweeps over the walls that have stopped a vertex; one is enough unless there are several.
const SWEEPS: usize = 100;

/// A step in which walls act.
pub(super) struct WalledStep<'a> {
    pub(super) walls: &'a [Wall],
    pub(super) mass: &'a [f64],
    /// Of every coordinate, zero where it is held.
    pub(super) inverse_mass: &'a [f64],
    /// Size [s].
    pub(super) h: f64,
    /// Positions [m] and velocities [m/s] before it.
    pub(super) from: (&'a [f64], &'a [f64]),
    /// Positions at its end [m].
    pub(super) x: &'a [f64],
    /// `M`, a function of `c h`.
    pub(super) response: &'a dyn Fn(f64) -> f64,
}

/// Reckons what drag has taken from velocities that walls take back. Memory for one step.
#[derive(Debug, Default)]
pub(super) struct WallDrag {
    /// `m c` of every coordinate [kg/s].
    coefficients: Vec<f64>,
    /// Velocities before walls act [m/s].
    v: Vec<f64>,
    ones: Vec<f64>,
}

impl WallDrag {
    /// Begins with a step that leads to `(x, v)` before walls act, of vertices of these masses under ether
    /// drag and what of `dissipation` acts in proportion to the mass; what that last evaluated is lost.
    pub(super) fn begin(
        &mut self,
        (x, v): (&[f64], &[f64]),
        mass: &[f64],
        ether_drag: f64,
        dissipation: &mut [Box<dyn DissipativeTerm>],
    ) {
        let d = v.len() / mass.len();
        self.v.clear();
        self.v.extend_from_slice(v);
        self.coefficients.clear();
        self.coefficients.extend(mass.iter().flat_map(|m| std::iter::repeat_n(ether_drag * m, d)));
        self.ones.resize(v.len(), 1.0);
        for term in dissipation.iter_mut().filter(|term| term.scales_with_mass()) {
            term.add_damping_product(x, v, &self.ones, &mut self.coefficients);
        }
    }

    /// Adds the part `K` along the walls of each vertex that they have stopped, of which `stops` tell, by
    /// vertex.
    pub(super) fn add_to(&self, stops: &[WallStop], step: &WalledStep, impulses: &mut WallImpulses) {
        for stops in stops.chunk_by(|a, b| a.vertex == b.vertex) {
            self.add_vertex(stops, step, impulses);
        }
    }

    /// The same of one vertex, the only one in `stops`.
    fn add_vertex(&self, stops: &[WallStop], step: &WalledStep, impulses: &mut WallImpulses) {
        let (vertex, d) = (stops[0].vertex, step.x.len() / step.mass.len());
        let rows = vertex * d..(vertex + 1) * d;
        let (m, x, weights) = (step.mass[vertex], &step.x[rows.clone()], &step.inverse_mass[rows.clone()]);
        let rate = self.coefficients[rows.start] / m;
        if rate == 0.0 {
            return;
        }
        let response = (step.response)(rate * step.h);
        let mut missing = [0.0; 3];
        for (c, row) in rows.enumerate().filter(|(c, _)| weights[*c] != 0.0) {
            let (before, free) = (step.from.1[row], self.v[row]);
            let left = (1.0 - rate * step.h * response) * before;
            let way = x[c] - step.from.0[row];
            missing[c] = m * (free - before - (free - left) / response + rate * way);
        }
        let sweeps = if stops.len() == 1 { 1 } else { SWEEPS };
        for _ in 0..sweeps {
            for stop in stops {
                let wall = &step.walls[stop.wall];
                let free = |c: usize| if weights[c] == 0.0 { 0.0 } else { wall.normal()[c] };
                let length2 = (0..d).map(|c| free(c) * free(c)).sum::<f64>();
                let size = (0..d).map(|c| missing[c] * free(c)).sum::<f64>() / length2;
                (0..d).for_each(|c| missing[c] -= size * free(c));
                impulses.add(stop, wall, x, weights, size);
            }
        }
    }
}
