//! Newton's method for the equations of an implicit step, as a minimisation.

mod evaluation;
mod linear;
mod search;
mod tolerance;

use super::cholesky::{self, Cholesky};
use super::conjugate_gradients::{self, CgEnd, ConjugateGradients, dot};
use super::hessian::{Assembler, Weights};
use super::iterative::{CG_TOLERANCE, Iterative};
use super::options::{LinearSolver, SolverOptions};
use super::{Iterate, Objective, SolveError, SolverWork, Verdict, scene_size};
use crate::deadline::Stop;
use crate::material::Psd;
use crate::solver::StepFault;
use crate::system::System;
use evaluation::weights;
use linear::Direction;
use search::{Accepted, Slope};

/// Corrections of so many units in the last place of the positions may be rounding: they are where they no longer shrink.
const ULPS: f64 = 64.0;
/// A factor at hand is kept while each correction is at most this part of the one before.
const CONTRACTION: f64 = 0.25;
/// The relative residual that is asked of the first solve by conjugate gradients, and the largest afterwards.
const FORCING: [f64; 2] = [1e-2, 1e-1];
/// A solve need not be more accurate than this part of what the matrix at hand lets corrections shrink by.
const FORCING_PART: f64 = 0.3;
/// The relative residual of solves for estimates of errors.
const ESTIMATE: f64 = 1e-3;
/// A full step so short, as a part of the size of the scene, may be near a minimum.
const NEAR: f64 = 1e-3;
/// What is added to the diagonal of projected Hessians in statics, as a part of the largest entry.
const STATIC_SHIFT: f64 = 1e-9;
/// In statics, a body so many sizes of the scene away from its last equilibrium is one that nothing holds.
const RUNAWAY: f64 = 1e3;

/// Minimises objectives of one system, keeping structure and factorisations between them.
pub(crate) struct Newton<const D: usize> {
    options: SolverOptions,
    assembler: Option<Assembler<D>>,
    cholesky: Option<Cholesky>,
    /// The weights of the matrix that `cholesky` last factorised, or that is at hand for conjugate gradients; none if it is projected.
    at_hand: Option<Weights>,
    iterative: Option<Iterative<D>>,
    /// Whether what is at hand was last solved with by conjugate gradients.
    by_iterations: bool,
    /// Solves that are left to the factorisation because conjugate gradients stalled, and how many were at the last time:
    /// they are tried again after twice as many.
    direct: (u64, u64),
    /// Memory of the matrix-free solver.
    cg: ConjugateGradients,
    /// Size of the scene when the first objective was met [m].
    size: f64,
    residual: Vec<f64>,
    direction: Vec<f64>,
    trial: Iterate,
    /// Solutions of conjugate gradients.
    solution: Vec<f64>,
    /// Velocities, where something dissipates.
    velocity: Vec<f64>,
    /// Gradient of the terms that have no energy, at the last iterate; empty where there are none.
    follower: Vec<f64>,
    work: SolverWork,
}

impl<const D: usize> Newton<D> {
    pub(crate) fn new(options: SolverOptions) -> Self {
        Newton {
            options,
            assembler: None,
            cholesky: None,
            at_hand: None,
            iterative: None,
            by_iterations: false,
            direct: (0, 0),
            cg: ConjugateGradients::default(),
            size: 0.0,
            residual: vec![],
            direction: vec![],
            trial: Iterate::default(),
            solution: vec![],
            velocity: vec![],
            follower: vec![],
            work: SolverWork::none(&options),
        }
    }

