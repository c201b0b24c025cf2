//! Preconditioned conjugate gradients for the matrices of implicit steps, with the policy for updating the
//! preconditioner.

use super::block_matrix::BlockMatrix;
use super::conjugate_gradients::{CgEnd, CgReport, CgTolerance, ConjugateGradients, Preconditioner};
use super::gauss_seidel::GaussSeidel;
use super::hessian::{Assembler, Weights};
use super::multigrid::Multigrid;
use super::subspace::{Corrected, Subspace};
use crate::deadline::Stop;
use crate::material::Psd;

/// Smallest relative residual required of conjugate gradients.
pub(super) const CG_TOLERANCE: f64 = 1e-6;
/// Multigrid iterations before a factorisation takes over: a V-cycle costs some ten products, so that
/// more would cost more.
const MULTIGRID_ITERATIONS: u64 = 300;
/// The levels are recomputed if a solve takes this many times the iterations expected from the first
/// solve with them, plus one.
const WORN_OUT: f64 = 1.2;

/// Limit of the saved-up iterations, in allowances of one solve. The balance starts here, and returns
/// here after a solve that failed.
const MOST_LEFT: u64 = 3;

/// Minimum factor by which the allowance grows when it is raised; raising it ends a pause after failures.
const MANY_MORE: u64 = 2;
/// Cost of a multigrid cycle in iterations with symmetric Gauss-Seidel, which read the matrix once: 12 ms
/// and 3.5 ms on rings of 23,520 vertices in contact.
const CYCLE: f64 = 3.5;
/// Times that an iteration reads the subspace factor: two solves, each forward and backward.
const FACTOR_READS: f64 = 4.0;

/// A matrix, its part of fixed structure, and the versions of its pattern and entries.
#[derive(Clone, Copy)]
pub struct AssembledMatrix<'a, const D: usize> {
    pub(super) whole: &'a BlockMatrix<D>,
    fixed: &'a BlockMatrix<D>,
    pattern: u64,
    entries: u64,
}

impl<'a, const D: usize> AssembledMatrix<'a, D> {
    /// Returns the matrices last assembled.
    pub fn of(assembler: &'a Assembler<D>) -> Self {
        AssembledMatrix {
            whole: assembler.matrix(),
            fixed: assembler.fixed(),
            pattern: assembler.pattern(),
            entries: assembler.entries(),
        }
    }
}

/// Conjugate gradients with a preconditioner that is kept between matrices.
pub enum Iterative<const D: usize> {
    /// Symmetric Gauss-Seidel, updated for each matrix.
    GaussSeidel {
        /// Preconditioner and solver.
        sweeps: Box<GaussSeidel<D>>,
        /// Pattern and entry versions of the prepared matrix.
        made_for: Option<[u64; 2]>,
        /// Iteration allowance of a solve, if limited.
        allowance: Option<Allowance>,
    },
    /// Multigrid levels, recomputed when they no longer fit.
    Multigrid(Box<Levels<D>>),
}

/// Conjugate gradients with multigrid.
pub struct Levels<const D: usize> {
    levels: Multigrid<D>,
    /// Correction on the vertices of changing stencils, which the levels do not see.
    subspace: Subspace<D>,
    made_for: Option<(Weights, Psd, u64)>,
    /// Iterations of the first solve per factor `e` of residual reduction.
    first_rate: Option<f64>,
    cg: ConjugateGradients,
}

/// Iterations that a solve may take: an average per solve, plus what earlier ones have saved.
#[derive(Clone, Copy, Debug)]
pub struct Allowance {
    each: u64,
    left: u64,
}

impl Allowance {
    fn new(each: u64) -> Self {
        Allowance { each, left: MOST_LEFT * each }
    }

    fn most(&self) -> u64 {
        self.each + self.left
    }

    /// Raises the allowance per solve if it grows by at least the factor `MANY_MORE`; returns whether it
    /// did.
    fn raise(&mut self, each: u64) -> bool {
        let is_more = each >= MANY_MORE * self.each;
        if is_more {
            self.each = each;
        }
        is_more
    }

    fn spend(&mut self, report: &CgReport) {
        let left = if report.end == CgEnd::Converged { self.most() - report.iterations } else { u64::MAX };
        self.left = left.min(MOST_LEFT * self.each);
    }
}

impl<const D: usize> Iterative<D> {
    /// Creates one with symmetric Gauss-Seidel, for at most `each` iterations per solve on average.
    pub fn gauss_seidel(sweeps: GaussSeidel<D>, each: Option<u64>) -> Self {
        let allowance = each.map(Allowance::new);
        Iterative::GaussSeidel { sweeps: Box::new(sweeps), made_for: None, allowance }
    }

    /// Creates one with these multigrid levels.
    pub fn multigrid(levels: Multigrid<D>) -> Self {
        let levels = Levels {
            levels,
            subspace: Subspace::new(),
            made_for: None,
            first_rate: None,
            cg: ConjugateGradients::default(),
        };
        Iterative::Multigrid(Box::new(levels))
    }

