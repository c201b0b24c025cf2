//! Body-centred cubic lattice over the bounding box of a surface.

use super::inside::GridAxes;
use super::tree::BoxCorners;

/// Number of extra cubes on each side of the box.
const MARGIN: usize = 1;

/// Lattice points: corners `(i, j, k)` of cubes, and their centres. Corners are numbered first, the last
/// index fastest.
pub(super) struct CubicLattice {
    /// Number of cubes along each axis.
    pub(super) cubes: [usize; 3],
    /// Coordinates of the corners.
    corners: GridAxes,
    /// Coordinates of the centres.
    middles: GridAxes,
}

impl CubicLattice {
    /// Number of cubes along each axis for a box, margin included.
    pub(super) fn cubes_of(bounds: &BoxCorners, spacing: f64) -> [usize; 3] {
        // A side of a whole number of cubes, up to rounding, has that many.
        let cubes = |c: usize| ((bounds[1][c] - bounds[0][c]) / spacing - 1e-9).ceil().max(1.0);
        [0, 1, 2].map(|c| (cubes(c) as usize).saturating_add(2 * MARGIN))
    }

    /// Lattice centred on a box.
    pub(super) fn new(bounds: &BoxCorners, spacing: f64) -> CubicLattice {
        let cubes = CubicLattice::cubes_of(bounds, spacing);
        let axis = |c: usize, shift: f64| -> Vec<f64> {
            let middle = 0.5 * (bounds[0][c] + bounds[1][c]);
            let points = cubes[c] + usize::from(shift == 0.0);
            (0..points).map(|i| middle + spacing * (i as f64 + shift - 0.5 * cubes[c] as f64)).collect()
        };
        CubicLattice {
            cubes,
            corners: [0, 1, 2].map(|c| axis(c, 0.0)),
            middles: [0, 1, 2].map(|c| axis(c, 0.5)),
        }
    }

    /// Coordinates of the corners, and of the centres.
    pub(super) fn axes(&self) -> [&GridAxes; 2] {
        [&self.corners, &self.middles]
    }

    fn corner_count(&self) -> usize {
        self.cubes.iter().map(|n| n + 1).product()
    }

    /// Number of corners and centres.
    pub(super) fn point_count(&self) -> usize {
        self.corner_count() + self.cubes.iter().product::<usize>()
    }

    pub(super) fn corner(&self, [i, j, k]: [usize; 3]) -> u32 {
        ((i * (self.cubes[1] + 1) + j) * (self.cubes[2] + 1) + k) as u32
    }

    pub(super) fn middle(&self, [i, j, k]: [usize; 3]) -> u32 {
        (self.corner_count() + (i * self.cubes[1] + j) * self.cubes[2] + k) as u32
    }

    /// Position of a lattice point [m].
    pub(super) fn place(&self, point: u32) -> [f64; 3] {
        let (is_corner, [i, j, k]) = self.indices(point);
        let axes = if is_corner { &self.corners } else { &self.middles };
        [axes[0][i], axes[1][j], axes[2][k]]
    }

    /// Winding numbers in the order of the lattice points, from those on the grids of corners and of
    /// centres.
    pub(super) fn ordered(&self, windings: [Vec<i16>; 2]) -> Vec<i16> {
        let mut ordered = Vec::with_capacity(self.point_count());
        for (windings, axes) in windings.iter().zip(self.axes()) {
            let [nx, ny, nz] = [0, 1, 2].map(|c| axes[c].len());
            for i in 0..nx {
                ordered.extend((0..ny * nz).map(|row| windings[row * nx + i]));
            }
        }
        ordered
    }

    /// Calls `visit` with each pair of neighbours, and true for a pair at the distance of a cube edge;
    /// the other pairs are a centre and a corner of its cube.
    pub(super) fn for_each_edge(&self, mut visit: impl FnMut([u32; 2], bool)) {
        for_each(self.cubes.map(|n| n + 1), |at| {
            for axis in 0..3 {
                let next = step(at, axis);
                if at[axis] < self.cubes[axis] {
                    visit([self.corner(at), self.corner(next)], true);
                }
            }
        });
        for_each(self.cubes, |at| {
            for axis in 0..3 {
                let next = step(at, axis);
                if next[axis] < self.cubes[axis] {
                    visit([self.middle(at), self.middle(next)], true);
                }
            }
            for corner in self.corners_of(at) {
                visit([self.middle(at), corner], false);
            }
        });
    }

    /// Calls `visit` with each tetrahedron, right-handed: two centres, then two corners of the square
    /// between their cubes. Edges `01` and `23` are as long as a cube edge, the others are half of cube
    /// diagonals.
    pub(super) fn for_each_tetrahedron(&self, mut visit: impl FnMut([u32; 4])) {
        for_each(self.cubes, |at| {
            for axis in 0..3 {
                let next = step(at, axis);
                if next[axis] < self.cubes[axis] {
                    let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
                    let square = [next, step(next, b), step(step(next, b), c), step(next, c)];
                    let square = square.map(|corner| self.corner(corner));
                    for side in 0..4 {
                        let ends = [square[side], square[(side + 1) % 4]];
                        visit([self.middle(at), self.middle(next), ends[0], ends[1]]);
                    }
                }
            }
        });
    }

