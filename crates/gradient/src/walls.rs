//! Walls at the end of a step: where they act, and the derivative of what they do.
//!
//! A vertex behind the plane `n . x = c` is put back on it, `x' = x + (c - n.x) w`, and its velocity into the
//! wall is taken, `v' = v - (n.v) w` where `n.v < 0`; `w = m / |m|^2` with `m` the normal without held
//! coordinates. Both are linear as long as the same vertices are behind the same walls; the step to that
//! place is one without walls. Where a vertex comes to a wall or leaves it, the derivative is that of the
//! side on which the run was.

use pliant::constraint::Wall;
use pliant::numbering::Numbering;
use pliant::simulation::{Simulation, Snapshot};
use pliant::system::System;

use crate::GradientError;
use crate::schedule::Schedule;

/// A vertex that has come to a wall, or left one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct WallEvent {
    /// The step at whose end it is there and at whose beginning it was not, or the other way round; as
    /// [`LossFrame::step`](crate::LossFrame::step) counts.
    pub step: u64,
    /// The vertex, in the order of the scene.
    pub vertex: usize,
    /// The wall, by its place among those of the system.
    pub wall: usize,
    /// True if it has come, false if it has left.
    pub has_come: bool,
}

/// Vertices on walls, by their numbers in the simulation, and the walls; ascending.
pub(crate) type Touching = Vec<(usize, usize)>;

/// A wall that has put a vertex back.
#[derive(Clone, Copy, Debug, PartialEq)]
struct WallAction {
    vertex: usize,
    wall: usize,
    /// True if it has taken the velocity, too.
    stops: bool,
}

/// The end of a step before walls acted, and what they did.
pub(crate) struct WalledEnd {
    pub(crate) x: Vec<f64>,
    pub(crate) v: Vec<f64>,
    /// In the order in which they act.
    actions: Vec<WallAction>,
    /// What touches after it.
    pub(crate) touching: Touching,
}

impl WalledEnd {
    /// Takes the step of `simulation` from `start` again, without walls; the simulation ends there.
    ///
    /// # Errors
    /// The step fails, or `start` is no state of the simulation.
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

    /// Takes derivatives by the end of the step to those by the place before walls acted.
    pub(crate) fn back(&self, system: &System, x_bar: &mut [f64], v_bar: &mut [f64]) {
        for action in self.actions.iter().rev() {
            let transposed = |normal: &[f64], back: &[f64], bar: &mut [f64]| {
                let along: f64 = back.iter().zip(&*bar).map(|(back, bar)| back * bar).sum();
                bar.iter_mut().zip(normal).for_each(|(bar, n)| *bar -= n * along);
            };
            action.each(system, x_bar, v_bar, transposed);
        }
    }

    /// Takes changes of the place before walls acted to those of the end of the step.
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

/// Events of step `step`, at whose beginning `before` touched and at whose end `after` does.
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
    /// Calls `change(normal, w, row)` with the vertex's rows of `x`, and of `v` where it was stopped.
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

/// `w` of a vertex with these inverse masses; `None` where the wall cannot move it.
fn way_back(wall: &Wall, weights: &[f64]) -> Option<[f64; 3]> {
    let mut free = [0.0; 3];
    let parts = free.iter_mut().zip(wall.normal()).zip(weights).filter(|(_, weight)| **weight != 0.0);
    parts.for_each(|((free, n), _)| *free = *n);
    let squared: f64 = free.iter().map(|n| n * n).sum();
    (squared > 0.0).then(|| free.map(|n| n / squared))
}

/// Distances from a wall below this part of the numbers that they are differences of are rounding.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Vertices on walls, or behind them, at `x`, with the walls that could move them; ascending.
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
