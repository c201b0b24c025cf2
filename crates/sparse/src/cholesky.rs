//! Sparse Cholesky factorisation with a given elimination order; the symbolic part is kept.

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

/// Structure of a symmetric matrix and of its factor, without their entries.
pub struct CholeskyStructure {
    /// Lower triangle by columns; by symmetry the upper one by rows.
    column_start: Vec<usize>,
    row: Vec<usize>,
    symbolic: SymbolicCholesky<usize>,
    /// Workspace of the factorisation, in addition to the factor.
    scratch: StackReq,
}

/// Error: the matrix is not positive definite, a pivot is not positive or is NaN.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the matrix is not positive definite")]
pub struct NotPositiveDefinite;

impl CholeskyStructure {
    /// Analyses a symmetric matrix of `n` rows. The lower triangle of column `j` has entries in rows
    /// `row[column_start[j]..column_start[j + 1]]`, ascending. Row `order[k]` is eliminated `k`-th.
    /// `None` if the structure of the factor does not fit into memory.
    ///
    /// # Panics
    /// If `column_start` and `row` are not the structure of a matrix, or `order` is not a permutation of
    /// its rows.
    pub fn new(column_start: Vec<usize>, row: Vec<usize>, order: &[usize]) -> Option<Self> {
        let n = column_start.len() - 1;
        let mut inverse = vec![0; n];
        order.iter().enumerate().for_each(|(k, v)| inverse[*v] = k);
        let symbolic = factorize_symbolic_cholesky(
            SymbolicSparseColMatRef::new_checked(n, n, &column_start, None, &row),
            Side::Lower,
            SymmetricOrdering::Custom(PermRef::new_checked(order, &inverse, n)),
            CholeskySymbolicParams::default(),
        )
        .ok()?;
        let numeric = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let scratch = numeric.or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        Some(CholeskyStructure { column_start, row, symbolic, scratch })
    }

    /// Estimates the memory of a [`SparseCholesky`] with this structure [bytes]: the matrix, the factor, and
    /// the memory to compute in.
    pub fn bytes(&self) -> usize {
        8 * (2 * self.row.len() + self.symbolic.len_val()) + self.scratch.unaligned_bytes_required()
    }

    /// Number of entries in the lower triangle of the matrix.
    pub fn entries(&self) -> usize {
        self.row.len()
    }

    /// Number of entries of the factor.
    pub fn factor_entries(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Counts the negative eigenvalues of the matrix with these entries of its lower triangle: the
    /// negative pivots of `L D L^T`, by Sylvester's law of inertia. `None` if a pivot vanishes, or the
    /// factor does not fit into memory.
    ///
    /// # Panics
    /// If their number is not [`entries`](Self::entries).
    pub fn negative_eigenvalues(&self, entries: &[f64]) -> Option<usize> {
        let scratch = self.symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(scratch).ok()?;
        let mut factor = zeros(vec![], self.symbolic.len_val())?;
        let a = SparseColMatRef::new(self.pattern(), entries);
        let stack = MemStack::new(&mut memory);
        let no_help = LdltRegularization::default();
        self.symbolic
            .factorize_numeric_ldlt(&mut factor, a, Side::Lower, no_help, Par::Seq, stack, Default::default())
            .ok()?;
        let pivots = self.pivots();
        let sound = |at: &usize| factor[*at] != 0.0 && factor[*at].is_finite();
        pivots.iter().all(sound).then(|| pivots.iter().filter(|at| factor[**at] < 0.0).count())
    }

    fn pattern(&self) -> SymbolicSparseColMatRef<'_, usize> {
        let n = self.column_start.len() - 1;
        SymbolicSparseColMatRef::new_checked(n, n, &self.column_start, None, &self.row)
    }

    /// Indices of the diagonal in the entries of the factor.
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
}

/// Memory of a factorisation for reuse by the next one.
///
/// Structures that keep changing have factors of ever different sizes. Allocating each anew leaves the
/// allocator with holes that fit none of those to come.
#[derive(Default)]
pub struct FactorMemory {
    entries: Vec<f64>,
    factor: Vec<f64>,
}

/// Sparse Cholesky factorisation `A = L L^T`.
pub struct SparseCholesky {
    structure: CholeskyStructure,
    entries: Vec<f64>,
    factor: Vec<f64>,
    memory: MemBuffer,
}

impl SparseCholesky {
    /// Allocates a matrix of this structure and its factor; `None` if memory is insufficient.
    pub fn new(structure: CholeskyStructure) -> Option<Self> {
        Self::in_memory_of(FactorMemory::default(), structure)
    }

    /// Allocates a matrix of this structure and its factor, reusing `last` if it is large enough; `None`
    /// if memory is insufficient.
    pub fn in_memory_of(last: FactorMemory, structure: CholeskyStructure) -> Option<Self> {
        let entries = zeros(last.entries, structure.row.len())?;
        let factor = zeros(last.factor, structure.symbolic.len_val())?;
        let memory = MemBuffer::try_new(structure.scratch).ok()?;
        Some(SparseCholesky { structure, entries, factor, memory })
    }

    /// Returns the memory of the matrix and its factor, without their structure.
    pub fn into_memory(self) -> FactorMemory {
        FactorMemory { entries: self.entries, factor: self.factor }
    }

    /// Structure of the matrix and of its factor.
    pub fn structure(&self) -> &CholeskyStructure {
        &self.structure
    }

    /// Entries of the lower triangle of the matrix, column by column, for [`factorize`](Self::factorize).
    pub fn entries_mut(&mut self) -> &mut [f64] {
        &mut self.entries
    }

