//! Outcome and summary of a run.

use crate::diagnostics::{Diagnostics, Reaction};
use crate::observer::{ObserverError, Work};
use crate::simulation::{ContactExtremes, MotionJumps, PathState, StepError};

/// Outcome of a run.
#[derive(Debug)]
pub enum Outcome {
    /// The run reached its duration.
    Done,
    /// The run was asked to stop.
    Interrupted,
    /// A step failed, or the energy blew up.
    Failed(StepError),
    /// An observer failed.
    ObserverFailed(ObserverError),
}

/// Summary of a run.
#[derive(Debug)]
pub struct Summary {
    /// Outcome of the run.
    pub outcome: Outcome,
    /// Frames shown.
    pub frames: u64,
    /// Work of this run.
    pub work: Work,
    /// Diagnostics at the start.
    pub start: Diagnostics,
    /// Diagnostics of the last valid state that was measured.
    pub end: Diagnostics,
    /// Reaction forces of pins and walls in the last valid state; empty if the energy blew up after it.
    pub reactions: Vec<Reaction>,
    /// Path of equilibria; `None` without arc-length continuation.
    pub path: Option<PathState>,
    /// Jumps of prescribed motion; `None` without any, and in statics, where each increment is a jump.
    pub motion_jumps: Option<MotionJumps>,
    /// Worst contacts at the end of any step, if forces alone keep surfaces apart.
    pub contact: ContactExtremes,
    /// Simulated time of the last frame shown [s].
    pub last_frame_time: f64,
    /// Largest `|E - E_0|` at any frame or check [J], after subtracting supplied energy and counted
    /// losses.
    pub largest_energy_change: f64,
    /// Largest energy gain at any frame or check [J], without external supply; losses do not compensate
    /// it.
    pub largest_energy_gain: f64,
    /// True for a static run, which has no kinetic energy to conserve.
    pub is_static: bool,
    /// Energy scale for `largest_energy_change` [J]: kinetic and stored energy at the start, what gravity
    /// can release over the scene size, and the most that was supplied.
    pub energy_scale: f64,
}

impl Summary {
    /// Returns `|E_end - E_0|` relative to the energy scale; supplied energy and counted losses are not
    /// drift. `None` in statics.
    pub fn relative_energy_drift(&self) -> Option<f64> {
        self.relative(self.end.conserved() - self.start.conserved())
    }

    /// Returns the largest `|E - E_0|` relative to the energy scale. `None` in statics.
    pub fn relative_energy_error(&self) -> Option<f64> {
        self.relative(self.largest_energy_change)
    }

    /// Returns the largest energy gain relative to the energy scale. `None` in statics.
    pub fn relative_energy_gain(&self) -> Option<f64> {
        self.relative(self.largest_energy_gain)
    }

    fn relative(&self, energy: f64) -> Option<f64> {
        (!self.is_static).then(|| energy.abs() / self.energy_scale)
    }

    /// Returns `|p_end - p_0|` [kg m/s]; zero in statics.
    pub fn momentum_change(&self) -> f64 {
        let d = |i: usize| self.end.linear_momentum[i] - self.start.linear_momentum[i];
        (d(0).powi(2) + d(1).powi(2) + d(2).powi(2)).sqrt()
    }
}
