//! Elements of `R` dimensions in `D`-dimensional space: `F`, a `D x R` matrix, maps the tangents of the
//! reference configuration to those of the current one.

use crate::algebra::Mat;
use crate::scalar::Scalar;

/// A `D x R` matrix, `m[row][column]`.
pub(crate) type Tangents<S, const D: usize, const R: usize> = [[S; R]; D];

/// Returns `[x_1 - x_0, ..., x_R - x_0]` in columns.
#[inline(always)]
pub(crate) fn edges<S: Scalar, const D: usize, const R: usize, const N: usize>(
    x: &[[S; D]; N],
) -> Tangents<S, D, R> {
    let mut edges = [[S::zero(); R]; D];
    for i in 0..D {
        for a in 0..R {
            edges[i][a] = x[a + 1][i] - x[0][i];
        }
    }
    edges
}

/// Returns `A B`.
#[inline(always)]
pub(crate) fn times<S: Scalar, const D: usize, const R: usize>(
    a: &Tangents<S, D, R>,
    b: &Mat<S, R>,
) -> Tangents<S, D, R> {
    let mut r = [[S::zero(); R]; D];
    for i in 0..D {
        for j in 0..R {
            let mut sum = a[i][0] * b[0][j];
            for k in 1..R {
                sum = a[i][k].mul_add(b[k][j], sum);
            }
            r[i][j] = sum;
        }
    }
    r
}

/// Returns `A^T B`.
#[inline(always)]
pub(crate) fn transpose_times<S: Scalar, const D: usize, const R: usize>(
    a: &Tangents<S, D, R>,
    b: &Tangents<S, D, R>,
) -> Mat<S, R> {
    let mut r = Mat::zero();
    for i in 0..R {
        for j in 0..R {
            let mut sum = a[0][i] * b[0][j];
            for k in 1..D {
                sum = a[k][i].mul_add(b[k][j], sum);
            }
            r[i][j] = sum;
        }
    }
    r
}