    /// Factorises the matrix of the present entries.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`]; no factor is available then.
    pub fn factorize(&mut self) -> Result<(), NotPositiveDefinite> {
        let a = SparseColMatRef::new(self.structure.pattern(), &self.entries);
        let stack = MemStack::new(&mut self.memory);
        let no_help =
            LltRegularization { dynamic_regularization_delta: 0.0, dynamic_regularization_epsilon: 0.0 };
        let factor = &mut self.factor;
        self.structure
            .symbolic
            .factorize_numeric_llt(factor, a, Side::Lower, no_help, Par::Seq, stack, Default::default())
            .map(|_| ())
            .map_err(|_| NotPositiveDefinite)
    }

    /// Solves `A x = b` with the factor last computed; `b` is overwritten by `x`.
    ///
    /// # Panics
    /// If the length of `b` is not the number of rows.
    pub fn solve(&mut self, b: &mut [f64]) {
        let llt = LltRef::new(&self.structure.symbolic, &self.factor);
        let n = b.len();
        let stack = MemStack::new(&mut self.memory);
        llt.solve_in_place_with_conj(Conj::No, MatMut::from_column_major_slice_mut(b, n, 1), Par::Seq, stack);
    }
}

/// Zeros, in the memory of `numbers` if it is large enough; `None` if they do not fit into memory.
fn zeros(mut numbers: Vec<f64>, count: usize) -> Option<Vec<f64>> {
    numbers.clear();
    if numbers.capacity() < count {
        // Freed first: its content need not be copied.
        numbers = Vec::new();
        numbers.try_reserve_exact(count).ok()?;
    }
    numbers.resize(count, 0.0);
    Some(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn structure() -> CholeskyStructure {
        chain(40)
    }

    /// Structure of `tridiag(-1, diagonal, -1)` with `n` rows, eliminated from both ends to the middle.
    fn chain(n: usize) -> CholeskyStructure {
        let column_start: Vec<usize> = (0..=n).map(|j| if j == n { 2 * n - 1 } else { 2 * j }).collect();
        let row = (0..n).flat_map(|j| [j, j + 1]).filter(|i| *i < n).collect();
        let order: Vec<usize> = (0..n).map(|k| if k % 2 == 0 { k / 2 } else { n - 1 - k / 2 }).collect();
        CholeskyStructure::new(column_start, row, &order).unwrap()
    }

    fn entries(structure: &CholeskyStructure, diagonal: f64) -> Vec<f64> {
        (0..structure.entries()).map(|k| if k % 2 == 0 { diagonal } else { -1.0 }).collect()
    }

    /// `A 1` is 1 at both ends and 0 between them, for `diagonal = 2`.
    #[test]
    fn a_chain_is_solved_and_one_that_buckles_is_not() {
        let mut cholesky = SparseCholesky::new(structure()).unwrap();
        let of = |diagonal| entries(&structure(), diagonal);
        cholesky.entries_mut().copy_from_slice(&of(2.0));
        cholesky.factorize().unwrap();
        let mut b = vec![0.0; 40];
        (b[0], b[39]) = (1.0, 1.0);
        cholesky.solve(&mut b);
        // The condition number is 4 / (pi / 41)^2 = 680.
        assert!(b.iter().all(|x| (x - 1.0).abs() < 680.0 * 40.0 * f64::EPSILON), "{b:?}");
        cholesky.entries_mut().copy_from_slice(&of(1.9));
        assert_eq!(cholesky.factorize(), Err(NotPositiveDefinite));
        cholesky.entries_mut().copy_from_slice(&of(f64::NAN));
        assert_eq!(cholesky.factorize(), Err(NotPositiveDefinite));
    }

    /// A shorter chain reuses the memory of a longer one, a longer one allocates: the factor is the same
    /// as without reuse.
    #[test]
    fn another_structure_is_factorised_in_the_memory_of_the_last() {
        let factorised = |n: usize, last: FactorMemory| {
            let mut cholesky = SparseCholesky::in_memory_of(last, chain(n)).unwrap();
            let of_chain = entries(cholesky.structure(), 2.0);
            cholesky.entries_mut().copy_from_slice(&of_chain);
            cholesky.factorize().unwrap();
            cholesky
        };
        let mut last = factorised(40, FactorMemory::default());
        for n in [24, 40, 80] {
            let before = last.factor.as_ptr();
            last = factorised(n, last.into_memory());
            assert_eq!(last.factor.as_ptr() == before, n <= 40, "{n}");
            assert_eq!(last.factor, factorised(n, FactorMemory::default()).factor, "{n}");
        }
    }

    /// Eigenvalues are `diagonal - 2 cos(j pi / 41)`: negative up to `j < 41/pi acos(diagonal / 2)`.
    #[test]
    fn negative_pivots_count_negative_eigenvalues() {
        let structure = structure();
        for diagonal in [2.1_f64, 1.9, 1.03, 0.1, -1.03] {
            let negative =
                (1..=40).filter(|j| diagonal < 2.0 * (f64::from(*j) * std::f64::consts::PI / 41.0).cos());
            let counted = structure.negative_eigenvalues(&entries(&structure, diagonal));
            assert_eq!(counted, Some(negative.count()), "{diagonal}");
        }
        // The pivot of the neighbour of an end is 1 - 1 / 1.
        assert_eq!(structure.negative_eigenvalues(&entries(&structure, 1.0)), None);
        assert_eq!(structure.negative_eigenvalues(&entries(&structure, f64::NAN)), None);
    }
}
