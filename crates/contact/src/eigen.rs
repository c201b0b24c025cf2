//! Positive semidefinite projection of small symmetric matrices, one pack at a time.

use pliant::scalar::{Mask, Scalar};

/// Sweep limit: convergence is quadratic, off-diagonal entries are then at rounding.
const MAX_SWEEPS: usize = 16;

/// Off-diagonal entries whose squares are below this fraction of the squared matrix norm are treated as
/// zero: they change an eigenvalue by less than its rounding.
const NEGLIGIBLE: f64 = 1e-31;

/// Sets the negative eigenvalues of rows and columns `0..n` of `a` to zero.
///
/// Cyclic Jacobi rotations (Golub and Van Loan, "Matrix computations", section 8.5). A lane whose entry is at
/// rounding is not rotated, so its bits do not depend on the other lanes.
#[inline(always)]
pub(crate) fn positive_part<S: Scalar, const K: usize>(a: &mut [[S; K]; K], n: usize) {
    let mut vectors = [[S::zero(); K]; K];
    let mut size = S::zero();
    for i in 0..n {
        vectors[i][i] = S::one();
        for j in 0..n {
            size += a[i][j] * a[i][j];
        }
    }
    let negligible = size * S::splat(NEGLIGIBLE);
    for _ in 0..MAX_SWEEPS {
        if !sweep(a, &mut vectors, n, negligible) {
            break;
        }
    }
    let mut positive = [S::zero(); K];
    for k in 0..n {
        positive[k] = a[k][k].max(S::zero());
    }
    for i in 0..n {
        for j in i..n {
            let mut sum = S::zero();
            for k in 0..n {
                sum += positive[k] * vectors[k][i] * vectors[k][j];
            }
            a[i][j] = sum;
            a[j][i] = sum;
        }
    }
}

/// One sweep over all pairs; true if any lane was rotated. Rows of `v` are the eigenvectors.
#[inline(always)]
fn sweep<S: Scalar, const K: usize>(
    a: &mut [[S; K]; K],
    v: &mut [[S; K]; K],
    n: usize,
    negligible: S,
) -> bool {
    let mut turned = false;
    for p in 0..n {
        for q in p + 1..n {
            let b = a[p][q];
            let turns = negligible.lt(b * b);
            if !turns.any() {
                continue;
            }
            turned = true;
            let (c, s) = rotation(a[p][p], a[q][q], b);
            let (c, s) = (S::select(turns, c, S::one()), S::select(turns, s, S::zero()));
            for k in 0..n {
                let (x, y) = (a[p][k], a[q][k]);
                a[p][k] = c * x - s * y;
                a[q][k] = s * x + c * y;
                let (x, y) = (v[p][k], v[q][k]);
                v[p][k] = c * x - s * y;
                v[q][k] = s * x + c * y;
            }
            for k in 0..n {
                let (x, y) = (a[k][p], a[k][q]);
                a[k][p] = c * x - s * y;
                a[k][q] = s * x + c * y;
            }
        }
    }
    turned
}

/// Cosine and sine of the rotation that zeroes `b` in `[p b; b q]`.
#[inline(always)]
fn rotation<S: Scalar>(p: S, q: S, b: S) -> (S, S) {
    let difference = q - p;
    let b2 = b + b;
    let u = difference.abs() + (difference * difference + b2 * b2).sqrt();
    let root = (u * u + b2 * b2).sqrt();
    let zero = root.lt(S::splat(1e-140));
    let r = S::one() / S::select(zero, S::one(), root);
    (S::select(zero, S::one(), u * r), S::select(zero, S::zero(), b2 * r.copysign(difference)))
}
