//! Elements of `R` dimensions in a space of `D`: `F` maps the tangents of the rest shape to those of the
//! present one, `D x R`.

use super::SimplexPack;
use crate::algebra::Mat;
use crate::lanes::{Lanes, RowSlice, WIDTH};
use crate::scalar::Scalar;

/// A `D x R` matrix, `m[row][column]`.
pub(crate) type Tangents<S, const D: usize, const R: usize> = [[S; R]; D];

/// `F = D_s D_m^-1`, `D_s = [x_1 - x_0, ..., x_R - x_0]` of the rows of one pack; linear in them.
#[inline(always)]
pub(crate) fn tangents<L: Lanes, const D: usize, const R: usize, const N: usize>(
    rows: &RowSlice<D>,
    index: &[[u16; WIDTH]; N],
    inverse_rest: &Mat<L, R>,
) -> Tangents<L, D, R> {
    let mut x = [[L::zero(); D]; N];
    for node in 0..N {
        x[node] = L::gather(rows, &index[node]);
    }
    let mut edges = [[L::zero(); R]; D];
    for i in 0..D {
        for a in 0..R {
            edges[i][a] = x[a + 1][i] - x[0][i];
        }
    }
    times(&edges, inverse_rest)
}

/// Adds the gradients at the vertices of one pack, given the stress `P` and the rest data.
#[inline(always)]
pub(crate) fn scatter_stress<L: Lanes, const D: usize, const R: usize, const N: usize>(
    rows: &mut RowSlice<D>,
    index: &[[u16; WIDTH]; N],
    p: &Tangents<L, D, R>,
    pack: &SimplexPack<R>,
) {
    let rest = pack.inverse_rest::<L>();
    let weight = pack.weight::<L>();
    // H = w P D_m^-T: column a is the gradient at vertex a + 1.
    let h = times(p, &rest.transpose());
    let mut gradients = [[L::zero(); D]; N];
    for i in 0..D {
        for a in 0..R {
            gradients[a + 1][i] = weight * h[i][a];
            gradients[0][i] -= gradients[a + 1][i];
        }
    }
    for node in 0..N {
        L::scatter_add(rows, &index[node], gradients[node]);
    }
}

/// `A B`.
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

/// `A^T B`.
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
