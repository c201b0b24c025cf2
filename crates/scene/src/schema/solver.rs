//! How implicit steps are solved.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Time;
use pliant::solver::{LinearSolver, SolverOptions};
use pliant::value::*;

/// How the equations of an implicit step are solved: by Newton's method, with a linear solver inside.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Solver {
    /// Newton's method ends where its next correction would move no coordinate by more than this [m].
    /// Without it, a thousandth of an estimate of what the scheme errs by in the step, or 1e-9 of the size
    /// of the scene at the start where that is more, as in statics; with `adaptive`, a hundredth of the
    /// error of positions that a step may make, or of what leads to that of velocities.
    #[serde(skip_serializing_if = "Option::is_none", with = "As::<Option<Length>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub tolerance: Option<f64>,
    /// Newton iterations that a solve may take before the run ends with a message; 500 without it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1))]
    pub iterations: Option<u32>,
    /// The linear solver in every iteration.
    pub linear: LinearSolver,
    /// A step that is not solved, or that ends where a force is not finite, is taken back and taken in
    /// halves, these in halves again if need be, so often at most: with 3, in parts down to an eighth of a
    /// step. The run ends with a message where the smallest fails too. Frames, keyframes and releases stay
    /// where they are, and the next step is tried as a whole. None without it; steps that are `adaptive` are
    /// tried at smaller sizes by themselves.
    #[serde(skip_serializing_if = "Option::is_none")]
    // A step of which 20 halves of halves are taken is `2^20` steps.
    #[schemars(range(min = 0, max = 20))]
    pub retries: Option<u32>,
}

impl Time {
    /// Options of the scene for solvers, the rest by default.
    pub fn solver_options(&self) -> SolverOptions {
        let Solver { tolerance, iterations, linear, retries } = self.solver.clone().unwrap_or_default();
        let default = SolverOptions::default();
        SolverOptions {
            tolerance,
            max_iterations: iterations.unwrap_or(default.max_iterations),
            linear,
            retries: retries.unwrap_or(default.retries),
            ..default
        }
    }
}
