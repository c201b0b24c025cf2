//! Second-order cells: corners, and a node in the middle of every edge.
//!
//! **The order of nodes**, everywhere in this library: the corners `0, 1, ..` as in the first-order cell,
//! then one node per edge in the order of VTK,
//! - line: `01`;
//! - triangle: `01, 12, 20`;
//! - tetrahedron: `01, 12, 02, 03, 13, 23`;
//! - quadrilateral, hexahedron: the order of [`CellKind::edges`](pliant::element::CellKind::edges), then
//!   one node in the middle of each side of a hexahedron and one in the middle of the cell, if the kind has
//!   them.
//!
//! VTK's files use this order ([VTK book](https://book.vtk.org/en/latest/VTKBook/05Chapter5.html), figure
//! 5-4). Gmsh [exchanges the last two](https://gmsh.info/doc/texinfo/gmsh.html#Node-ordering) nodes of a
//! tetrahedron.

use std::collections::BTreeMap;

use super::Mesh;
use pliant::element::{CellBlock, TETRAHEDRON_EDGES, TRIANGLE_EDGES};

/// An edge with its ends in ascending order.
pub(super) fn sorted(a: u32, b: u32) -> [u32; 2] {
    if a < b { [a, b] } else { [b, a] }
}

/// Treatment of mid-edge nodes by a reader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MidNodes {
    /// A second-order cell is an error.
    #[default]
    Refuse,
    /// Mid-edge nodes are dropped: the corners form a first-order mesh.
    Drop,
    /// Mid-edge nodes are kept, in [`Mesh::triangle_middles`] and [`Mesh::tetrahedron_middles`].
    Keep,
}

impl Mesh {
    /// Triangles (`N = 3`, with mid-edge nodes `N = 6`) or tetrahedra (`N = 4`, `N = 10`), in order.
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

    /// Surface as flat triangles for drawing: those of [`surface_triangles`](Mesh::surface_triangles). In
    /// a second-order mesh a triangle is drawn as four through its mid-edge nodes, a quadrilateral as
    /// eight about its centre node, or as six without one.
    pub fn drawn_triangles(&self) -> Vec<[u32; 3]> {
        let faces = self.flat_faces();
        faces.iter().flat_map(|face| (2..face.len()).map(|i| [face[0], face[i - 1], face[i]])).collect()
    }

