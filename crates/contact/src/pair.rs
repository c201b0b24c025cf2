//! Geometry of a pair whose closest points lie inside both primitives: coefficients of its vertices,
//! normal and tangents.
//!
//! Coefficients depend on the parameters of the closest points, `c(beta) = c_0 + sum_j beta_j c_j'`, so
//! `r(beta) = sum c_i x_i` with `t_j = dr/dbeta_j = sum c_j'_i x_i`, and `beta` minimises `|r|`. Closest
//! points on the boundary of a primitive are those of a pair of smaller primitives, see
//! [`closest`](crate::closest).

use crate::vector::{along, difference, dot, inverse_or_zero, mixture, scaled};
use pliant::scalar::Scalar;

/// Kind of pair: `N` vertices, `P` parameters of its closest points.
pub trait PairKind<const N: usize, const P: usize> {
    /// `c_0`.
    const START: [f64; N];
    /// `c_j'`.
    const SLOPES: [[f64; N]; P];
    /// Number of vertices of the first primitive.
    const FIRST: usize;
}

/// Pair of two points.
#[derive(Clone, Copy, Debug)]
pub struct PointPoint;
/// Point and edge, the closest point between the edge's ends.
#[derive(Clone, Copy, Debug)]
pub struct PointEdge;
/// Point and triangle, the closest point inside the triangle.
#[derive(Clone, Copy, Debug)]
pub struct PointTriangle;
/// Two crossing edges, two vertices each.
#[derive(Clone, Copy, Debug)]
pub struct EdgeEdge;

impl PairKind<2, 0> for PointPoint {
    const START: [f64; 2] = [1.0, -1.0];
    const SLOPES: [[f64; 2]; 0] = [];
    const FIRST: usize = 1;
}

impl PairKind<3, 1> for PointEdge {
    const START: [f64; 3] = [1.0, -1.0, 0.0];
    const SLOPES: [[f64; 3]; 1] = [[0.0, 1.0, -1.0]];
    const FIRST: usize = 1;
}

impl PairKind<4, 2> for PointTriangle {
    const START: [f64; 4] = [1.0, -1.0, 0.0, 0.0];
    const SLOPES: [[f64; 4]; 2] = [[0.0, 1.0, -1.0, 0.0], [0.0, 1.0, 0.0, -1.0]];
    const FIRST: usize = 1;
}

impl PairKind<4, 2> for EdgeEdge {
    const START: [f64; 4] = [1.0, 0.0, -1.0, 0.0];
    const SLOPES: [[f64; 4]; 2] = [[-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0]];
    const FIRST: usize = 2;
}

/// Closest points of the lines or planes that a pair spans, and the frame of its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct PairGeometry<S, const D: usize, const N: usize, const P: usize> {
    /// `c`: `r = sum c_i x_i`.
    pub coefficients: [S; N],
    /// `R^-T c'`, with `T = E R` the tangents `t_j` in an orthonormal basis [1/m].
    pub slopes: [[S; N]; P],
    /// `E`: orthonormal basis of the tangents `t_j`; orthogonal to the normal.
    pub tangents: [[S; D]; P],
    /// `n = r / d`; zero if `d` is zero.
    pub normal: [S; D],
    /// `d` [m].
    pub distance: S,
    /// `d^2` [m^2].
    pub squared_distance: S,
}

impl<S: Scalar, const D: usize, const N: usize, const P: usize> PairGeometry<S, D, N, P> {
    /// Geometry of the kind `K` at the positions `x` [m].
    #[inline(always)]
    pub fn of<K: PairKind<N, P>>(x: &[[S; D]; N]) -> Self {
        let x = &relative(x);
        let mut c = splat(&K::START);
        let mut slopes = [[S::zero(); N]; P];
        let mut tangents = [[S::zero(); D]; P];
        for j in 0..P {
            let slope = splat(&K::SLOPES[j]);
            let (mut row, mut t) = (slope, mixture(&slope, x));
            for k in 0..j {
                // Twice: the first pass leaves rounding relative to the whole of `t`.
                for _ in 0..2 {
                    let part = -dot(&t, &tangents[k]);
                    t = along(&t, part, &tangents[k]);
                    row = along(&row, part, &slopes[k]);
                }
            }
            let inverse = inverse_or_zero(dot(&t, &t).sqrt());
            tangents[j] = scaled(inverse, &t);
            slopes[j] = scaled(inverse, &row);
        }
        let mut r = mixture(&c, x);
        for _ in 0..2 {
            for j in 0..P {
                let part = -dot(&r, &tangents[j]);
                r = along(&r, part, &tangents[j]);
                c = along(&c, part, &slopes[j]);
            }
        }
        let squared_distance = dot(&r, &r);
        let distance = squared_distance.sqrt();
        let normal = scaled(inverse_or_zero(distance), &r);
        PairGeometry { coefficients: c, slopes, tangents, normal, distance, squared_distance }
    }

    /// Gradient `dE/dx_i = 2 E'(D) d c_i n` [N] from `E' = dE/dD` [J/m^2].
    #[inline(always)]
    pub fn gradient(&self, slope: S) -> [[S; D]; N] {
        let force = scaled((slope + slope) * self.distance, &self.normal);
        let mut gradient = [[S::zero(); D]; N];
        for i in 0..N {
            gradient[i] = scaled(self.coefficients[i], &force);
        }
        gradient
    }
}

/// Broadcasts constants to every lane.
#[inline(always)]
fn splat<S: Scalar, const N: usize>(constants: &[f64; N]) -> [S; N] {
    let mut all = [S::zero(); N];
    for i in 0..N {
        all[i] = S::splat(constants[i]);
    }
    all
}

/// Positions relative to the first. This keeps the digits of differences far from the origin.
#[inline(always)]
pub(crate) fn relative<S: Scalar, const D: usize, const N: usize>(x: &[[S; D]; N]) -> [[S; D]; N] {
    let mut moved = *x;
    for i in 0..N {
        moved[i] = difference(&x[i], &x[0]);
    }
    moved
}
