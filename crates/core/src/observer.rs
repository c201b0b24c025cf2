//! What a run shows to whoever watches it: recorder, progress bar, statistics, Python.

use crate::diagnostics::{Diagnostics, ElementState, Reaction};
use crate::simulation::RetriedSteps;
use crate::solver::SolverWork;

/// Work done since the start of the run, in counts that do not depend on the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Work {
    /// Time steps taken.
    pub steps: u64,
    /// Evaluations of the total force.
    pub force_evaluations: u64,
    /// Steps that were taken back because their error was too large, or that could not be taken and were tried again at a smaller
    /// size; `None` where step sizes do not follow the error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rejected_steps: Option<u64>,
    /// Steps that were not solved at once and were taken in parts; `None` where the scene allows no retries.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retried: Option<RetriedSteps>,
    /// What the solvers of an implicit scheme did; `None` for explicit ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub solver: Option<SolverWork>,
}

/// One moment of a run. Borrowed: an observer copies what it keeps.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// Number of the frame, from 0.
    pub index: u64,
    /// Steps taken so far.
    pub step: u64,
    /// Simulated time [s].
    pub time: f64,
    /// 2 or 3.
    pub dimension: usize,
    /// Positions, flat `(n, dimension)` [m].
    pub x: &'a [f64],
    /// Velocities, flat `(n, dimension)` [m/s].
    pub v: &'a [f64],
    /// Energies and momenta of this moment; `None` where no observer asked for them.
    pub diagnostics: Option<&'a Diagnostics>,
    /// Deformation and stress of every finite element, body after body, each in the order of its mesh; `None` where no observer
    /// asked for them.
    pub elements: Option<&'a [ElementState]>,
    /// Deformation and stress at the points of elements that probes have named; `None` where no observer asked for them.
    pub points: Option<&'a [ElementState]>,
    /// The forces with which pins hold their vertices, of those that have not let go; `None` where no observer asked for them.
    pub reactions: Option<&'a [Reaction]>,
    /// Work counters.
    pub work: Work,
}

/// Watches a run, frame by frame.
pub trait Observer {
    /// Whether this observer reads [`Frame::diagnostics`]; they are computed only if one does.
    fn wants_diagnostics(&self) -> bool {
        false
    }

    /// Whether this observer reads [`Frame::elements`]; they are computed only if one does.
    fn wants_elements(&self) -> bool {
        false
    }

    /// Whether this observer reads [`Frame::points`]; they are computed only if one does.
    fn wants_points(&self) -> bool {
        false
    }

    /// Whether this observer reads [`Frame::reactions`]; they are computed only if one does.
    fn wants_reactions(&self) -> bool {
        false
    }

    /// Called at every output frame, the initial state included.
    ///
    /// # Errors
    /// Whatever keeps the observer from doing its work; the run stops and reports it.
    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError>;
}

/// An observer could not do its work.
#[derive(Debug, thiserror::Error)]
#[error("{what}: {source}")]
pub struct ObserverError {
    /// What it was doing, e.g. `writing out.mcap.part`.
    pub what: String,
    /// Why it failed.
    #[source]
    pub source: Box<dyn std::error::Error + Send + Sync>,
}
