//! The angle between two triangles that share an edge.

use super::ScalarStrain;
use crate::scalar::Scalar;

/// Added to squares that are divided by: what has collapsed has no direction.
const TINY: f64 = 1e-280;

/// `s = theta - theta_0` [rad], `theta` the angle between the normals of the triangles `(x_0, x_1, x_2)` and
/// `(x_1, x_0, x_3)`: 0 where they lie in a plane, positive where both fold to the side that the normals
/// point to, in `(-pi, pi]`. `rest` is `(cos theta_0, sin theta_0)`; the deviation is in `(-pi, pi]` too.
///
/// With `e = x_1 - x_0` and the normals `n_A = e x (x_2 - x_0)`, `n_B = (x_3 - x_0) x e`:
/// `theta = atan2(|e| n_A . (x_3 - x_0), n_A . n_B)`, accurate at every angle; `d theta/d x_2 = |e| n_A / |n_A|^2`, the same with B
/// at `x_3`, and on the edge the opposite of these, shared as the feet of the heights divide it. A triangle without area has no normal, and
/// nothing acts on it. Where a hinge folds on through `pi` from rest the angle jumps: nothing here keeps a sheet from passing through
/// itself.
///
/// Grinspun, Hirani, Desbrun, Schroeder 2003, *Discrete shells*, Symposium on Computer Animation.
#[derive(Clone, Copy, Debug)]
pub struct HingeAngle;

#[inline(always)]
fn cross<S: Scalar>(a: &[S; 3], b: &[S; 3]) -> [S; 3] {
    let mut r = [S::zero(); 3];
    for i in 0..3 {
        let (p, q) = ((i + 1) % 3, (i + 2) % 3);
        r[i] = a[p] * b[q] - a[q] * b[p];
    }
    r
}

#[inline(always)]
fn dot<S: Scalar>(a: &[S; 3], b: &[S; 3]) -> S {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

#[inline(always)]
fn difference<S: Scalar>(a: &[S; 3], b: &[S; 3]) -> [S; 3] {
    let mut r = *a;
    for c in 0..3 {
        r[c] -= b[c];
    }
    r
}

impl ScalarStrain<3, 4> for HingeAngle {
    const OF: &'static str = "hinge";

    #[inline(always)]
    fn deviation<S: Scalar>(x: &[[S; 3]; 4], rest: &[S; 2]) -> (S, [[S; 3]; 4]) {
        let e = difference(&x[1], &x[0]);
        let a = difference(&x[2], &x[0]);
        let b = difference(&x[3], &x[0]);
        let (normal_a, normal_b) = (cross(&e, &a), cross(&b, &e));
        let tiny = S::splat(TINY);
        let square = dot(&e, &e) + tiny;
        let length = square.sqrt();
        let (sine, cosine) = (length * dot(&normal_a, &b), dot(&normal_a, &normal_b));
        let [cos_0, sin_0] = *rest;
        let angle = (sine * cos_0 - cosine * sin_0).atan2(cosine * cos_0 + sine * sin_0);

        let of_a = length / (dot(&normal_a, &normal_a) + tiny);
        let of_b = length / (dot(&normal_b, &normal_b) + tiny);
        let (foot_a, foot_b) = (dot(&a, &e) / square, dot(&b, &e) / square);
        let mut gradient = [[S::zero(); 3]; 4];
        for c in 0..3 {
            let (at_a, at_b) = (of_a * normal_a[c], of_b * normal_b[c]);
            gradient[2][c] = at_a;
            gradient[3][c] = at_b;
            gradient[1][c] = -(foot_a * at_a + foot_b * at_b);
            gradient[0][c] = -(at_a + at_b + gradient[1][c]);
        }
        (angle, gradient)
    }
}
