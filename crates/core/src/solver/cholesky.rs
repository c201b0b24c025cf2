//! Sparse Cholesky factorisation by faer, on a nested-dissection order; the symbolic part is kept.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use super::block_matrix::BlockMatrix;
use super::ordering::nested_dissection;

/// `A = L L^T`.
///
/// Sequential: faer's parallel factorisation does not give the same bits for any number of threads.
pub struct Cholesky {
    /// The lower triangle by columns; by symmetry the upper one by rows.
    column_start: Vec<usize>,
    row: Vec<usize>,
    entries: Vec<f64>,
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    memory: MemBuffer,
}

/// The matrix is not positive definite: a pivot is not positive, or not a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotPositiveDefinite;

impl Cholesky {
    /// Analyses the structure of `matrix`, whose vertices are at `x` (flat). `None` where the factor would not fit memory.
    pub fn new<const D: usize>(matrix: &BlockMatrix<D>, x: &[f64]) -> Option<Self> {
        let n = matrix.rows() * D;
        let (mut column_start, mut row) = (Vec::with_capacity(n + 1), vec![]);
        column_start.push(0);
        for vertex in 0..matrix.rows() {
            for k in 0..D {
                for (c, _) in matrix.row(vertex) {
                    row.extend((0..D).map(|l| c * D + l).filter(|at| *at >= vertex * D + k));
                }
                column_start.push(row.len());
            }
        }
        let order = nested_dissection(matrix, x);
        let forward: Vec<usize> =
            order.iter().flat_map(|v| (0..D).map(move |k| *v as usize * D + k)).collect();
        let mut inverse = vec![0; n];
        forward.iter().enumerate().for_each(|(k, v)| inverse[*v] = k);
        let symbolic = factorize_symbolic_cholesky(
            SymbolicSparseColMatRef::new_checked(n, n, &column_start, None, &row),
            Side::Lower,
            SymmetricOrdering::Custom(PermRef::new_checked(&forward, &inverse, n)),
            CholeskySymbolicParams::default(),
        )
        .ok()?;
        let numeric = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let memory =
            MemBuffer::try_new(numeric.or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq))).ok()?;
        Some(Cholesky {
            entries: vec![0.0; row.len()],
            factor: vec![0.0; symbolic.len_val()],
            column_start,
            row,
            symbolic,
            memory,
        })
    }

    /// Factorises `matrix`, which has the structure that was analysed.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`].
    pub fn factorize<const D: usize>(&mut self, matrix: &BlockMatrix<D>) -> Result<(), NotPositiveDefinite> {
        let mut next = self.entries.iter_mut();
        for vertex in 0..matrix.rows() {
            for k in 0..D {
                for (c, block) in matrix.row(vertex) {
                    let from = if c < vertex {
                        D
                    } else if c == vertex {
                        k
                    } else {
                        0
                    };
                    for (entry, next) in block[k][from.min(D)..].iter().zip(&mut next) {
                        *next = *entry;
                    }
                }
            }
        }
        let n = self.column_start.len() - 1;
        let structure = SymbolicSparseColMatRef::new_checked(n, n, &self.column_start, None, &self.row);
        let a = SparseColMatRef::new(structure, &self.entries);
        let stack = MemStack::new(&mut self.memory);
        let no_help =
            LltRegularization { dynamic_regularization_delta: 0.0, dynamic_regularization_epsilon: 0.0 };
        self.symbolic
            .factorize_numeric_llt(
                &mut self.factor,
                a,
                Side::Lower,
                no_help,
                Par::Seq,
                stack,
                Default::default(),
            )
            .map(|_| ())
            .map_err(|_| NotPositiveDefinite)
    }

    /// Solves `A x = b` with the factor last computed; `b` is overwritten by `x`.
    pub fn solve(&mut self, b: &mut [f64]) {
        let llt = LltRef::new(&self.symbolic, &self.factor);
        let n = b.len();
        let stack = MemStack::new(&mut self.memory);
        llt.solve_in_place_with_conj(Conj::No, MatMut::from_column_major_slice_mut(b, n, 1), Par::Seq, stack);
    }

    /// Entries of the factor.
    pub fn factor_entries(&self) -> usize {
        self.factor.len()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        8 * (self.column_start.len() + self.row.len() + self.entries.len() + self.factor.len())
    }
}
