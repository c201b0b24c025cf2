//! Newton's method for the equations of an implicit step, as a minimisation.
//!
//! # What each rule saves
//! Each rule was switched off by itself in the first 60 steps of the 24 scenes in `scenes/` whose steps are
//! solved. The ratio is the work without the rule over the work with it, `N` of Newton iterations, `F` of
//! factorisations, `C` of iterations of conjugate gradients, `E` of energies. A rule that saves less than a
//! tenth everywhere, or costs as much elsewhere, does not stay for its speed.
//!
//! ```text
//! rule                                              off                                        costs
//! factor kept while corrections shrink              F 10 stiff_pendulum_2d, 3.4 card_house     N 0.5 to 0.8
//! directions told to contact and friction           N 9.8 soft_stack, 7.8 bunny_drop           N 0.88 +
//! full steps watched (watchdog)                     N 6.6 hexahedra, 1.4 cooks_membrane_2d     N 0.77 *
//! stresses predicted after long steps               N 6 hexahedra, 1.7 cooks_membrane_2d
//! exact Hessians near a minimum (NEAR)              N 3.8 load_steps_2d, 2.7 pressed_block_2d  N 0.87
//! accuracy of linear solves follows (FORCING)       C 3.9 bunny_drop                           N 0.88
//! lagged quantities updated on the way              N 2.2 chain, 2.1 bunny_drop                F 0.58 +
//! and after two full steps (went_whole)             N 2 chain, 1.5 gripper                     F 0.68 +
//! contact: less accurate solves (GUARDED_FORCING)   C 1.9 bunny_drop
//! tolerance follows the scheme's error (PART)       N 1.4 cloth_on_ball, F 2.1 card_house
//! corrections to come are estimated (EVEN)          N 1.2 cloth_on_ball, F 2 card_house        N 0.88
//! wait for exact Hessians (EXACT_AGAIN)             N 1.12 cloth_on_ball
//! steps lengthened while they go down               N 1.12 hair_on_head
//! ```
//! `+` is `card_house`, `*` `incompressible_block`.
//!
//! Others are there to end at all: steps judged by slopes where the decrease drowns in rounding (`DROWNED`;
//! without it 3 of the 24 scenes fail), steps that may not end uphill after many iterations (`STAGNANT`),
//! bodies that nothing holds (`BALANCED`), way to prescribed positions (`prescribed`), friction that cycles
//! (`ROUND`), creep of sticking contacts (`PART_OF_CREEP`), conjugate gradients that fail (`Pause`). These
//! 24 scenes do not need the last five. Steps of a reused factor are not halved (`Slope::whole`): that saves
//! an eighth of the energies in `chain` and costs a quarter of the factorisations in `card_house`. A cloth
//! that folds needs it (`a_cloth_that_folds_takes_whole_steps`).

mod evaluation;
mod linear;
mod prescribed;
mod search;
mod solve;
mod state;
mod tolerance;
mod watchdog;

use self::linear::{IterativeSolver, Pause};
use self::solve::Begin;
use super::cholesky;
use super::conjugate_gradients::{CgEnd, ConjugateGradients};
use super::hessian::Weights;
use super::iterative::{AssembledMatrix, Iterative};
use super::linearisation::Linearisation;
use super::options::{LinearSolver, SolverOptions};
use super::structure::LentStructure;
use super::{Iterate, Objective, SolverWork, scene_size};
use crate::material::Psd;
use crate::solver::StepFault;
use crate::system::System;

