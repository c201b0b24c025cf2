//! Factorisations of sparse and dense `f64` matrices: faer behind plain functions and slices.
//!
//! Everything is sequential, because the parallel factorisations of faer do not give the same bits for
//! any number of threads. If a factor does not fit into memory, the result is `None` instead of an abort.
//!
//! ```
//! use pliant_sparse::{CholeskyStructure, SparseCholesky};
//!
//! // [4 1; 1 3] by the columns of its lower triangle, eliminated in the order of its rows.
//! let structure = CholeskyStructure::new(vec![0, 2, 3], vec![0, 1, 1], &[0, 1]).ok_or("no memory")?;
//! let mut cholesky = SparseCholesky::new(structure).ok_or("no memory")?;
//! cholesky.entries_mut().copy_from_slice(&[4.0, 1.0, 3.0]);
//! cholesky.factorize()?;
//! let mut x = [1.0, 2.0];
//! cholesky.solve(&mut x);
//! assert!((x[0] - 1.0 / 11.0).abs() < 1e-15 && (x[1] - 7.0 / 11.0).abs() < 1e-15);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod cholesky;
mod lu;
mod symmetric;

pub use cholesky::{CholeskyStructure, FactorMemory, NotPositiveDefinite, SparseCholesky};
pub use lu::{Lu, SymbolicLu};
pub use symmetric::{SymmetricEigen, symmetric_eigen};
