//! Faces of elements, for surface terms: edges in 2D, triangles and quadrilaterals in 3D, of first and
//! second order. No other module has their shape functions and quadrature.
//!
//! The dimension `D` and the number of nodes `N` identify the face: 2 or 3 nodes in 2D; in 3D 3 or 6 of
//! triangles, 4, 8 or 9 of quadrilaterals. A face of second order may be curved. The order of its nodes
//! is: corners, middles of the edges `01, 12, 20` or `01, 12, 23, 30`, centre.

use super::multilinear::{self, GAUSS};
use super::quad8::QUAD8;
use super::quad9::QUAD9;
use super::second_order::{THREE, products};
use super::shape::TRIANGLE_EDGES;
use crate::algebra::cross;

/// Corners of the reference quadrilateral `[-1, 1]^2`.
const SQUARE: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// Quadrature point of a reference face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FacePoint<const N: usize> {
    /// Weight, as a fraction of the measure of the face; the weights of a face sum to 1.
    pub weight: f64,
    /// Shape function of each node; their sum is 1.
    pub shape: [f64; N],
    /// Derivatives of the shape functions with respect to the face coordinates `xi_k = lambda_k`,
    /// `k = 1 .. D - 1`; in 2D the second is 0. The coordinates of a quadrilateral run from 0 to 1.
    pub slopes: [[f64; 2]; N],
}

/// Returns the corners of the edges that have a middle node, in the order of these nodes.
pub const fn face_edges<const D: usize, const N: usize>() -> &'static [[usize; 2]] {
    match (D, N) {
        (2, 2) | (3, 3 | 4) => &[],
        (2, 3) => &[[0, 1]],
        (3, 6) => &TRIANGLE_EDGES,
        (3, 8 | 9) => QUAD8.kind.edges,
        _ => panic!("a face has 2 or 3 nodes in 2D, 3, 4, 6, 8 or 9 in 3D"),
    }
}

/// True if the face is a quadrilateral.
const fn is_quadrilateral<const D: usize, const N: usize>() -> bool {
    D == 3 && matches!(N, 4 | 8 | 9)
}

/// Returns the number of corners of a face.
pub(crate) const fn face_corners<const D: usize, const N: usize>() -> usize {
    if is_quadrilateral::<D, N>() { 4 } else { D }
}

/// Returns the point of a quadrilateral at `xi` in `[-1, 1]^2`.
fn square_point<const N: usize>(weight: f64, xi: [f64; 2]) -> FacePoint<N> {
    let (mut shape, mut slopes) = ([0.0; N], [[0.0; 2]; N]);
    match N {
        4 => {
            shape.copy_from_slice(&multilinear::shape(&SQUARE, &xi));
            slopes.copy_from_slice(&multilinear::slopes(&SQUARE, &xi));
        }
        8 => {
            shape.copy_from_slice(&(QUAD8.shape)(&xi));
            slopes.copy_from_slice(&(QUAD8.slopes)(&xi));
        }
        _ => {
            shape.copy_from_slice(&(QUAD9.shape)(&xi));
            slopes.copy_from_slice(&(QUAD9.slopes)(&xi));
        }
    }
    FacePoint { weight, shape, slopes: slopes.map(|slope| slope.map(|s| 2.0 * s)) }
}

/// Returns the point with the barycentric coordinates `lambda`.
fn face_point<const D: usize, const N: usize>(weight: f64, lambda: [f64; 3]) -> FacePoint<N> {
    let edges = face_edges::<D, N>();
    let (mut shape, mut slopes) = ([0.0; N], [[0.0; 2]; N]);
    // Adds `slope` times the derivative of `lambda_i`.
    let add = |slopes: &mut [f64; 2], i: usize, slope: f64| {
        for (k, entry) in slopes.iter_mut().enumerate().take(D - 1) {
            *entry += if i == 0 {
                -slope
            } else if i == k + 1 {
                slope
            } else {
                0.0
            };
        }
    };
    for i in 0..D {
        let l = lambda[i];
        let (value, slope) = if edges.is_empty() { (l, 1.0) } else { (l * (2.0 * l - 1.0), 4.0 * l - 1.0) };
        shape[i] = value;
        add(&mut slopes[i], i, slope);
    }
    for (a, &[i, j]) in (D..).zip(edges) {
        shape[a] = 4.0 * lambda[i] * lambda[j];
        add(&mut slopes[a], i, 4.0 * lambda[j]);
        add(&mut slopes[a], j, 4.0 * lambda[i]);
    }
    FacePoint { weight, shape, slopes }
}

