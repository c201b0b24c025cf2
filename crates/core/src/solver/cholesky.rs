//! Sparse Cholesky factorisation of block matrices in nested-dissection order, with reusable symbolic
//! analysis.

use pliant_sparse::CholeskyStructure;

pub use pliant_sparse::NotPositiveDefinite;

use super::block_matrix::BlockMatrix;
use super::ordering::nested_dissection;

/// Cholesky factor `A = L L^T`.
pub struct Cholesky(pliant_sparse::SparseCholesky);

/// Computes the structure of the factor of `matrix`, whose vertices are at `x` (flat), before its entries
/// are allocated. `None` if not even that fits memory.
pub fn structure<const D: usize>(matrix: &BlockMatrix<D>, x: &[f64]) -> Option<CholeskyStructure> {
    let n = matrix.rows() * D;
    // Half of the off-diagonal blocks, and the lower half of the diagonal ones.
    let beside = (matrix.column.len() - matrix.rows()) / 2;
    let entries = beside * D * D + matrix.rows() * D * (D + 1) / 2;
    let (mut column_start, mut row) = (Vec::with_capacity(n + 1), Vec::with_capacity(entries));
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
    let order: Vec<usize> = order.iter().flat_map(|v| (0..D).map(move |k| *v as usize * D + k)).collect();
    CholeskyStructure::new(column_start, row, &order)
}

/// Writes the lower triangle of `matrix` by columns, which is its upper one by rows.
fn read<const D: usize>(matrix: &BlockMatrix<D>, entries: &mut [f64]) {
    let mut next = entries.iter_mut();
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
}

impl Cholesky {
    /// Analyses the structure of `matrix`, whose vertices are at `x` (flat). `None` if the factor would
    /// not fit memory.
    pub fn new<const D: usize>(matrix: &BlockMatrix<D>, x: &[f64]) -> Option<Self> {
        pliant_sparse::SparseCholesky::new(structure(matrix, x)?).map(Cholesky)
    }

    /// Analyses a matrix of another structure, reusing the memory of this one, whose structure is freed
    /// first.
    pub fn analyse_again<const D: usize>(self, matrix: &BlockMatrix<D>, x: &[f64]) -> Option<Self> {
        let memory = self.0.into_memory();
        pliant_sparse::SparseCholesky::in_memory_of(memory, structure(matrix, x)?).map(Cholesky)
    }

    /// Factorises `matrix`, which must have the analysed structure.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] if it is not positive definite.
    pub fn factorize<const D: usize>(&mut self, matrix: &BlockMatrix<D>) -> Result<(), NotPositiveDefinite> {
        read(matrix, self.0.entries_mut());
        self.0.factorize()
    }

    /// Solves `A x = b` with the last factor in place: `b` becomes `x`.
    pub fn solve(&mut self, b: &mut [f64]) {
        self.0.solve(b);
    }

    /// Returns the number of negative eigenvalues of `matrix`, which must have the analysed structure.
    /// `None` if a pivot vanishes or the factor does not fit memory.
    pub fn negative_eigenvalues<const D: usize>(&self, matrix: &BlockMatrix<D>) -> Option<usize> {
        let mut entries = vec![0.0; self.0.structure().entries()];
        read(matrix, &mut entries);
        self.0.structure().negative_eigenvalues(&entries)
    }

    /// Returns the number of factor entries.
    pub fn factor_entries(&self) -> usize {
        self.0.structure().factor_entries()
    }
}
