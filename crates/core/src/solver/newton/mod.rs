//! Newton's method for the equations of an implicit step, as a minimisation.

mod evaluation;
mod linear;
mod prescribed;
mod search;
mod solve;
mod tolerance;
mod watchdog;

use self::linear::{IterativeSolver, Pause};
use self::solve::Begin;
use super::cholesky::{self, Cholesky};
use super::conjugate_gradients::{self, CgEnd, ConjugateGradients, Preconditioner};
use super::hessian::{Assembler, Weights};
use super::iterative::{AssembledMatrix, Iterative};
use super::multigrid::Multigrid;
use super::options::{LinearSolver, SolverOptions};
use super::structure::{LentStructure, MatrixStructure};
use super::{Iterate, Objective, SolverWork, scene_size};
use crate::material::Psd;
use crate::solver::StepFault;
use crate::system::System;

/// Corrections of so many units in the last place of the positions may be rounding: they are where they no
/// longer shrink.
const ULPS: f64 = 64.0;
/// A factor at hand is kept while each correction is at most this part of the one before.
const CONTRACTION: f64 = 0.25;
/// The relative residual that is asked of the first solve by conjugate gradients, and the largest afterwards.
const FORCING: [f64; 2] = [1e-2, 1e-1];
/// A solve need not be more accurate than this part of what the matrix at hand lets corrections shrink by.
const FORCING_PART: f64 = 0.3;
/// The smallest relative residual where terms guard ways: what they push back is no smoother for more.
const GUARDED_FORCING: f64 = 1e-5;
/// The largest part of the error in the energy norm that such a solve leaves: it ends here or there.
///
/// At 5e-2 a stack of cubes in frictional contact, corrections below 1e-5 m, ends as near to its solution
/// (6e-6 m) as by the residual alone (1.1e-5 m), and needs less than half of the iterations.
const GUARDED_ENERGY: f64 = 5e-2;
/// The relative residual of solves for estimates of errors.
const ESTIMATE: f64 = 1e-3;
/// A full step so short, as a part of the size of the scene, may be near a minimum.
const NEAR: f64 = 1e-3;
/// Ways between minima lead round in a circle where they shrink by less than this part of what goes over to
/// the next: by all of it where minima stay.
const ROUND: f64 = 0.1;
/// They lead straight on where they shrink by more than this part.
const STRAIGHT: f64 = 0.5;
/// Addition to the diagonal of projected Hessians in statics, as a part of the largest entry.
const STATIC_SHIFT: f64 = 1e-9;
/// In statics, a body so many sizes of the scene away from its last equilibrium is one that nothing holds.
const RUNAWAY: f64 = 1e3;

/// Minimises objectives of one system, keeping structure and factorisations between them.
pub(crate) struct Newton<const D: usize> {
    options: SolverOptions,
    assembler: Option<Assembler<D>>,
    cholesky: Option<Cholesky>,
    /// The version of the pattern that `cholesky` is for.
    factor_pattern: u64,
    /// The weights of the matrix that `cholesky` last factorised, or that is at hand for conjugate gradients;
    /// none if it is projected.
    at_hand: Option<Weights>,
    /// Conjugate gradients that are tried before anything else.
    first: Option<Iterative<D>>,
    pause_of_first: Pause,
    iterative: Option<Iterative<D>>,
    /// Levels of multigrid that were lent, until they are first used.
    levels: Option<Multigrid<D>>,
    pause_of_iterations: Pause,
    /// The solver by iterations that the last system was solved by; `None` after a factorisation.
    solved_by: Option<IterativeSolver>,
    /// Memory of the matrix-free solver.
    cg: ConjugateGradients,
    /// Size of the scene when the first objective was met [m].
    size: f64,
    /// The least speed [m/s] up to which friction grows; infinite where nothing rubs.
    threshold_speed: f64,
    residual: Vec<f64>,
    direction: Vec<f64>,
    trial: Iterate,
    /// True if `trial` is the iterate before: pressures are predicted from there.
    stepped_from: bool,
    /// Solutions of conjugate gradients.
    solution: Vec<f64>,
    /// Velocities, where something dissipates.
    velocity: Vec<f64>,
    /// Gradient of the terms that have no energy, at the last iterate; empty where there are none.
    follower: Vec<f64>,
    /// The part of the last value of the objective that is the same from every iterate.
    conservative: f64,
    work: SolverWork,
}

