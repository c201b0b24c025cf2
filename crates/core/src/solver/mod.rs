//! Solvers of implicit steps: Newton's method as a minimisation, and the linear solvers inside.

pub mod block_matrix;
pub mod cholesky;
pub mod conjugate_gradients;
pub(crate) mod coupled;
mod fault;
pub mod gauss_seidel;
pub mod hessian;
mod iterative;
pub mod multigrid;
mod newton;
mod options;
pub mod ordering;
pub mod structure;
mod subspace;
pub(crate) mod tangent;

pub use fault::StepFault;
pub use options::{LinearSolver, PART_OF_STEP_ERROR, SolverOptions};

use crate::system::System;
use newton::Newton;
use structure::LentStructure;

/// The velocities `v = rate (u - drift)`, `u = x - origin`, that a scheme gives a configuration at the end
/// of a stage.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Velocity<'a> {
    /// Where increments begin: the old positions, flat [m].
    pub(crate) origin: &'a [f64],
    /// [1/s].
    pub(crate) rate: f64,
    /// How far the scheme moves what has no velocity in the stage, flat [m].
    pub(crate) drift: &'a [f64],
}

/// The incremental potential of an implicit step or stage,
/// `Phi(u) = inertia/2 (u - target)^T M (u - target) + stiffness E(origin + u)`, in the coordinates that are
/// free to move.
///
/// With dissipation, `stiffness / rate R(x_k, v(u))` is added, `x_k` the last iterate; with forces that have
/// no energy the work of the force at the last iterate. Both have the right gradient there.
///
/// Its minimum solves `inertia M (u - target) + stiffness (dE/dx + dR/dv) = 0`; Martin, Thomaszewski,
/// Grinspun, Gross 2011, "Example-based elastic materials", eq. 4. The unknowns are increments `u = x -
/// origin`, not positions: velocities are their quotients by the step, accelerations by its square, and the
/// rounding of positions would be felt in both; Hairer, Wanner 1996, section IV.8.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Objective<'a> {
    /// Factor of the inertia: 1 without drag, 0 in statics.
    pub(crate) inertia: f64,
    /// Where the vertices would go without force, from the origin, flat [m].
    pub(crate) target: &'a [f64],
    /// Factor of the energy [s^2].
    pub(crate) stiffness: f64,
    /// Where increments begin, and what velocities they are.
    pub(crate) velocity: Velocity<'a>,
    /// The velocities of held coordinates, flat [m/s]; the others are not looked at.
    pub(crate) held_velocity: &'a [f64],
    /// Where held coordinates are to be at the end, flat [m], where they are not there yet: they go together
    /// with the others, for terms guard the ways. The others are not looked at.
    pub(crate) goal: Option<&'a [f64]>,
    /// Take one full Newton step and look no further.
    pub(crate) single_iteration: bool,
}

/// A configuration, twice: positions `x = origin + u` where free to move, and the increments, in which they
/// are known better.
#[derive(Clone, Debug, Default)]
pub(crate) struct Iterate {
    /// Positions, flat [m].
    pub(crate) x: Vec<f64>,
    /// Increments, flat [m]; of held coordinates not looked at.
    pub(crate) u: Vec<f64>,
}

impl Iterate {
    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        8 * (self.x.len() + self.u.len())
    }
}

/// Minimises [`Objective`]s. What was learnt about one system is kept for the next.
pub(crate) trait Minimizer: Send + Sync {
    /// Moves the free coordinates to a minimum. The system holds the force there, unless the objective asks
    /// for a single iteration.
    fn minimize(
        &mut self,
        system: &mut System,
        objective: &Objective<'_>,
        at: &mut Iterate,
    ) -> Result<(), StepFault>;