    /// The surface as triangles and quadrilaterals, counter-clockwise seen from outside.
    ///
    /// Quadrilaterals are those that [`drawn_triangles`](Mesh::drawn_triangles) splits in two: the faces of
    /// hexahedra, and the inner part of the faces of `hex20` and `quad8`.
    pub fn flat_faces(&self) -> Vec<Vec<u32>> {
        let (middles, face_nodes) = (self.middles(), self.face_nodes());
        if let Some(block) = self.block() {
            let faces = self.quadrilaterals(block).into_iter();
            if self.order() == 1 {
                return faces.map(|face| face.to_vec()).collect();
            }
            return faces.flat_map(|face| around(face, &middles, &face_nodes)).collect();
        }
        let faces = self.surface_triangles().into_iter();
        if self.order() == 1 {
            return faces.map(|face| face.to_vec()).collect();
        }
        let four = |[a, b, c]: [u32; 3]| {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[a, b]| middles[&sorted(a, b)]);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(|face| face.to_vec())
        };
        faces.flat_map(four).collect()
    }

    /// Mid-edge node of each edge of a second-order mesh, by the ascending ends of the edge.
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
        for block in self.blocks.iter().filter(|block| block.kind.order() == 2) {
            for cell in block.cells() {
                let nodes = &cell[block.kind.corners..];
                let edges = block.kind.edges.iter().zip(nodes);
                middles.extend(edges.map(|([a, b], m)| (sorted(cell[*a], cell[*b]), *m)));
            }
        }
        middles
    }

    /// Centre node of each quadrilateral of a second-order mesh with such nodes, by its ascending
    /// corners.
    pub(super) fn face_nodes(&self) -> BTreeMap<Vec<u32>, u32> {
        let mut nodes = BTreeMap::new();
        for block in self.blocks.iter().filter(|block| block.kind.order() == 2) {
            let kind = block.kind;
            for cell in block.cells() {
                let of_faces = kind.sides.iter().zip(&cell[kind.face_nodes()]);
                nodes.extend(of_faces.map(|(side, node)| (corners_of(cell, side), *node)));
                if kind.dimension == 2 && kind.nodes > kind.corners + kind.edges.len() {
                    nodes.insert(ascending(&cell[..kind.corners]), cell[kind.nodes - 1]);
                }
            }
        }
        nodes
    }

    /// Order of the cells: 2 if they have mid-edge nodes, otherwise 1.
    pub fn order(&self) -> usize {
        let of_simplices = !self.triangle_middles.is_empty() || !self.tetrahedron_middles.is_empty();
        if of_simplices || self.blocks.iter().any(|block| block.kind.order() == 2) { 2 } else { 1 }
    }

    /// Returns the mesh with second-order cells: new nodes in the middle of every edge (shared between
    /// the cells that meet there), of the faces of hexahedra, and of quadrilaterals and hexahedra.
    /// Vertices keep their numbers. The new ones follow: those of edges in lexicographic order, those of
    /// faces in the order of their corners, then those of cells in the order of cells. Groups gain the
    /// new nodes of their cells. A second-order mesh is returned unchanged.
    ///
    /// Returns `None` if vertices and edges together exceed 2^32 - 1 and cannot be numbered.
    pub fn promoted_to_quadratic(&self) -> Option<Mesh> {
        self.promoted(false)
    }

    /// Returns the mesh with second-order cells that have mid-edge nodes only.
    pub fn promoted_to_serendipity(&self) -> Option<Mesh> {
        self.promoted(true)
    }

    fn promoted(&self, serendipity: bool) -> Option<Mesh> {
        if self.order() == 2 {
            return Some(self.clone());
        }
        // Edges, faces and cells that get a node, each once.
        let mut edges: Vec<[u32; 2]> = Vec::new();
        for cell in &self.triangles {
            edges.extend(TRIANGLE_EDGES.map(|[a, b]| sorted(cell[a], cell[b])));
        }
        for cell in &self.tetrahedra {
            edges.extend(TETRAHEDRON_EDGES.map(|[a, b]| sorted(cell[a], cell[b])));
        }
        let kind_of = |block: &CellBlock| block.kind.of_second_order(serendipity).unwrap_or(block.kind);
        let (mut faces, mut cells): (Vec<Vec<u32>>, usize) = (vec![], 0);
        for block in &self.blocks {
            edges.extend(block.edges());
            let kind = kind_of(block);
            for cell in block.cells().filter(|_| kind.nodes > kind.corners + kind.edges.len()) {
                if kind.dimension == 2 {
                    faces.push(ascending(cell));
                } else {
                    faces.extend(kind.sides.iter().map(|side| corners_of(cell, side)));
                    cells += 1;
                }
            }
        }
        edges.sort_unstable();
        edges.dedup();
        faces.sort_unstable();
        faces.dedup();
        // Numbers of the new nodes: edges first, then faces, then cells.
        let first = u32::try_from(self.vertex_count()).ok()?;
        let first_face = u32::try_from(edges.len()).ok().and_then(|count| first.checked_add(count))?;
        let first_cell = u32::try_from(faces.len()).ok().and_then(|count| first_face.checked_add(count))?;
        u32::try_from(cells).ok().and_then(|count| first_cell.checked_add(count))?;
        let middle: BTreeMap<[u32; 2], u32> = edges.iter().copied().zip(first..).collect();
        let face_node: BTreeMap<Vec<u32>, u32> = faces.iter().cloned().zip(first_face..).collect();
        let mut mesh = self.clone();
        for &[a, b] in &edges {
            let (a, b) = (self.point(a as usize), self.point(b as usize));
            // Halved before the sum, which could overflow.
            mesh.points.extend(a.iter().zip(b).map(|(a, b)| 0.5 * a + 0.5 * b));
        }
        // Second-order simplices.
        let triangle = |cell: &[u32; 3]| TRIANGLE_EDGES.map(|[a, b]| middle[&sorted(cell[a], cell[b])]);
        let tetrahedron = |cell: &[u32; 4]| TETRAHEDRON_EDGES.map(|[a, b]| middle[&sorted(cell[a], cell[b])]);
        mesh.triangle_middles = self.triangles.iter().map(triangle).collect();
        mesh.tetrahedron_middles = self.tetrahedra.iter().map(tetrahedron).collect();
        // Second-order cells of other kinds.
        let mut next_cell = first_cell..;
        for (block, before) in mesh.blocks.iter_mut().zip(&self.blocks) {
            let kind = kind_of(before);
            block.kind = kind;
            block.vertices.clear();
            for cell in before.cells() {
                let from = block.vertices.len();
                block.vertices.extend(cell);
                block.vertices.extend(kind.edges.iter().map(|[a, b]| middle[&sorted(cell[*a], cell[*b])]));
                if kind.dimension == 2 {
                    block.vertices.extend(face_node.get(&ascending(cell)).filter(|_| !serendipity));
                } else if !serendipity {
                    block.vertices.extend(kind.sides.iter().map(|side| face_node[&corners_of(cell, side)]));
                    block.vertices.extend(next_cell.next());
                }
                debug_assert_eq!(block.vertices.len() - from, kind.nodes);
            }
        }
        // Positions of the nodes in faces and cells.
        mesh.points.resize(mesh.points.len() + (faces.len() + cells) * self.dimension, 0.0);
        mesh.centre();
        // Groups gain the new nodes of their cells.
        let lines = if self.lines.is_empty() { &self.edges } else { &self.lines };
        for group in mesh.groups.values_mut() {
            for &cell in &group.cells {
                let cell = cell as usize;
                match group.topological_dimension {
                    1 => {
                        let [a, b] = lines[cell];
                        group.vertices.extend(middle.get(&sorted(a, b)));
                    }
                    dimension => {
                        let block = mesh.blocks.iter().find(|block| block.kind.dimension == dimension);
                        if let Some(block) = block {
                            let nodes = block.kind.nodes;
                            group.vertices.extend(&block.vertices[cell * nodes..][..nodes]);
                        } else if dimension == 2 {
                            group.vertices.extend(mesh.triangle_middles[cell]);
                        } else if dimension == 3 {
                            group.vertices.extend(mesh.tetrahedron_middles[cell]);
                        }
                    }
                }
            }
            group.vertices.sort_unstable();
            group.vertices.dedup();
        }
        super::skin::promote(&mut mesh);
        Some(mesh)
    }

    /// Moves the nodes in the middle of second-order faces and cells to where the serendipity shape
    /// functions of the corners and mid-edge nodes place them. A face centre is half the sum of its
    /// mid-edge nodes minus a quarter of the sum of its corners; a hexahedron's centre has a quarter of
    /// each sum. Gordon, Hall 1973, "Transfinite element methods", Numerische Mathematik 21, 109.
    pub(super) fn centre(&mut self) {
        let middles = self.middles();
        let mut moved: Vec<(u32, Vec<f64>)> = vec![];
        let mut place = |mesh: &Mesh, node: u32, corners: &[u32], edges: &[u32], share: f64| {
            let sum = |nodes: &[u32], c: usize| nodes.iter().map(|v| mesh.point(*v as usize)[c]).sum::<f64>();
            let at = |c: usize| share * sum(edges, c) - 0.25 * sum(corners, c);
            moved.push((node, (0..mesh.dimension).map(at).collect()));
        };
        for block in &self.blocks {
            let kind = block.kind;
            let ends = kind.corners + kind.edges.len();
            for cell in block.cells().filter(|_| kind.nodes > ends) {
                let (corners, edges) = (&cell[..kind.corners], &cell[kind.corners..ends]);
                let share = if kind.dimension == 2 { 0.5 } else { 0.25 };
                place(self, cell[kind.nodes - 1], corners, edges, share);
                for (side, node) in kind.sides.iter().zip(&cell[kind.face_nodes()]) {
                    let corners: Vec<u32> = side.iter().map(|corner| cell[*corner]).collect();
                    let next = |i: usize| corners[(i + 1) % corners.len()];
                    let edges: Vec<u32> =
                        (0..corners.len()).map(|i| middles[&sorted(corners[i], next(i))]).collect();
                    place(self, *node, &corners, &edges, 0.5);
                }
            }
        }
        for (node, at) in moved {
            let first = node as usize * self.dimension;
            self.points[first..first + self.dimension].copy_from_slice(&at);
        }
    }
}

