//! Options of the implicit solvers, as scenes specify them, and the automatic choice of the linear
//! solver.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::system::System;

/// Options for nonlinear and linear solves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverOptions {
    /// Newton's method stops if its next correction would move no vertex by more than this [m]. `None`:
    /// 1e-3 of the estimated integration error of the step, at least 1e-9 of the scene size; with
    /// error-controlled steps [`PART_OF_STEP_ERROR`] of the error tolerance; with friction at most 0.05 of
    /// the creep distance of a step. Collocation methods use 1e-13 of the scene size.
    pub tolerance: Option<f64>,
    /// Error tolerances of error-controlled steps, for positions [m] and velocities [m/s].
    pub step_error: Option<[f64; 2]>,
    /// Order of the integrator, if the tolerance may follow its error.
    pub order: Option<u32>,
    /// Length scale of the tolerances [m]; `None`: the scene size at the first solve.
    pub size: Option<f64>,
    /// Newton iteration limit.
    pub max_iterations: u32,
    /// The linear solver.
    pub linear: LinearSolver,
    /// Levels of step subdivision after a failed solve; 0: none.
    pub retries: u32,
}

/// Fraction of the step's error tolerance that solves may add: small enough not to matter.
pub const PART_OF_STEP_ERROR: f64 = 1e-2;

impl SolverOptions {
    /// Returns the Newton tolerance [m] for a scene of `size` [m] whose velocities are `rate` [1/s] times
    /// increments.
    pub(super) fn tolerance(&self, size: f64, rate: f64) -> f64 {
        let by_error = |[position, velocity]: [f64; 2]| PART_OF_STEP_ERROR * position.min(velocity / rate);
        self.tolerance.or(self.step_error.map(by_error)).unwrap_or(1e-9 * size)
    }

    /// True if the tolerance may follow the integration error, as nothing else sets it.
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

/// Unknowns from which `auto` takes multigrid for solids. Their factor grows like the 4/3rd power of the
/// unknowns. Factors of plane bodies and sheets grow hardly faster than the matrix, and large stiff
/// sheets buckle in modes that conjugate gradients find slowly.
const SOLID_FROM: usize = 3_000;
/// Unknowns from which `auto` takes multigrid in 2D and without solids.
const PLANE_FROM: usize = 200_000;
/// Unknowns from which membranes in contact try conjugate gradients; below, the factorisations that a
/// step can reuse cost less.
const MEMBRANE_FROM: usize = 6_000;
/// Conjugate-gradient iterations that take as long as factorising a sheet, divided by the square root of
/// the block rows; measured on a square of 4,225 vertices.
const QUICK: f64 = 4.0;
/// Conjugate-gradient iterations that take as long as a multigrid solve with levels and contact subspace:
/// on five cubes of 729 vertices in contact a solve took 10.3 ms, an iteration 0.15 ms.
const QUICK_OF_SOLIDS: u64 = 70;

impl LinearSolver {
    /// All linear solvers.
    pub const ALL: [LinearSolver; 5] = [
        LinearSolver::Auto,
        LinearSolver::Cholesky,
        LinearSolver::Cg,
        LinearSolver::Multigrid,
        LinearSolver::MatrixFree,
    ];

    /// Returns the name in scenes.
    pub fn name(self) -> &'static str {
        match self {
            LinearSolver::Auto => "auto",
            LinearSolver::Cholesky => "cholesky",
            LinearSolver::Cg => "cg",
            LinearSolver::Multigrid => "multigrid",
            LinearSolver::MatrixFree => "matrix-free",
        }
    }

    /// Returns the solver for `system`; never [`Auto`](Self::Auto).
    pub fn choose(self, system: &System) -> LinearSolver {
        match self {
            LinearSolver::Auto if is_full(system) || unknowns(system) < multigrid_from(system) => {
                LinearSolver::Cholesky
            }
            LinearSolver::Auto => LinearSolver::Multigrid,
            chosen => chosen,
        }
    }

    /// Returns how many conjugate-gradient iterations with symmetric Gauss-Seidel are tried on `rows` of
    /// blocks before the solver of [`choose`](Self::choose): as many as cost about one solve by that.
    /// `None` if none are tried. `inertia` is the inertia factor of the objective.
    pub(super) fn first_iterations(self, system: &System, inertia: f64, rows: usize) -> Option<u64> {
        if self != LinearSolver::Auto || inertia == 0.0 || !system.has_guards() {
            return None;
        }
        match self.choose(system) {
            // On a sheet, an iteration costs O(rows), a factorisation O(rows^(3/2)).
            LinearSolver::Cholesky if is_large_membrane(system) => {
                Some((QUICK * (rows as f64).sqrt()) as u64)
            }
            LinearSolver::Multigrid if has_solids(system) => Some(QUICK_OF_SOLIDS),
            _ => None,
        }
    }

    /// True for conjugate gradients on an assembled matrix.
    pub(crate) fn is_iterative(self) -> bool {
        matches!(self, LinearSolver::Cg | LinearSolver::Multigrid)
    }

    /// Describes the choice for `system` and its reason.
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

/// Number of free coordinates; obstacles and pinned coordinates are excluded.
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

/// True if time steps with contact should try conjugate gradients before a factorisation.
///
/// Sheets in contact take tens of Newton iterations per step, most with limited steps. Few of their
/// solves need to be accurate, and inertia keeps the matrices well conditioned.
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