/// Corrections of this many units in the last place of the positions are rounding once they no longer
/// shrink.
const ULPS: f64 = 64.0;
/// A reused factor is kept while each correction is at most this fraction of the last.
const CONTRACTION: f64 = 0.25;
/// Relative residual of the first conjugate-gradient solve, and the largest one afterwards.
const FORCING: [f64; 2] = [1e-2, 1e-1];
/// Relative residual of a solve, as a fraction of the expected contraction of corrections.
const FORCING_PART: f64 = 0.3;
/// Smallest relative residual under terms that limit steps, where more accuracy does not help.
const GUARDED_FORCING: f64 = 1e-5;
/// Largest energy-norm error of such a solve; either criterion ends it.
///
/// At 5e-2 a stack of cubes in frictional contact, with corrections below 1e-5 m, ends as near to its
/// solution (6e-6 m) as by the residual alone (1.1e-5 m), in less than half of the iterations.
const GUARDED_ENERGY: f64 = 5e-2;
/// Relative residual of solves for error estimates.
const ESTIMATE: f64 = 1e-3;
/// Full-step length, as a fraction of the scene size, below which a minimum may be near.
const NEAR: f64 = 1e-3;
/// Relaxation threshold of the friction fixed-point iteration: below this relative contraction the minima
/// cycle, and the update is damped.
const ROUND: f64 = 0.1;
/// Above this relative contraction the damping is reduced.
const STRAIGHT: f64 = 0.5;
/// Shift of the diagonal of projected Hessians in statics, as a fraction of the largest entry.
const STATIC_SHIFT: f64 = 1e-9;
/// In statics, a displacement of this many scene sizes from the last equilibrium means an unsupported
/// body.
const RUNAWAY: f64 = 1e3;

/// Vectors that a solve holds, about: of Newton's method, configurations, conjugate gradients.
const VECTORS: usize = 18;
/// Bytes of symmetric Gauss-Seidel sweeps, as a part of those of the matrix: its blocks above the diagonal.
const SWEEPS: f64 = 0.6;
/// Bytes of the levels of multigrid, beside those of the matrix, for each coordinate: smoothers, weights.
const PER_COORDINATE: usize = 200;

/// Minimises objectives of one system; keeps structure and factorisations between them.
pub(crate) struct Newton<const D: usize> {
    options: SolverOptions,
    linear: Linearisation<D>,
    /// Weights of the matrix last factorised or available to conjugate gradients; `None` if it is projected.
    at_hand: Option<Weights>,
    /// Conjugate gradients that are tried first.
    first: Option<Iterative<D>>,
    pause_of_first: Pause,
    iterative: Option<Iterative<D>>,
    pause_of_iterations: Pause,
    /// Iterative solver of the last linear system; `None` after a factorisation.
    solved_by: Option<IterativeSolver>,
    /// Scratch memory of the matrix-free solver.
    cg: ConjugateGradients,
    /// Scene size at the first objective [m].
    size: f64,
    /// Smallest friction regularisation velocity [m/s]; infinite without friction.
    threshold_speed: f64,
    residual: Vec<f64>,
    direction: Vec<f64>,
    trial: Iterate,
    /// True if `trial` is the last iterate, from which pressures are predicted.
    stepped_from: bool,
    /// Solutions of conjugate gradients.
    solution: Vec<f64>,
    /// Velocities, used with dissipation.
    velocity: Vec<f64>,
    /// Gradient of the non-conservative terms at the last iterate; empty without such terms.
    follower: Vec<f64>,
    /// Part of the last objective value that does not depend on the iterate.
    conservative: f64,
    work: SolverWork,
}

impl<const D: usize> Newton<D> {
    pub(crate) fn new(options: SolverOptions) -> Self {
        Newton {
            options,
            linear: Linearisation::default(),
            at_hand: None,
            first: None,
            pause_of_first: Pause::default(),
            iterative: None,
            pause_of_iterations: Pause::default(),
            solved_by: None,
            cg: ConjugateGradients::default(),
            size: 0.0,
            threshold_speed: f64::INFINITY,
            residual: vec![],
            direction: vec![],
            trial: Iterate::default(),
            stepped_from: false,
            solution: vec![],
            velocity: vec![],
            follower: vec![],
            conservative: 0.0,
            work: SolverWork::none(&options),
        }
    }

