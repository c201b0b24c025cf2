//! Curvature of a polyline at a vertex.

use super::ScalarStrain;
use crate::algebra::fused_dot;
use crate::scalar::Scalar;

/// Added to divisors: an edge without length has no direction.
const TINY: f64 = 1e-280;
/// Square of the curvature assigned to a straight joint in space: below it, the plane of bending is noise.
const STRAIGHT: f64 = 1e-20;

/// Curvature of a polyline at `x_1` relative to rest: `s = kappa - kappa_0`, `kappa = 2 tan(phi/2)` with the
/// turning angle `phi` from `e = x_1 - x_0` to `f = x_2 - x_1`; `rest` is `kappa_0`. `kappa` is the length of
/// the curvature binormal `2 e x f / (|e| |f| + e . f)`; in the plane it has a sign, positive
/// counter-clockwise. A joint that folds back on itself has no finite curvature.
///
/// In space a straight joint bends equally in every direction: there `kappa = sqrt(|kb|^2 + 1e-20)`, whose
/// square is smooth.
///
/// Source: Bergou, Wardetzky, Robinson, Audoly, Grinspun 2008, *Discrete elastic rods*, ACM Transactions
/// on Graphics 27(3), the isotropic case without twist.
#[derive(Clone, Copy, Debug)]
pub struct Curvature;

/// Returns the cross product; in 2D its one component comes first, and the others are zero.
#[inline(always)]
fn cross<S: Scalar, const D: usize>(a: &[S; D], b: &[S; D]) -> [S; D] {
    let mut r = [S::zero(); D];
    if D == 2 {
        r[0] = a[0] * b[1] - a[1] * b[0];
    } else {
        for i in 0..D {
            let (p, q) = ((i + 1) % D, (i + 2) % D);
            r[i] = a[p] * b[q] - a[q] * b[p];
        }
    }
    r
}

/// Returns `n x a`; in 2D `n` is the unit vector out of the plane.
#[inline(always)]
fn turned<S: Scalar, const D: usize>(n: &[S; D], a: &[S; D]) -> [S; D] {
    if D == 2 {
        let mut r = *a;
        (r[0], r[1]) = (-a[1], a[0]);
        return r;
    }
    cross(n, a)
}

impl<const D: usize> ScalarStrain<D, 3> for Curvature {
    const OF: &'static str = "joint";

    #[inline(always)]
    fn deviation<S: Scalar>(x: &[[S; D]; 3], rest: &[S; 2]) -> (S, [[S; D]; 3]) {
        let (mut e, mut f) = (x[1], x[2]);
        for c in 0..D {
            e[c] -= x[0][c];
            f[c] -= x[1][c];
        }
        let tiny = S::splat(TINY);
        let (ee, ff) = (fused_dot(&e, &e) + tiny, fused_dot(&f, &f) + tiny);
        let lengths = (ee * ff).sqrt();
        let reciprocal = S::splat(2.0) / (lengths + fused_dot(&e, &f) + tiny);
        let mut binormal = cross(&e, &f);
        for c in 0..D {
            binormal[c] *= reciprocal;
        }
        let curvature =
            if D == 2 { binormal[0] } else { (fused_dot(&binormal, &binormal) + S::splat(STRAIGHT)).sqrt() };
        let mut axis = binormal;
        for c in 0..D {
            axis[c] = binormal[c] / curvature;
        }
        // d kappa / d phi
        let slope = lengths * reciprocal;
        let (by_e, by_f) = (turned(&axis, &e), turned(&axis, &f));
        let (of_e, of_f) = (slope / ee, slope / ff);
        let mut gradient = [[S::zero(); D]; 3];
        for c in 0..D {
            gradient[0][c] = of_e * by_e[c];
            gradient[2][c] = of_f * by_f[c];
            gradient[1][c] = -(gradient[0][c] + gradient[2][c]);
        }
        (curvature - rest[0], gradient)
    }
}