/// Returns the quadrature points of a face, exact for degree 5 on edges (Gauss, 3 points) and 4 on
/// triangles (6 points: Dunavant 1985, *High degree efficient symmetrical Gaussian quadrature rules for
/// the triangle*, Int. J. Numer. Meth. Eng. 21, 1129, degree 4). On quadrilaterals the degree is 3 in
/// each coordinate (Gauss, 2 x 2 points), in second order 5 (3 x 3 points). This suffices for the force
/// of a uniform pressure on a curved face and for the volume behind it.
///
/// # Panics
/// If there is no such face.
pub fn face_points<const D: usize, const N: usize>() -> Vec<FacePoint<N>> {
    if D == 2 {
        let far = 0.5 * (1.0 - 0.6_f64.sqrt());
        let points = [(5.0 / 18.0, far), (4.0 / 9.0, 0.5), (5.0 / 18.0, 1.0 - far)];
        return points.iter().map(|(w, s)| face_point::<D, N>(*w, [1.0 - s, *s, 0.0])).collect();
    }
    if N > 6 {
        let points = products::<2, 3, 9>(&THREE);
        return points.iter().map(|(xi, weight)| square_point(0.25 * weight, *xi)).collect();
    }
    if is_quadrilateral::<D, N>() {
        return SQUARE.iter().map(|corner| square_point(0.25, corner.map(|c| GAUSS * c))).collect();
    }
    let orbits = [
        (0.223_381_589_678_011_47, 0.445_948_490_915_964_9),
        (0.109_951_743_655_321_87, 0.091_576_213_509_770_74),
    ];
    let three = orbits.iter().flat_map(|&(w, a)| (0..3).map(move |corner| (w, a, corner)));
    let lambda = |a: f64, corner: usize| [0, 1, 2].map(|i| if i == corner { 1.0 - 2.0 * a } else { a });
    three.map(|(w, a, corner)| face_point::<D, N>(w, lambda(a, corner))).collect()
}

/// Returns the midpoint of a face, with the weight of the whole face.
pub fn face_middle<const D: usize, const N: usize>() -> FacePoint<N> {
    if is_quadrilateral::<D, N>() {
        square_point(1.0, [0.0; 2])
    } else {
        face_point::<D, N>(1.0, [1.0 / D as f64; 3])
    }
}

/// Returns the outward vector area `n dA` of a face with the nodes `x`, as if it were constant with its
/// value at `point`, as on a first-order edge or triangle. Edges run counter-clockwise about the body in
/// 2D (length [m]); triangles are counter-clockwise seen from outside in 3D (area [m^2]).
pub fn vector_area<const D: usize, const N: usize>(x: &[[f64; D]; N], point: &FacePoint<N>) -> [f64; D] {
    let [s, t] = tangents(x, point);
    let mut area = [0.0; D];
    if D == 2 {
        (area[0], area[1]) = (s[1], -s[0]);
    } else {
        area.copy_from_slice(&cross(&s, &t).map(|c| share::<D, N>() * c));
    }
    area
}

/// Returns the area of the reference face in 3D.
const fn share<const D: usize, const N: usize>() -> f64 {
    if is_quadrilateral::<D, N>() { 1.0 } else { 0.5 }
}

/// Returns the derivatives of the position on a face with respect to its coordinates.
fn tangents<const D: usize, const N: usize>(x: &[[f64; D]; N], point: &FacePoint<N>) -> [[f64; 3]; 2] {
    let mut tangents = [[0.0; 3]; 2];
    // Relative to the first corner: positions far from the origin lose no digits.
    for (x_a, slopes) in x.iter().zip(&point.slopes).skip(1) {
        for c in 0..D {
            (0..2).for_each(|k| tangents[k][c] += slopes[k] * (x_a[c] - x[0][c]));
        }
    }
    tangents
}

