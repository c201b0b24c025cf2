//! Exact tangents of statics, definite or not, for path following (continuation).

use super::hessian::{Assembler, At, Weights};
use super::lu::BlockLu;
use crate::material::Psd;
use crate::system::System;

/// Factorises the exact Hessian `d2E/dx2` of a system, which may be indefinite, and solves with it.
///
/// Uses LU with partial pivoting: beyond a limit point the Hessian has no Cholesky factor, and a
/// projected Hessian is not the tangent of the path.
pub(crate) trait ExactTangent: Send + Sync {
    /// Factorises the Hessian at `x`, flat [m]. Returns false if it is exactly singular or not finite, or
    /// if its factors do not fit memory.
    fn factorize(&mut self, system: &mut System, x: &[f64]) -> bool;

    /// Solves in place with the last factorisation: `b` [N] becomes the solution [m]. Zero stays zero at
    /// constrained coordinates.
    fn solve(&self, b: &mut [f64]);
}

/// Creates a tangent for systems of `dimension` coordinates per vertex.
pub(crate) fn exact_tangent(dimension: usize) -> Box<dyn ExactTangent> {
    match dimension {
        1 => Box::new(SparseTangent::<1>::default()),
        2 => Box::new(SparseTangent::<2>::default()),
        _ => Box::new(SparseTangent::<3>::default()),
    }
}

#[derive(Default)]
struct SparseTangent<const D: usize> {
    assembler: Option<Assembler<D>>,
    lu: BlockLu,
}

impl<const D: usize> ExactTangent for SparseTangent<D> {
    fn factorize(&mut self, system: &mut System, x: &[f64]) -> bool {
        // Rebuild structures if the system has changed.
        if !self.assembler.as_ref().is_some_and(|assembler| assembler.fits(system)) {
            (self.assembler, self.lu) = (Some(Assembler::new(system)), BlockLu::default());
        }
        let Some(assembler) = &mut self.assembler else { return false };
        let weights = Weights { inertia: 0.0, stiffness: 1.0, damping: 0.0 };
        assembler.assemble(system, At { x, v: &[], psd: Psd::Exact, predicted_from: None }, weights);
        self.lu.factorize(assembler.matrix(), assembler.pattern())
    }

    fn solve(&self, b: &mut [f64]) {
        self.lu.solve(b);
    }
}
