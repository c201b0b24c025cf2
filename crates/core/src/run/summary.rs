//! How a run ended, and what can be said of it.

use crate::diagnostics::{Diagnostics, Reaction};
use crate::observer::{ObserverError, Work};
use crate::simulation::{ContactExtremes, MotionJumps, PathState, StepError};

/// How a run ended.
#[derive(Debug)]
pub enum Outcome {
    /// It reached its duration.
    Done,
    /// It was asked to stop.
    Interrupted,
    /// A step could not be taken, or the energy blew up.
    Failed(StepError),
    /// An observer could not do its work.
    ObserverFailed(ObserverError),
}

/// Summary at the end.
#[derive(Debug)]
pub struct Summary {
    /// How it ended.
    pub outcome: Outcome,
    /// Frames shown.
    pub frames: u64,
    /// Work done in this run.
    pub work: Work,
    /// Measurements at the start.
    pub start: Diagnostics,
    /// Measurements of the last good state that was measured.
    pub end: Diagnostics,
    /// The forces with which pins hold their vertices in the last good state; empty where the energy blew up
    /// after it.
    pub reactions: Vec<Reaction>,
    /// Path of equilibria; `None` unless one was followed by arc length.
    pub path: Option<PathState>,
    /// Prescribed motion that jumped; `None` without any, and in statics, where every increment is a jump.
    pub motion_jumps: Option<MotionJumps>,
    /// The worst contacts at the end of any step, where forces alone keep surfaces apart.
    pub contact: ContactExtremes,
    /// Simulated time of the last frame shown [s].
    pub last_frame_time: f64,
    /// Largest `|E - E_0|` seen at any frame or guard [J], without what is known to have come in from
    /// outside and gone out.
    pub largest_energy_change: f64,
    /// Largest growth of the energy seen at any frame or guard [J], without what came in from outside; no
    /// loss makes up for it.
    pub largest_energy_gain: f64,
    /// True if it went from equilibrium to equilibrium: there is no energy of motion then that could be
    /// kept.
    pub is_static: bool,
    /// Energy that `largest_energy_change` is to be compared with [J]: all there was at the start, kinetic
    /// and stored, and what gravity can give over the size of the scene, and the most that came in from
    /// outside.
    pub energy_scale: f64,
}

impl Summary {
    /// `|E_end - E_0|` over the energy scale; what is known to have come in from outside and gone out is no
    /// drift. `None` in statics.
    pub fn relative_energy_drift(&self) -> Option<f64> {
        self.relative(self.end.conserved() - self.start.conserved())
    }

    /// Largest `|E - E_0|` seen, over the energy scale. `None` in statics.
    pub fn relative_energy_error(&self) -> Option<f64> {
        self.relative(self.largest_energy_change)
    }

    /// Largest growth of the energy seen, over the energy scale. `None` in statics.
    pub fn relative_energy_gain(&self) -> Option<f64> {
        self.relative(self.largest_energy_gain)
    }

    fn relative(&self, energy: f64) -> Option<f64> {
        (!self.is_static).then(|| energy.abs() / self.energy_scale)
    }

    /// `|p_end - p_0|` [kg m/s]; nothing in statics.
    pub fn momentum_change(&self) -> f64 {
        let d = |i: usize| self.end.linear_momentum[i] - self.start.linear_momentum[i];
        (d(0).powi(2) + d(1).powi(2) + d(2).powi(2)).sqrt()
    }
}
