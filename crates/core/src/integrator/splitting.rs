//! Splitting schemes: the kinetic and the potential part of the motion, each solved exactly, in turn.

use super::{Integrator, StepFault, all_finite};
use crate::state::State;
use crate::system::System;

/// One part of a step, by its share of the step size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// `v += c h a(x)`.
    Kick(f64),
    /// `x += c h v`.
    Drift(f64),
}

/// Runs any sequence of kicks and drifts.
///
/// The force at the end of a step serves the first kick of the next, where positions have not changed since.
pub struct Splitting {
    stages: &'static [Stage],
    x: Vec<f64>,
    v: Vec<f64>,
}

impl Splitting {
    /// A runner for `stages` on `unknowns` coordinates.
    pub fn new(stages: &'static [Stage], unknowns: usize) -> Self {
        Splitting { stages, x: vec![0.0; unknowns], v: vec![0.0; unknowns] }
    }
}

impl Integrator for Splitting {
    fn step(&mut self, system: &mut System, state: &mut State, h: f64) -> Result<(), StepFault> {
        // The step is taken on copies, so that one that fails leaves the state as it was.
        self.x.copy_from_slice(state.x());
        self.v.copy_from_slice(state.v());
        for stage in self.stages {
            match *stage {
                Stage::Kick(c) => {
                    if !state.acceleration_is_current {
                        system.acceleration(&self.x, &mut state.acceleration);
                        state.acceleration_is_current = true;
                    }
                    add_scaled(&mut self.v, c * h, &state.acceleration);
                }
                Stage::Drift(c) => {
                    add_scaled(&mut self.x, c * h, &self.v);
                    state.acceleration_is_current = false;
                }
            }
        }
        if !(all_finite(&self.x) && all_finite(&self.v)) {
            state.acceleration_is_current = false;
            return Err(StepFault::at(system, &self.x, &self.v));
        }
        state.swap(&mut self.x, &mut self.v);
        Ok(())
    }

    fn undo(&mut self, state: &mut State) {
        // The swap at the end of the step left the old state here.
        state.swap(&mut self.x, &mut self.v);
        state.acceleration_is_current = false;
    }

    fn bytes(&self) -> usize {
        8 * (self.x.len() + self.v.len())
    }
}

/// `y += c x`.
fn add_scaled(y: &mut [f64], c: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += c * x;
    }
}
