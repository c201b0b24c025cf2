//! Faces of elements, for what acts on a surface: edges in two dimensions, triangles in three. This is the one place that knows
//! their shape functions and quadrature.

/// A point of a reference face: its weight, as a share of the measure of the face, and the shape function of every vertex there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FacePoint<const D: usize> {
    /// Weights of a face sum to 1.
    pub weight: f64,
    /// Shape functions of a point sum to 1.
    pub shape: [f64; D],
}

/// Quadrature on a linear face with `D` vertices, exact for polynomials of degree 5 (edges: Gauss, 3 points) and 4 (triangles, 6
/// points: Dunavant 1985, *High degree efficient symmetrical Gaussian quadrature rules for the triangle*, Int. J. Numer. Meth.
/// Eng. 21, 1129, degree 4).
///
/// # Panics
/// If `D` is neither 2 nor 3.
pub fn face_points<const D: usize>() -> Vec<FacePoint<D>> {
    let point = |weight: f64, coordinates: &[f64]| {
        let mut shape = [0.0; D];
        shape.copy_from_slice(coordinates);
        FacePoint { weight, shape }
    };
    match D {
        2 => {
            let far = 0.5 * (1.0 - 0.6_f64.sqrt());
            let points = [(5.0 / 18.0, far), (4.0 / 9.0, 0.5), (5.0 / 18.0, 1.0 - far)];
            points.iter().map(|(w, s)| point(*w, &[1.0 - s, *s])).collect()
        }
        3 => {
            let orbits = [
                (0.223_381_589_678_011_47, 0.445_948_490_915_964_9),
                (0.109_951_743_655_321_87, 0.091_576_213_509_770_74),
            ];
            let three = orbits.iter().flat_map(|&(w, a)| (0..3).map(move |corner| (w, a, corner)));
            let shape =
                |a: f64, corner: usize| [0, 1, 2].map(|i| if i == corner { 1.0 - 2.0 * a } else { a });
            three.map(|(w, a, corner)| point(w, &shape(a, corner))).collect()
        }
        _ => unreachable!("faces are edges or triangles"),
    }
}

/// The vector area `n dA` of a linear face, out of the body: its edges run counter-clockwise about the body in two dimensions
/// (length [m]), its triangles are counter-clockwise seen from outside in three (area [m^2]).
pub fn vector_area<const D: usize>(x: &[[f64; D]; D]) -> [f64; D] {
    let mut area = [0.0; D];
    if D == 2 {
        (area[0], area[1]) = (x[1][1] - x[0][1], x[0][0] - x[1][0]);
    } else {
        let edge = |i: usize| [0, 1, 2].map(|c| x[i][c] - x[0][c]);
        area.copy_from_slice(&cross(edge(1), edge(2)).map(|c| 0.5 * c));
    }
    area
}

/// Cross product.
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integrals of monomials over the reference face, relative to its measure: `a! b! (d-1)! / (a + b + d - 1)!`.
    #[test]
    fn polynomials_are_integrated_exactly() {
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        for degree in 0..=5 {
            let found: f64 = face_points::<2>().iter().map(|p| p.weight * p.shape[1].powi(degree)).sum();
            assert!((found - 1.0 / f64::from(degree + 1)).abs() < 1e-15, "{degree}: {found}");
        }
        for (a, b) in (0..=4).flat_map(|a| (0..=4 - a).map(move |b| (a, b))) {
            let value = |p: &FacePoint<3>| p.shape[1].powi(a as i32) * p.shape[2].powi(b as i32);
            let found: f64 = face_points::<3>().iter().map(|p| p.weight * value(p)).sum();
            let exact = factorial(a) * factorial(b) * 2.0 / factorial(a + b + 2);
            assert!((found - exact).abs() < 1e-15, "{a} {b}: {found} {exact}");
        }
    }
}
