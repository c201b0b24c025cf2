//! Sparse LU factors of symmetric block matrices that need not be positive definite.

use pliant_sparse::{Lu, SymbolicLu};

use super::block_matrix::BlockMatrix;

/// LU factors with partial pivoting of one matrix; the structure is kept from one matrix to the next.
#[derive(Default)]
pub struct BlockLu {
    /// Structure, with the version of its pattern.
    symbolic: Option<(SymbolicLu, u64)>,
    entries: Vec<f64>,
    factor: Option<Lu>,
}

impl BlockLu {
    /// Factorises a symmetric matrix, `pattern` the version of its pattern. Returns false if it is exactly
    /// singular or not finite, or if its factors do not fit memory.
    pub fn factorize<const D: usize>(&mut self, matrix: &BlockMatrix<D>, pattern: u64) -> bool {
        self.factor = None;
        if self.symbolic.as_ref().is_none_or(|(_, of)| *of != pattern) {
            let (mut start, mut row) = (vec![0], vec![]);
            for vertex in 0..matrix.rows() {
                for _ in 0..D {
                    row.extend(matrix.row(vertex).flat_map(|(c, _)| (0..D).map(move |l| c * D + l)));
                    start.push(row.len());
                }
            }
            self.symbolic = SymbolicLu::new(start, row).map(|symbolic| (symbolic, pattern));
        }
        let BlockLu { symbolic, entries, factor } = self;
        let Some((symbolic, _)) = symbolic else { return false };
        // Rows serve as columns.
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

    /// True if there are factors.
    pub fn is_factorised(&self) -> bool {
        self.factor.is_some()
    }

    /// Forgets the factors.
    pub fn forget(&mut self) {
        self.factor = None;
    }

    /// Solves with the last factors in place: `b` becomes the solution. Nothing happens without factors.
    pub fn solve(&self, b: &mut [f64]) {
        if let Some(factor) = &self.factor {
            factor.solve(b);
        }
    }
}