    /// Counts a solve that ended with a `correction` [m] too large to have settled.
    fn note_loose(&mut self, system: &System, at: &Iterate, correction: f64) {
        let free = at.u.iter().zip(system.inverse_mass()).filter(|(_, w)| **w != 0.0);
        self.work.note_loose(correction, free.map(|(u, _)| *u), self.size);
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
            self.iterative = None;
        }
        self.direct.0 = self.direct.0.saturating_sub(1);
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
        let reach = at.x.iter().chain(objective.target).fold(0.0, |m: f64, x| m.max(x.abs()));
        let floor = ULPS * f64::EPSILON * reach;
        let fail = |system: &System, at: &Iterate, verdict, iterations, correction| {
            let solve = Some(SolveError { verdict, iterations, correction });
            Err(StepFault { solve, ..StepFault::at(system, &at.x, &at.x) })
        };
        if !self.residual(system, objective, at) {
            return fail(system, at, Verdict::Infeasible, 0, f64::INFINITY);
        }
        // With dissipation, or forces without energy, the objective is another one in every iteration.
        let changes = system.is_damped() || !self.follower.is_empty();
        let mut value = None;
        let mut psd = Psd::Exact;
        let mut correction = f64::INFINITY;
        // What a matrix costs beside a solve by conjugate gradients does not pay for an old one, but within one minimisation.
        let inexact = !objective.single_iteration && self.options.linear.choose(system).is_iterative();
        if inexact {
            self.at_hand = None;
        }
        // Whether Hessians were indefinite, or a step was shortened.
        let mut curved = false;
        let mut forcing = if inexact { FORCING[0] } else { CG_TOLERANCE };
        // The textbook's single iteration is one with the Hessian where it starts.
        let mut keep = !objective.single_iteration;
        for iteration in 0..self.options.max_iterations {
            if self.residual.iter().all(|r| *r == 0.0) {
                return Ok(());
            }
            if system.is_stopped() {
                return fail(system, at, Verdict::Stopped, iteration, correction);
            }
            let before = correction;
            let negligible = self.tolerance(system, objective, at).max(floor);
            // A factor at hand costs a solve, a new one twenty times that: it is kept as long as corrections shrink fast.
            let mut old_matrix = keep && self.at_hand == Some(weights(objective));
            // Whether the correction says nothing of how far a minimum is.
            let mut truncated;
            let slope = loop {
                let found = self.solve_linear(system, objective, at, psd, (old_matrix, forcing));
                truncated = matches!(found, Direction::Truncated);
                let slope = match found {
                    Direction::Truncated if objective.single_iteration => f64::NAN,
                    Direction::Descent | Direction::Truncated => dot(&self.direction, &self.residual),
                    Direction::Indefinite => f64::NAN,
                    Direction::Failed => {
                        let stopped = system.is_stopped();
                        let verdict = if stopped { Verdict::Stopped } else { Verdict::LinearSolver };
                        return fail(system, at, verdict, iteration, correction);
                    }
                };
                correction = self.direction.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
                if old_matrix && !(slope < 0.0 && correction <= CONTRACTION * before) {
                    old_matrix = false;
                    continue;
                }
                if slope < 0.0 {
                    break slope;
                }
                if slope == 0.0 && correction <= negligible && !truncated {
                    // So near that the product underflows.
                    return Ok(());
                }
                if psd == Psd::Projected || self.options.linear == LinearSolver::MatrixFree {
                    return fail(system, at, Verdict::Indefinite, iteration, correction);
                }
                // From here on to the end of this solve: a Hessian that was indefinite once will be again.
                psd = Psd::Projected;
            };
            self.work.newton_iterations += 1;
            if objective.inertia == 0.0 {
                let away = at.u.iter().zip(system.inverse_mass());
                let away = away.fold(0.0, |m: f64, (u, w)| if *w == 0.0 { m } else { m.max(u.abs()) });
                if away > RUNAWAY * self.size {
                    return fail(system, at, Verdict::Indefinite, iteration, correction);
                }
            }
            if objective.single_iteration {
                self.go(system, objective, at, 1.0);
                std::mem::swap(at, &mut self.trial);
                return Ok(());
            }
            let start = match value {
                Some(value) if !changes => value,
                _ => self.value(system, objective, at, at),
            };
            // In a step of time a part of the direction of an earlier matrix is worth less than a new
            // matrix; in statics it leads on from the last equilibrium.
            let whole = old_matrix && objective.inertia > 0.0 && correction > negligible;
            let slope = Slope { start, slope, correction, negligible, whole };
            let accepted = self.search(system, objective, at, &slope);
            let Some(Accepted { value: there, halvings, finite }) = accepted else {
                if whole {
                    keep = false;
                    continue;
                }
                if forcing > CG_TOLERANCE {
                    // A loose solution may point nowhere: an accurate one with the same matrix comes before another matrix.
                    (forcing, correction) = (CG_TOLERANCE, f64::INFINITY);
                    continue;
                }
                if correction <= negligible && !truncated {
                    self.note_loose(system, at, correction);
                    return Ok(());
                }
                if old_matrix {
                    keep = false;
                    continue;
                }
                if psd == Psd::Exact {
                    psd = Psd::Projected;
                    continue;
                }
                return fail(system, at, Verdict::Stalled, iteration, correction);
            };
            self.work.halvings += u64::from(halvings);
            let steady = keep && halvings == 0 && psd == Psd::Exact;
            keep = halvings == 0;
            if keep && correction <= NEAR * self.size {
                // Near a minimum the exact Hessian is positive definite, and converges quadratically.
                psd = Psd::Exact;
            }
            value = Some(there);
            let finite = finite.unwrap_or_else(|| self.residual_at_trial(system, objective));
            std::mem::swap(at, &mut self.trial);
            if !finite {
                return fail(system, at, Verdict::Infeasible, iteration, correction);
            }
            // The first correction by a factor of an earlier solve says little about the next.
            let known = (iteration > 0 || !old_matrix) && !truncated;
            let tolerance = self.tolerance(system, objective, at);
            let rounding = correction <= floor && correction >= 0.5 * before;
            // A solve with a large residual may leave a small correction where the matrix is ill conditioned: the last one is accurate.
            let left = if steady { self.left(objective, before, correction) } else { correction };
            if (left <= tolerance || rounding) && known && forcing <= CG_TOLERANCE {
                self.note_loose(system, at, correction);
                return Ok(());
            }
            if inexact {
                // Corrections shrink by what solves leave, or by how much the matrix has changed: the former need not be much less.
                // Negative curvature, though, shows only in solves that are accurate.
                curved |= psd == Psd::Projected || truncated || !keep;
                let shrink = if before.is_finite() { correction / before } else { FORCING[0] };
                let last = correction * shrink.min(1.0) <= negligible;
                forcing = if curved || last {
                    CG_TOLERANCE
                } else {
                    (FORCING_PART * shrink).clamp(CG_TOLERANCE, FORCING[1])
                };
            }
        }
        fail(system, at, Verdict::IterationCap, self.options.max_iterations, correction)
    }

    fn objective(&mut self, system: &mut System, objective: &Objective<'_>, at: &Iterate) -> f64 {
        self.follower.clear();
        self.value(system, objective, at, at)
    }

    fn solve_last(&mut self, right: &mut [f64]) -> bool {
        // A projected matrix is none of the Jacobian.
        let Some(weights) = self.at_hand else { return false };
        if self.by_iterations {
            let (Some(iterative), Some(assembler)) = (&mut self.iterative, &self.assembler) else {
                return false;
            };
            let made_for = (weights, Psd::Exact);
            let report = iterative.solve(assembler.matrix(), made_for, right, &mut self.solution, ESTIMATE);
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

    fn work(&self) -> SolverWork {
        self.work
    }

    fn bytes(&self) -> usize {
        let vectors = [&self.residual, &self.direction, &self.solution, &self.velocity, &self.follower];
        8 * vectors.iter().map(|v| v.len()).sum::<usize>()
            + self.trial.bytes()
            + self.assembler.as_ref().map_or(0, Assembler::bytes)
            + self.cholesky.as_ref().map_or(0, Cholesky::bytes)
            + self.iterative.as_ref().map_or(0, Iterative::bytes)
            + self.cg.bytes()
    }

    fn predicted_bytes(&self, system: &mut System, x: &[f64]) -> usize {
        let mut solver = Newton::<D>::new(self.options);
        solver.prepare(system, x);
        let vectors = 8 * x.len() * usize::from(system.is_damped());
        let linear = solver.options.linear.choose(system);
        let Some(assembler) = &solver.assembler else {
            // Of the products with damping, and what is held.
            return solver.bytes() + vectors + conjugate_gradients::bytes(x.len()) + 9 * x.len();
        };
        let matrix = assembler.matrix();
        let rest = system.rest_positions().unwrap_or(x);
        let factor =
            |x: &[f64]| cholesky::structure(matrix, x).map_or(usize::MAX / 2, |structure| structure.bytes());
        let linear = match linear {
            LinearSolver::Cg => Iterative::<D>::jacobi_bytes(matrix),
            LinearSolver::Multigrid => Iterative::multigrid(matrix, rest, assembler.held(), &Stop::default())
                .map_or(usize::MAX / 2, |levels| levels.bytes() + conjugate_gradients::bytes(x.len())),
            LinearSolver::Cholesky | LinearSolver::Auto | LinearSolver::MatrixFree => factor(x),
        };
        (solver.bytes() + vectors).saturating_add(linear)
    }
}
