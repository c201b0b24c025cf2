//! Counts of work.

use super::RetriedSteps;
use crate::control::increments::Increments;
use crate::solver::SolverWork;

/// Work since the start of the run, in machine-independent counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Work {
    /// Time steps taken.
    pub steps: u64,
    /// Evaluations of the total force.
    pub force_evaluations: u64,
    /// Steps rejected for their error, or failed and retried with a smaller size; `None` without adaptive
    /// steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rejected_steps: Option<u64>,
    /// Static increments; `None` with fixed increments and in dynamics.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub increments: Option<Increments>,
    /// Failed steps that were subdivided; `None` without any if the scene allows none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retried: Option<RetriedSteps>,
    /// Solver work of an implicit integrator; `None` for explicit ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub solver: Option<SolverWork>,
}
