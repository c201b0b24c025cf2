//! Counts of work.

use super::RetriedSteps;
use crate::control::increments::Increments;
use crate::solver::SolverWork;

/// Work done since the start of the run, in counts that do not depend on the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Work {
    /// Time steps taken.
    pub steps: u64,
    /// Evaluations of the total force.
    pub force_evaluations: u64,
    /// Steps that were taken back because their error was too large, or that could not be taken and were
    /// tried again at a smaller size; `None` where step sizes do not follow the error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rejected_steps: Option<u64>,
    /// Increments of statics; `None` where their size is fixed, and in dynamics.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub increments: Option<Increments>,
    /// Steps that were not solved at once and were taken in parts; `None` where
    /// there were none and the scene allows none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retried: Option<RetriedSteps>,
    /// Work of the solvers of an implicit scheme; `None` for explicit ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub solver: Option<SolverWork>,
}
