//! Singular value decomposition with rotations on both sides.

use super::eigen::{jacobi_rotation, rotate_rows, symmetric_sweep};
use super::{Mat, Vect, fused_dot};
use crate::scalar::{Mask, Scalar};

/// `F = U diag(sigma) V^T` with `U` and `V` rotations (determinant +1), see [`signed_svd`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Svd<S, const D: usize> {
    /// Left singular vectors, in columns.
    pub u: Mat<S, D>,
    /// `sigma[0] >= sigma[1] >= ... >= |sigma[D-1]|`: only the last may be negative, and is where `det F <
    /// 0`.
    pub sigma: Vect<S, D>,
    /// Right singular vectors, in columns.
    pub v: Mat<S, D>,
}

/// `F / |F|` and `|F|` (Frobenius).
///
/// Below 1e-145 the norm is taken as 1e-145, so that zero stays zero. Where an entry of `F` is infinite or
/// NaN, or `|F|^2` overflows (`|F| > 1e154`), every entry of the result is NaN: `norm / norm^2` instead of
/// `1 / norm` sees to it, at no cost, and the comparison is written so that NaN is not mistaken for small.
#[inline(always)]
pub(super) fn normalized<S: Scalar, const D: usize>(f: &Mat<S, D>) -> (Mat<S, D>, S) {
    let squared = f.norm_squared();
    let floor = S::splat(1e-290);
    let squared = S::select(squared.lt(floor), floor, squared);
    let norm = squared.sqrt();
    (f.scale(norm / squared), norm)
}

/// Signed singular value decomposition of any `F`, singular and inverted ones included.
///
/// Orthogonality and reconstruction are good to a few units of rounding of `|F|`, as are the singular
/// values. Where `F` has an infinite or NaN entry, or `|F| > 1e154`, everything in the result is NaN. `F =
/// 0` gives `U = V = I`.
///
/// Jacobi rotations diagonalise `F^T F` (three sweeps, enough for all but the last digits); one sweep of
/// one-sided Jacobi on `B = F V` (Hestenes; Demmel and Veselic, "Jacobi's method is more accurate than QR",
/// 1992) restores what squaring lost. `U` follows from the columns of `B`, the last one by the cross product,
/// which puts the sign of `det F` on the last singular value (convention of Irving, Teran and Fedkiw,
/// "Invertible finite elements for robust simulation of large deformation", 2004).
#[inline(always)]
pub fn signed_svd<S: Scalar, const D: usize>(f: &Mat<S, D>) -> Svd<S, D> {
    let (g, norm) = normalized(f);
    // Row k of `v` and of `b` is column k of V and of B = G V.
    let mut a = g.transpose_mul(&g);
    let mut v = Mat::identity();
    symmetric_sweep(&mut a, &mut v);
    if D == 3 {
        symmetric_sweep(&mut a, &mut v);
        symmetric_sweep(&mut a, &mut v);
    }
    let mut b = v.mul_transpose(&g);
    one_sided_step(&mut b, &mut v, 0, 1);
    if D == 3 {
        one_sided_step(&mut b, &mut v, 0, 2);
        one_sided_step(&mut b, &mut v, 1, 2);
    }
    sort(&mut b, &mut v);
    let (u, mut sigma) = left(&b, &v);
    for i in 0..D {
        sigma[i] *= norm;
    }
    Svd { u: u.transpose(), sigma, v: v.transpose() }
}

/// `a - (u . a) u`
#[inline(always)]
fn orthogonal_part<S: Scalar, const D: usize>(a: &Vect<S, D>, u: &Vect<S, D>) -> Vect<S, D> {
    let d = -fused_dot(u, a);
    let mut r = *a;
    for i in 0..D {
        r[i] = u[i].mul_add(d, a[i]);
    }
    r
}

#[inline(always)]
fn select<S: Scalar, const D: usize>(mask: S::Mask, a: &Vect<S, D>, b: &Vect<S, D>) -> Vect<S, D> {
    let mut r = *a;
    for i in 0..D {
        r[i] = S::select(mask, a[i], b[i]);
    }
    r
}

