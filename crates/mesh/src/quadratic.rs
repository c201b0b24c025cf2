//! Cells of second order: corners, and a node in the middle of every edge.
//!
//! **The order of nodes**, everywhere in this library: the corners `0, 1, ..` as in the cell of first order,
//! then one node per edge in the order of VTK,
//! - line: `01`;
//! - triangle: `01, 12, 20`;
//! - tetrahedron: `01, 12, 02, 03, 13, 23`.
//!
//! VTK's files have it so ([VTK book](https://book.vtk.org/en/latest/VTKBook/05Chapter5.html), figure 5-4).
//! Gmsh [exchanges the last two](https://gmsh.info/doc/texinfo/gmsh.html#Node-ordering) nodes of a
//! tetrahedron.

use std::collections::BTreeMap;

use super::Mesh;
use pliant::element::{TETRAHEDRON_EDGES, TRIANGLE_EDGES};

/// An edge by its ends, whichever way it runs.
pub(super) fn sorted(a: u32, b: u32) -> [u32; 2] {
    if a < b { [a, b] } else { [b, a] }
}

/// Treatment of nodes in the middle of edges by a reader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MidNodes {
    /// A cell of second order is an error.
    #[default]
    Refuse,
    /// The corners make a mesh of first order.
    Drop,
    /// Nodes are in [`Mesh::triangle_middles`] and [`Mesh::tetrahedron_middles`].
    Keep,
}

impl Mesh {
    /// Its triangles (`N = 3`, with the nodes in the middle of their edges `6`) or tetrahedra (`4`, `10`),
    /// in their order.
    ///
    /// # Panics
    /// If `N` is none of these, or the mesh is not of second order for 6 or 10.
    pub fn elements<const N: usize>(&self) -> Vec<[u32; N]> {
        fn joined<const N: usize, const A: usize, const B: usize>(
            corners: &[[u32; A]],
            middles: &[[u32; B]],
        ) -> Vec<[u32; N]> {
            let node = |cell: usize, a: usize| if a < A { corners[cell][a] } else { middles[cell][a - A] };
            (0..corners.len()).map(|cell| std::array::from_fn(|a| node(cell, a))).collect()
        }
        match N {
            3 | 6 => joined(&self.triangles, &self.triangle_middles),
            4 | 10 => joined(&self.tetrahedra, &self.tetrahedron_middles),
            _ => unreachable!("elements have 3, 4, 6 or 10 nodes"),
        }
    }

    /// The surface as flat triangles to draw: those of [`surface_triangles`](Mesh::surface_triangles), in a
    /// mesh of second order each as the four between its corners and the nodes in the middle of its edges.
    pub fn drawn_triangles(&self) -> Vec<[u32; 3]> {
        let faces = self.surface_triangles();
        if self.order() == 1 {
            return faces;
        }
        let middles = self.middles();
        let four = |[a, b, c]: [u32; 3]| {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[a, b]| middles[&sorted(a, b)]);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        faces.into_iter().flat_map(four).collect()
    }

    /// The vertex in the middle of each edge of a mesh of second order, by the ends of the edge, ascending.
    pub(super) fn middles(&self) -> BTreeMap<[u32; 2], u32> {
        let mut middles = BTreeMap::new();
        for (cell, nodes) in self.tetrahedra.iter().zip(&self.tetrahedron_middles) {
            middles.extend(
                TETRAHEDRON_EDGES.iter().zip(nodes).map(|([a, b], m)| (sorted(cell[*a], cell[*b]), *m)),
            );
        }
        for (cell, nodes) in self.triangles.iter().zip(&self.triangle_middles) {
            middles
                .extend(TRIANGLE_EDGES.iter().zip(nodes).map(|([a, b], m)| (sorted(cell[*a], cell[*b]), *m)));
        }
        middles
    }

    /// 2 if there are nodes in the middle of the edges of cells, otherwise 1.
    pub fn order(&self) -> usize {
        if self.triangle_middles.is_empty() && self.tetrahedron_middles.is_empty() { 1 } else { 2 }
    }

    /// The same mesh with a node in the middle of every edge of its triangles and tetrahedra, shared between
    /// the cells that meet there. Vertices keep their numbers; the new ones follow in the lexicographic
    /// order of their edges. Groups gain the nodes in the middle of the edges of their cells. A mesh of
    /// second order is returned as it is.
    ///
    /// A mesh whose vertices and edges together are more than 2^32 - 1 cannot be numbered: `None`.
    pub fn promoted_to_quadratic(&self) -> Option<Mesh> {
        if self.order() == 2 {
            return Some(self.clone());
        }
        let mut edges: Vec<[u32; 2]> = Vec::new();
        for cell in &self.triangles {
            edges.extend(TRIANGLE_EDGES.map(|[a, b]| sorted(cell[a], cell[b])));
        }
        for cell in &self.tetrahedra {
            edges.extend(TETRAHEDRON_EDGES.map(|[a, b]| sorted(cell[a], cell[b])));
        }
        edges.sort_unstable();
        edges.dedup();
        let first = u32::try_from(self.vertex_count()).ok()?;
        u32::try_from(edges.len()).ok().and_then(|count| first.checked_add(count))?;
        let middle: BTreeMap<[u32; 2], u32> = edges.iter().copied().zip(first..).collect();
        let mut mesh = self.clone();
        for &[a, b] in &edges {
            let (a, b) = (self.point(a as usize), self.point(b as usize));
            // Halved first: a sum may leave the range of numbers.
            mesh.points.extend(a.iter().zip(b).map(|(a, b)| 0.5 * a + 0.5 * b));
        }
        let triangle = |cell: &[u32; 3]| TRIANGLE_EDGES.map(|[a, b]| middle[&sorted(cell[a], cell[b])]);
        let tetrahedron = |cell: &[u32; 4]| TETRAHEDRON_EDGES.map(|[a, b]| middle[&sorted(cell[a], cell[b])]);
        mesh.triangle_middles = self.triangles.iter().map(triangle).collect();
        mesh.tetrahedron_middles = self.tetrahedra.iter().map(tetrahedron).collect();
        let lines = if self.lines.is_empty() { &self.edges } else { &self.lines };
        for group in mesh.groups.values_mut() {
            for &cell in &group.cells {
                let cell = cell as usize;
                match group.topological_dimension {
                    1 => {
                        let [a, b] = lines[cell];
                        group.vertices.extend(middle.get(&sorted(a, b)));
                    }
                    2 => group.vertices.extend(mesh.triangle_middles[cell]),
                    3 => group.vertices.extend(mesh.tetrahedron_middles[cell]),
                    _ => {}
                }
            }
            group.vertices.sort_unstable();
            group.vertices.dedup();
        }
        super::skin::promote(&mut mesh);
        Some(mesh)
    }
}
