//! Exact predicates: the side of a plane on which a point lies, the intersection of an edge with a triangle.

use robust::{Coord, Coord3D};

use crate::geometry::{cross, dot, subtract};

/// Corners of a triangle.
pub(crate) type Corners = [[f64; 3]; 3];

fn point(x: &[f64; 3]) -> Coord3D<f64> {
    Coord3D { x: x[0], y: x[1], z: x[2] }
}

/// `det (a - d, b - d, c - d)` with exact sign: positive if `d` is below the plane of a triangle that is
/// counter-clockwise seen from above (J. R. Shewchuk, 1997).
pub(super) fn side([a, b, c]: &Corners, d: &[f64; 3]) -> f64 {
    robust::orient3d(point(a), point(b), point(c), point(d))
}

/// `(b - a) x (c - a)` of plane points, with exact sign.
pub(crate) fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let point = |x: [f64; 2]| Coord { x: x[0], y: x[1] };
    robust::orient2d(point(a), point(b), point(c))
}

/// Fraction of the segment from `p` to `q` at which it meets a triangle, sides and corners included;
/// `None` if it does not meet it, or lies in its plane. The decision is exact.
pub(super) fn meeting(triangle: &Corners, p: &[f64; 3], q: &[f64; 3]) -> Option<f64> {
    // The corners are sorted, so that their order in the file does not change the bits of the result.
    let mut corners = *triangle;
    corners.sort_unstable_by(|a, b| {
        a.iter().zip(b).fold(std::cmp::Ordering::Equal, |order, (a, b)| order.then(a.total_cmp(b)))
    });
    let (start, end) = (side(&corners, p), side(&corners, q));
    if (start > 0.0) == (end > 0.0) && (start < 0.0) == (end < 0.0) || !is_through(&corners, p, q, true) {
        return None;
    }
    Some((start / (start - end)).clamp(0.0, 1.0))
}

/// True if the line through `p` and `q` passes through the triangle; if `included`, also through its
/// sides and corners.
fn is_through([a, b, c]: &Corners, p: &[f64; 3], q: &[f64; 3], included: bool) -> bool {
    let turns = [[a, b], [b, c], [c, a]].map(|[from, to]| side(&[*p, *q, *from], to));
    if included {
        turns.iter().all(|t| *t >= 0.0) || turns.iter().all(|t| *t <= 0.0)
    } else {
        turns.iter().all(|t| *t > 0.0) || turns.iter().all(|t| *t < 0.0)
    }
}

/// True if an edge pierces the interior of a triangle, from strictly one side to strictly the other.
pub(crate) fn pierces(triangle: &Corners, p: &[f64; 3], q: &[f64; 3]) -> bool {
    let (start, end) = (side(triangle, p), side(triangle, q));
    (start < 0.0 && end > 0.0 || start > 0.0 && end < 0.0) && is_through(triangle, p, q, false)
}

/// Squared distance of a point from a triangle [m^2] (C. Ericson, Real-Time Collision Detection, 5.1.5).
pub(super) fn squared_distance([a, b, c]: &Corners, p: &[f64; 3]) -> f64 {
    let (ab, ac, ap) = (subtract(*b, *a), subtract(*c, *a), subtract(*p, *a));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return dot(ap, ap);
    }
    let bp = subtract(*p, *b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return dot(bp, bp);
    }
    let cp = subtract(*p, *c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return dot(cp, cp);
    }
    let from = |x: [f64; 3], along: [f64; 3], share: f64| {
        let offset = [0, 1, 2].map(|i| x[i] - share * along[i]);
        dot(offset, offset)
    };
    if d1 * d4 - d3 * d2 <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return from(ap, ab, d1 / (d1 - d3));
    }
    if d5 * d2 - d1 * d6 <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return from(ap, ac, d2 / (d2 - d6));
    }
    if d3 * d6 - d5 * d4 <= 0.0 && d4 >= d3 && d5 >= d6 {
        return from(bp, subtract(*c, *b), (d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let normal = cross(ab, ac);
    let height = dot(normal, ap);
    height * height / dot(normal, normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: Corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn edges_meet_sides_and_corners_and_nothing_beside_them() {
        let meet = |x: f64, y: f64| meeting(&TRIANGLE, &[x, y, -1.0], &[x, y, 3.0]);
        for (x, y) in [(0.25, 0.25), (0.5, 0.5), (0.0, 0.0), (1.0, 0.0), (0.0, 0.75)] {
            assert_eq!(meet(x, y), Some(0.25), "{x} {y}");
        }
        let least = f64::EPSILON / 2.0;
        for (x, y) in [(0.5, 0.5 + least), (-least, 0.0), (1.0 + 2.0 * least, 0.0)] {
            assert_eq!(meet(x, y), None, "{x} {y}");
        }
        assert_eq!(meeting(&TRIANGLE, &[0.2, 0.2, 0.0], &[0.2, 0.2, 1.0]), Some(0.0));
        assert_eq!(meeting(&TRIANGLE, &[0.2, 0.2, 1.0], &[0.2, 0.2, 2.0]), None);
        assert_eq!(meeting(&TRIANGLE, &[0.2, 0.2, 0.0], &[0.9, 0.9, 0.0]), None, "in the plane");
        assert!(pierces(&TRIANGLE, &[0.2, 0.2, -1.0], &[0.2, 0.2, 1.0]));
        assert!(!pierces(&TRIANGLE, &[0.5, 0.5, -1.0], &[0.5, 0.5, 1.0]), "a side");
        assert!(!pierces(&TRIANGLE, &[0.2, 0.2, 0.0], &[0.2, 0.2, 1.0]), "from its plane");
    }

    #[test]
    fn distances_are_from_the_inside_the_sides_and_the_corners() {
        let far = |x: f64, y: f64, z: f64| squared_distance(&TRIANGLE, &[x, y, z]);
        for ([x, y, z], expected) in [
            ([0.25, 0.25, 2.0], 4.0),
            ([0.5, -1.0, 0.0], 1.0),
            ([-2.0, 0.5, 0.0], 4.0),
            ([1.0, 1.0, 0.0], 0.5),
            ([-1.0, -1.0, 1.0], 3.0),
            ([3.0, -1.0, 0.0], 5.0),
            ([-1.0, 3.0, 0.0], 5.0),
        ] {
            assert!((far(x, y, z) - expected).abs() < 1e-15, "{x} {y} {z}");
        }
    }
}