    /// The objective at a configuration; `+inf` outside the domain of a material.
    fn objective(&mut self, system: &mut System, objective: &Objective<'_>, at: &Iterate) -> f64;

    /// Replaces `right` by the solution with the matrix that the last minimisation ended with, by conjugate
    /// gradients to a thousandth; false where there is none, as where it was projected, or never made.
    fn solve_last(&mut self, right: &mut [f64]) -> bool;

    /// Gives its structure away, and goes on with the one `lent`, as if it were its own. What was learnt with
    /// it is forgotten.
    fn exchange_structure(&mut self, system: &System, lent: Option<LentStructure>) -> Option<LentStructure>;

    /// Work done so far.
    fn work(&self) -> SolverWork;

    /// Bytes held.
    fn bytes(&self) -> usize;

    /// Bytes that it holds once it has minimised an objective of `system` near `x`, flat [m]: the structures
    /// are made and left, entries of a factor are only counted.
    fn predicted_bytes(&self, system: &mut System, x: &[f64]) -> usize;
}

/// A minimiser for systems of `dimension` coordinates per vertex.
pub(crate) fn minimizer(dimension: usize, options: SolverOptions) -> Box<dyn Minimizer> {
    match dimension {
        1 => Box::new(Newton::<1>::new(options)),
        2 => Box::new(Newton::<2>::new(options)),
        _ => Box::new(Newton::<3>::new(options)),
    }
}

pub use crate::algebra::scene_size;

/// Work done in solvers, in counts that do not depend on the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct SolverWork {
    /// Newton iterations.
    pub newton_iterations: u64,
    /// Energies evaluated in line searches.
    pub energies: u64,
    /// Steps that a line search halved.
    pub halvings: u64,
    /// Matrices assembled.
    pub hessians: u64,
    /// Matrices factorised.
    pub factorizations: u64,
    /// Patterns analysed anew, because they had no room for stencils that changed; zero where none do.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub analyses: u64,
    /// Solves that ended while friction still changed with the contact forces; zero without friction.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub unsettled: u64,
    /// Most Newton iterations in a row of one solve that a term which guards ways cut short; zero where none
    /// was.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub longest_limited: u64,
    /// Iterations of conjugate gradients.
    pub cg_iterations: u64,
    /// Solves by conjugate gradients that stalled, or took more iterations than another solver is worth, and
    /// were left to that: multigrid or a factorisation.
    pub fallbacks: u64,
    /// Solves that the scene's own tolerance ended while a correction was more than a tenth of the motion of
    /// the step, and more than a millionth of the size of the scene; `None` where the scene names no
    /// tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loose: Option<u64>,
}

/// Counts that only some runs have are not written where they are zero.
fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// Corrections below this part of the size of the scene are small, whatever the motion.
const SETTLED: f64 = 1e-6;
/// And so are those below this part of the motion of the step.
const SMALL_PART: f64 = 0.1;

impl SolverWork {
    /// No work yet, of solves as `options` say.
    pub(crate) fn none(options: &SolverOptions) -> Self {
        SolverWork { loose: options.tolerance.map(|_| 0), ..SolverWork::default() }
    }

    /// Counts a solve that ended with a `correction` [m] which says that it has not settled: one that is no
    /// small part of the motion, whose free components are these `increments` [m], in a scene of this `size`
    /// [m].
    pub(crate) fn note_loose(&mut self, correction: f64, increments: impl Iterator<Item = f64>, size: f64) {
        let Some(loose) = &mut self.loose else { return };
        if correction > SETTLED * size {
            let motion = increments.fold(0.0, |m: f64, u| m.max(u.abs()));
            *loose += u64::from(correction > SMALL_PART * motion);
        }
    }

    /// The work of both.
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

/// Why a solve did not end at a minimum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SolveFailure {
    /// The start has no finite energy or force.
    Infeasible,
    /// No step along the direction lowers the objective any more.
    Stalled,
    /// The matrix is not positive definite, even with all negative eigenvalues of elements removed.
    Indefinite,
    /// The linear solver did not get there.
    LinearSolver,
    /// The iterations are used up.
    IterationCap,
    /// The corrections of an explicit iteration no longer shrink.
    Diverged,
    /// The solution is none that a motion leads to: it makes energy.
    Spurious,
    /// Prescribed motion leads through what cannot yield.
    Obstructed,
    /// It was told to stop.
    Stopped,
    /// The exact tangent is singular, or the force at hand not finite.
    Singular,
    /// No load changes with the load factor.
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
                "the solution that was found makes energy of nothing, and is not that of the motion"
            }
            SolveFailure::IterationCap => "not converged within the iterations allowed",
            SolveFailure::Obstructed => {
                "obstructed: prescribed motion leads through what is in its way and cannot yield"
            }
            SolveFailure::Stopped => "stopped",
            SolveFailure::Singular => "singular: the tangent has a direction without stiffness",
            SolveFailure::Unloaded => {
                "unloaded: nothing that is free feels a load that changes with the load factor"
            }
        })
    }
}

/// A solve that did not end at a minimum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolveError {
    /// Why.
    pub verdict: SolveFailure,
    /// Iterations taken.
    pub iterations: u32,
    /// Largest component of the last correction [m].
    pub correction: f64,
    /// The largest force that was left, in statics; `None` where no force is finite.
    pub left: Option<ForceLeft>,
}

/// The largest component of the force that is left at a coordinate that is free.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ForceLeft {
    /// Its size [N].
    pub force: f64,
    /// The vertex.
    pub vertex: usize,
}
