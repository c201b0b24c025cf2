//! Checkpoints of complete runs.

use std::cmp::Ordering;

use super::Plan;
use crate::diagnostics::Diagnostics;
use crate::observer::{Notes, ObserverError};
use crate::simulation::{self, Simulation};

/// Everything that a run continues from, except the scene and the plan.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RunCheckpoint {
    /// State of the simulation.
    pub simulation: simulation::Checkpoint,
    /// State of the run.
    pub run: RunState,
    /// Notes of observers.
    pub notes: Notes,
}

/// Decides which checkpoints are kept, and stores them.
pub trait Checkpoints {
    /// True if the last checkpoint must be kept after `step` steps; called once before each step. The
    /// last one is also kept when the run ends well or is interrupted.
    fn is_due(&mut self, step: u64) -> bool;

    /// Stores a checkpoint.
    ///
    /// # Errors
    /// If it cannot be stored; the run stops and reports it.
    fn keep(&mut self, checkpoint: &RunCheckpoint) -> Result<(), ObserverError>;
}

/// State of a run: frames, and reference energies for later ones.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RunState {
    /// Step of the simulation at the start.
    pub(super) first_step: u64,
    /// Time of the simulation at the start [s].
    pub(super) first_time: f64,
    /// Step and time [s] of the run when the checkpoint was kept.
    pub(super) reached_step: u64,
    pub(super) reached_time: f64,
    /// Frames shown.
    pub(super) frames: u64,
    /// Step since the start of the next frame, with fixed steps.
    pub(super) next_frame: u64,
    /// Time of the last frame shown [s].
    pub(super) last_frame_time: f64,
    /// Diagnostics at the start.
    pub(super) start: Diagnostics,
    /// Diagnostics of the last valid state that was measured.
    pub(super) last_good: Diagnostics,
    /// Energy scale at the start, and with the energy supplied since [J].
    pub(super) scale_at_start: f64,
    pub(super) energy_scale: f64,
    /// Largest change and gain of energy so far [J].
    pub(super) largest_energy_change: f64,
    pub(super) largest_energy_gain: f64,
}

impl RunState {
    /// Creates the state at the start of a run.
    pub(super) fn new(simulation: &mut Simulation) -> Self {
        simulation.forget_what_was_noted();
        let start = simulation.diagnostics();
        let energy_scale = super::energy_scale(simulation, &start);
        let (step, time) = (simulation.state().step, simulation.state().time);
        RunState {
            first_step: step,
            first_time: time,
            reached_step: step,
            reached_time: time,
            frames: 0,
            next_frame: 0,
            last_frame_time: 0.0,
            last_good: start.clone(),
            start,
            scale_at_start: energy_scale,
            energy_scale,
            largest_energy_change: 0.0,
            largest_energy_gain: 0.0,
        }
    }

    /// Returns the number of frames shown so far.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Returns the time of the last frame [s]; `None` before the first.
    pub fn last_frame_time(&self) -> Option<f64> {
        (self.frames > 0).then_some(self.last_frame_time)
    }

    /// Returns the step of the run when its checkpoint was kept.
    pub fn reached_step(&self) -> u64 {
        self.reached_step
    }

    /// Returns the simulated time since the start of the run when its checkpoint was kept [s].
    pub fn elapsed(&self) -> f64 {
        self.reached_time - self.first_time
    }

    /// Compares the progress at that moment with the end of `plan`; `simulation` must be of the same
    /// scene. The last frame comes after a checkpoint at the end.
    pub fn against(&self, plan: &Plan, simulation: &Simulation) -> Ordering {
        match simulation.step_control() {
            Some(_) => self.elapsed().total_cmp(&plan.duration),
            None => (self.reached_step - self.first_step).cmp(&plan.steps(simulation.step_size())),
        }
    }

    /// Returns the diagnostics at the start of the run.
    pub fn start(&self) -> &Diagnostics {
        &self.start
    }
}