    /// Returns the multigrid levels, if any.
    pub fn into_levels(self) -> Option<Multigrid<D>> {
        match self {
            Iterative::GaussSeidel { .. } => None,
            Iterative::Multigrid(levels) => Some(levels.levels),
        }
    }

    /// Sets the flag that ends solves.
    pub(super) fn set_stop(&mut self, stop: Stop) {
        match self {
            Iterative::GaussSeidel { sweeps, .. } => sweeps.set_stop(stop),
            Iterative::Multigrid(levels) => levels.cg.set_stop(stop),
        }
    }

    /// Solves `whole solution = right` to a tolerance, in a number of iterations at most that the solver's
    /// own limits may lower. `made` has the weights, the treatment of elements and the positions, flat [m],
    /// of the matrix.
    pub fn solve(
        &mut self,
        matrices: AssembledMatrix<'_, D>,
        made: (Weights, Psd, &[f64]),
        right: &[f64],
        solution: &mut [f64],
        (tolerance, most): (CgTolerance, u64),
    ) -> CgReport {
        match self {
            Iterative::GaussSeidel { sweeps, made_for, allowance } => {
                let of = Some([matrices.pattern, matrices.entries]);
                if *made_for != of {
                    *made_for = None;
                    if sweeps.update(matrices.whole, matrices.pattern).is_err() {
                        return INDEFINITE;
                    }
                    *made_for = of;
                }
                let own = allowance.map_or(10 * right.len() as u64 + 1000, |allowance| allowance.most());
                let report = sweeps.solve(right, solution, tolerance, own.min(most));
                allowance.iter_mut().for_each(|allowance| allowance.spend(&report));
                report
            }
            Iterative::Multigrid(levels) => levels.solve(matrices, made, right, solution, (tolerance, most)),
        }
    }

    /// Raises the allowance of iterations per solve, if limited and if it grows enough; returns whether
    /// it did.
    pub(super) fn raise_allowance(&mut self, each: f64) -> bool {
        match self {
            Iterative::GaussSeidel { allowance: Some(allowance), .. } => allowance.raise(each as u64),
            _ => false,
        }
    }

    /// Returns the cost of one iteration of the last solve with this matrix, in iterations with symmetric
    /// Gauss-Seidel.
    pub(super) fn cost_of_iteration(&self, matrix: &BlockMatrix<D>) -> f64 {
        match self {
            Iterative::GaussSeidel { .. } => 1.0,
            Iterative::Multigrid(levels) => {
                let entries = (D * D * matrix.value.len()) as f64;
                CYCLE + FACTOR_READS * levels.subspace.factor_entries() as f64 / entries
            }
        }
    }
}

/// Report for a matrix found not positive definite before the first iteration.
const INDEFINITE: CgReport = CgReport { end: CgEnd::Indefinite, iterations: 0, relative_residual: 1.0 };

impl<const D: usize> Levels<D> {
    /// Solves as [`Iterative::solve`] does.
    fn solve(
        &mut self,
        AssembledMatrix { whole: matrix, fixed, pattern, .. }: AssembledMatrix<'_, D>,
        (weights, psd, x): (Weights, Psd, &[f64]),
        right: &[f64],
        solution: &mut [f64],
        (tolerance, most): (CgTolerance, u64),
    ) -> CgReport {
        let Levels { levels, subspace, made_for, first_rate, cg } = self;
        // Recompute the levels if they were made for another matrix or have worn out.
        let of = Some((weights, psd, pattern));
        if *made_for != of {
            (*made_for, *first_rate) = (None, None);
            if levels.update_parts(fixed, matrix, pattern).is_err() {
                return INDEFINITE;
            }
            *made_for = of;
        }
        // Correct the preconditioner on the vertices of changing stencils, if there are any.
        let mut corrected;
        let preconditioner: &mut dyn Preconditioner<D> = match subspace.update(matrix, fixed, (pattern, x)) {
            Ok(false) => levels,
            Ok(true) => {
                corrected = Corrected { matrix, subspace, inner: levels };
                &mut corrected
            }
            Err(_) => return INDEFINITE,
        };
        let product = |p: &[f64], q: &mut [f64]| matrix.multiply(p, q);
        let most = most.min(MULTIGRID_ITERATIONS);
        let report = cg.solve(product, preconditioner, right, solution, tolerance, most);
        // Mark the levels as worn out if this solve took too many iterations.
        let (count, gained) = (report.iterations as f64, -libm::log(report.relative_residual));
        let first = *first_rate.get_or_insert(count / gained);
        let worn_out = count > WORN_OUT * first * gained + 1.0;
        if worn_out || report.end != CgEnd::Converged {
            *made_for = None;
        }
        report
    }
}
