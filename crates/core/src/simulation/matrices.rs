//! Matrices of the linearised equations, for use by other programs.

use super::Simulation;
use crate::material::Psd;
use crate::solver::hessian::{Assembler, At, Weights};

/// Sparse matrix in compressed row format: the entries of row `i` are `row_start[i]..row_start[i + 1]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SparseMatrix {
    /// Start of each row; one entry more than rows.
    pub row_start: Vec<usize>,
    /// Columns, ascending in each row.
    pub column: Vec<usize>,
    /// Entries.
    pub value: Vec<f64>,
}

/// Error if a matrix is not available.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MatrixError {
    /// Each vertex acts on all others: the matrix is full.
    #[error("{term} couples every vertex with all others: its matrix is full")]
    Full {
        /// Name of the term.
        term: String,
    },
}

impl Simulation {
    /// Returns the stiffness `K = d2E/dx2` [N/m] at the current positions, for the coordinates
    /// `vertex * dimension + axis`, vertices in scene order. It is symmetric, exact, and covers all
    /// coordinates as if unconstrained. Terms without a second derivative, such as user-defined external
    /// forces, are omitted.
    ///
    /// # Errors
    /// [`MatrixError::Full`] if each vertex acts on all others.
    pub fn stiffness_matrix(&mut self) -> Result<SparseMatrix, MatrixError> {
        self.matrix(Weights { inertia: 0.0, stiffness: 1.0, damping: 0.0 })
    }

    /// Returns the damping `C = d2R/dv2` [N s/m] at the current state, in the same order.
    ///
    /// # Errors
    /// [`MatrixError::Full`] if each vertex acts on all others.
    pub fn damping_matrix(&mut self) -> Result<SparseMatrix, MatrixError> {
        self.matrix(Weights { inertia: 0.0, stiffness: 0.0, damping: 1.0 })
    }

    fn matrix(&mut self, weights: Weights) -> Result<SparseMatrix, MatrixError> {
        if let Some(term) = self.system.terms().iter().find(|term| term.properties().couples_all) {
            return Err(MatrixError::Full { term: term.name() });
        }
        Ok(match self.system.dimension() {
            2 => self.blocks::<2>(weights),
            _ => self.blocks::<3>(weights),
        })
    }

    fn blocks<const D: usize>(&mut self, weights: Weights) -> SparseMatrix {
        let (state, numbering) = (&self.state, &self.numbering);
        self.system.as_if_free(|system| {
            system.find_stencils(state.x());
            let mut assembler = Assembler::<D>::new(system);
            assembler.assemble(
                system,
                At { x: state.x(), v: state.v(), psd: Psd::Exact, predicted_from: None },
                weights,
            );
            let matrix = assembler.matrix();
            let mut sparse = SparseMatrix { row_start: vec![0], ..SparseMatrix::default() };
            for vertex in 0..matrix.rows() as u32 {
                let row = matrix.row(numbering.internal(vertex) as usize);
                let mut row: Vec<_> =
                    row.map(|(column, block)| (numbering.original(column as u32) as usize, block)).collect();
                row.sort_unstable_by_key(|(column, _)| *column);
                for k in 0..D {
                    for (column, block) in &row {
                        sparse.column.extend((0..D).map(|l| column * D + l));
                        sparse.value.extend_from_slice(&block[k]);
                    }
                    sparse.row_start.push(sparse.column.len());
                }
            }
            sparse
        })
    }
}
