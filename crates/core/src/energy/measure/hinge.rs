//! Angle between two triangles that share an edge.

use super::{PARTS, ScalarStrain};
use crate::algebra::{cross, fused_dot};
use crate::scalar::Scalar;

/// Added to squares in divisors: collapsed triangles have no direction.
const TINY: f64 = 1e-280;

/// Dihedral angle of a hinge relative to rest: `s = theta - theta_0` [rad], `theta` the angle between the
/// normals of the triangles `(x_0, x_1, x_2)` and `(x_1, x_0, x_3)`: 0 if they are coplanar, positive if both
/// fold towards their normals, in `(-pi, pi]`. `rest` is `(cos theta_0, sin theta_0)`; the deviation is in
/// `(-pi, pi]` too.
///
/// With `e = x_1 - x_0` and the normals `n_A = e x (x_2 - x_0)`, `n_B = (x_3 - x_0) x e`: `theta = atan2(|e|
/// n_A . (x_3 - x_0), n_A . n_B)`, accurate at every angle. The gradient is `d theta/d x_2 = |e| n_A /
/// |n_A|^2`, the same with B at `x_3`, and on the edge the opposite of these, divided by the feet of the
/// heights. A triangle without area has no normal, and no force acts on it. If a hinge folds beyond a
/// deviation of `pi`, the angle jumps: this energy does not prevent self-intersection.
///
/// Source: Grinspun, Hirani, Desbrun, Schroeder 2003, *Discrete shells*, Symposium on Computer Animation.
#[derive(Clone, Copy, Debug)]
pub struct HingeAngle;

#[inline(always)]
fn difference<S: Scalar>(a: &[S; 3], b: &[S; 3]) -> [S; 3] {
    let mut r = *a;
    for c in 0..3 {
        r[c] -= b[c];
    }
    r
}

#[inline(always)]
fn scaled<S: Scalar>(factor: S, a: &[S; 3]) -> [S; 3] {
    let mut r = *a;
    for c in 0..3 {
        r[c] = factor * a[c];
    }
    r
}

/// Frame of one triangle of a hinge.
struct HingeSide<S> {
    /// Unit vector in the triangle from the edge to the vertex across, and its normal `e x t`.
    across: [S; 3],
    normal: [S; 3],
    /// Inverse of the height [1/m].
    inverse_height: S,
    /// Coefficients of the motion of the opposite vertex relative to the foot of its height, for both ends of
    /// the edge. That of the vertex itself is 1.
    foot: [S; 2],
}

impl<S: Scalar> HingeSide<S> {
    /// Creates the triangle of the edge from the origin to `e` and the vertex at `a`;
    /// `e_squared = |e|^2`.
    #[inline(always)]
    fn new(e: &[S; 3], e_squared: S, a: &[S; 3]) -> Self {
        let normal = cross(e, a);
        let inverse = S::one() / (fused_dot(&normal, &normal) + S::splat(TINY)).sqrt();
        let length = e_squared.sqrt();
        let normal = scaled(inverse, &normal);
        let across = scaled(S::one() / length, &cross(&normal, e));
        let part = fused_dot(a, e) / e_squared;
        HingeSide { across, normal, inverse_height: length * inverse, foot: [part - S::one(), -part] }
    }

    /// Returns `c (x) d`: the motion along `d` of the opposite vertex relative to the foot of its height;
    /// `across` is the index of that vertex.
    #[inline(always)]
    fn spread(&self, d: &[S; 3], across: usize) -> [[S; 3]; 4] {
        let mut spread = [[S::zero(); 3]; 4];
        spread[0] = scaled(self.foot[0], d);
        spread[1] = scaled(self.foot[1], d);
        spread[across] = *d;
        spread
    }
}

/// Returns `a u + b v`.
#[inline(always)]
fn combined<S: Scalar>(a: S, u: &[[S; 3]; 4], b: S, v: &[[S; 3]; 4]) -> [[S; 3]; 4] {
    let mut sum = *u;
    for n in 0..4 {
        for c in 0..3 {
            sum[n][c] = a.mul_add(u[n][c], b * v[n][c]);
        }
    }
    sum
}

