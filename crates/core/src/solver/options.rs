//! What a scene may say about the solvers of implicit steps.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How nonlinear and linear systems are solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverOptions {
    /// Newton's method stops where its next correction would move no vertex by more than this [m]; `None`: 1e-9 of the
    /// size of the scene.
    pub tolerance: Option<f64>,
    /// Newton iterations that a solve may take.
    pub max_iterations: u32,
    /// The linear solver.
    pub linear: LinearSolver,
}

impl Default for SolverOptions {
    fn default() -> Self {
        SolverOptions { tolerance: None, max_iterations: 500, linear: LinearSolver::Auto }
    }
}

/// How `A d = -r` is solved in every Newton iteration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LinearSolver {
    /// Chosen by size and kind; `pliant check` says what and why.
    #[default]
    Auto,
    /// Sparse Cholesky factorisation.
    Cholesky,
    /// Conjugate gradients on the assembled matrix, preconditioned by its diagonal blocks.
    Cg,
    /// Conjugate gradients on the assembled matrix, preconditioned by multigrid: coarser lattices over the bodies.
    Multigrid,
    /// Conjugate gradients without a matrix: products with the exact Hessian, element by element.
    MatrixFree,
}

/// Up to so many unknowns `auto` takes Cholesky.
const AUTO_CHOLESKY_UP_TO: usize = 60_000;

impl LinearSolver {
    /// The solver for so many unknowns, itself never [`Auto`](Self::Auto), and why.
    pub fn choose(self, unknowns: usize) -> (LinearSolver, String) {
        match self {
            LinearSolver::Auto if unknowns <= AUTO_CHOLESKY_UP_TO => (
                LinearSolver::Cholesky,
                format!("sparse Cholesky, chosen for {unknowns} unknowns (up to {AUTO_CHOLESKY_UP_TO})"),
            ),
            LinearSolver::Auto => (
                LinearSolver::Cg,
                format!("conjugate gradients, chosen for {unknowns} unknowns (above {AUTO_CHOLESKY_UP_TO})"),
            ),
            LinearSolver::Cholesky => (self, "sparse Cholesky".into()),
            LinearSolver::Cg => (self, "conjugate gradients with block-Jacobi preconditioner".into()),
            LinearSolver::Multigrid => (self, "conjugate gradients with multigrid preconditioner".into()),
            LinearSolver::MatrixFree => (self, "matrix-free conjugate gradients".into()),
        }
    }
}
