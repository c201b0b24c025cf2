//! Solvers for implicit steps: Newton's method as a minimisation, and its linear solvers.

pub mod block_matrix;
pub mod cholesky;
pub mod conjugate_gradients;
pub(crate) mod coupled;
mod fault;
pub mod gauss_seidel;
pub mod hessian;
pub mod iterative;
pub mod linearisation;
pub mod lu;
pub mod multigrid;
mod newton;
mod options;
pub mod ordering;
pub mod stages;
pub mod structure;
mod subspace;
pub(crate) mod tangent;

pub use fault::StepFault;
pub use options::{LinearSolver, PART_OF_STEP_ERROR, SolverOptions};

use crate::system::System;
use newton::Newton;
use structure::LentStructure;

/// Velocity of a configuration at the end of a stage: `v = rate (u - drift)`, `u = x - origin`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Velocity<'a> {
    /// Old positions, from which increments count, flat [m].
    pub(crate) origin: &'a [f64],
    /// Factor from increments to velocities [1/s].
    pub(crate) rate: f64,
    /// Increment at which the velocity vanishes, flat [m].
    pub(crate) drift: &'a [f64],
}

/// Incremental potential of an implicit step or stage in the free coordinates,
/// `Phi(u) = inertia/2 (u - target)^T M (u - target) + stiffness E(origin + u)`.
///
/// With dissipation, `stiffness / rate R(x_k, v(u))` is added, `x_k` the last iterate. Non-conservative
/// forces add the work of the force at the last iterate. Both have the exact gradient there.
///
/// The minimum solves `inertia M (u - target) + stiffness (dE/dx + dR/dv) = 0`; Martin, Thomaszewski,
/// Grinspun, Gross 2011, "Example-based elastic materials", eq. 4. The unknowns are increments
/// `u = x - origin`, not positions: velocities divide them by the step, accelerations by its square,
/// which would amplify the rounding of positions; Hairer, Wanner 1996, section IV.8.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Objective<'a> {
    /// Factor of the inertia: 1 without drag, 0 in statics.
    pub(crate) inertia: f64,
    /// Inertial prediction relative to the origin, flat [m].
    pub(crate) target: &'a [f64],
    /// Factor of the energy [s^2].
    pub(crate) stiffness: f64,
    /// Origin of the increments and their velocities.
    pub(crate) velocity: Velocity<'a>,
    /// Velocities of constrained coordinates, flat [m/s]; other entries are ignored.
    pub(crate) held_velocity: &'a [f64],
    /// Final positions of constrained coordinates, flat [m], if they still have to move: terms that limit
    /// steps make them move together with the free ones. Other entries are ignored.
    pub(crate) goal: Option<&'a [f64]>,
    /// True to take one full Newton step only.
    pub(crate) single_iteration: bool,
}

/// A configuration as positions `x = origin + u` (free coordinates) and as increments, which are more
/// accurate.
#[derive(Clone, Debug, Default)]
pub(crate) struct Iterate {
    /// Positions, flat [m].
    pub(crate) x: Vec<f64>,
    /// Increments, flat [m]; ignored at constrained coordinates.
    pub(crate) u: Vec<f64>,
}

/// Minimises [`Objective`]s; keeps structures and factorisations from one to the next.
pub(crate) trait Minimizer: Send + Sync {
    /// Moves the free coordinates to a minimum. Afterwards the system holds the force there, unless the
    /// objective asks for a single iteration.
    fn minimize(
        &mut self,
        system: &mut System,
        objective: &Objective<'_>,
        at: &mut Iterate,
    ) -> Result<(), StepFault>;

    /// Returns the objective at a configuration; `+inf` outside the domain of a material.
    fn objective(&mut self, system: &mut System, objective: &Objective<'_>, at: &Iterate) -> f64;

    /// Solves with the matrix of the last minimisation in place, by conjugate gradients to a relative
    /// residual of 1e-3. Returns false without such a matrix, for example if it was projected.
    fn solve_last(&mut self, right: &mut [f64]) -> bool;

    /// Returns the matrix structure and continues with `lent` as if it were its own. Discards all
    /// matrices.
    fn exchange_structure(&mut self, system: &System, lent: Option<LentStructure>) -> Option<LentStructure>;

    /// Returns the work so far.
    fn work(&self) -> SolverWork;

    /// Estimates the memory after minimising an objective of `system` near `x`, flat [m], in bytes. Builds
    /// the structures temporarily; factor entries are only counted.
    fn predicted_bytes(&self, system: &mut System, x: &[f64]) -> usize;
}

/// Creates a minimiser for systems of `dimension` coordinates per vertex.
pub(crate) fn minimizer(dimension: usize, options: SolverOptions) -> Box<dyn Minimizer> {
    match dimension {
        1 => Box::new(Newton::<1>::new(options)),
        2 => Box::new(Newton::<2>::new(options)),
        _ => Box::new(Newton::<3>::new(options)),
    }
}

pub use crate::algebra::scene_size;

/// Work done in solvers, in machine-independent counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct SolverWork {
    /// Newton iterations.
    pub newton_iterations: u64,
    /// Energies evaluated in line searches.
    pub energies: u64,
    /// Step halvings in line searches.
    pub halvings: u64,
    /// Matrices assembled.
    pub hessians: u64,
    /// Matrices factorised.
    pub factorizations: u64,
    /// Symbolic analyses repeated because the pattern had no room for changed stencils; zero without such
    /// stencils.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub analyses: u64,
    /// Solves whose friction fixed-point iteration did not converge; zero without friction.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub unsettled: u64,
    /// Most consecutive Newton iterations of one solve whose step a term limited; zero if none was.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub longest_limited: u64,
    /// Conjugate-gradient iterations.
    pub cg_iterations: u64,
    /// Conjugate-gradient solves that stalled or took too many iterations, and were handed to multigrid
    /// or a factorisation.
    pub fallbacks: u64,
    /// Solves that ended at the scene's own tolerance although the last correction exceeded a tenth of
    /// the motion of the step and a millionth of the scene size; `None` if the scene sets no tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loose: Option<u64>,
}

