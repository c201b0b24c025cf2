//! Preconditioned conjugate gradients for the matrices of Newton's method, and when their preconditioner is
//! computed anew.

use super::block_matrix::BlockMatrix;
use super::conjugate_gradients::{
    self, BlockJacobi, CgEnd, CgReport, CgTolerance, ConjugateGradients, Preconditioner,
};
use super::hessian::{Assembler, Weights};
use super::multigrid::Multigrid;
use super::subspace::{Corrected, Subspace};
use crate::deadline::Stop;
use crate::material::Psd;

/// The smallest relative residual that is asked of conjugate gradients.
pub(super) const CG_TOLERANCE: f64 = 1e-6;
/// Iterations with multigrid before a factorisation takes over: a V-cycle costs some ten products, so this
/// many cost more.
const MULTIGRID_ITERATIONS: u64 = 300;
/// The levels are computed anew where a solve takes so many times the iterations that the first solve with
/// them lets expect, and one more.
const WORN_OUT: f64 = 1.2;

/// Iterations that solves with an allowance may have left for later ones, in those of one; as many are there
/// at the beginning, and after a solve that did without.
const MOST_LEFT: u64 = 3;

/// A matrix, its part whose structure stays, and the version of its pattern.
#[derive(Clone, Copy)]
pub(super) struct AssembledMatrix<'a, const D: usize> {
    pub(super) whole: &'a BlockMatrix<D>,
    pub(super) fixed: &'a BlockMatrix<D>,
    pub(super) pattern: u64,
}

impl<'a, const D: usize> AssembledMatrix<'a, D> {
    /// The matrices last assembled.
    pub(super) fn of(assembler: &'a Assembler<D>) -> Self {
        AssembledMatrix { whole: assembler.matrix(), fixed: assembler.fixed(), pattern: assembler.pattern() }
    }
}

/// Conjugate gradients with a preconditioner, kept from one matrix to the next.
pub(super) struct Iterative<const D: usize> {
    kind: PreconditionerKind<D>,
    cg: ConjugateGradients,
}

enum PreconditionerKind<const D: usize> {
    /// Computed anew for every matrix; with the iterations that a solve may take, where they are limited.
    Jacobi(BlockJacobi<D>, Option<Allowance>),
    /// Computed anew where it no longer fits.
    Multigrid {
        levels: Box<Multigrid<D>>,
        /// Vertices of stencils that change, which the levels do not see.
        subspace: Box<Subspace<D>>,
        made_for: Option<(Weights, Psd, u64)>,
        /// Iterations of the first solve for each factor `e` of the residual.
        first_rate: Option<f64>,
    },
}

/// Iterations that a solve may take: what each may in the mean, and what those before it have left.
#[derive(Clone, Copy, Debug)]
struct Allowance {
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

    fn spend(&mut self, report: &CgReport) {
        let left = if report.end == CgEnd::Converged { self.most() - report.iterations } else { u64::MAX };
        self.left = left.min(MOST_LEFT * self.each);
    }
}

impl<const D: usize> Iterative<D> {
    /// With the inverse diagonal blocks, for at most so many iterations a solve in the mean.
    pub(super) fn jacobi(each: Option<u64>) -> Self {
        Iterative {
            kind: PreconditionerKind::Jacobi(BlockJacobi::default(), each.map(Allowance::new)),
            cg: ConjugateGradients::default(),
        }
    }

    /// Arguments and result as those of [`Multigrid::until`].
    pub(super) fn multigrid(matrix: &BlockMatrix<D>, x: &[f64], held: &[bool], stop: &Stop) -> Option<Self> {
        let levels = Box::new(Multigrid::until(matrix, x, held, stop)?);
        let subspace = Box::new(Subspace::new());
        let kind = PreconditionerKind::Multigrid { levels, subspace, made_for: None, first_rate: None };
        Some(Iterative { kind, cg: ConjugateGradients::default() })
    }

    /// Ends solves while the flag is set.
    pub(super) fn set_stop(&mut self, stop: Stop) {
        self.cg.set_stop(stop);
    }

    /// Solves `whole solution = right` to a `tolerance`; the matrix was made with these
    /// weights and this treatment of elements, for vertices at `x`, flat [m].
    pub(super) fn solve(
        &mut self,
        AssembledMatrix { whole: matrix, fixed, pattern }: AssembledMatrix<'_, D>,
        (weights, psd, x): (Weights, Psd, &[f64]),
        right: &[f64],
        solution: &mut [f64],
        tolerance: CgTolerance,
    ) -> CgReport {
        let indefinite = CgReport { end: CgEnd::Indefinite, iterations: 0, relative_residual: 1.0 };
        let mut corrected;
        let (preconditioner, most): (&mut dyn Preconditioner<D>, u64) = match &mut self.kind {
            PreconditionerKind::Jacobi(jacobi, allowance) => {
                if jacobi.update(matrix).is_err() {
                    return indefinite;
                }
                (jacobi, allowance.map_or(10 * right.len() as u64 + 1000, |allowance| allowance.most()))
            }
            PreconditionerKind::Multigrid { levels, subspace, made_for, first_rate } => {
                let of = Some((weights, psd, pattern));
                if *made_for != of {
                    (*made_for, *first_rate) = (None, None);
                    if levels.update_parts(fixed, matrix, pattern).is_err() {
                        return indefinite;
                    }
                    *made_for = of;
                }
                match subspace.update(matrix, fixed, (pattern, x)) {
                    Ok(false) => (&mut **levels, MULTIGRID_ITERATIONS),
                    Ok(true) => {
                        corrected = Corrected { matrix, subspace, inner: &mut **levels };
                        (&mut corrected, MULTIGRID_ITERATIONS)
                    }
                    Err(_) => return indefinite,
                }
            }
        };
        let product = |p: &[f64], q: &mut [f64]| matrix.multiply(p, q);
        let report = self.cg.solve(product, preconditioner, right, solution, tolerance, most);
        match &mut self.kind {
            PreconditionerKind::Jacobi(_, allowance) => {
                allowance.iter_mut().for_each(|allowance| allowance.spend(&report));
            }
            PreconditionerKind::Multigrid { made_for, first_rate, .. } => {
                let (count, gained) = (report.iterations as f64, -report.relative_residual.ln());
                let first = *first_rate.get_or_insert(count / gained);
                let worn_out = count > WORN_OUT * first * gained + 1.0;
                if worn_out || report.end != CgEnd::Converged {
                    *made_for = None;
                }
            }
        }
        report
    }

    /// Bytes that one with the diagonal blocks of `matrix` as its preconditioner holds.
    pub(super) fn jacobi_bytes(matrix: &BlockMatrix<D>) -> usize {
        8 * matrix.rows() * D * D + conjugate_gradients::bytes(matrix.rows() * D)
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let preconditioner = match &self.kind {
            PreconditionerKind::Jacobi(jacobi, _) => jacobi.bytes(),
            PreconditionerKind::Multigrid { levels, subspace, .. } => levels.bytes() + subspace.bytes(),
        };
        self.cg.bytes() + preconditioner
    }
}
