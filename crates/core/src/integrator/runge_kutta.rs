//! Explicit Runge-Kutta methods on the first-order system `(x, v)' = (v, a(x, v, t) - c v)`; `c` is the
//! ether drag.

use rayon::prelude::*;

use super::equations::{acceleration_at, end_step};
use super::estimate::{ErrorNorm, Judgement, Tolerances};
use super::tableau::{Stages, Tableau};
use super::{Integrator, node};
use crate::lanes::Numbers;
use crate::solver::StepFault;
use crate::state::State;
use crate::system::{ForceId, System};

/// Values per block.
const BLOCK: usize = 4096;
/// Stages of the longest tableau.
const MOST_STAGES: usize = 16;
/// Below this many values, dispatch to other threads costs more than it saves.
const PARALLEL_FROM: usize = 8 * BLOCK;

/// Integrator for an explicit tableau.
pub struct RungeKutta {
    tableau: Tableau,
    stages: Stages,
    x: Numbers,
    v: Numbers,
    norm: ErrorNorm,
}

impl RungeKutta {
    /// Creates the integrator for `tableau` on `unknowns` coordinates.
    pub fn new(tableau: Tableau, unknowns: usize) -> Self {
        RungeKutta {
            tableau,
            stages: Stages::new(&tableau, unknowns),
            x: Numbers::zeros(unknowns),
            v: Numbers::zeros(unknowns),
            norm: if tableau.companion.is_some() { ErrorNorm::new(unknowns) } else { ErrorNorm::default() },
        }
    }

    /// Computes `x = x_n + h sum_j w_j v_j`, `v = v_n + h sum_j w_j a_j` over the first `weights.len()`
    /// stages, block by block, so that a block stays in the cache while the stages are added.
    fn combine(&mut self, state: &State, h: f64, weights: &[f64]) {
        let RungeKutta { stages: Stages { velocity, acceleration }, x, v, .. } = self;
        let block = |(i, (x, v)): (usize, (&mut [f64], &mut [f64]))| {
            let range = i * BLOCK..i * BLOCK + x.len();
            x.copy_from_slice(&state.x()[range.clone()]);
            v.copy_from_slice(&state.v()[range.clone()]);
            for (j, w) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                add_scaled(x, h * w, &velocity[j][range.clone()]);
                add_scaled(v, h * w, &acceleration[j][range.clone()]);
            }
        };
        if x.len() < PARALLEL_FROM {
            x.chunks_mut(BLOCK).zip(v.chunks_mut(BLOCK)).enumerate().for_each(block);
        } else {
            x.par_chunks_mut(BLOCK).zip(v.par_chunks_mut(BLOCK)).enumerate().for_each(block);
        }
    }
}

/// `(1 - R)/z` for the stability function `R` at `-z`: velocity that a force produces under drag, as a
/// fraction of that without drag.
fn response(tableau: &Tableau, z: f64) -> f64 {
    let mut stages = [0.0; MOST_STAGES];
    for (i, row) in tableau.a.iter().enumerate() {
        stages[i] = 1.0 - z * row.iter().zip(&stages).map(|(a, stage)| a * stage).sum::<f64>();
    }
    tableau.b.iter().zip(&stages).map(|(b, stage)| b * stage).sum()
}

/// `y += c x`.
fn add_scaled(y: &mut [f64], c: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += c * x;
    }
}

impl Integrator for RungeKutta {
    fn step(&mut self, system: &mut System, state: &mut State, h: f64) -> Result<(), StepFault> {
        let Tableau { a, b, .. } = self.tableau;
        let mut force = ForceId::NONE;
        for stage in 0..b.len() {
            self.combine(state, h, a[stage]);
            let known = if stage == 0 { state.force } else { ForceId::NONE };
            let time = state.time + node(a[stage]) * h;
            let Stages { velocity, acceleration } = &mut self.stages;
            let at = (&mut self.x[..], &mut self.v[..]);
            acceleration_at(system, time, at, known, &mut acceleration[stage])?;
            velocity[stage].copy_from_slice(&self.v);
        }
        if self.tableau.is_first_same_as_last() {
            force = system.force();
        } else {
            self.combine(state, h, b);
        }
        let response = |z| response(&self.tableau, z);
        end_step(system, state, h, (&mut self.x, &mut self.v), force, &response)
    }

    fn judge(
        &mut self,
        system: &mut System,
        state: &State,
        h: f64,
        tolerances: &Tolerances,
    ) -> Option<Judgement> {
        let difference = self.tableau.companion?.difference;
        let RungeKutta { stages: Stages { velocity, acceleration }, v: before, norm, .. } = self;
        let errors = |range: std::ops::Range<usize>, x: &mut [f64], v: &mut [f64]| {
            for (j, d) in difference.iter().enumerate().filter(|(_, d)| **d != 0.0) {
                add_scaled(x, h * d, &velocity[j][range.clone()]);
                add_scaled(v, h * d, &acceleration[j][range.clone()]);
            }
        };
        Some(Judgement::Error(norm.of(system, tolerances, before, state.v(), errors)))
    }

    fn stage_velocities(&self) -> &[Vec<f64>] {
        &self.stages.velocity
    }

    fn undo(&mut self, state: &mut State) {
        // The swap at the end of the step left the old state here.
        state.swap(&mut self.x, &mut self.v, ForceId::NONE);
    }
}
