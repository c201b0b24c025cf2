//! Measures of simplices: signed volume and longest edge, safe against over- and underflow.

use pliant::lanes::hypot;

/// Measure of a simplex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SimplexMeasure {
    /// Signed volume [m^3], area [m^2] (non-negative if the simplex has no orientation) or length [m].
    pub volume: f64,
    /// Longest edge `h` [m].
    pub size: f64,
    /// `det Dm / h^d`, dimensionless.
    pub relative: f64,
    /// Sum of the squared edge lengths over `h^2`.
    pub relative_edges: f64,
}

pub(super) fn subtract(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Position, padded with zeros to three coordinates.
fn padded(point: &[f64]) -> [f64; 3] {
    let mut x = [0.0; 3];
    for (to, from) in x.iter_mut().zip(point) {
        *to = *from;
    }
    x
}

/// Longest of these edges of a cell [m].
pub(super) fn longest_edge<const D: usize>(nodes: &[[f64; D]], edges: &[[usize; 2]]) -> f64 {
    let length = |[a, b]: &[usize; 2]| (0..D).fold(0.0, |sum, c| hypot(sum, nodes[*b][c] - nodes[*a][c]));
    edges.iter().map(length).fold(0.0, f64::max)
}

/// Measures an edge, a triangle or a tetrahedron, `N` = 2, 3, 4.
///
/// `points` is flat, `(n, dimension)` [m], and contains every index of `cell`. Tetrahedra and triangles
/// in the plane are signed, triangles in space are not. Edges are divided by the largest coordinate
/// difference before any product, so that the test on `relative` is scale-invariant from 1e-150 m to
/// 1e150 m. NaN coordinates give NaN.
pub(super) fn measure<const N: usize>(points: &[f64], dimension: usize, cell: [u32; N]) -> SimplexMeasure {
    let x: [[f64; 3]; N] = cell.map(|i| padded(&points[i as usize * dimension..][..dimension]));
    let mut edges = [[0.0; 3]; 6];
    let mut count = 0;
    for a in 0..N {
        for b in a + 1..N {
            edges[count] = subtract(x[b], x[a]);
            count += 1;
        }
    }
    let edges = &mut edges[..count];
    let scale =
        edges.iter().flatten().fold(0.0_f64, |s, e| if e.abs() > s || e.is_nan() { e.abs() } else { s });
    if scale == 0.0 {
        return SimplexMeasure { volume: 0.0, size: 0.0, relative: 0.0, relative_edges: 0.0 };
    }
    edges.iter_mut().flatten().for_each(|e| *e /= scale);
    let squares: f64 = edges.iter().map(|e| dot(*e, *e)).sum();
    let longest = edges.iter().map(|e| dot(*e, *e)).fold(0.0_f64, f64::max).sqrt();
    // The first N - 1 edges start at vertex 0: they are the columns of Dm.
    let (determinant, factor) = match N {
        2 => (longest, 1.0),
        3 => {
            let normal = cross(edges[0], edges[1]);
            (if dimension == 2 { normal[2] } else { dot(normal, normal).sqrt() }, 2.0)
        }
        _ => (dot(edges[0], cross(edges[1], edges[2])), 6.0),
    };
    let power = N as i32 - 1;
    SimplexMeasure {
        volume: determinant / factor * scale.powi(power),
        size: longest * scale,
        relative: determinant / longest.powi(power),
        relative_edges: squares / (longest * longest),
    }
}
