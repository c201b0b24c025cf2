//! Kinds of cells: nodes, edges, faces, shape functions, quadrature and their types in file formats.
//!
//! Meshes, readers, writers and recordings use a [`CellKind`]. Integrals over the cell use an
//! [`Isoparametric`], with `J = sum_a X_a (dN_a/dxi)^T`. Kernels read its shape functions at the
//! quadrature points as numbers and are the same for every kind. Source: Zienkiewicz, Taylor, Zhu
//! 2013, *The Finite Element Method: Its Basis and Fundamentals*, chapters 5 and 6.

use std::any::Any;

use super::ElementDescription;
use crate::algebra::Mat;

/// Kind of cell. Nodes are in VTK's order: corners, then middles of edges, of faces and of the cell.
#[derive(Debug, PartialEq, Eq)]
pub struct CellKind {
    /// Name, singular.
    pub name: &'static str,
    /// Name, plural.
    pub plural: &'static str,
    /// Topological dimension.
    pub dimension: usize,
    /// Number of nodes.
    pub nodes: usize,
    /// Number of corners, equal to the number of nodes in a cell of first order.
    pub corners: usize,
    /// Nodes at the ends of each edge. In second order the node in the middle of edge `k` is
    /// `corners + k`.
    pub edges: &'static [[usize; 2]],
    /// Corners of each side: in 3D faces, counter-clockwise seen from outside; in 2D edges,
    /// counter-clockwise around the cell. Nodes in the middle of faces, if any, follow those of edges in
    /// this order.
    pub sides: &'static [&'static [usize]],
    /// Node order of the mirror image: node `a` of a mirrored cell was node `mirror[a]`.
    pub mirror: &'static [usize],
    /// Type number in VTK.
    pub vtk: u8,
    /// Type number in Gmsh.
    pub gmsh: u64,
    /// Position of each node in Gmsh's order; empty if the orders agree.
    pub gmsh_nodes: &'static [usize],
    /// Type name in recordings, `topology/BODY.SUFFIX.u32`.
    pub suffix: &'static str,
    /// Description for `pliant list elements`.
    pub about: ElementDescription,
}

impl CellKind {
    /// Returns 2 if the cell has nodes in the middle of its edges, otherwise 1.
    pub const fn order(&self) -> usize {
        if self.nodes > self.corners { 2 } else { 1 }
    }

    /// Returns the second-order kind with the same corners: with the most nodes (Lagrange) or with the
    /// fewest (serendipity). `None` for a kind of second order.
    pub fn of_second_order(&self, serendipity: bool) -> Option<&'static CellKind> {
        let fits = |kind: &&&CellKind| kind.order() == 2 && self.order() == 1 && kind.edges == self.edges;
        let kinds = || CELL_KINDS.iter().filter(fits).copied();
        if serendipity {
            kinds().min_by_key(|kind| kind.nodes)
        } else {
            kinds().max_by_key(|kind| kind.nodes)
        }
    }

    /// Returns the first-order kind with the same corners.
    pub fn of_first_order(&self) -> Option<&'static CellKind> {
        CELL_KINDS.iter().find(|kind| kind.order() == 1 && kind.edges == self.edges).copied()
    }

    /// Returns the nodes in the middle of the faces in 3D, in the order of `sides`; empty if faces have
    /// none.
    pub fn face_nodes(&self) -> std::ops::Range<usize> {
        let first = self.corners + self.edges.len();
        let has_faces = self.dimension == 3 && self.nodes >= first + self.sides.len();
        first..if has_faces { first + self.sides.len() } else { first }
    }
}

/// Cells of one kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CellBlock {
    /// Kind of the cells.
    pub kind: &'static CellKind,
    /// Vertices of the cells, flat `(cells, kind.nodes)`.
    pub vertices: Vec<u32>,
}

impl CellBlock {
    /// Returns the number of cells.
    pub fn len(&self) -> usize {
        self.vertices.len() / self.kind.nodes
    }

    /// True if the block has no cells.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    /// Returns the vertices of each cell.
    pub fn cells(&self) -> impl ExactSizeIterator<Item = &[u32]> + Clone {
        self.vertices.chunks_exact(self.kind.nodes)
    }

    /// Returns the cells of first order with the same corners.
    #[must_use]
    pub fn of_first_order(&self) -> CellBlock {
        let Some(kind) = self.kind.of_first_order() else { return self.clone() };
        CellBlock { kind, vertices: self.cells().flat_map(|cell| &cell[..kind.nodes]).copied().collect() }
    }

