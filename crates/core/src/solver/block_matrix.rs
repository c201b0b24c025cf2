//! Symmetric sparse matrices of small dense blocks.

use rayon::prelude::*;

use crate::lanes::{Kernel, Lanes, dispatch_compact};

/// Rows per task; below twice as many, dispatch costs more than it saves.
const TASK_ROWS: usize = 1024;

/// A `D x D` block, by rows.
pub type Block<const D: usize> = [[f64; D]; D];

/// Symmetric matrix with one row of `D x D` blocks per vertex. Both triangles are stored row by row,
/// columns ascending; each row has its diagonal block.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BlockMatrix<const D: usize> {
    /// The blocks of row `i` are `row_start[i]..row_start[i + 1]`.
    pub row_start: Vec<u32>,
    /// Column of every block.
    pub column: Vec<u32>,
    /// The blocks.
    pub value: Vec<Block<D>>,
    /// Index of the diagonal block of every row.
    pub diagonal: Vec<u32>,
}

impl<const D: usize> BlockMatrix<D> {
    /// The zero matrix of this structure.
    ///
    /// # Panics
    /// If a row has no diagonal block.
    pub fn zero(row_start: Vec<u32>, column: Vec<u32>) -> Self {
        let find = |row: usize| {
            let blocks = row_start[row] as usize..row_start[row + 1] as usize;
            let at = column[blocks].binary_search(&(row as u32)).expect("every row has its diagonal block");
            row_start[row] + at as u32
        };
        let diagonal = (0..row_start.len() - 1).map(find).collect();
        BlockMatrix { value: vec![[[0.0; D]; D]; column.len()], diagonal, row_start, column }
    }

    /// Rows of blocks.
    pub fn rows(&self) -> usize {
        self.diagonal.len()
    }

    /// The blocks of row `i`, each with its column.
    #[inline(always)]
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, &Block<D>)> {
        let range = self.row_start[i] as usize..self.row_start[i + 1] as usize;
        self.column[range.clone()].iter().map(|c| *c as usize).zip(&self.value[range])
    }

    /// `y = A x`, both flat. The same bits on any number of threads.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        let (x, y) = (x.as_chunks::<D>().0, y.as_chunks_mut::<D>().0);
        if y.len() < 2 * TASK_ROWS || rayon::current_num_threads() == 1 {
            return dispatch_compact(Product { matrix: self, x, first: 0, y });
        }
        let tasks = y.par_chunks_mut(TASK_ROWS).enumerate();
        tasks.for_each(|(task, y)| {
            dispatch_compact(Product { matrix: self, x, first: task * TASK_ROWS, y });
        });
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        4 * (self.row_start.len() + self.column.len() + self.diagonal.len()) + size_of_val(&self.value[..])
    }
}

/// Rows of `A x` from `first` on.
struct Product<'a, const D: usize> {
    matrix: &'a BlockMatrix<D>,
    x: &'a [[f64; D]],
    first: usize,
    y: &'a mut [[f64; D]],
}

impl<const D: usize> Kernel for Product<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (i, y) in self.y.iter_mut().enumerate() {
            // One sum per entry of a block, so that they are independent.
            let mut sums = [[0.0; D]; D];
            for (c, block) in self.matrix.row(self.first + i) {
                let x = &self.x[c];
                for k in 0..D {
                    for l in 0..D {
                        sums[k][l] += block[k][l] * x[l];
                    }
                }
            }
            for k in 0..D {
                y[k] = sums[k][0];
                for l in 1..D {
                    y[k] += sums[k][l];
                }
            }
        }
    }
}
