//! Explicit Runge-Kutta methods on the first-order system `(x, v)' = (v, a(x))`.

use super::{Integrator, StepFault, all_finite};
use crate::state::State;
use crate::system::System;

/// An explicit Butcher tableau; Hairer, Norsett, Wanner 1993, *Solving Ordinary Differential Equations I*, eq. II.1.8.
///
/// Forces do not depend on time, so the nodes `c` are not needed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tableau {
    /// Row `i` holds `a_ij`, `j < i`.
    pub a: &'static [&'static [f64]],
    /// Weights.
    pub b: &'static [f64],
}

/// Runs any explicit tableau.
pub struct RungeKutta {
    tableau: Tableau,
    /// Stage velocities and accelerations.
    velocity: Vec<Vec<f64>>,
    acceleration: Vec<Vec<f64>>,
    x: Vec<f64>,
    v: Vec<f64>,
}

impl RungeKutta {
    /// A runner for `tableau` on `unknowns` coordinates.
    pub fn new(tableau: Tableau, unknowns: usize) -> Self {
        let stages = vec![vec![0.0; unknowns]; tableau.b.len()];
        RungeKutta {
            tableau,
            velocity: stages.clone(),
            acceleration: stages,
            x: vec![0.0; unknowns],
            v: vec![0.0; unknowns],
        }
    }

    /// `x = x_n + h sum_j w_j v_j` and the same for `v`, over the first `weights.len()` stages.
    fn combine(&mut self, state: &State, h: f64, weights: &[f64]) {
        self.x.copy_from_slice(state.x());
        self.v.copy_from_slice(state.v());
        for (j, w) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
            for i in 0..self.x.len() {
                self.x[i] += h * w * self.velocity[j][i];
                self.v[i] += h * w * self.acceleration[j][i];
            }
        }
    }
}

impl Integrator for RungeKutta {
    fn step(&mut self, system: &mut System, state: &mut State, h: f64) -> Result<(), StepFault> {
        let Tableau { a, b } = self.tableau;
        for stage in 0..b.len() {
            self.combine(state, h, a[stage]);
            if stage == 0 && state.acceleration_is_current {
                self.acceleration[0].copy_from_slice(&state.acceleration);
            } else {
                system.acceleration(&self.x, &mut self.acceleration[stage]);
            }
            self.velocity[stage].copy_from_slice(&self.v);
            if !all_finite(&self.acceleration[stage]) {
                return Err(StepFault::at(system, &self.x, &self.v));
            }
        }
        self.combine(state, h, b);
        if !(all_finite(&self.x) && all_finite(&self.v)) {
            return Err(StepFault::at(system, &self.x, &self.v));
        }
        state.swap(&mut self.x, &mut self.v);
        state.acceleration_is_current = false;
        Ok(())
    }

    fn undo(&mut self, state: &mut State) {
        // The swap at the end of the step left the old state here.
        state.swap(&mut self.x, &mut self.v);
        state.acceleration_is_current = false;
    }

    fn bytes(&self) -> usize {
        8 * self.x.len() * (2 + 2 * self.velocity.len())
    }
}