    /// Corners of a cube in the order of the nodes of a hexahedron.
    pub(super) fn corners_of(&self, [i, j, k]: [usize; 3]) -> [u32; 8] {
        let square = |k: usize| [[i, j, k], [i + 1, j, k], [i + 1, j + 1, k], [i, j + 1, k]];
        let [a, b, c, d] = square(k);
        let [e, f, g, h] = square(k + 1);
        [a, b, c, d, e, f, g, h].map(|corner| self.corner(corner))
    }

    /// Index of the cube of which a point is the lowest corner or the centre.
    pub(super) fn cube_of(&self, point: u32) -> usize {
        let [i, j, k] = self.indices(point).1;
        (i * (self.cubes[1] + 1) + j) * (self.cubes[2] + 1) + k
    }

    /// True for a corner, and the indices of the point.
    fn indices(&self, point: u32) -> (bool, [usize; 3]) {
        let corners = self.corner_count();
        let is_corner = (point as usize) < corners;
        let number = if is_corner { point as usize } else { point as usize - corners };
        let [ny, nz] = [1, 2].map(|c| self.cubes[c] + usize::from(is_corner));
        (is_corner, [number / (ny * nz), number / nz % ny, number % nz])
    }

    /// True if the sum of a point's indices is even: of the two ends of a cube edge, exactly one is even.
    pub(super) fn is_even(&self, point: u32) -> bool {
        self.indices(point).1.iter().sum::<usize>().is_multiple_of(2)
    }
}

fn step(mut at: [usize; 3], axis: usize) -> [usize; 3] {
    at[axis] += 1;
    at
}

/// Calls `visit` with each index triple below these counts, the last index fastest.
pub(super) fn for_each(counts: [usize; 3], mut visit: impl FnMut([usize; 3])) {
    for i in 0..counts[0] {
        for j in 0..counts[1] {
            for k in 0..counts[2] {
                visit([i, j, k]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{cross, dot, subtract};

    #[test]
    fn tetrahedra_fill_the_lattice_right_handed() {
        let lattice = CubicLattice::new(&[[0.0; 3], [1.0, 0.5, 0.75]], 0.25);
        assert_eq!(lattice.cubes, [6, 4, 5]);
        let mut volume = 0.0;
        lattice.for_each_tetrahedron(|cell| {
            let [a, b, c, d] = cell.map(|point| lattice.place(point));
            let [ab, ac, ad] = [b, c, d].map(|x| subtract(x, a));
            let own = dot(ab, cross(ac, ad)) / 6.0;
            assert!((own / (0.25f64.powi(3) / 12.0) - 1.0).abs() < 1e-12, "{own}");
            let square = |p: [f64; 3], q: [f64; 3]| dot(subtract(p, q), subtract(p, q)) * 16.0;
            assert!((square(a, b) - 1.0).abs() < 1e-12 && (square(c, d) - 1.0).abs() < 1e-12);
            for (p, q) in [(a, c), (a, d), (b, c), (b, d)] {
                assert!((square(p, q) - 0.75).abs() < 1e-12);
            }
            assert!(lattice.is_even(cell[0]) != lattice.is_even(cell[1]));
            assert!(lattice.is_even(cell[2]) != lattice.is_even(cell[3]));
            volume += own;
        });
        // Four tetrahedra fill the octahedron around each square between two cubes.
        let squares = 5 * 4 * 5 + 6 * 3 * 5 + 6 * 4 * 4;
        assert!((volume - f64::from(squares) * 0.25f64.powi(3) / 3.0).abs() < 1e-12);
    }

    #[test]
    fn edges_are_those_of_the_tetrahedra_and_of_the_rim() {
        let lattice = CubicLattice::new(&[[0.0; 3], [0.5; 3]], 0.25);
        let mut edges = vec![];
        lattice.for_each_edge(|[a, b], is_long| edges.push(([a.min(b), a.max(b)], is_long)));
        edges.sort_unstable();
        assert!(edges.windows(2).all(|pair| pair[0].0 != pair[1].0));
        lattice.for_each_tetrahedron(|cell| {
            for (a, b, is_long) in
                [(0, 1, true), (2, 3, true), (0, 2, false), (0, 3, false), (1, 2, false), (1, 3, false)]
            {
                let (a, b): (u32, u32) = (cell[a], cell[b]);
                assert!(edges.binary_search(&([a.min(b), a.max(b)], is_long)).is_ok());
            }
        });
    }
}
