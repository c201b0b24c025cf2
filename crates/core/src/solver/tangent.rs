//! Exact tangents of statics, definite or not, for path following (continuation).

use pliant_sparse::{Lu, SymbolicLu};

use super::hessian::{Assembler, At, Weights};
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
    symbolic: Option<SymbolicLu>,
    entries: Vec<f64>,
    factor: Option<Lu>,
}

impl<const D: usize> ExactTangent for SparseTangent<D> {
    fn factorize(&mut self, system: &mut System, x: &[f64]) -> bool {
        self.factor = None;
        // Rebuild structures if the system has changed.
        if !self.assembler.as_ref().is_some_and(|assembler| assembler.fits(system)) {
            self.assembler = Some(Assembler::new(system));
            self.symbolic = None;
        }
        let SparseTangent { assembler, symbolic, entries, factor } = self;
        let Some(assembler) = assembler else { return false };
        let weights = Weights { inertia: 0.0, stiffness: 1.0, damping: 0.0 };
        assembler.assemble(system, At { x, v: &[], psd: Psd::Exact, predicted_from: None }, weights);
        let matrix = assembler.matrix();
        // Symbolic analysis of the scalar pattern.
        if symbolic.is_none() {
            let (mut start, mut row) = (vec![0], vec![]);
            for vertex in 0..matrix.rows() {
                for _ in 0..D {
                    row.extend(matrix.row(vertex).flat_map(|(c, _)| (0..D).map(move |l| c * D + l)));
                    start.push(row.len());
                }
            }
            *symbolic = SymbolicLu::new(start, row);
        }
        let Some(symbolic) = symbolic else { return false };
        // The matrix is symmetric: rows serve as columns.
        entries.clear();
        for vertex in 0..matrix.rows() {
            for k in 0..D {
                entries.extend(matrix.row(vertex).flat_map(|(_, block)| block[k]));
            }
        }
        if entries.iter().all(|entry| entry.is_finite()) {
            *factor = symbolic.factorize(entries);
        }
        factor.is_some()
    }

    fn solve(&self, b: &mut [f64]) {
        if let Some(factor) = &self.factor {
            factor.solve(b);
        }
    }
}
