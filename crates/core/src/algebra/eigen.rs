//! Jacobi rotations, and the symmetric eigenproblem solved with them.

use super::{Mat, Vect};
use crate::scalar::Scalar;

/// The plane rotation `(cos, sin)` that diagonalises `[[p, b], [b, q]]`, by an angle of at most 45 degrees.
///
/// With `d = q - p`, `h = sqrt(d^2 + 4 b^2)` and `u = |d| + h`: `cos = u / sqrt(u^2 + 4 b^2)` and
/// `sin = 2 b sgn(d) / sqrt(u^2 + 4 b^2)`, from the smaller root `tan = 2 b sgn(d) / u` of `t^2 + d t / b -
/// 1 = 0`, which has no cancellation (Golub and Van Loan, "Matrix computations"). Below 1e-140 `d` and `b`
/// count as zero, and nothing is turned.
#[inline(always)]
pub(super) fn jacobi_rotation<S: Scalar>(p: S, q: S, b: S) -> (S, S) {
    let difference = q - p;
    let b2 = b + b;
    let b2_squared = b2 * b2;
    let u = difference.abs() + difference.mul_add(difference, b2_squared).sqrt();
    let squared = u.mul_add(u, b2_squared);
    // NaN compares false, and stays.
    let zero = squared.lt(S::splat(1e-280));
    let root = squared.sqrt();
    let r = S::one() / root;
    // The quotient, rounded as by a division: exactly 1 for small angles, so that converged vectors keep
    // their length.
    let c = u * r;
    let c = (-c).mul_add(root, u).mul_add(r, c);
    (S::select(zero, S::one(), c), S::select(zero, S::zero(), b2 * r.copysign(difference)))
}

/// Rows `p` and `q` of `m` become `c m_p - s m_q` and `s m_p + c m_q`.
#[inline(always)]
pub(super) fn rotate_rows<S: Scalar, const D: usize>(m: &mut Mat<S, D>, p: usize, q: usize, c: S, s: S) {
    for i in 0..D {
        let (x, y) = (m[p][i], m[q][i]);
        m[p][i] = c.mul_add(x, -(s * y));
        m[q][i] = s.mul_add(x, c * y);
    }
}

/// Zeroes `a[p][q]`. Only the upper triangle of `a` is read and written; row `k` of `v` is eigenvector `k`.
#[inline(always)]
fn symmetric_step<S: Scalar, const D: usize>(a: &mut Mat<S, D>, v: &mut Mat<S, D>, p: usize, q: usize) {
    let b = a[p][q];
    let (c, s) = jacobi_rotation(a[p][p], a[q][q], b);
    // tan b = sin (2 cos b - sin (q - p)), without a division.
    let shift = s * c.mul_add(b + b, s * (a[p][p] - a[q][q]));
    a[p][p] -= shift;
    a[q][q] += shift;
    a[p][q] = S::zero();
    if D == 3 {
        let o = 3 - p - q;
        let (px, py) = (p.min(o), p.max(o));
        let (qx, qy) = (q.min(o), q.max(o));
        let (x, y) = (a[px][py], a[qx][qy]);
        a[px][py] = c.mul_add(x, -(s * y));
        a[qx][qy] = s.mul_add(x, c * y);
    }
    rotate_rows(v, p, q, c, s);
}

/// One sweep of Jacobi rotations over all pairs.
#[inline(always)]
pub(super) fn symmetric_sweep<S: Scalar, const D: usize>(a: &mut Mat<S, D>, v: &mut Mat<S, D>) {
    symmetric_step(a, v, 0, 1);
    if D == 3 {
        symmetric_step(a, v, 0, 2);
        symmetric_step(a, v, 1, 2);
    }
}

/// Eigenvalues, unsorted, and eigenvectors (row `k` belongs to eigenvalue `k`) of a symmetric matrix.
///
/// Cyclic Jacobi until the off-diagonal is below rounding. Only the upper triangle of `a` is read.
pub fn symmetric_eigen<const D: usize>(a: &Mat<f64, D>) -> (Vect<f64, D>, Mat<f64, D>) {
    let mut a = *a;
    let mut v = Mat::identity();
    // Quadratic convergence: four or five sweeps in practice; the bound ends the loop for NaN.
    for _ in 0..16 {
        symmetric_sweep(&mut a, &mut v);
        let (mut diagonal, mut off) = (0.0, 0.0);
        for i in 0..D {
            diagonal += a[i][i] * a[i][i];
            for j in i + 1..D {
                off += a[i][j] * a[i][j];
            }
        }
        if off <= 1e-36 * diagonal {
            break;
        }
    }
    let mut lambda = [0.0; D];
    for i in 0..D {
        lambda[i] = a[i][i];
    }
    (lambda, v)
}

/// Solves the eigenproblem of [`symmetric_eigen`] on any scalar, with a fixed number of sweeps, enough for
/// the last digits.
#[inline(always)]
pub fn symmetric_eigen_of_lanes<S: Scalar, const D: usize>(a: &Mat<S, D>) -> (Vect<S, D>, Mat<S, D>) {
    let mut a = *a;
    let mut v = Mat::identity();
    // A rotation makes a 2x2 matrix diagonal.
    let sweeps = if D == 2 { 1 } else { 5 };
    for _ in 0..sweeps {
        symmetric_sweep(&mut a, &mut v);
    }
    let mut lambda = [S::zero(); D];
    for i in 0..D {
        lambda[i] = a[i][i];
    }
    (lambda, v)
}
