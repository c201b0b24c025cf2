//! Cells as values: nodes, edges, faces, shape functions and quadrature of a kind, and how files call it.
//!
//! A [`CellKind`] is what meshes, readers, writers and recordings ask; an [`Isoparametric`] is the same cell
//! for those who integrate over it, `J = sum_a X_a (dN_a/dxi)^T`. Kernels read its shape functions at the
//! quadrature points as numbers and are the same for every kind. Zienkiewicz, Taylor, Zhu 2013, *The Finite
//! Element Method: Its Basis and Fundamentals*, chapters 5 and 6.

use std::any::Any;

use super::ElementDescription;
use crate::algebra::Mat;

/// Kind of cell. Nodes have VTK's order: corners, those in the middle of edges, of sides, of the cell.
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
    /// Number of corners: as many as nodes in a cell of first order.
    pub corners: usize,
    /// Nodes at the ends of its edges. Of second order the node in the middle of edge `k` is `corners + k`.
    pub edges: &'static [[usize; 2]],
    /// Corners of its sides: in 3D faces, counter-clockwise seen from outside; in 2D edges that run
    /// counter-clockwise about it. The node in the middle of face `k`, where faces have one, follows those of
    /// edges in this order.
    pub sides: &'static [&'static [usize]],
    /// Order of the nodes of its mirror image: node `a` of a cell that was mirrored was node `mirror[a]`.
    pub mirror: &'static [usize],
    /// Number of the type in VTK.
    pub vtk: u8,
    /// Number of the type in Gmsh.
    pub gmsh: u64,
    /// Place of each node in Gmsh's order; empty where it is this one.
    pub gmsh_nodes: &'static [usize],
    /// Name of the type in recordings, `topology/BODY.SUFFIX.u32`.
    pub suffix: &'static str,
    /// Description for `pliant list elements`.
    pub about: ElementDescription,
}

impl CellKind {
    /// 2 if it has nodes in the middle of its edges, otherwise 1.
    pub const fn order(&self) -> usize {
        if self.nodes > self.corners { 2 } else { 1 }
    }

    /// The kind of second order with its corners: with the most nodes there is (Lagrange), or with the fewest
    /// (serendipity); `None` of one of second order.
    pub fn of_second_order(&self, serendipity: bool) -> Option<&'static CellKind> {
        let fits = |kind: &&&CellKind| kind.order() == 2 && self.order() == 1 && kind.edges == self.edges;
        let kinds = || CELL_KINDS.iter().filter(fits).copied();
        if serendipity {
            kinds().min_by_key(|kind| kind.nodes)
        } else {
            kinds().max_by_key(|kind| kind.nodes)
        }
    }

    /// The kind of first order with its corners.
    pub fn of_first_order(&self) -> Option<&'static CellKind> {
        CELL_KINDS.iter().find(|kind| kind.order() == 1 && kind.edges == self.edges).copied()
    }

    /// The node in the middle of each of its sides in 3D, in their order; none where faces have none.
    pub fn face_nodes(&self) -> std::ops::Range<usize> {
        let first = self.corners + self.edges.len();
        let has_faces = self.dimension == 3 && self.nodes >= first + self.sides.len();
        first..if has_faces { first + self.sides.len() } else { first }
    }
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

    /// Returns the cells of first order with the same corners.
    #[must_use]
    pub fn of_first_order(&self) -> CellBlock {
        let Some(kind) = self.kind.of_first_order() else { return self.clone() };
        CellBlock { kind, vertices: self.cells().flat_map(|cell| &cell[..kind.nodes]).copied().collect() }
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
    /// Quadrature points of energy, of first order of mass too, with weights whose sum is the volume of the
    /// reference cell.
    pub points: &'static [([f64; D], f64)],
    /// Slopes of the shape functions at these points for kernels, of cells of second order alone.
    pub slopes_at_points: &'static [[[f64; D]; N]],
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

    /// Signed area [m^2] or volume [m^3]: of first order exact but for rounding, of second order the sum over
    /// the points of the energy, exact where sides are straight.
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

    /// Consistent masses of first order for unit density, `integral of N_a N_b` [m^2 or m^3], by the
    /// quadrature of the energy; those of second order are in [`MassRule`](super::MassRule). Exact for
    /// parallelepipeds, and their row sums for every multilinear cell.
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

    /// Lumped masses of first order for unit density, `integral of N_a` [m^2 or m^3]: the row sums of the
    /// consistent ones.
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

/// Registers kinds of cells of first and of second order.
macro_rules! cells {
    (first order: $($first:path),+; second order: $($second:path),+;) => {
        /// Every kind of cell beside simplices.
        pub const CELL_KINDS: &[&CellKind] = &[$($first.kind,)+ $($second.kind,)+];

        impl CellKind {
            /// Hands the isoparametric cell of this kind to `visitor`.
            ///
            /// # Panics
            /// If the kind is not registered.
            pub fn visit<V: CellVisitor>(&self, visitor: V) -> V::Output {
                if self.order() == 1 { self.visit_first(visitor) } else { self.visit_second(visitor) }
            }

            /// Visits the cell as [`visit`](Self::visit) does, of first order alone: the visitor is compiled
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

            /// Visits the cell as [`visit`](Self::visit) does, of second order alone.
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

            /// Number of its quadrature points.
            pub fn quadrature_points(&self) -> usize {
                let known = [
                    $(($first.kind, $first.points.len()),)+
                    $(($second.kind, $second.points.len()),)+
                ];
                known.iter().find(|(kind, _)| *kind == self).map_or(0, |(_, points)| *points)
            }
        }

        /// Number of quadrature points of the cell of second order with `N` nodes in `D` dimensions; 0 if
        /// there is none.
        pub(super) const fn point_count<const D: usize, const N: usize>() -> usize {
            $(
                if $second.kind.dimension == D && $second.kind.nodes == N {
                    return $second.points.len();
                }
            )+
            0
        }

        /// The cell of second order with `N` nodes in `D` dimensions; `None` if there is none, as for
        /// simplices.
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