    /// Returns the vertices of each cell of `N` nodes.
    ///
    /// # Panics
    /// If the cells have another number of nodes.
    pub fn of<const N: usize>(&self) -> &[[u32; N]] {
        assert_eq!(N, self.kind.nodes, "nodes of a {}", self.kind.name);
        self.vertices.as_chunks::<N>().0
    }

    /// Returns the edges of all cells, lower vertex first; an edge of several cells appears as often.
    pub fn edges(&self) -> impl Iterator<Item = [u32; 2]> {
        let edge = |cell: &[u32], [a, b]: [usize; 2]| [cell[a].min(cell[b]), cell[a].max(cell[b])];
        self.cells().flat_map(move |cell| self.kind.edges.iter().map(move |ends| edge(cell, *ends)))
    }

    /// Returns the sides of all cells that have `N` vertices, ordered as in [`CellKind::sides`].
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

/// Shape functions or their derivatives at a position in the reference cell.
type At<const D: usize, T> = fn(&[f64; D]) -> T;

/// Isoparametric cell of `N` nodes in `D` dimensions.
#[derive(Clone, Copy, Debug)]
pub struct Isoparametric<const D: usize, const N: usize> {
    /// Kind of the cell.
    pub kind: &'static CellKind,
    /// Positions of the nodes in the reference cell.
    pub nodes: &'static [[f64; D]; N],
    /// Shape functions `N_a(xi)`.
    pub shape: At<D, [f64; N]>,
    /// Derivatives `dN_a/dxi_k` of the shape functions.
    pub slopes: At<D, [[f64; D]; N]>,
    /// Quadrature points of the energy, in first order also of the mass, with weights whose sum is the
    /// volume of the reference cell.
    pub points: &'static [([f64; D], f64)],
    /// Derivatives of the shape functions at these points, for kernels; in second order only.
    pub slopes_at_points: &'static [[[f64; D]; N]],
}

impl<const D: usize, const N: usize> Isoparametric<D, N> {
    /// Returns `J = dX/dxi` [m] at `xi` of the cell with these nodes.
    pub fn jacobian(&self, nodes: &[[f64; D]; N], xi: &[f64; D]) -> Mat<f64, D> {
        let mut j = Mat::zero();
        for (point, slope) in nodes.iter().zip((self.slopes)(xi)) {
            for r in 0..D {
                for c in 0..D {
                    // Relative to the first node: positions far from the origin lose no digits.
                    j[r][c] += (point[r] - nodes[0][r]) * slope[c];
                }
            }
        }
        j
    }

    /// Returns the signed area [m^2] or volume [m^3]. In first order it is exact up to rounding; in
    /// second order it is the sum over the points of the energy, exact if sides are straight.
    pub fn volume(&self, nodes: &[[f64; D]; N]) -> f64 {
        self.points.iter().map(|(xi, weight)| weight * self.jacobian(nodes, xi).determinant()).sum()
    }

    /// Returns the least `det J` at the nodes and quadrature points, relative to the mean: 1 for
    /// parallelepipeds, not positive for folded cells; NaN without volume.
    pub fn least_jacobian(&self, nodes: &[[f64; D]; N]) -> f64 {
        let at_points = self.least_at_points(nodes);
        self.nodes.iter().fold(at_points, |least, xi| least.min(self.relative_jacobian(nodes, xi)))
    }

    /// Returns the least `det J` at the quadrature points only, relative to the mean; NaN without volume.
    pub fn least_at_points(&self, nodes: &[[f64; D]; N]) -> f64 {
        let at_points = self.points.iter().map(|(xi, _)| self.relative_jacobian(nodes, xi));
        at_points.reduce(f64::min).unwrap_or(f64::NAN)
    }

    fn relative_jacobian(&self, nodes: &[[f64; D]; N], xi: &[f64; D]) -> f64 {
        let reference: f64 = self.points.iter().map(|(_, weight)| weight).sum();
        let mean = self.volume(nodes) / reference;
        if mean == 0.0 { f64::NAN } else { self.jacobian(nodes, xi).determinant() / mean.abs() }
    }

    /// Returns the shape quality, from 0 (flat at a node) to 1: the harmonic mean over the nodes of
    /// `D (det J)^(2/D) / |J|^2`. Source: Knupp 2001, *Algebraic mesh quality metrics*, SIAM J. Sci.
    /// Comput. 23, 193.
    pub fn mean_ratio(&self, nodes: &[[f64; D]; N]) -> f64 {
        let inverse = |xi: &[f64; D]| {
            let j = self.jacobian(nodes, xi);
            j.norm_squared() / (D as f64 * j.determinant().max(0.0).powf(2.0 / D as f64))
        };
        N as f64 / self.nodes.iter().map(inverse).sum::<f64>()
    }

