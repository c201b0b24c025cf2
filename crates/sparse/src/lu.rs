//! Sparse LU factorisation with partial pivoting.

use faer::MatMut;
use faer::linalg::solvers::Solve;
use faer::sparse::linalg::{lu, solvers};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};

use crate::CholeskyStructure;

/// Size of both factors and of the held updates, in Cholesky factors of the same order, halved.
const ADDED: f64 = 1.55;
/// The same where damping joins the stages.
const ADDED_BY_DAMPING: f64 = 2.0;

/// Structure of a square matrix by columns, and the order in which they are eliminated.
pub struct SymbolicLu {
    column_start: Vec<usize>,
    row: Vec<usize>,
    symbolic: solvers::SymbolicLu<usize>,
}

/// `A = P L U Q`.
pub struct Lu(solvers::Lu<usize, f64>);

impl SymbolicLu {
    /// Analyses a square matrix with entries in rows `row[column_start[j]..column_start[j + 1]]` of column
    /// `j`, ascending. `None` where the structure of the factors does not fit memory.
    ///
    /// # Panics
    /// If `column_start` and `row` are not the structure of a square matrix.
    pub fn new(column_start: Vec<usize>, row: Vec<usize>) -> Option<Self> {
        let n = column_start.len() - 1;
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &column_start, None, &row);
        let symbolic = solvers::SymbolicLu::try_new(pattern).ok()?;
        Some(SymbolicLu { column_start, row, symbolic })
    }

    /// Place of the entry in `row` of `column` among the entries; `None` where it is zero.
    pub fn entry(&self, row: usize, column: usize) -> Option<usize> {
        let start = self.column_start[column];
        let rows = &self.row[start..self.column_start[column + 1]];
        rows.binary_search(&row).ok().map(|at| start + at)
    }

    /// Entries of the matrix.
    pub fn entries(&self) -> usize {
        self.row.len()
    }

    /// Bytes of the structure of the matrix.
    pub fn bytes(&self) -> usize {
        8 * (self.column_start.len() + self.row.len())
    }

    /// Bytes that a factorisation is expected to take: the matrix and its transpose, both factors, and the
    /// updates held for later columns. An estimate: a Cholesky factor in the order of the columns, twice,
    /// times
    /// a measured constant for row exchanges and updates. With two or three unknowns a vertex and stage,
    /// meshes
    /// of 400 to 15,000 vertices took within 10 % of it where stages meet in masses alone, and within 25 %
    /// where they are `coupled` by damping. `None` where the structure does not fit memory.
    pub fn factor_bytes(&self, coupled: bool) -> Option<usize> {
        let pattern = self.pattern();
        let symbolic = lu::factorize_symbolic_lu(pattern, Default::default()).ok()?;
        let (mut start, mut row) = (vec![0], vec![]);
        for (column, from) in self.column_start.windows(2).enumerate() {
            row.extend(self.row[from[0]..from[1]].iter().copied().filter(|row| *row >= column));
            start.push(row.len());
        }
        let factor = CholeskyStructure::new(start, row, symbolic.col_perm().arrays().0)?;
        let added = if coupled { ADDED_BY_DAMPING } else { ADDED };
        let factors = added * 2.0 * 8.0 * factor.factor_entries() as f64;
        Some(factors as usize + 4 * 16 * self.row.len())
    }

    fn pattern(&self) -> SymbolicSparseColMatRef<'_, usize> {
        let n = self.column_start.len() - 1;
        SymbolicSparseColMatRef::new_checked(n, n, &self.column_start, None, &self.row)
    }

    /// Factorises the matrix with these entries, column by column; `None` where it is singular, or its
    /// factors do not fit memory.
    ///
    /// # Panics
    /// If there are more or fewer than [`entries`](Self::entries).
    pub fn factorize(&self, entries: &[f64]) -> Option<Lu> {
        let matrix = SparseColMatRef::new(self.pattern(), entries);
        solvers::Lu::try_new_with_symbolic(self.symbolic.clone(), matrix).ok().map(Lu)
    }
}

impl Lu {
    /// Solves `A x = b`; `b` is overwritten by `x`.
    ///
    /// # Panics
    /// If `b` has not a number for each row.
    pub fn solve(&self, b: &mut [f64]) {
        let n = b.len();
        self.0.solve_in_place(MatMut::from_column_major_slice_mut(b, n, 1));
    }
}

#[cfg(test)]
mod tests {
    use super::SymbolicLu;

    /// `[0 2; 3 1]` needs a pivot that is not on the diagonal.
    #[test]
    fn rows_are_exchanged_where_a_pivot_is_zero() {
        let symbolic = SymbolicLu::new(vec![0, 1, 3], vec![1, 0, 1]).unwrap();
        assert_eq!((symbolic.entry(0, 0), symbolic.entry(1, 1)), (None, Some(2)));
        let mut b = [4.0, 5.0];
        symbolic.factorize(&[3.0, 2.0, 1.0]).unwrap().solve(&mut b);
        assert!((b[0] - 1.0).abs() < 1e-15 && (b[1] - 2.0).abs() < 1e-15, "{b:?}");
    }
}
