//! Exact winding numbers of a closed surface around the points of a grid.

use super::exact::{Corners, side, turn};

/// Coordinates of a grid of points along each axis, ascending [m].
pub(super) type GridAxes = [Vec<f64>; 3];

/// Winding number around each point `(x_i, y_j, z_k)` of a grid, at index `(j nz + k) nx + i`: 1 inside
/// and 0 outside of a surface that is counter-clockwise seen from outside.
///
/// The sum counts the triangles that a line along x crosses beyond the point, with the sign of their
/// normals. Signs are exact. A point on the surface is perturbed symbolically, by an infinitesimal along
/// x and smaller ones along y and z. Lines then meet no edge and no corner, and neighbouring points
/// differ only if the surface is between them.
pub(super) fn windings(triangles: impl Iterator<Item = Corners>, axes: &GridAxes) -> Vec<i16> {
    let [nx, ny, nz] = [0, 1, 2].map(|axis| axes[axis].len());
    let mut windings = vec![0i16; nx * ny * nz];
    for [a, mut b, mut c] in triangles {
        // Projection of the triangle along x, counter-clockwise.
        let flat = |x: &[f64; 3]| [x[1], x[2]];
        let area = turn(flat(&a), flat(&b), flat(&c));
        if area == 0.0 {
            continue;
        }
        let sign = if area > 0.0 { 1 } else { -1 };
        if area < 0.0 {
            std::mem::swap(&mut b, &mut c);
        }
        // Grid lines within the bounding box of the projection.
        let [js, ks] = [1, 2].map(|axis| {
            let [low, high] = [f64::min, f64::max].map(|pick| pick(a[axis], pick(b[axis], c[axis])));
            let before = |limit: f64| axes[axis].partition_point(|x| *x < limit);
            before(low)..axes[axis].partition_point(|x| *x <= high)
        });
        for j in js {
            for k in ks.clone() {
                let place = [axes[1][j], axes[2][k]];
                let sides = [[&a, &b], [&b, &c], [&c, &a]];
                if sides.iter().all(|[from, to]| is_left(flat(from), flat(to), place)) {
                    // With the corners swapped the normal of the triangle points along x.
                    let is_before = |x: &f64| side(&[a, b, c], &[*x, place[0], place[1]]) > 0.0;
                    let count = axes[0].partition_point(is_before);
                    if count > 0 {
                        let winding = &mut windings[(j * nz + k) * nx + count - 1];
                        *winding = winding.saturating_add(sign);
                    }
                }
            }
        }
    }
    // Sums along x: each crossing counts for all points before it.
    for row in windings.chunks_exact_mut(nx.max(1)) {
        for i in (1..nx).rev() {
            row[i - 1] = row[i - 1].saturating_add(row[i]);
        }
    }
    windings
}

/// True if a symbolically perturbed point is to the left of the line from `a` to `b`.
fn is_left(a: [f64; 2], b: [f64; 2], place: [f64; 2]) -> bool {
    let area = turn(a, b, place);
    if area != 0.0 {
        return area > 0.0;
    }
    // The sign of the perturbation: derivative with respect to the first coordinate, then the second.
    if a[1] == b[1] { b[0] > a[0] } else { b[1] < a[1] }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The surface of the cube from 0 to 1, counter-clockwise seen from outside.
    pub(crate) fn cube() -> Vec<Corners> {
        let mut triangles = vec![];
        for axis in 0..3 {
            for end in [0.0, 1.0] {
                let corner = |u: f64, v: f64| {
                    let mut x = [0.0; 3];
                    (x[axis], x[(axis + 1) % 3], x[(axis + 2) % 3]) = (end, u, v);
                    x
                };
                let [a, b, c, d] = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
                let both = if end > 0.0 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
                triangles.extend(both);
            }
        }
        triangles
    }

    /// Points on faces, edges, diagonals and corners: half of the faces belong to the cube.
    #[test]
    fn a_cube_holds_the_points_of_a_grid_that_lies_on_its_faces() {
        let axis: Vec<f64> = (-2..=6).map(|i| f64::from(i) * 0.25).collect();
        let axes = [axis.clone(), axis.clone(), axis.clone()];
        let windings = windings(cube().into_iter(), &axes);
        let within = |x: f64| (0.0..1.0).contains(&x);
        for (j, y) in axis.iter().enumerate() {
            for (k, z) in axis.iter().enumerate() {
                for (i, x) in axis.iter().enumerate() {
                    let expected = i16::from(within(*x) && within(*y) && within(*z));
                    assert_eq!(windings[(j * 9 + k) * 9 + i], expected, "{x} {y} {z}");
                }
            }
        }
    }

    #[test]
    fn surfaces_count_as_often_as_they_wind_around_a_point() {
        let larger = |by: f64| cube().into_iter().map(move |t| t.map(|x| x.map(|c| 0.5 + by * (c - 0.5))));
        let at = |triangles: Vec<Corners>| {
            windings(triangles.into_iter(), &[vec![-2.0, 0.4], vec![0.3], vec![0.6]])
        };
        assert_eq!(at(cube().into_iter().chain(larger(3.0)).collect()), [0, 2]);
        let inwards = cube().into_iter().map(|[a, b, c]| [a, c, b]);
        assert_eq!(at(inwards.clone().chain(larger(3.0)).collect()), [0, 0]);
        assert_eq!(at(inwards.collect()), [0, -1]);
    }
}
