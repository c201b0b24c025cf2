//! The rotation of the polar decomposition.

use super::Mat;
use super::fused_dot;
use super::svd::{normalized, signed_svd};
use crate::scalar::{Mask, Scalar};

/// Returns the rotation `R` nearest to `F`: `F = R S` with `S` symmetric and `det R = +1`, also if `det F <
/// 0`.
///
/// `R` maximises `tr(R^T F)`, which then is `tr S = sigma_1 + ... + sigma_D` with the signs of
/// [`signed_svd`](super::signed_svd()). It is unique unless the two smallest singular values add up to zero;
/// there a rotation is returned that depends on `F` alone, never on other lanes. `R(0) = I`.
///
/// Error in `R`, times `(sigma_2 + sigma_3) / |F|`: a few units of rounding; `|R^T R - I| <= 4e-12`, and
/// 1e-14 where all singular values lie within a factor of three. Where `F` has an infinite or NaN entry, or
/// `|F| > 1e154`, every entry of `R` is NaN. In two dimensions `|F| < 1e-145` counts as zero.
///
/// [`Scalar::rotation`] is the same function with derivatives; materials call that one.
#[inline(always)]
pub fn rotation<S: Scalar, const D: usize>(f: &Mat<S, D>) -> Mat<S, D> {
    if D == 2 { rotation_2d(f) } else { rotation_3d(f) }
}

/// `R = [[a, -b], [b, a]] / sqrt(a^2 + b^2)` with `a = F_00 + F_11`, `b = F_10 - F_01`; the identity for `a
/// = b = 0`.
#[inline(always)]
fn rotation_2d<S: Scalar, const D: usize>(f: &Mat<S, D>) -> Mat<S, D> {
    let (one, zero) = (S::one(), S::zero());
    let a = f[0][0] + f[1][1];
    let b = f[1][0] - f[0][1];
    let squared = a.mul_add(a, b * b);
    let undefined = squared.lt(S::splat(1e-290));
    // n / n^2, not 1 / n: NaN everywhere for infinite input.
    let r = squared.sqrt() / squared;
    let cos = S::select(undefined, one, a * r);
    let sin = S::select(undefined, zero, b * r);
    let mut m = Mat::scalar(cos);
    m[0][1] = -sin;
    m[1][0] = sin;
    m
}

/// Below this, `2 (s1 + s2) (s1 + s3) (s2 + s3)` of `F / |F|` makes the closed form lose too many digits.
const DEGENERATE: f64 = 0.05;

/// Rotation in three dimensions by invariants: with `G = F / |F|`, `J = det G`, `C = cof G` and `l = tr S`,
///
/// `R = ((l^2 + 1) G + 2 l C - 2 G G^T G) / (l (l^2 - 1) - 2 J)`,
///
/// from the Cayley-Hamilton theorem for `S` (the approach of Hoger and Carlson, "Determination of the
/// stretch and rotation in the polar decomposition of the deformation gradient", 1984). The denominator is
/// `2 (s1 + s2) (s1 + s3) (s2 + s3)`; lanes where it is small, or where the root `l` has not converged, take
/// `R = U V^T` from the singular value decomposition.
#[inline(always)]
fn rotation_3d<S: Scalar, const D: usize>(f: &Mat<S, D>) -> Mat<S, D> {
    let (g, _) = normalized(f);
    let c = g.cofactor();
    let j = g.determinant_with(&c);
    let (l, unconverged) = trace_of_stretch(j, c.norm_squared());
    let l2 = l * l;
    let denominator = l.mul_add(l2 - S::one(), -(j + j));
    let r = S::one() / denominator;
    let diagonal = (l2 + S::one()) * r;
    let minus_2r = -(r + r);
    let mut m = Mat::zero();
    for i in 0..D {
        m[i][i] = minus_2r.mul_add(fused_dot(&g[i], &g[i]), diagonal);
        for k in 0..i {
            let x = minus_2r * fused_dot(&g[i], &g[k]);
            m[i][k] = x;
            m[k][i] = x;
        }
    }
    let rotation = c.scale_add((l + l) * r, &m.mul(&g));
    // NaN compares false: a lane that is not finite keeps its NaN.
    let degenerate = denominator.lt(S::splat(DEGENERATE)) | unconverged;
    if degenerate.any() {
        return Mat::select(degenerate, &S::rotation_by_svd_where(degenerate, &g), &rotation);
    }
    rotation
}

/// The rotation `R = U V^T` from the signed singular value decomposition; slower than [`rotation`] and
/// accurate everywhere.
#[inline(always)]
pub fn rotation_by_svd<S: Scalar, const D: usize>(f: &Mat<S, D>) -> Mat<S, D> {
    let svd = signed_svd(f);
    svd.u.mul_transpose(&svd.v)
}

/// `l = s1 + s2 + s3` for `s1^2 + s2^2 + s3^2 = 1`, `s1 s2 s3 = J`, `|cof|^2 = s1^2 s2^2 + s2^2 s3^2 + s3^2
/// s1^2`, and which lanes have not converged.
///
/// It is the largest root of `p(l) = (l^2 - 1)^2 - 8 J l - 4 |cof|^2`, approached from `sqrt(3)`, its upper
/// bound, by Halley's iteration, which is monotonic there. A lane stops once its step is below 1e-5:
/// convergence is cubic, so the root is then exact, and the result cannot depend on the other lanes of a
/// pack.
#[inline(always)]
fn trace_of_stretch<S: Scalar>(j: S, cofactor_squared: S) -> (S, S::Mask) {
    let one = S::one();
    let j8 = S::splat(8.0) * j;
    let c4 = S::splat(4.0) * cofactor_squared;
    // The square root of 3, rounded up.
    let mut l = S::splat(1.732_050_807_568_877_4);
    let mut moving = S::zero().lt(one);
    for _ in 0..6 {
        let l2 = l * l;
        let a = l2 - one;
        let p = a.mul_add(a, -j8.mul_add(l, c4));
        let slope = (S::splat(4.0) * l).mul_add(a, -j8);
        let half_curvature = S::splat(6.0).mul_add(l2, S::splat(-2.0));
        let step = p * slope / slope.mul_add(slope, -(p * half_curvature)).max(S::splat(1e-30));
        l = S::select(moving, l - step, l);
        moving = moving & S::splat(1e-5).lt(step.abs());
        if !moving.any() {
            break;
        }
    }
    (l, moving)
}