    /// Counts a solve that ended with a `correction` [m] too large to be converged.
    fn note_loose(&mut self, system: &System, at: &Iterate, correction: f64) {
        let free = at.u.iter().zip(system.inverse_mass()).filter(|(_, w)| **w != 0.0);
        self.work.note_loose(correction, free.map(|(u, _)| *u), self.size);
    }

    /// Minimises while updating lagged quantities along the way, then iterates to their fixed point at
    /// most `most` times. Values lagged far from the minimum, with nearly closed gaps, may make the solve
    /// fail: it then restarts with values lagged at its start, which it keeps to the minimum.
    fn minimize_frozen(
        &mut self,
        system: &mut System,
        objective: &Objective<'_>,
        at: &mut Iterate,
        most: u32,
    ) -> Result<(), StepFault> {
        let start = at.clone();
        let mut end = self.solve(system, objective, at, (Begin::Anywhere, most - 1));
        if most > 1 && end.is_err() && !system.is_stopped() {
            at.clone_from(&start);
            // Discards everything from the failed attempt.
            system.thaw();
            system.freeze(&at.x, 1.0);
            end = self.solve(system, objective, at, (Begin::Anywhere, 0));
        }
        if end? { Ok(()) } else { self.settle(system, objective, at, most) }
    }

    /// Fixed-point iteration for the lagged quantities of dissipative terms: minimises again with those
    /// of the last minimum, at most `most` times. Displacements between minima shrink by about the same
    /// factor each time; the iteration stops if the predicted next one is below the tolerance.
    ///
    /// If they do not shrink, as for friction that lifts its own load, the minima cycle: the update is
    /// then damped (Mann 1953, "Mean value methods in iteration", Proc. Amer. Math. Soc. 4, no. 3).
    fn settle(
        &mut self,
        system: &mut System,
        objective: &Objective<'_>,
        at: &mut Iterate,
        most: u32,
    ) -> Result<(), StepFault> {
        let (mut last, mut part, mut most_part) = (f64::INFINITY, 1.0, 1.0);
        for _ in 1..most {
            let before = at.u.clone();
            if !system.freeze(&at.x, part) {
                return Ok(());
            }
            self.solve(system, objective, at, (Begin::NearMinimum, 0))?;
            // Displacement of the minimum at full relaxation, and the predicted next one.
            let moved = before.iter().zip(&at.u).fold(0.0, |m: f64, (a, b)| m.max((b - a).abs())) / part;
            let left = if last.is_finite() && moved < last { moved * (moved / last) } else { moved };
            if left <= self.tolerance(system, objective, at) {
                return Ok(());
            }
            // Adapt the relaxation factor to the contraction.
            let shrunk = (1.0 - moved / last) / part;
            if shrunk < ROUND {
                (most_part, part) = (0.75 * part, 0.5 * part);
            } else if shrunk > STRAIGHT {
                part = f64::min(1.5 * part, most_part);
            }
            last = moved;
        }
        self.work.unsettled += u64::from(most > 1);
        Ok(())
    }

    /// Builds the matrix structure, unless the existing one fits.
    fn prepare(&mut self, system: &mut System, x: &[f64]) {
        if self.size == 0.0 {
            self.size = self.options.size.unwrap_or_else(|| scene_size(x, system.dimension()));
        }
        let trial = &mut self.trial;
        for v in [&mut self.residual, &mut self.direction, &mut self.solution, &mut trial.x, &mut trial.u] {
            v.resize(x.len(), 0.0);
        }
        let matrix_free = self.options.linear == LinearSolver::MatrixFree;
        if !matrix_free && self.linear.fit(system) {
            self.linear.forget_factor();
            (self.at_hand, self.first, self.iterative) = (None, None, None);
        }
        self.pause_of_first.count();
        self.pause_of_iterations.count();
        self.threshold_speed = system.threshold_speed();
    }
}

