//! Linear system of one Newton iteration, solved by the scene's linear solver.

use super::evaluation::weights;
use super::{Newton, STATIC_SHIFT};
use crate::material::Psd;
use crate::solver::conjugate_gradients::{CgEnd, CgTolerance, NoPreconditioner};
use crate::solver::gauss_seidel::GaussSeidel;
use crate::solver::hessian::{At, Weights};
use crate::solver::iterative::{AssembledMatrix, CG_TOLERANCE, Iterative};
use crate::solver::options::LinearSolver;
use crate::solver::{Iterate, Objective};
use crate::system::System;

/// Request for one linear solve.
#[derive(Clone, Copy)]
pub(super) struct LinearRequest<'a> {
    /// Form of the element Hessians.
    pub(super) psd: Psd,
    /// True if the matrix of an earlier iterate may be reused.
    pub(super) old_matrix: bool,
    /// Tolerance of conjugate gradients.
    pub(super) tolerance: CgTolerance,
    /// Displacement of constrained coordinates, which free ones follow to first order, flat [m].
    pub(super) way: Option<&'a [f64]>,
}

/// Outcome of one linear solve.
pub(super) enum Direction {
    /// A descent direction that solves the linear system.
    Descent,
    /// A descent direction only: the matrix is not positive definite.
    Truncated,
    /// The matrix is not positive definite.
    Indefinite,
    /// The solver failed otherwise.
    Failed,
}

/// Iterative solvers that a minimisation may try before a factorisation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum IterativeSolver {
    /// Conjugate gradients with symmetric Gauss-Seidel, for a few iterations.
    First,
    /// The solver chosen by the options.
    Chosen,
}

/// Minimisations for which a stalled solver is skipped; the count doubles each time.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pause {
    left: u64,
    last: u64,
}

impl Pause {
    /// True if the solver may be tried.
    pub(super) fn is_over(self) -> bool {
        self.left == 0
    }

    /// Skips the solver from now on.
    fn begin(&mut self) {
        self.last = 2 * self.last.max(1);
        self.left = self.last;
    }

    /// Counts a minimisation that starts.
    pub(super) fn count(&mut self) {
        self.left = self.left.saturating_sub(1);
    }
}

impl<const D: usize> Newton<D> {
    /// Solves `A d = -residual` for the direction, or `A_ff d_f = -r_f - A_fp d_p` if constrained
    /// coordinates move by `d_p`.
    pub(super) fn solve_linear(
        &mut self,
        system: &mut System,
        objective: &Objective<'_>,
        at: &Iterate,
        request: LinearRequest<'_>,
    ) -> Direction {
        let LinearRequest { psd, old_matrix, tolerance, way } = request;
        let weights = weights(objective);
        let x = &at.x;
        let linear = self.options.linear.choose(system);
        if system.is_damped() {
            self.velocity_at(system, objective, at);
        }
        self.direction.iter_mut().zip(&self.residual).for_each(|(d, r)| *d = -r);
        if linear == LinearSolver::MatrixFree {
            if let Some(way) = way {
                system.hessian_product(x, way, &mut self.solution);
                self.subtract_from_direction(system, weights);
            }
            return self.matrix_free(system, weights, x);
        }
        // Decide between iterations and a factorisation; a reused factor only needs a solve.
        let first = self.options.linear.first_iterations(system, objective.inertia, x.len() / D);
        let first = first.filter(|_| self.pause_of_first.is_over());
        let by_iterations = linear.is_iterative() && self.pause_of_iterations.is_over();
        let by_factor = first.is_none() && !by_iterations;
        if let Some(factor) = self.linear.factor().filter(|_| old_matrix && by_factor) {
            factor.solve(&mut self.direction);
            return Direction::Descent;
        }
        // Assemble the matrix, unless the last one is reused.
        if !old_matrix {
            let assembler = self.linear.assembler_mut().expect("prepared");
            system.find_stencils(x);
            let predicted_from = self.stepped_from.then_some(&self.trial.x[..]);
            assembler.assemble(system, At { x, v: &self.velocity, psd, predicted_from }, weights);
            if objective.inertia == 0.0 && psd == Psd::Projected {
                // Projected Hessians may be singular, and statics has no inertia.
                assembler.shift(STATIC_SHIFT);
            }
            self.work.hessians += 1;
        }
        if let Some(way) = way {
            let assembler = self.linear.assembler().expect("prepared");
            assembler.held_product(system, x, way, &mut self.solution);
            self.subtract_from_direction(system, weights);
        }
        self.at_hand = None;
        let made_for = (weights, psd, &x[..]);
        // Try the iterative solvers in turn.
        for solver in [IterativeSolver::First, IterativeSolver::Chosen] {
            let iterative = match solver {
                IterativeSolver::First => {
                    let Some(each) = first else { continue };
                    let new = || Iterative::gauss_seidel(GaussSeidel::default(), Some(each));
                    self.first.get_or_insert_with(new)
                }
                IterativeSolver::Chosen if !by_iterations => continue,
                IterativeSolver::Chosen => {
                    if self.iterative.is_none() {
                        self.iterative = match linear {
                            LinearSolver::Multigrid => {
                                // Lattices are built over the reference positions, as the start may be
                                // deformed.
                                let rest = system.rest_positions().unwrap_or(x);
                                self.linear.take_levels(rest, &system.stop()).map(Iterative::multigrid)
                            }
                            _ => Some(Iterative::gauss_seidel(GaussSeidel::default(), None)),
                        };
                    }
                    let Some(iterative) = &mut self.iterative else { return Direction::Failed };
                    iterative
                }
            };
            iterative.set_stop(system.stop());
            let matrices = AssembledMatrix::of(self.linear.assembler().expect("prepared"));
            let until = (tolerance, u64::MAX);
            let report = iterative.solve(matrices, made_for, &self.direction, &mut self.solution, until);
            self.work.cg_iterations += report.iterations;
            let cost = report.iterations as f64 * iterative.cost_of_iteration(matrices.whole);
            if let (IterativeSolver::Chosen, Some(first)) = (solver, &mut self.first) {
                // If multigrid solves turn out long, longer tries without it pay off first.
                if first.raise_allowance(cost) {
                    self.pause_of_first = Pause::default();
                }
            }
            match report.end {
                CgEnd::Converged => {
                    self.at_hand = (psd == Psd::Exact).then_some(weights);
                    self.solved_by = Some(solver);
                    std::mem::swap(&mut self.direction, &mut self.solution);
                    return Direction::Descent;
                }
                CgEnd::Stopped => return Direction::Failed,
                // First remove the negative eigenvalues of elements.
                CgEnd::Indefinite if psd == Psd::Exact => return Direction::Indefinite,
                CgEnd::Indefinite | CgEnd::Stalled => {
                    // Skip the solver for the rest of this solve and for the next ones.
                    match solver {
                        IterativeSolver::First => self.pause_of_first.begin(),
                        IterativeSolver::Chosen => self.pause_of_iterations.begin(),
                    }
                    self.work.fallbacks += 1;
                }
            }
        }
        // Factorise; a changed pattern needs a new symbolic analysis.
        let Some(is_again) = self.linear.analyse(system.ordering_positions(x)) else {
            return Direction::Failed;
        };
        self.work.analyses += u64::from(is_again);
        self.work.factorizations += 1;
        if self.linear.factorise().is_err() {
            return Direction::Indefinite;
        }
        // A projected matrix is too stiff somewhere: a small correction by it need not be near a minimum.
        self.at_hand = (psd == Psd::Exact).then_some(weights);
        self.solved_by = None;
        if let Some(factor) = self.linear.factor() {
            factor.solve(&mut self.direction);
        }
        Direction::Descent
    }

