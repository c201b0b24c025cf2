//! The nearest positive semidefinite matrix.

use super::eigen::jacobi_rotation;

/// Sweeps after which off-diagonal entries are at rounding: convergence is quadratic.
const MAX_SWEEPS: usize = 32;

/// Sets the negative eigenvalues of a symmetric matrix `n x n`, by rows, to zero: the nearest positive semidefinite matrix in the
/// Frobenius norm (Higham 1988, "Computing a nearest symmetric positive semidefinite matrix"). By cyclic Jacobi rotations, Golub and Van
/// Loan, "Matrix computations", section 8.5. One that is not finite stays as it is.
///
/// # Panics
/// If there are not `n * n` numbers.
pub(crate) fn project_positive(matrix: &mut [f64], n: usize) {
    assert_eq!(matrix.len(), n * n, "a square matrix");
    if matrix.iter().any(|entry| !entry.is_finite()) {
        return;
    }
    let mut a = matrix.to_vec();
    // Eigenvectors by rows.
    let mut v: Vec<f64> = (0..n * n).map(|i| f64::from(u8::from(i / n == i % n))).collect();
    let size: f64 = a.iter().map(|entry| entry * entry).sum();
    for _ in 0..MAX_SWEEPS {
        let off = |a: &[f64]| (0..n * n).filter(|i| i / n != i % n).map(|i| a[i] * a[i]).sum::<f64>();
        if off(&a) <= 1e-30 * size {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                let (c, s) = jacobi_rotation(a[p * n + p], a[q * n + q], a[p * n + q]);
                for i in 0..n {
                    let (x, y) = (a[p * n + i], a[q * n + i]);
                    (a[p * n + i], a[q * n + i]) = (c * x - s * y, s * x + c * y);
                    let (x, y) = (v[p * n + i], v[q * n + i]);
                    (v[p * n + i], v[q * n + i]) = (c * x - s * y, s * x + c * y);
                }
                for i in 0..n {
                    let (x, y) = (a[i * n + p], a[i * n + q]);
                    (a[i * n + p], a[i * n + q]) = (c * x - s * y, s * x + c * y);
                }
            }
        }
    }
    if (0..n).all(|k| a[k * n + k] >= 0.0) {
        return;
    }
    matrix.fill(0.0);
    for k in (0..n).filter(|k| a[k * n + k] > 0.0) {
        for i in 0..n {
            for j in 0..n {
                matrix[i * n + j] += a[k * n + k] * v[k * n + i] * v[k * n + j];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn negative_eigenvalues_become_zero_and_others_stay() {
        // Reflections I - 2 w w^T have orthonormal rows, which are the eigenvectors.
        let n = 9;
        let w: Vec<f64> = (0..n).map(|i| 1.0 + (i as f64).sin()).collect();
        let length: f64 = w.iter().map(|w| w * w).sum();
        let q = |k: usize, i: usize| f64::from(u8::from(k == i)) - 2.0 * w[k] * w[i] / length;
        let made = |eigenvalue: fn(usize) -> f64| -> Vec<f64> {
            let entry = |i: usize, j: usize| (0..n).map(|k| eigenvalue(k) * q(k, i) * q(k, j)).sum();
            (0..n * n).map(|ij| entry(ij / n, ij % n)).collect()
        };
        let mut matrix = made(|k| [-3.0, -1e-3, 0.0, 1e-3, 1.0, 1.0, 2.0, 50.0, 1e3][k]);
        let expected = made(|k| [0.0, 0.0, 0.0, 1e-3, 1.0, 1.0, 2.0, 50.0, 1e3][k]);
        project_positive(&mut matrix, n);
        assert!(matrix.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-12 * 1e3));
        // One that is positive is not touched.
        let mut positive = made(|k| k as f64 + 0.5);
        let before = positive.clone();
        project_positive(&mut positive, n);
        assert_eq!(positive, before);
    }
}