    /// Returns the consistent mass matrix of a first-order cell for unit density, `integral of N_a N_b`
    /// [m^2 or m^3], by the quadrature of the energy; [`MassRule`](super::MassRule) has second order.
    /// Entries are exact for parallelepipeds, row sums for every multilinear cell.
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

    /// Returns the lumped masses of a first-order cell for unit density, `integral of N_a` [m^2 or m^3]:
    /// the row sums of the consistent mass matrix.
    pub fn lumped(&self, nodes: &[[f64; D]; N]) -> [f64; N] {
        let mut mass = [0.0; N];
        for (xi, weight) in self.points {
            let weight = weight * self.jacobian(nodes, xi).determinant();
            mass.iter_mut().zip((self.shape)(xi)).for_each(|(mass, shape)| *mass += weight * shape);
        }
        mass
    }

    /// Returns the reference coordinates `xi` of the point `at`, by Newton's method from the centre of
    /// the cell; `None` if the point is far outside.
    pub fn locate(&self, nodes: &[[f64; D]; N], at: &[f64]) -> Option<[f64; D]> {
        /// Limit on Newton steps; a few are enough for a point in the cell.
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

/// Computation with the isoparametric cell of some kind.
pub trait CellVisitor {
    /// Result of the computation.
    type Output;

    /// Runs the computation for cells of `N` nodes in `D` dimensions.
    fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Self::Output;
}

/// Registers kinds of cells of first and of second order.
macro_rules! cells {
    (first order: $($first:path),+; second order: $($second:path),+;) => {
        /// Every kind of cell except simplices.
        pub const CELL_KINDS: &[&CellKind] = &[$($first.kind,)+ $($second.kind,)+];

        impl CellKind {
            /// Calls `visitor` with the isoparametric cell of this kind.
            ///
            /// # Panics
            /// If the kind is not registered.
            pub fn visit<V: CellVisitor>(&self, visitor: V) -> V::Output {
                if self.order() == 1 { self.visit_first(visitor) } else { self.visit_second(visitor) }
            }

            /// Visits the cell like [`visit`](Self::visit), in first order only: the visitor is compiled
            /// for no other.
            ///
            /// # Panics
            /// If the kind is not registered or of second order.
            pub fn visit_first<V: CellVisitor>(&self, visitor: V) -> V::Output {
                $(
                    if *self == *$first.kind {
                        return visitor.visit(&$first);
                    }
                )+
                unreachable!("{} is not registered in first order", self.name)
            }

            /// Visits the cell like [`visit`](Self::visit), in second order only.
            ///
            /// # Panics
            /// If the kind is not registered or of first order.
            pub fn visit_second<V: CellVisitor>(&self, visitor: V) -> V::Output {
                $(
                    if *self == *$second.kind {
                        return visitor.visit(&$second);
                    }
                )+
                unreachable!("{} is not registered in second order", self.name)
            }

            /// Returns the number of quadrature points.
            pub fn quadrature_points(&self) -> usize {
                let known = [
                    $(($first.kind, $first.points.len()),)+
                    $(($second.kind, $second.points.len()),)+
                ];
                known.iter().find(|(kind, _)| *kind == self).map_or(0, |(_, points)| *points)
            }
        }

        /// Returns the number of quadrature points of the second-order cell with `N` nodes in `D`
        /// dimensions; 0 if there is none.
        pub(super) const fn point_count<const D: usize, const N: usize>() -> usize {
            $(
                if $second.kind.dimension == D && $second.kind.nodes == N {
                    return $second.points.len();
                }
            )+
            0
        }

        /// Returns the second-order cell with `N` nodes in `D` dimensions; `None` if there is none, as
        /// for simplices.
        #[inline(always)]
        pub(crate) fn second_order_cell<const D: usize, const N: usize>()
        -> Option<&'static Isoparametric<D, N>> {
            $(
                let cell: &'static dyn Any = &$second;
                if let Some(cell) = cell.downcast_ref() {
                    return Some(cell);
                }
            )+
            None
        }
    };
}

cells! {
    first order: super::quadrilateral::QUADRILATERAL, super::hexahedron::HEXAHEDRON;
    second order: super::quad8::QUAD8, super::quad9::QUAD9, super::hex20::HEX20, super::hex27::HEX27;
}

#[cfg(test)]
mod tests;