/// Makes columns `p` and `q` of `B` (rows here) orthogonal.
#[inline(always)]
fn one_sided_step<S: Scalar, const D: usize>(b: &mut Mat<S, D>, v: &mut Mat<S, D>, p: usize, q: usize) {
    let (c, s) = jacobi_rotation(fused_dot(&b[p], &b[p]), fused_dot(&b[q], &b[q]), fused_dot(&b[p], &b[q]));
    rotate_rows(b, p, q, c, s);
    rotate_rows(v, p, q, c, s);
}

/// Sorts by descending length of the rows of `b`. A swap negates one row, so `v` stays a rotation.
#[inline(always)]
fn sort<S: Scalar, const D: usize>(b: &mut Mat<S, D>, v: &mut Mat<S, D>) {
    let mut length = [S::zero(); D];
    for i in 0..D {
        length[i] = fused_dot(&b[i], &b[i]);
    }
    for p in 0..D {
        for q in p + 1..D {
            let swap = length[p].lt(length[q]);
            (length[p], length[q]) =
                (S::select(swap, length[q], length[p]), S::select(swap, length[p], length[q]));
            for i in 0..D {
                (b[p][i], b[q][i]) = (S::select(swap, b[q][i], b[p][i]), S::select(swap, -b[p][i], b[q][i]));
                (v[p][i], v[q][i]) = (S::select(swap, v[q][i], v[p][i]), S::select(swap, -v[p][i], v[q][i]));
            }
        }
    }
}

/// `U` (in rows) and the singular values from the sorted, orthogonal columns of `B` (in rows). Where a
/// column vanishes its direction is taken from `V`, so that `U V^T` is the identity for `F = 0`.
#[inline(always)]
fn left<S: Scalar, const D: usize>(b: &Mat<S, D>, v: &Mat<S, D>) -> (Mat<S, D>, Vect<S, D>) {
    let one = S::one();
    let mut u = *v;
    let mut sigma = [S::zero(); D];

    let squared = fused_dot(&b[0], &b[0]);
    let zero = squared.lt(S::splat(1e-280));
    let s0 = squared.sqrt();
    let r = one / S::select(zero, one, s0);
    let mut u0 = b[0];
    for i in 0..D {
        u0[i] = b[0][i] * r;
    }
    u[0] = select(zero, &v[0], &u0);
    sigma[0] = s0;

    if D == 2 {
        u[1][0] = -u[0][1];
        u[1][1] = u[0][0];
        sigma[1] = fused_dot(&u[1], &b[1]);
    } else {
        let mut w = orthogonal_part(&b[1], &u[0]);
        let mut squared = fused_dot(&w, &w);
        // Below rounding of |F|: any direction will do, and the singular values are zero.
        let vanishes = squared.lt(S::splat(1e-34)) | zero;
        if vanishes.any() {
            // At least one of v1, v2 is far from u0; prefer v1, which gives the identity for F = 0.
            let near = S::splat(0.8).lt(fused_dot(&u[0], &v[1]).abs());
            let direction = orthogonal_part(&select(near, &v[2], &v[1]), &u[0]);
            w = select(vanishes, &direction, &w);
            squared = S::select(vanishes, fused_dot(&direction, &direction), squared);
        }
        let r = one / squared.sqrt();
        for i in 0..D {
            w[i] *= r;
        }
        // Once more: the first pass loses digits where b1 is short.
        u[1] = orthogonal_part(&w, &u[0]);
        for i in 0..D {
            let (p, q) = ((i + 1) % D, (i + 2) % D);
            u[2][i] = u[0][p].mul_add(u[1][q], -(u[0][q] * u[1][p]));
        }
        let s1 = fused_dot(&u[1], &b[1]);
        sigma[1] = S::select(vanishes, S::zero(), S::select(s0.lt(s1), s0, s1));
        sigma[2] = fused_dot(&u[2], &b[2]);
    }
    // Rounding must not break the promised order.
    let last = sigma[D - 1];
    let bound = sigma[D - 2];
    sigma[D - 1] = S::select(bound.lt(last.abs()), bound.copysign(last), last);
    (u, sigma)
}
