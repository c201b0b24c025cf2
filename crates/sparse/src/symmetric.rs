//! Eigenvalues and eigenvectors of dense symmetric matrices.

use faer::{Mat, Side};

/// Eigendecomposition `A = V diag(values) V^T`.
pub struct SymmetricEigen {
    /// Eigenvalues, ascending.
    pub values: Vec<f64>,
    vectors: Mat<f64>,
}

impl SymmetricEigen {
    /// Component `row` of the eigenvector of `values[column]`; the vectors are orthonormal.
    pub fn vector(&self, row: usize, column: usize) -> f64 {
        self.vectors[(row, column)]
    }
}

/// Computes all eigenvalues and eigenvectors of the symmetric matrix of `n` rows with these entries;
/// those above the diagonal are ignored. `None` if the iteration fails, for example for entries that are
/// not finite.
pub fn symmetric_eigen(n: usize, entry: impl Fn(usize, usize) -> f64) -> Option<SymmetricEigen> {
    let matrix = Mat::<f64>::from_fn(n, n, |i, j| entry(i.max(j), i.min(j)));
    let eigen = matrix.self_adjoint_eigen(Side::Lower).ok()?;
    let values = (0..n).map(|j| eigen.S()[j]).collect();
    Some(SymmetricEigen { values, vectors: eigen.U().to_owned() })
}

#[cfg(test)]
mod tests {
    use super::symmetric_eigen;

    /// `[2 1; 1 2]`: 1 along (1, -1), 3 along (1, 1).
    #[test]
    fn values_ascend_and_vectors_belong_to_them() {
        let eigen = symmetric_eigen(2, |i, j| if i == j { 2.0 } else { 1.0 }).unwrap();
        assert!((eigen.values[0] - 1.0).abs() < 1e-15 && (eigen.values[1] - 3.0).abs() < 1e-15);
        let v = |column| (eigen.vector(0, column), eigen.vector(1, column));
        assert!((v(0).0 + v(0).1).abs() < 1e-15 && (v(1).0 - v(1).1).abs() < 1e-15);
        assert!((v(1).0.powi(2) - 0.5).abs() < 1e-15);
    }
}
