//! Coarsest multigrid level, solved directly by sparse Cholesky.

use super::smoother::Row;
use crate::solver::block_matrix::BlockMatrix;
use crate::solver::cholesky::{Cholesky, NotPositiveDefinite};

/// A factorisation with its vectors.
pub(super) struct Coarsest<const D: usize> {
    factor: Cholesky,
    /// Right-hand side, then solution.
    pub(super) x: Vec<Row>,
    flat: Vec<f64>,
    /// Scale of the solution.
    scale: f64,
}

impl<const D: usize> Coarsest<D> {
    /// Analyses matrices of this structure, with rows at `positions` (flat). `None` if the factor would
    /// not fit memory.
    pub(super) fn new(matrix: &BlockMatrix<D>, positions: &[f64]) -> Option<Self> {
        let (factor, rows) = (Cholesky::new(matrix, positions)?, matrix.rows());
        Some(Coarsest { factor, x: vec![[0.0; 4]; rows], flat: vec![0.0; rows * D], scale: 1.0 })
    }

    /// Factorises `matrix`; solutions are those of `scale * matrix`.
    pub(super) fn set(&mut self, matrix: &BlockMatrix<D>, scale: f64) -> Result<(), NotPositiveDefinite> {
        self.scale = 1.0 / scale;
        self.factor.factorize(matrix)
    }

    /// Solves in place for the right-hand side in `x`.
    pub(super) fn solve(&mut self) {
        let Coarsest { factor, x, flat, scale } = self;
        for (flat, x) in flat.as_chunks_mut::<D>().0.iter_mut().zip(&*x) {
            (0..D).for_each(|k| flat[k] = f64::from(x[k]));
        }
        factor.solve(flat);
        for (flat, x) in flat.as_chunks::<D>().0.iter().zip(x) {
            (0..D).for_each(|k| x[k] = (*scale * flat[k]) as f32);
        }
    }

    /// Computes `z = A^-1 r` in double precision.
    pub(super) fn solve_flat(&mut self, r: &[f64], z: &mut [f64]) {
        z.copy_from_slice(r);
        self.factor.solve(z);
    }

    pub(super) fn rows(&self) -> usize {
        self.x.len()
    }
}
