//! Cells as values: nodes, edges, faces, shape functions and quadrature of a kind, and how files call it.
//!
//! A [`CellKind`] is what meshes, readers, writers and recordings ask; an [`Isoparametric`] is the same cell
//! for those who integrate over it, `J = sum_a X_a (dN_a/dxi)^T`. Kernels read its shape functions at the
//! quadrature points as numbers and are the same for every kind. Zienkiewicz, Taylor, Zhu 2013, *The Finite
//! Element Method: Its Basis and Fundamentals*, chapters 5 and 6.

use super::ElementDescription;
use crate::algebra::Mat;

/// Kind of cell. Nodes have VTK's order.
#[derive(Debug, PartialEq, Eq)]
pub struct CellKind {
    /// Its name, singular and plural.
    pub name: &'static str,
    /// More of them.
    pub plural: &'static str,
    /// Topological dimension.
    pub dimension: usize,
    /// Number of nodes.
    pub nodes: usize,
    /// Nodes at the ends of its edges.
    pub edges: &'static [[usize; 2]],
    /// Nodes of its sides: in 3D faces, counter-clockwise seen from outside; in 2D edges that run
    /// counter-clockwise about it.
    pub sides: &'static [&'static [usize]],
    /// Order of the nodes of its mirror image: node `a` of a cell that was mirrored was node `mirror[a]`.
    pub mirror: &'static [usize],
    /// Number of the type in VTK.
    pub vtk: u8,
    /// Number of the type in Gmsh.
    pub gmsh: u64,
    /// Name of the type in recordings, `topology/BODY.SUFFIX.u32`.
    pub suffix: &'static str,
    /// Description for `pliant list elements`.
    pub about: ElementDescription,
}

/// Cells of one kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CellBlock {
    /// Their kind.
    pub kind: &'static CellKind,
    /// Their vertices, flat `(cells, kind.nodes)`.
    pub vertices: Vec<u32>,
}

impl CellBlock {
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.vertices.len() / self.kind.nodes
    }

    /// True if it has no cells.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    /// The vertices of each cell.
    pub fn cells(&self) -> impl ExactSizeIterator<Item = &[u32]> + Clone {
        self.vertices.chunks_exact(self.kind.nodes)
    }

    /// The vertices of each cell of `N` nodes.
    ///
    /// # Panics
    /// If its cells have another number of nodes.
    pub fn of<const N: usize>(&self) -> &[[u32; N]] {
        assert_eq!(N, self.kind.nodes, "nodes of a {}", self.kind.name);
        self.vertices.as_chunks::<N>().0
    }

    /// The edges of all cells, lower vertex first; edges of several cells as often.
    pub fn edges(&self) -> impl Iterator<Item = [u32; 2]> {
        let edge = |cell: &[u32], [a, b]: [usize; 2]| [cell[a].min(cell[b]), cell[a].max(cell[b])];
        self.cells().flat_map(move |cell| self.kind.edges.iter().map(move |ends| edge(cell, *ends)))
    }

    /// The sides of all cells with `N` vertices, as [`CellKind::sides`] has them.
    pub fn sides<const N: usize>(&self) -> impl Iterator<Item = [u32; N]> {
        let sides = self.kind.sides.iter().filter(|side| side.len() == N);
        self.cells().flat_map(move |cell| {
            sides.clone().map(move |side| {
                let mut vertices = [0; N];
                vertices.iter_mut().zip(*side).for_each(|(vertex, node)| *vertex = cell[*node]);
                vertices
            })
        })
    }
}

/// Shape functions or their slopes at a place of the reference cell.
type At<const D: usize, T> = fn(&[f64; D]) -> T;

/// Isoparametric cell of `N` nodes in `D` dimensions.
#[derive(Clone, Copy, Debug)]
pub struct Isoparametric<const D: usize, const N: usize> {
    /// Its kind.
    pub kind: &'static CellKind,
    /// Places of its nodes in the reference cell.
    pub nodes: &'static [[f64; D]; N],
    /// Shape functions `N_a(xi)`.
    pub shape: At<D, [f64; N]>,
    /// Their slopes `dN_a/dxi_k`.
    pub slopes: At<D, [[f64; D]; N]>,
    /// Quadrature points of energy and mass, with weights whose sum is the volume of the reference cell.
    pub points: &'static [([f64; D], f64)],
}

impl<const D: usize, const N: usize> Isoparametric<D, N> {
    /// `J = dX/dxi` [m] at `xi` of the cell with these nodes.
    pub fn jacobian(&self, nodes: &[[f64; D]; N], xi: &[f64; D]) -> Mat<f64, D> {
        let mut j = Mat::zero();
        for (point, slope) in nodes.iter().zip((self.slopes)(xi)) {
            for r in 0..D {
                for c in 0..D {
                    // Measured from the first node: what is far from the origin loses no digits.
                    j[r][c] += (point[r] - nodes[0][r]) * slope[c];
                }
            }
        }
        j
    }

    /// Signed area [m^2] or volume [m^3]; exact for multilinear cells but for rounding.
    pub fn volume(&self, nodes: &[[f64; D]; N]) -> f64 {
        self.points.iter().map(|(xi, weight)| weight * self.jacobian(nodes, xi).determinant()).sum()
    }

    /// Least `det J` at the nodes and quadrature points, as a fraction of its mean: 1 for parallelepipeds,
    /// not positive for folded cells; NaN without volume.
    pub fn least_jacobian(&self, nodes: &[[f64; D]; N]) -> f64 {
        let at_points = self.least_at_points(nodes);
        self.nodes.iter().fold(at_points, |least, xi| least.min(self.relative_jacobian(nodes, xi)))
    }