/// Returns the derivative of [`vector_area`] with respect to node `j`, applied to `u`, or its transpose.
pub fn area_rate<const D: usize, const N: usize>(
    x: &[[f64; D]; N],
    point: &FacePoint<N>,
    j: usize,
    u: [f64; D],
    transposed: bool,
) -> [f64; D] {
    let mut rate = [0.0; D];
    let sign = if transposed { -1.0 } else { 1.0 };
    let slope = point.slopes[j];
    if D == 2 {
        // A quarter turn to the right; the transpose turns back.
        (rate[0], rate[1]) = (sign * slope[0] * u[1], -sign * slope[0] * u[0]);
    } else {
        // 1/2 (slope_0 u x t + s x slope_1 u).
        let [s, t] = tangents(x, point);
        let factor = sign * share::<D, N>();
        let across = [0, 1, 2].map(|c| factor * (slope[1] * s[c] - slope[0] * t[c]));
        rate.copy_from_slice(&cross(&across, &[0, 1, 2].map(|c| u[c])));
    }
    rate
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integrals of monomials over the reference face, relative to its measure: `a! b! (d-1)! / (a + b + d -
    /// 1)!`.
    #[test]
    fn polynomials_are_integrated_exactly() {
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        for degree in 0..=5 {
            let found: f64 = face_points::<2, 2>().iter().map(|p| p.weight * p.shape[1].powi(degree)).sum();
            assert!((found - 1.0 / f64::from(degree + 1)).abs() < 1e-15, "{degree}: {found}");
        }
        for (a, b) in (0..=4).flat_map(|a| (0..=4 - a).map(move |b| (a, b))) {
            let value = |p: &FacePoint<3>| p.shape[1].powi(a as i32) * p.shape[2].powi(b as i32);
            let found: f64 = face_points::<3, 3>().iter().map(|p| p.weight * value(p)).sum();
            let exact = factorial(a) * factorial(b) * 2.0 / factorial(a + b + 2);
            assert!((found - exact).abs() < 1e-15, "{a} {b}: {found} {exact}");
        }
    }

    fn is_a_lagrange_basis<const D: usize, const N: usize>() {
        let corner = |i: usize| [0, 1, 2].map(|k| f64::from(u8::from(k == i)));
        let mut nodes: Vec<[f64; 3]> = (0..D).map(corner).collect();
        for [i, j] in face_edges::<D, N>() {
            nodes.push([0, 1, 2].map(|k| 0.5 * (nodes[*i][k] + nodes[*j][k])));
        }
        for (a, node) in nodes.iter().enumerate() {
            let shape = face_point::<D, N>(1.0, *node).shape;
            assert!(
                (0..N).all(|b| shape[b] == f64::from(u8::from(a == b))),
                "{D}D, {N} nodes: {a} {shape:?}"
            );
        }
        for point in face_points::<D, N>() {
            assert!((point.shape.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        }
        // Central differences of quadratic functions are exact.
        let lambda = [0.5, 0.3, if D == 2 { 0.0 } else { 0.2 }];
        for k in 0..D - 1 {
            let moved = |step: f64| {
                let mut at = lambda;
                (at[0], at[k + 1]) = (at[0] - step, at[k + 1] + step);
                face_point::<D, N>(1.0, at).shape
            };
            let (ahead, behind, found) =
                (moved(0.125), moved(-0.125), face_point::<D, N>(1.0, lambda).slopes);
            assert!((0..N).all(|a| (found[a][k] - 4.0 * (ahead[a] - behind[a])).abs() < 1e-14));
        }
    }

    #[test]
    fn shape_functions_are_one_at_their_node_and_zero_at_the_others_and_have_these_slopes() {
        is_a_lagrange_basis::<2, 2>();
        is_a_lagrange_basis::<3, 3>();
        is_a_lagrange_basis::<2, 3>();
        is_a_lagrange_basis::<3, 6>();
    }

    /// Checks the volume under `z = 1 + x y^2 / 4` over a square from the flux through its curved top.
    #[test]
    fn the_flux_through_a_curved_quadrilateral_is_the_volume_under_it() {
        fn flux<const N: usize>(nodes: &[[f64; 2]; N]) -> f64 {
            let x = nodes.map(|[x, y]| [x, y, 1.0 + 0.25 * x * y * y]);
            let at = |p: &FacePoint<N>| {
                let height: f64 = p.shape.iter().zip(&x).map(|(n, x)| n * x[2]).sum();
                p.weight * height * vector_area(&x, p)[2]
            };
            face_points::<3, N>().iter().map(at).sum()
        }
        assert!((flux(QUAD8.nodes) - 4.0).abs() < 1e-14);
        assert!((flux(QUAD9.nodes) - 4.0).abs() < 1e-14);
        // The square is off the axes of symmetry.
        let lifted = |nodes: &[[f64; 2]; 9]| nodes.map(|[x, y]| [x + 1.0, y]);
        assert!((flux(&lifted(QUAD9.nodes)) - 4.0 * (1.0 + 0.25 / 3.0)).abs() < 1e-14);
    }

    #[test]
    fn a_flat_quadrilateral_has_its_area_at_every_point() {
        let x = [[1.0, 2.0, 3.0], [3.0, 2.0, 3.0], [3.0, 2.0, 7.0], [1.0, 2.0, 7.0]];
        let points = face_points::<3, 4>();
        assert!((points.iter().map(|p| p.weight).sum::<f64>() - 1.0).abs() < 1e-15);
        for point in points.iter().chain([&face_middle::<3, 4>()]) {
            let area = vector_area(&x, point);
            assert!((area[1] + 8.0).abs() < 1e-14 && area[0] == 0.0 && area[2] == 0.0, "{area:?}");
            assert!((point.shape.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        }
    }
}
