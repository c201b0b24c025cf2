//! Options of the solvers of implicit steps, as a scene gives them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::system::System;

/// How nonlinear and linear systems are solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverOptions {
    /// Newton's method stops where its next correction would move no vertex by more than this [m]; `None`:
    /// a thousandth of an estimate of the error of the scheme in the step, at least 1e-9 of the size of the
    /// scene; where steps follow the error, [`PART_OF_STEP_ERROR`] of what a step may err by.
    pub tolerance: Option<f64>,
    /// Where steps follow the error, what a step may err by in positions [m] and in velocities [m/s].
    pub step_error: Option<[f64; 2]>,
    /// Order of the scheme whose steps are solved, where the tolerance may follow its error.
    pub order: Option<u32>,
    /// The length that tolerances go by [m]; `None`: the size of the scene where the first step is solved.
    pub size: Option<f64>,
    /// Newton iterations that a solve may take.
    pub max_iterations: u32,
    /// The linear solver.
    pub linear: LinearSolver,
    /// How often a step that is not solved may be halved; 0: not at all.
    pub retries: u32,
}

/// The part of the error allowed to a step that solves may add to it: too little to be seen, and no more
/// accurate than that.
pub const PART_OF_STEP_ERROR: f64 = 1e-2;

impl SolverOptions {
    /// The largest correction [m] that is none, in a scene of this `size` [m] where velocities are `rate`
    /// [1/s] times increments.
    pub(super) fn tolerance(&self, size: f64, rate: f64) -> f64 {
        let by_error = |[position, velocity]: [f64; 2]| PART_OF_STEP_ERROR * position.min(velocity / rate);
        self.tolerance.or(self.step_error.map(by_error)).unwrap_or(1e-9 * size)
    }

    /// True if the tolerance may grow with the error of a step: nothing else says what it is.
    pub(super) fn follows_error(&self) -> bool {
        self.tolerance.is_none() && self.step_error.is_none()
    }
}

impl Default for SolverOptions {
    fn default() -> Self {
        SolverOptions {
            tolerance: None,
            step_error: None,
            order: None,
            size: None,
            max_iterations: 500,
            linear: LinearSolver::Auto,
            retries: 0,
        }
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
    /// Conjugate gradients on the assembled matrix, preconditioned by symmetric Gauss-Seidel.
    Cg,
    /// Conjugate gradients on the assembled matrix, preconditioned by multigrid: coarser lattices over the
    /// bodies.
    Multigrid,
    /// Conjugate gradients without a matrix: products with the exact Hessian, element by element.
    MatrixFree,
}

/// From so many unknowns on `auto` takes multigrid for solids. Their factor grows like the 4/3rd power of
/// the unknowns; that of plane bodies and of sheets hardly faster than the matrix, and those that are large
/// and stiff buckle in ways that conjugate gradients are slow to find.
const SOLID_FROM: usize = 3_000;
/// From so many in two dimensions, and where nothing fills space.
const PLANE_FROM: usize = 200_000;
/// From so many unknowns on membranes in contact try conjugate gradients: below, the factorisations that a
/// step can use again cost less.
const MEMBRANE_FROM: usize = 6_000;
/// Iterations of conjugate gradients over the root of the rows of blocks that factorising a sheet takes as
/// long as: measured on a square of 4,225 vertices.
const QUICK: f64 = 4.0;
/// Iterations of conjugate gradients that a solve with multigrid takes as long as, with levels and subspace
/// of contact: on five cubes of 729 vertices in contact a solve took 10.3 ms, an iteration 0.15 ms.
const QUICK_OF_SOLIDS: u64 = 70;

impl LinearSolver {
    /// All of them.
    pub const ALL: [LinearSolver; 5] = [
        LinearSolver::Auto,
        LinearSolver::Cholesky,
        LinearSolver::Cg,
        LinearSolver::Multigrid,
        LinearSolver::MatrixFree,
    ];