impl<const D: usize> Newton<D> {
    pub(crate) fn new(options: SolverOptions) -> Self {
        Newton {
            options,
            assembler: None,
            cholesky: None,
            factor_pattern: 0,
            at_hand: None,
            first: None,
            pause_of_first: Pause::default(),
            iterative: None,
            levels: None,
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

    /// Counts a solve that ended with a `correction` [m] too large to have settled.
    fn note_loose(&mut self, system: &System, at: &Iterate, correction: f64) {
        let free = at.u.iter().zip(system.inverse_mass()).filter(|(_, w)| **w != 0.0);
        self.work.note_loose(correction, free.map(|(u, _)| *u), self.size);
    }

    /// Minimises with what dissipative terms hold renewed on the way, and settles at most `most` times after
    /// it. What is taken far from the minimum, between surfaces that all but touch, may lead nowhere: then
    /// once more from the beginning, with what was taken there held to the minimum.
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
            // Nothing of the way that failed is carried on.
            system.thaw();
            system.freeze(&at.x, 1.0);
            end = self.solve(system, objective, at, (Begin::Anywhere, 0));
        }
        if end? { Ok(()) } else { self.settle(system, objective, at, most) }
    }

    /// Goes on from a minimum until what dissipative terms hold is that of the minimum itself, at most `most`
    /// times. Ways between minima shrink by about the same factor each time: the last is not gone where it
    /// would be none.
    ///
    /// Where they do not shrink, as of friction that lifts its own load, minima go round in a circle: then
    /// what is held goes only a part of the way to that of the minimum (Mann 1953, "Mean value methods in
    /// iteration", Proc. Amer. Math. Soc. 4, no. 3).
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
            let moved = before.iter().zip(&at.u).fold(0.0, |m: f64, (a, b)| m.max((b - a).abs())) / part;
            let left = if last.is_finite() && moved < last { moved * (moved / last) } else { moved };
            if left <= self.tolerance(system, objective, at) {
                return Ok(());
            }
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

