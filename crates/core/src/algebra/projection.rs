//! Projection of a symmetric matrix to the nearest positive semidefinite one.

use std::ops::{Index, IndexMut};

use super::eigen::jacobi_rotation;
use crate::scalar::{Mask, Scalar};

/// Sweeps after which off-diagonal entries are at rounding: convergence is quadratic.
const MAX_SWEEPS: usize = 32;

/// Projects a symmetric matrix `n x n`, by rows, to the nearest positive semidefinite matrix in the Frobenius
/// norm: negative eigenvalues become zero (Higham 1988, "Computing a nearest symmetric positive semidefinite
/// matrix"). The method is cyclic Jacobi rotations, Golub and Van Loan, "Matrix computations", section 8.5. A
/// matrix that is not finite is left unchanged.
///
/// # Panics
/// If there are not `n * n` numbers.
pub(crate) fn project_positive(matrix: &mut [f64], n: usize) {
    assert_eq!(matrix.len(), n * n, "a square matrix");
    if matrix.iter().any(|entry| !entry.is_finite()) {
        return;
    }
    let mut a = matrix.to_vec();
    if is_positive(&mut a, n) {
        return;
    }
    a.copy_from_slice(matrix);
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

/// True if a symmetric matrix of `n` rows has no negative eigenvalue but for rounding: with a slightly larger
/// diagonal it has a Cholesky factor, which overwrites its upper triangle.
fn is_positive(a: &mut [f64], n: usize) -> bool {
    /// Round-off of a zero, relative to the largest diagonal entry.
    const ROUNDING: f64 = 1e-14;
    let largest = (0..n).fold(0.0, |largest: f64, k| largest.max(a[k * n + k]));
    (0..n).for_each(|k| a[k * n + k] += ROUNDING * largest);
    for k in 0..n {
        let (above, below) = a.split_at_mut((k + 1) * n);
        let row = &mut above[k * n + k..];
        if row[0].is_nan() || row[0] <= 0.0 {
            return false;
        }
        let root = row[0].sqrt();
        row.iter_mut().for_each(|entry| *entry /= root);
        for (i, rest) in below.chunks_exact_mut(n).enumerate() {
            let factor = row[i + 1];
            rest[k + 1 + i..]
                .iter_mut()
                .zip(&row[i + 1..])
                .for_each(|(entry, of_row)| *entry -= factor * of_row);
        }
    }
    true
}

/// A square matrix of at most [`PackedMatrix::ROWS`] rows. Entries may be packs: several matrices side by
/// side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PackedMatrix<S>([[S; 9]; 9]);

impl<S> PackedMatrix<S> {
    /// Rows that there is room for.
    pub(crate) const ROWS: usize = 9;
}

impl<S: Scalar> Default for PackedMatrix<S> {
    #[inline(always)]
    fn default() -> Self {
        PackedMatrix([[S::zero(); 9]; 9])
    }
}

impl<S> Index<usize> for PackedMatrix<S> {
    type Output = [S; 9];
    #[inline(always)]
    fn index(&self, row: usize) -> &[S; 9] {
        &self.0[row]
    }
}

impl<S> IndexMut<usize> for PackedMatrix<S> {
    #[inline(always)]
    fn index_mut(&mut self, row: usize) -> &mut [S; 9] {
        &mut self.0[row]
    }
}

/// Convergence threshold of off-diagonal entries relative to the matrix, as squared norms.
const CONVERGED: f64 = 1e-28;

/// Projects as [`project_positive`] does the first `n` rows and columns of matrices side by side.
/// Eigenvectors are exact to `1e-14` of the matrix; sweeps continue until all of them are.
#[inline(always)]
pub(crate) fn project_positive_packed<S: Scalar>(matrix: &mut PackedMatrix<S>, n: usize) {
    let mut a = *matrix;
    let mut v = PackedMatrix::<S>::default();
    let mut size = S::zero();
    for i in 0..n {
        v[i][i] = S::one();
        for j in 0..n {
            size = a[i][j].mul_add(a[i][j], size);
        }
    }
    let enough = S::splat(CONVERGED) * size;
    for _ in 0..MAX_SWEEPS {
        let mut off = S::zero();
        for i in 0..n {
            for j in i + 1..n {
                off = a[i][j].mul_add(a[i][j], off);
            }
        }
        // NaN compares false: what is not finite does not keep the others waiting.
        if !enough.lt(off + off).any() {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                rotate(&mut a, &mut v, n, p, q);
            }
        }
    }
    for i in 0..n {
        for j in i..n {
            let mut sum = S::zero();
            for k in 0..n {
                let positive = a[k][k].max(S::zero());
                sum = (positive * v[k][i]).mul_add(v[k][j], sum);
            }
            // `max` would make a number of what is none.
            let entry = S::select(size.lt(S::splat(f64::INFINITY)), sum, matrix[i][j]);
            (matrix[i][j], matrix[j][i]) = (entry, entry);
        }
    }
}

/// Rotates in the plane `p < q` so that `a[p][q]` becomes zero. Only the upper triangle of `a` is read and
/// written; row `k` of `v` is eigenvector `k`.
#[inline(always)]
fn rotate<S: Scalar>(a: &mut PackedMatrix<S>, v: &mut PackedMatrix<S>, n: usize, p: usize, q: usize) {
    let b = a[p][q];
    let (c, s) = jacobi_rotation(a[p][p], a[q][q], b);
    // `tan b = sin (2 cos b - sin (q - p))`, without a division.
    let shift = s * c.mul_add(b + b, s * (a[p][p] - a[q][q]));
    a[p][p] -= shift;
    a[q][q] += shift;
    a[p][q] = S::zero();
    for i in 0..p {
        let (x, y) = (a[i][p], a[i][q]);
        (a[i][p], a[i][q]) = (c.mul_add(x, -(s * y)), s.mul_add(x, c * y));
    }
    for i in p + 1..q {
        let (x, y) = (a[p][i], a[i][q]);
        (a[p][i], a[i][q]) = (c.mul_add(x, -(s * y)), s.mul_add(x, c * y));
    }
    for i in q + 1..n {
        let (x, y) = (a[p][i], a[q][i]);
        (a[p][i], a[q][i]) = (c.mul_add(x, -(s * y)), s.mul_add(x, c * y));
    }
    for i in 0..n {
        let (x, y) = (v[p][i], v[q][i]);
        (v[p][i], v[q][i]) = (c.mul_add(x, -(s * y)), s.mul_add(x, c * y));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_side_by_side_are_projected_as_each_alone() {
        for n in [2, 6, 9] {
            let entry =
                |i: usize, j: usize| (((i.min(j) * 7 + i.max(j) * 3) as f64 * 0.618).fract() - 0.5) * 10.0;
            let mut alone: Vec<f64> = (0..n * n).map(|ij| entry(ij / n, ij % n)).collect();
            let mut packed = PackedMatrix::default();
            (0..n * n).for_each(|ij| packed[ij / n][ij % n] = alone[ij]);
            project_positive(&mut alone, n);
            project_positive_packed(&mut packed, n);
            for ij in 0..n * n {
                assert!((packed[ij / n][ij % n] - alone[ij]).abs() < 1e-12, "n = {n}, entry {ij}");
            }
        }
        let mut bad = PackedMatrix::default();
        bad[0][1] = f64::NAN;
        bad[1][0] = f64::NAN;
        project_positive_packed(&mut bad, 2);
        assert!(bad[0][1].is_nan());
    }

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