/// Returns the change of the edge along `d`, as a vector over the vertices.
#[inline(always)]
fn of_edge<S: Scalar>(d: &[S; 3]) -> [[S; 3]; 4] {
    [scaled(-S::one(), d), *d, [S::zero(); 3], [S::zero(); 3]]
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
        let square = fused_dot(&e, &e) + tiny;
        let length = square.sqrt();
        let (sine, cosine) = (length * fused_dot(&normal_a, &b), fused_dot(&normal_a, &normal_b));
        let [cos_0, sin_0] = *rest;
        let angle = (sine * cos_0 - cosine * sin_0).atan2(cosine * cos_0 + sine * sin_0);

        let of_a = length / (fused_dot(&normal_a, &normal_a) + tiny);
        let of_b = length / (fused_dot(&normal_b, &normal_b) + tiny);
        let (foot_a, foot_b) = (fused_dot(&a, &e) / square, fused_dot(&b, &e) / square);
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

    /// Bounds the Hessian of `theta = phi_A - phi_B`, the angles of the two triangles about the edge. For
    /// a triangle of height `h`, with `y = x_2 - foot`, the edge `e` of length `L`, and the unit vector
    /// of `e`, `t` and `n` as axes:
    ///
    /// `dx^T grad grad phi dx = -2 dy_n dy_t / h^2 - 2 de_n dy_e / (h L) - de_n de_t / L^2`.
    ///
    /// `2 a b <= (r a + b / r)^2 / 2` bounds a product, by its positive part if both have equal lengths.
    /// The last terms of both triangles together are `sin (phi_A - phi_B) / L^2` times a difference of
    /// squares along the two bisectors of the angle.
    #[inline(always)]
    fn positive_parts<S: Scalar>(x: &[[S; 3]; 4], rest: &[S; 2]) -> Option<[[[S; 3]; 4]; PARTS]> {
        let (angle, gradient) = Self::deviation(x, rest);
        let e = difference(&x[1], &x[0]);
        let square = fused_dot(&e, &e) + S::splat(TINY);
        let (length, half) = (square.sqrt(), S::splat(0.5));
        let unit = scaled(S::one() / length, &e);
        let sides = [
            HingeSide::new(&e, square, &difference(&x[2], &x[0])),
            HingeSide::new(&e, square, &difference(&x[3], &x[0])),
        ];
        let mut parts = [gradient; PARTS];
        for k in 0..2 {
            let (side, v) = (&sides[k], 2 + k);
            // Minus that of the angle for the first, whose angle grows with the whole, that for the second.
            let sign = S::one().copysign(if k == 0 { -angle } else { angle });
            let first = side.inverse_height * (half * angle.abs()).sqrt();
            let up = side.spread(&side.normal, v);
            parts[1 + 2 * k] = combined(first, &up, sign * first, &side.spread(&side.across, v));
            // Squares of the lengths of `de_n` and `dy_e`: 2 and |c|^2.
            let [a, b] = side.foot;
            let ratio = (half * (S::one() + a * a + b * b)).sqrt();
            let second = (angle.abs() * half * side.inverse_height / length).sqrt();
            let (root, turned) = (ratio.sqrt(), of_edge(&side.normal));
            parts[2 + 2 * k] = combined(second * root, &turned, sign * second / root, &side.spread(&unit, v));
        }
        let [a, b] = &sides;
        let curvature = angle * fused_dot(&b.normal, &a.across) / square;
        let line = difference(&a.across, &b.across);
        let inverse = S::one() / (fused_dot(&line, &line) + S::splat(TINY)).sqrt();
        let line = scaled(inverse, &line);
        let beside = cross(&unit, &line);
        let is_up = S::zero().lt(curvature);
        let mut along = line;
        for c in 0..3 {
            along[c] = curvature.abs().sqrt() * S::select(is_up, beside[c], line[c]);
        }
        parts[5] = of_edge(&along);
        Some(parts)
    }
}
