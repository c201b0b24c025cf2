//! Walls at the end of a step: where they act, and the derivative of their action.
//!
//! A vertex behind the plane `n . x = c` is projected back, `x' = x + (c - n.x) w`, and loses its
//! velocity into the wall, `v' = v - (n.v) w` if `n.v < 0`; `w = m / |m|^2` with `m` the normal without
//! fixed coordinates. Both maps are linear as long as the same vertices are behind the same walls, and
//! they follow a step without walls. Where a vertex comes to a wall or leaves it, the derivative is that
//! of the side on which the run was.

use pliant::constraint::Wall;
use pliant::numbering::Numbering;
use pliant::simulation::{Simulation, Snapshot};
use pliant::system::System;

use crate::GradientError;
use crate::schedule::Schedule;

/// Event of a vertex that comes to a wall or leaves one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct WallEvent {
    /// Number of the step in which it comes or leaves, counted as
    /// [`LossFrame::step`](crate::LossFrame::step).
    pub step: u64,
    /// Vertex, in the order of the scene.
    pub vertex: usize,
    /// Wall, by its index in the system.
    pub wall: usize,
    /// True if it comes, false if it leaves.
    pub has_come: bool,
}

/// Vertices on walls, by their indices in the simulation, and the walls; ascending.
pub(crate) type Touching = Vec<(usize, usize)>;

/// Action of a wall that projects a vertex back.
#[derive(Clone, Copy, Debug, PartialEq)]
struct WallAction {
    vertex: usize,
    wall: usize,
    /// True if it also stops the velocity into the wall.
    stops: bool,
}

/// End of a step before walls acted, and their actions.
pub(crate) struct WalledEnd {
    pub(crate) x: Vec<f64>,
    pub(crate) v: Vec<f64>,
    /// Actions in the order in which they apply.
    actions: Vec<WallAction>,
    /// Vertices on walls after the step.
    pub(crate) touching: Touching,
}

impl WalledEnd {
    /// Repeats the step of `simulation` from `start` without walls; the simulation ends there.
    ///
    /// # Errors
    /// A step that fails, or a `start` that does not belong to the simulation.
    pub(crate) fn of_step(
        simulation: &mut Simulation,
        start: &Snapshot,
        schedule: &Schedule,
    ) -> Result<Self, GradientError> {
        simulation.restore(start)?;
        let walls = simulation.system_mut().replace_walls(vec![]);
        let end = schedule.step(simulation);
        simulation.system_mut().replace_walls(walls);
        end?;
        let (x, v) = (simulation.state().x().to_vec(), simulation.state().v().to_vec());
        Ok(WalledEnd::new(simulation.system(), x, v))
    }

    fn new(system: &System, x: Vec<f64>, v: Vec<f64>) -> Self {
        let (d, weights) = (system.dimension(), system.inverse_mass());
        let (mut now_x, mut now_v, mut actions) = (x.clone(), v.clone(), vec![]);
        for (number, wall) in system.walls().iter().enumerate() {
            for (vertex, row) in now_x.chunks_exact(d).enumerate().filter(|(_, row)| wall.depth(row) > 0.0) {
                let rows = vertex * d..vertex * d + row.len();
                if way_back(wall, &weights[rows.clone()]).is_some() {
                    let into: f64 = wall.normal().iter().zip(&now_v[rows]).map(|(n, v)| n * v).sum();
                    actions.push(WallAction { vertex, wall: number, stops: into < 0.0 });
                }
            }
            wall.apply(weights, &mut now_x, &mut now_v, |_, _| {});
        }
        WalledEnd { touching: touching(system, &now_x), x, v, actions }
    }

    /// Propagates derivatives by the end of the step to those by the state before walls acted.
    pub(crate) fn back(&self, system: &System, x_bar: &mut [f64], v_bar: &mut [f64]) {
        for action in self.actions.iter().rev() {
            let transposed = |normal: &[f64], back: &[f64], bar: &mut [f64]| {
                let along: f64 = back.iter().zip(&*bar).map(|(back, bar)| back * bar).sum();
                bar.iter_mut().zip(normal).for_each(|(bar, n)| *bar -= n * along);
            };
            action.each(system, x_bar, v_bar, transposed);
        }
    }

    /// Propagates changes of the state before walls acted to those of the end of the step.
    pub(crate) fn forth(&self, system: &System, x_dot: &mut [f64], v_dot: &mut [f64]) {
        for action in &self.actions {
            let along_wall = |normal: &[f64], back: &[f64], dot: &mut [f64]| {
                let along: f64 = normal.iter().zip(&*dot).map(|(n, dot)| n * dot).sum();
                dot.iter_mut().zip(back).for_each(|(dot, back)| *dot -= back * along);
            };
            action.each(system, x_dot, v_dot, along_wall);
        }
    }
}

/// Events of step `step`, from the contacts `before` to those `after` it.
pub(crate) fn events(
    numbering: &Numbering,
    step: u64,
    before: &Touching,
    after: &Touching,
) -> impl Iterator<Item = WallEvent> {
    let only_in = move |a: &Touching, b: &Touching, has_come| {
        let alone = a.iter().filter(|pair| b.binary_search(pair).is_err());
        let event = |&(vertex, wall): &(usize, usize)| {
            let vertex = numbering.original(vertex as u32) as usize;
            WallEvent { step, vertex, wall, has_come }
        };
        alone.map(event).collect::<Vec<_>>()
    };
    only_in(after, before, true).into_iter().chain(only_in(before, after, false))
}

impl WallAction {
    /// Calls `change(normal, w, row)` with the vertex's row of `x`, and of `v` if it was stopped.
    fn each(
        self,
        system: &System,
        x: &mut [f64],
        v: &mut [f64],
        change: impl Fn(&[f64], &[f64], &mut [f64]),
    ) {
        let (d, wall) = (system.dimension(), &system.walls()[self.wall]);
        let rows = self.vertex * d..(self.vertex + 1) * d;
        let Some(back) = way_back(wall, &system.inverse_mass()[rows.clone()]) else { return };
        change(wall.normal(), &back[..d], &mut x[rows.clone()]);
        if self.stops {
            change(wall.normal(), &back[..d], &mut v[rows]);
        }
    }
}

/// Vector `w` of a vertex with these inverse masses; `None` if the wall cannot move it.
fn way_back(wall: &Wall, weights: &[f64]) -> Option<[f64; 3]> {
    let mut free = [0.0; 3];
    let parts = free.iter_mut().zip(wall.normal()).zip(weights).filter(|(_, weight)| **weight != 0.0);
    parts.for_each(|((free, n), _)| *free = *n);
    let squared: f64 = free.iter().map(|n| n * n).sum();
    (squared > 0.0).then(|| free.map(|n| n / squared))
}

/// Distances from a wall below this fraction of the terms they are differences of are rounding.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Vertices on walls or behind them at `x`, with the walls that can move them; ascending.
pub(crate) fn touching(system: &System, x: &[f64]) -> Touching {
    let d = system.dimension();
    let mut touching = vec![];
    for (vertex, row) in x.chunks_exact(d).enumerate() {
        let weights = &system.inverse_mass()[vertex * d..(vertex + 1) * d];
        for (number, wall) in system.walls().iter().enumerate() {
            let size: f64 = row.iter().zip(wall.normal()).map(|(x, n)| (x * n).abs()).sum();
            let reached = wall.depth(row) >= -ROUNDING * (size + wall.offset().abs());
            if reached && way_back(wall, weights).is_some() {
                touching.push((vertex, number));
            }
        }
    }
    touching
}