fn ascending(vertices: &[u32]) -> Vec<u32> {
    let mut vertices = vertices.to_vec();
    vertices.sort_unstable();
    vertices
}

/// Ascending corners of a side of a cell.
fn corners_of(cell: &[u32], side: &[usize]) -> Vec<u32> {
    ascending(&side.iter().map(|corner| cell[*corner]).collect::<Vec<_>>())
}

/// Splits a second-order quadrilateral into triangles: eight about its centre node; without one, four at
/// the corners and two between the mid-edge nodes.
fn around(
    corners: [u32; 4],
    middles: &BTreeMap<[u32; 2], u32>,
    face_nodes: &BTreeMap<Vec<u32>, u32>,
) -> Vec<Vec<u32>> {
    let edge = |i: usize| middles[&sorted(corners[i], corners[(i + 1) % 4])];
    let e = [0, 1, 2, 3].map(edge);
    let mut faces = vec![];
    if let Some(&centre) = face_nodes.get(&ascending(&corners)) {
        for i in 0..4 {
            faces.extend([vec![corners[i], e[i], centre], vec![e[i], corners[(i + 1) % 4], centre]]);
        }
    } else {
        faces.extend([0, 1, 2, 3].map(|i| vec![e[(i + 3) % 4], corners[i], e[i]]));
        faces.push(e.to_vec());
    }
    faces
}