impl<const D: usize> super::Minimizer for Newton<D> {
    fn minimize(
        &mut self,
        system: &mut System,
        objective: &Objective<'_>,
        at: &mut Iterate,
    ) -> Result<(), StepFault> {
        self.prepare(system, &at.x);
        // Bodies not in contact at the start may meet along the way. A single iteration uses the lagged
        // values where it starts. Values that are never updated are taken at the start of the step, not
        // at a guess.
        let most = system.most_renewals().filter(|_| !objective.single_iteration);
        system.freeze(if most == Some(1) { objective.velocity.origin } else { &at.x }, 1.0);
        let end = match most {
            Some(most) => self.minimize_frozen(system, objective, at, most),
            None => self.solve(system, objective, at, (Begin::Anywhere, 0)).map(|_| ()),
        };
        system.thaw();
        end
    }

    fn objective(&mut self, system: &mut System, objective: &Objective<'_>, at: &Iterate) -> f64 {
        self.follower.clear();
        self.value(system, objective, at, at)
    }

    fn solve_last(&mut self, right: &mut [f64]) -> bool {
        // A projected matrix is not the Jacobian.
        let Some(weights) = self.at_hand else { return false };
        if let Some(solver) = self.solved_by {
            let iterative = match solver {
                IterativeSolver::First => &mut self.first,
                IterativeSolver::Chosen => &mut self.iterative,
            };
            let (Some(iterative), Some(assembler)) = (iterative, self.linear.assembler()) else {
                return false;
            };
            // If the pattern is that of the last solve, positions are not used.
            let made_for = (weights, Psd::Exact, &self.trial.x[..]);
            let matrices = AssembledMatrix::of(assembler);
            let until = (ESTIMATE.into(), u64::MAX);
            let report = iterative.solve(matrices, made_for, right, &mut self.solution, until);
            self.work.cg_iterations += report.iterations;
            if report.end == CgEnd::Converged {
                right.copy_from_slice(&self.solution);
            }
            return report.end == CgEnd::Converged;
        }
        let Some(factor) = self.linear.factor() else { return false };
        factor.solve(right);
        true
    }

    fn exchange_structure(&mut self, system: &System, lent: Option<LentStructure>) -> Option<LentStructure> {
        let used = self.iterative.take().and_then(Iterative::into_levels);
        self.linear.forget_factor();
        (self.at_hand, self.first) = (None, None);
        self.linear.exchange(system, used, lent)
    }

    fn work(&self) -> SolverWork {
        self.work
    }

    fn predicted_bytes(&self, system: &mut System, x: &[f64]) -> usize {
        let mut solver = Newton::<D>::new(self.options);
        solver.prepare(system, x);
        let linear = solver.options.linear.choose(system);
        // Contact lists persist between steps; those at the start are representative.
        system.find_stencils(x);
        if let Some(assembler) = solver.linear.assembler_mut() {
            assembler.expect_stencils(system, x);
        }
        let vectors = 8 * VECTORS * x.len();
        let Some(assembler) = solver.linear.assembler() else { return vectors };
        let matrix = assembler.matrix();
        let part = |part: f64| (part * matrix.bytes() as f64) as usize;
        let linear = match linear {
            LinearSolver::Cg => part(SWEEPS),
            LinearSolver::Multigrid => matrix.bytes() + PER_COORDINATE * x.len(),
            // If iterations are tried first, count the factor of those that fail.
            LinearSolver::Cholesky | LinearSolver::Auto | LinearSolver::MatrixFree => {
                let structure = cholesky::structure(matrix, system.ordering_positions(x));
                structure.map_or(usize::MAX / 2, |structure| structure.bytes())
            }
        };
        // Iterations tried first may fail: count the solver after them, too.
        let first = solver.options.linear.first_iterations(system, 1.0, matrix.rows());
        let first = first.map_or(0, |_| part(SWEEPS));
        (assembler.bytes() + vectors + first).saturating_add(linear)
    }
}