    /// Least `det J` at the quadrature points alone, as a fraction of its mean; NaN without volume.
    pub fn least_at_points(&self, nodes: &[[f64; D]; N]) -> f64 {
        let at_points = self.points.iter().map(|(xi, _)| self.relative_jacobian(nodes, xi));
        at_points.reduce(f64::min).unwrap_or(f64::NAN)
    }

    fn relative_jacobian(&self, nodes: &[[f64; D]; N], xi: &[f64; D]) -> f64 {
        let reference: f64 = self.points.iter().map(|(_, weight)| weight).sum();
        let mean = self.volume(nodes) / reference;
        if mean == 0.0 { f64::NAN } else { self.jacobian(nodes, xi).determinant() / mean.abs() }
    }

    /// Shape of the cell between 0, flat at a node, and 1: the harmonic mean over its nodes of
    /// `D (det J)^(2/D) / |J|^2`. Knupp 2001, *Algebraic mesh quality metrics*, SIAM J. Sci. Comput. 23, 193.
    pub fn mean_ratio(&self, nodes: &[[f64; D]; N]) -> f64 {
        let inverse = |xi: &[f64; D]| {
            let j = self.jacobian(nodes, xi);
            j.norm_squared() / (D as f64 * j.determinant().max(0.0).powf(2.0 / D as f64))
        };
        N as f64 / self.nodes.iter().map(inverse).sum::<f64>()
    }

    /// Consistent masses for unit density, `integral of N_a N_b` [m^2 or m^3], by the quadrature of the
    /// energy: exact for parallelepipeds, and their row sums for every multilinear cell.
    pub fn consistent(&self, nodes: &[[f64; D]; N]) -> [[f64; N]; N] {
        let mut mass = [[0.0; N]; N];
        for (xi, weight) in self.points {
            let (shape, weight) = ((self.shape)(xi), weight * self.jacobian(nodes, xi).determinant());
            for (row, a) in mass.iter_mut().zip(&shape) {
                row.iter_mut().zip(&shape).for_each(|(entry, b)| *entry += weight * a * b);
            }
        }
        mass
    }

    /// Lumped masses for unit density, `integral of N_a` [m^2 or m^3]: the row sums of the consistent ones.
    pub fn lumped(&self, nodes: &[[f64; D]; N]) -> [f64; N] {
        let mut mass = [0.0; N];
        for (xi, weight) in self.points {
            let weight = weight * self.jacobian(nodes, xi).determinant();
            mass.iter_mut().zip((self.shape)(xi)).for_each(|(mass, shape)| *mass += weight * shape);
        }
        mass
    }

    /// Place `xi` of the point `at` of the cell with these nodes, by Newton's method from its centre; `None`
    /// where the point is far outside.
    pub fn locate(&self, nodes: &[[f64; D]; N], at: &[f64]) -> Option<[f64; D]> {
        /// Steps of Newton's method; a few are enough for a point in the cell.
        const MOST_STEPS: usize = 50;
        let size = |c: usize| nodes.iter().map(|p| (p[c] - nodes[0][c]).abs()).fold(0.0, f64::max);
        if (0..D).any(|c| (at[c] - nodes[0][c]).abs() > 2.0 * size(c)) {
            return None;
        }
        let mut xi = [0.0; D];
        for _ in 0..MOST_STEPS {
            let shape = (self.shape)(&xi);
            let mut off = [0.0; D];
            for c in 0..D {
                let found: f64 = shape.iter().zip(nodes).map(|(n, x)| n * (x[c] - nodes[0][c])).sum();
                off[c] = at[c] - nodes[0][c] - found;
            }
            let change = self.jacobian(nodes, &xi).inverse().mul_vec(&off);
            (0..D).for_each(|c| xi[c] += change[c]);
            if change.iter().all(|c| c.abs() <= 1e-10) {
                return Some(xi);
            }
            if xi.iter().any(|c| !c.is_finite() || c.abs() > 1e3) {
                return None;
            }
        }
        None
    }
}

/// Work on the isoparametric cell of some kind.
pub trait CellVisitor {
    /// Result of the work.
    type Output;

    /// Does the work for cells of `N` nodes in `D` dimensions.
    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Self::Output;
}

/// Registers kinds of cells.
macro_rules! cells {
    ($($cell:path;)+) => {
        /// Every kind of cell beside simplices.
        pub const CELL_KINDS: &[&CellKind] = &[$($cell.kind,)+];

        impl CellKind {
            /// Hands the isoparametric cell of this kind to `visitor`.
            ///
            /// # Panics
            /// If the kind is not registered.
            pub fn visit<V: CellVisitor>(&self, visitor: V) -> V::Output {
                $(
                    if *self == *$cell.kind {
                        return visitor.visit(&$cell);
                    }
                )+
                unreachable!("{} is not registered", self.name)
            }

            /// Number of its quadrature points.
            pub fn quadrature_points(&self) -> usize {
                let known = [$(($cell.kind, $cell.points.len()),)+];
                known.iter().find(|(kind, _)| *kind == self).map_or(0, |(_, points)| *points)
            }
        }
    };
}

cells! {
    super::quadrilateral::QUADRILATERAL;
    super::hexahedron::HEXAHEDRON;
}

#[cfg(test)]
mod tests;