/// True for counts that are omitted from the output.
fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// Corrections below this fraction of the scene size are small, whatever the motion.
const SETTLED: f64 = 1e-6;
/// Corrections below this fraction of the motion of the step are small.
const SMALL_PART: f64 = 0.1;

impl SolverWork {
    /// Returns zero work for solves with `options`.
    pub(crate) fn none(options: &SolverOptions) -> Self {
        SolverWork { loose: options.tolerance.map(|_| 0), ..SolverWork::default() }
    }

    /// Counts a solve that ended unconverged: its `correction` [m] is large compared with the motion,
    /// whose free components are `increments` [m], and with the scene `size` [m].
    pub(crate) fn note_loose(&mut self, correction: f64, increments: impl Iterator<Item = f64>, size: f64) {
        let Some(loose) = &mut self.loose else { return };
        if correction > SETTLED * size {
            let motion = increments.fold(0.0, |m: f64, u| m.max(u.abs()));
            *loose += u64::from(correction > SMALL_PART * motion);
        }
    }

    /// Adds both; `longest_limited` is the maximum.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        SolverWork {
            newton_iterations: self.newton_iterations + other.newton_iterations,
            energies: self.energies + other.energies,
            halvings: self.halvings + other.halvings,
            hessians: self.hessians + other.hessians,
            factorizations: self.factorizations + other.factorizations,
            analyses: self.analyses + other.analyses,
            unsettled: self.unsettled + other.unsettled,
            longest_limited: self.longest_limited.max(other.longest_limited),
            cg_iterations: self.cg_iterations + other.cg_iterations,
            fallbacks: self.fallbacks + other.fallbacks,
            loose: self.loose.or(other.loose).map(|_| self.loose.unwrap_or(0) + other.loose.unwrap_or(0)),
        }
    }
}

/// Reason why a solve did not end at a minimum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SolveFailure {
    /// The start has no finite energy or force.
    Infeasible,
    /// The line search finds no decrease along the direction.
    Stalled,
    /// The matrix is not positive definite, even with all negative eigenvalues of elements removed.
    Indefinite,
    /// The linear solver did not converge.
    LinearSolver,
    /// The iteration limit is reached.
    IterationCap,
    /// The corrections of a fixed-point iteration no longer shrink.
    Diverged,
    /// The solution gains energy: it is not one of the motion.
    Spurious,
    /// Prescribed motion is blocked by an obstacle that cannot yield.
    Obstructed,
    /// The run was told to stop.
    Stopped,
    /// The exact tangent is singular, or the force is not finite.
    Singular,
    /// No load depends on the load factor.
    Unloaded,
}

impl std::fmt::Display for SolveFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            SolveFailure::Infeasible => "infeasible: no finite energy or force",
            SolveFailure::Stalled => "stalled: the line search finds no decrease",
            SolveFailure::Indefinite => "indefinite: the matrix has directions without stiffness or mass",
            SolveFailure::LinearSolver => "the linear solver did not converge",
            SolveFailure::Diverged => "the iteration for the accelerations does not converge at this step",
            SolveFailure::Spurious => {
                "the solution gains energy without external work, so it is not the physical one"
            }
            SolveFailure::IterationCap => "not converged within the iterations allowed",
            SolveFailure::Obstructed => {
                "obstructed: an obstacle that cannot yield blocks the prescribed motion"
            }
            SolveFailure::Stopped => "stopped",
            SolveFailure::Singular => "singular: the tangent has a direction without stiffness",
            SolveFailure::Unloaded => "unloaded: no free degree of freedom depends on the load factor",
        })
    }
}

/// Error of a solve that did not end at a minimum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolveError {
    /// Reason.
    pub verdict: SolveFailure,
    /// Iterations taken.
    pub iterations: u32,
    /// Largest component of the last correction [m].
    pub correction: f64,
    /// Largest residual force, in statics; `None` if no force is finite.
    pub left: Option<ForceLeft>,
}

/// Largest component of the residual force at a free coordinate.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ForceLeft {
    /// Magnitude [N].
    pub force: f64,
    /// Vertex number.
    pub vertex: usize,
}