    /// The name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            LinearSolver::Auto => "auto",
            LinearSolver::Cholesky => "cholesky",
            LinearSolver::Cg => "cg",
            LinearSolver::Multigrid => "multigrid",
            LinearSolver::MatrixFree => "matrix-free",
        }
    }

    /// The solver for `system`, itself never [`Auto`](Self::Auto).
    pub fn choose(self, system: &System) -> LinearSolver {
        match self {
            LinearSolver::Auto if is_full(system) || unknowns(system) < multigrid_from(system) => {
                LinearSolver::Cholesky
            }
            LinearSolver::Auto => LinearSolver::Multigrid,
            chosen => chosen,
        }
    }

    /// Iterations of conjugate gradients with symmetric Gauss-Seidel, for `rows` of blocks, that are tried
    /// before the solver of [`choose`](Self::choose), for an objective with this factor of the `inertia`: as
    /// many as cost about as much as a solve by that; `None` where none are tried.
    pub(super) fn first_iterations(self, system: &System, inertia: f64, rows: usize) -> Option<u64> {
        if self != LinearSolver::Auto || inertia == 0.0 || !system.has_guards() {
            return None;
        }
        match self.choose(system) {
            // Of a sheet the one grows like the rows, the factorisation like their power 3/2.
            LinearSolver::Cholesky if is_large_membrane(system) => {
                Some((QUICK * (rows as f64).sqrt()) as u64)
            }
            LinearSolver::Multigrid if has_solids(system) => Some(QUICK_OF_SOLIDS),
            _ => None,
        }
    }

    /// True if this is conjugate gradients on an assembled matrix.
    pub(crate) fn is_iterative(self) -> bool {
        matches!(self, LinearSolver::Cg | LinearSolver::Multigrid)
    }

    /// That, and why.
    pub fn explain(self, system: &System) -> String {
        let what = match self.choose(system) {
            LinearSolver::Multigrid => "conjugate gradients with multigrid preconditioner",
            LinearSolver::Cg => "conjugate gradients with symmetric Gauss-Seidel preconditioner",
            LinearSolver::MatrixFree => "matrix-free conjugate gradients",
            LinearSolver::Cholesky | LinearSolver::Auto => "sparse Cholesky",
        };
        let (unknowns, from) = (unknowns(system), multigrid_from(system));
        match self {
            LinearSolver::Auto if is_full(system) => {
                format!("{what}, chosen because every particle acts on every other")
            }
            LinearSolver::Auto if from == usize::MAX => format!("{what}, chosen for one dimension"),
            LinearSolver::Auto => {
                let side = if unknowns < from { format!("below {from}") } else { format!("from {from} on") };
                let first = match self.first_iterations(system, 1.0, unknowns) {
                    Some(_) => "; in steps of time conjugate gradients without it first, for contact",
                    None => "",
                };
                format!("{what}, chosen for {unknowns} unknowns ({side} {}){first}", of_what(system))
            }
            _ => what.into(),
        }
    }
}

/// Coordinates that move: obstacles and what pins hold have none.
fn unknowns(system: &System) -> usize {
    system.inverse_mass().iter().filter(|w| **w != 0.0).count()
}

fn multigrid_from(system: &System) -> usize {
    match system.dimension() {
        1 => usize::MAX,
        3 if has_solids(system) => SOLID_FROM,
        _ => PLANE_FROM,
    }
}

/// True if conjugate gradients are worth trying before a factorisation in steps of time with contact.
///
/// Sheets that meet something take tens of iterations of Newton's method a step, most of them cut short: few
/// of their solves need be accurate, and inertia keeps the matrices of steps well conditioned.
fn is_large_membrane(system: &System) -> bool {
    let is_membrane = system.dimension() == 3
        && !has_solids(system)
        && !is_full(system)
        && system.terms().iter().any(|term| term.elements().is_some());
    is_membrane && (MEMBRANE_FROM..PLANE_FROM).contains(&unknowns(system))
}

fn has_solids(system: &System) -> bool {
    system.terms().iter().any(|term| term.properties().fills_space)
}

fn of_what(system: &System) -> &'static str {
    match system.dimension() {
        3 if has_solids(system) => "for solids",
        3 => "for sheets and strands",
        _ => "in 2D",
    }
}

/// True if the matrix is full.
fn is_full(system: &System) -> bool {
    system.terms().iter().any(|term| term.properties().couples_all)
}
