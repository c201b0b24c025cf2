//! Sparse Cholesky factorisation by faer, on a nested-dissection order; the symbolic part is kept.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::ldlt::factor::LdltRegularization;
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use super::block_matrix::BlockMatrix;
use super::ordering::nested_dissection;

/// `A = L L^T`.
///
/// Sequential: faer's parallel factorisation does not give the same bits for any number of threads.
pub struct Cholesky {
    analysis: Analysis,
    entries: Vec<f64>,
    factor: Vec<f64>,
    memory: MemBuffer,
}

/// Structure of a matrix and of its factor, before there is memory for their entries.
pub struct Analysis {
    /// The lower triangle by columns; by symmetry the upper one by rows.
    column_start: Vec<usize>,
    row: Vec<usize>,
    symbolic: SymbolicCholesky<usize>,
    /// Memory of the factorisation beside the factor.
    scratch: StackReq,
}

/// The matrix is not positive definite: a pivot is not positive, or not a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotPositiveDefinite;

impl Analysis {
    /// Analyses the structure of `matrix`, whose vertices are at `x` (flat). `None` where not even that fits
    /// memory.
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
        let scratch = numeric.or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        Some(Analysis { column_start, row, symbolic, scratch })
    }

    /// Bytes that a [`Cholesky`] of this structure holds.
    pub fn bytes(&self) -> usize {
        let numbers = self.column_start.len() + 2 * self.row.len() + self.symbolic.len_val();
        8 * (numbers + self.indices()) + self.scratch.unaligned_bytes_required()
    }

    /// Entries of the factor.
    pub fn factor_entries(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Number of negative eigenvalues of `matrix`, which has the structure that was analysed: that of the
    /// negative pivots of `L D L^T`, by Sylvester's law of inertia. `None` where a pivot vanishes, or the
    /// factor does not fit memory.
    pub fn negative_eigenvalues<const D: usize>(&self, matrix: &BlockMatrix<D>) -> Option<usize> {
        let scratch = self.symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(scratch).ok()?;
        let (mut entries, mut factor) = (zeros(self.row.len())?, zeros(self.symbolic.len_val())?);
        self.read(matrix, &mut entries);
        let a = SparseColMatRef::new(self.structure(), &entries);
        let stack = MemStack::new(&mut memory);
        let no_help = LdltRegularization::default();
        self.symbolic
            .factorize_numeric_ldlt(&mut factor, a, Side::Lower, no_help, Par::Seq, stack, Default::default())
            .ok()?;
        let mut negative = 0;
        for at in self.pivots() {
            if factor[at] == 0.0 || !factor[at].is_finite() {
                return None;
            }
            negative += usize::from(factor[at] < 0.0);
        }
        Some(negative)
    }

    /// Writes the lower triangle of `matrix`.
    fn read<const D: usize>(&self, matrix: &BlockMatrix<D>, entries: &mut [f64]) {
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

    /// Places of the entries of the lower triangle.
    fn structure(&self) -> SymbolicSparseColMatRef<'_, usize> {
        let n = self.column_start.len() - 1;
        SymbolicSparseColMatRef::new_checked(n, n, &self.column_start, None, &self.row)
    }

    /// Places of the diagonal in the entries of the factor.
    fn pivots(&self) -> Vec<usize> {
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Simplicial(factor) => {
                let n = self.column_start.len() - 1;
                factor.factor().col_ptr()[..n].to_vec()
            }
            // Supernodes are dense columns of one length, the square of their own rows first.
            SymbolicCholeskyRaw::Supernodal(factor) => {
                let (begin, end) = (factor.supernode_begin(), factor.supernode_end());
                let of_node = |node: usize| {
                    let (start, columns) = (factor.col_ptr_for_val()[node], end[node] - begin[node]);
                    let rows = (factor.col_ptr_for_val()[node + 1] - start) / columns;
                    (0..columns).map(move |column| start + column * (rows + 1))
                };
                (0..factor.n_supernodes()).flat_map(of_node).collect()
            }
        }
    }

    /// Indices that the structure of the factor takes, and the permutation in both directions.
    fn indices(&self) -> usize {
        let n = self.column_start.len() - 1;
        2 * n
            + match self.symbolic.raw() {
                SymbolicCholeskyRaw::Simplicial(factor) => factor.row_idx().len() + 2 * n,
                // The rows of supernodes, by columns and by rows.
                SymbolicCholeskyRaw::Supernodal(factor) => {
                    2 * factor.row_idx().len() + 4 * factor.n_supernodes()
                }
            }
    }
}

impl Cholesky {
    /// Analyses the structure of `matrix`, whose vertices are at `x` (flat). `None` where the factor would
    /// not fit memory.
    pub fn new<const D: usize>(matrix: &BlockMatrix<D>, x: &[f64]) -> Option<Self> {
        let analysis = Analysis::new(matrix, x)?;
        let memory = MemBuffer::try_new(analysis.scratch).ok()?;
        let (entries, factor) = (zeros(analysis.row.len())?, zeros(analysis.symbolic.len_val())?);
        Some(Cholesky { analysis, entries, factor, memory })
    }

    /// Factorises `matrix`, which has the structure that was analysed.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`].
    pub fn factorize<const D: usize>(&mut self, matrix: &BlockMatrix<D>) -> Result<(), NotPositiveDefinite> {
        self.analysis.read(matrix, &mut self.entries);
        let a = SparseColMatRef::new(self.analysis.structure(), &self.entries);
        let stack = MemStack::new(&mut self.memory);
        let no_help =
            LltRegularization { dynamic_regularization_delta: 0.0, dynamic_regularization_epsilon: 0.0 };
        self.analysis
            .symbolic
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
        let llt = LltRef::new(&self.analysis.symbolic, &self.factor);
        let n = b.len();
        let stack = MemStack::new(&mut self.memory);
        llt.solve_in_place_with_conj(Conj::No, MatMut::from_column_major_slice_mut(b, n, 1), Par::Seq, stack);
    }

    /// Structure of the matrix and of the factor.
    pub fn analysis(&self) -> &Analysis {
        &self.analysis
    }

    /// Entries of the factor.
    pub fn factor_entries(&self) -> usize {
        self.factor.len()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.analysis.bytes()
    }
}

/// So many zeros; `None` where they do not fit memory.
fn zeros(count: usize) -> Option<Vec<f64>> {
    let mut zeros = Vec::new();
    zeros.try_reserve_exact(count).ok()?;
    zeros.resize(count, 0.0);
    Some(zeros)
}