    /// Subtracts the forces in `solution` from the right-hand side in `direction` at free coordinates.
    fn subtract_from_direction(&mut self, system: &System, weights: Weights) {
        let forces = self.direction.iter_mut().zip(&self.solution).zip(system.inverse_mass());
        for ((right, force), _) in forces.filter(|(_, inverse_mass)| **inverse_mass != 0.0) {
            *right -= weights.stiffness * force;
        }
    }

    /// Conjugate gradients with products of the exact Hessian, without a preconditioner.
    fn matrix_free(&mut self, system: &mut System, weights: Weights, x: &[f64]) -> Direction {
        let right = std::mem::take(&mut self.direction);
        let mut solution = std::mem::take(&mut self.solution);
        let stop = system.stop();
        let held: Vec<bool> = system.inverse_mass().iter().map(|w| *w == 0.0).collect();
        let (velocity, mut damped) = (&self.velocity, vec![0.0; x.len()]);
        // Product with stiffness, damping and inertia; identity at constrained coordinates.
        let product = |p: &[f64], q: &mut [f64]| {
            system.hessian_product(x, p, q);
            if system.is_damped() {
                system.damping_product(x, velocity, p, &mut damped);
                let factor = weights.damping / weights.stiffness;
                q.iter_mut().zip(&damped).for_each(|(q, c)| *q += factor * c);
            }
            let d = system.dimension();
            for i in 0..q.len() {
                q[i] = if held[i] {
                    p[i]
                } else {
                    weights.stiffness * q[i] + weights.inertia * system.mass()[i / d] * p[i]
                };
            }
        };
        let iterations = 10 * right.len() as u64 + 1000;
        self.cg.set_stop(stop);
        let report = self.cg.solve::<D>(
            product,
            &mut NoPreconditioner,
            &right,
            &mut solution,
            CG_TOLERANCE,
            iterations,
        );
        (self.direction, self.solution) = (solution, right);
        self.work.cg_iterations += report.iterations;
        match report.end {
            CgEnd::Converged => Direction::Descent,
            // No element eigenvalues can be removed here.
            CgEnd::Indefinite => Direction::Truncated,
            CgEnd::Stalled | CgEnd::Stopped => Direction::Failed,
        }
    }
}