    /// Makes the structure of the matrix, unless the one there is fits.
    fn prepare(&mut self, system: &mut System, x: &[f64]) {
        if self.size == 0.0 {
            self.size = self.options.size.unwrap_or_else(|| scene_size(x, system.dimension()));
        }
        let trial = &mut self.trial;
        for v in [&mut self.residual, &mut self.direction, &mut self.solution, &mut trial.x, &mut trial.u] {
            v.resize(x.len(), 0.0);
        }
        let matrix_free = self.options.linear == LinearSolver::MatrixFree;
        if !matrix_free && !self.assembler.as_ref().is_some_and(|a| a.fits(system)) {
            self.assembler = Some(Assembler::new(system));
            (self.cholesky, self.at_hand) = (None, None);
            (self.first, self.iterative, self.levels) = (None, None, None);
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
        // Where nothing is held at the start, as before bodies meet, it may be on the way. A single iteration
        // sees what there is where it starts; what is never renewed is of the start of the step, not of a
        // guess.
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
        // A projected matrix is none of the Jacobian.
        let Some(weights) = self.at_hand else { return false };
        if let Some(solver) = self.solved_by {
            let iterative = match solver {
                IterativeSolver::First => &mut self.first,
                IterativeSolver::Chosen => &mut self.iterative,
            };
            let (Some(iterative), Some(assembler)) = (iterative, &self.assembler) else {
                return false;
            };
            // Where the pattern is still that of the last solve, places say nothing.
            let made_for = (weights, Psd::Exact, &self.trial.x[..]);
            let matrices = AssembledMatrix::of(assembler);
            let report = iterative.solve(matrices, made_for, right, &mut self.solution, ESTIMATE.into());
            self.work.cg_iterations += report.iterations;
            if report.end == CgEnd::Converged {
                right.copy_from_slice(&self.solution);
            }
            return report.end == CgEnd::Converged;
        }
        let Some(cholesky) = &mut self.cholesky else { return false };
        cholesky.solve(right);
        true
    }

    fn exchange_structure(&mut self, system: &System, lent: Option<LentStructure>) -> Option<LentStructure> {
        let used = self.iterative.take().and_then(Iterative::into_levels);
        // Over other positions than those at rest they are of one run alone.
        let levels = used.or(self.levels.take()).filter(|_| system.rest_positions().is_some());
        let own = self.assembler.take().map(|assembler| MatrixStructure { assembler, levels });
        (self.cholesky, self.at_hand, self.first) = (None, None, None);
        if let Some(MatrixStructure { assembler, levels }) = lent.and_then(|lent| lent.taken(system)) {
            (self.assembler, self.levels) = (Some(assembler), levels);
        }
        own.and_then(MatrixStructure::lent)
    }

    fn work(&self) -> SolverWork {
        self.work
    }

    fn bytes(&self) -> usize {
        let vectors = [&self.residual, &self.direction, &self.solution, &self.velocity, &self.follower];
        8 * vectors.iter().map(|v| v.len()).sum::<usize>()
            + self.trial.bytes()
            + self.assembler.as_ref().map_or(0, Assembler::bytes)
            + self.cholesky.as_ref().map_or(0, Cholesky::bytes)
            + self.levels.as_ref().map_or(0, Preconditioner::bytes)
            + [&self.first, &self.iterative].into_iter().flatten().map(Iterative::bytes).sum::<usize>()
            + self.cg.bytes()
    }

    fn predicted_bytes(&self, system: &mut System, x: &[f64]) -> usize {
        let mut solver = Newton::<D>::new(self.options);
        solver.prepare(system, x);
        let vectors = 8 * x.len() * usize::from(system.is_damped());
        let linear = solver.options.linear.choose(system);
        // Lists of contact are held as long as steps are taken; those at the start are much like later ones.
        system.find_stencils(x);
        if let Some(assembler) = &mut solver.assembler {
            assembler.expect_stencils(system, x);
        }
        let Some(assembler) = &solver.assembler else {
            // Of the products with damping, and what is held.
            return solver.bytes() + vectors + conjugate_gradients::bytes(x.len()) + 9 * x.len();
        };
        let matrix = assembler.matrix();
        let rest = system.rest_positions().unwrap_or(x);
        let factor = |x: &[f64]| {
            let structure = cholesky::structure(matrix, system.ordering_positions(x));
            structure.map_or(usize::MAX / 2, |structure| structure.bytes())
        };
        let linear = match linear {
            LinearSolver::Cg => Iterative::<D>::gauss_seidel_bytes(matrix),
            LinearSolver::Multigrid => Multigrid::new(assembler.fixed(), rest, assembler.held())
                .map_or(usize::MAX / 2, |levels| levels.bytes() + conjugate_gradients::bytes(x.len())),
            // Where iterations are tried first, the factor of those that take too many is counted.
            LinearSolver::Cholesky | LinearSolver::Auto | LinearSolver::MatrixFree => factor(x),
        };
        // Iterations that are tried first may take too many: what comes after them is counted beside them.
        let first = solver.options.linear.first_iterations(system, 1.0, matrix.rows());
        let first = first.map_or(0, |_| Iterative::<D>::gauss_seidel_bytes(matrix));
        (solver.bytes() + vectors + first).saturating_add(linear)
    }
}
