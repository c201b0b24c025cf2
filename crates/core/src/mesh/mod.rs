//! Meshes: generators, readers, checks and selections. Plain data, either two- or three-dimensional.

use std::collections::BTreeMap;

/// A named set of cells of one topological dimension (a physical group of a mesh file).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Group {
    /// 0 points, 1 edges, 2 triangles, 3 tetrahedra.
    pub topological_dimension: usize,
    /// Indices into the mesh's cells of that dimension (for points: vertex indices), ascending.
    pub cells: Vec<u32>,
    /// Every vertex of those cells, ascending, each once.
    pub vertices: Vec<u32>,
}

/// Vertices and the simplices between them.
///
/// `points` is flat, `(n, dimension)` [m]. A mesh may hold cells of several dimensions at once: a solid keeps the
/// boundary triangles that carry its named groups. Elements are made of the cells of the highest dimension.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// 2 or 3.
    pub dimension: usize,
    /// Rest positions, flat `(n, dimension)` [m].
    pub points: Vec<f64>,
    /// Edges. When there are any, springs are made of these; otherwise of the edges of the highest cells.
    pub edges: Vec<[u32; 2]>,
    /// Triangles, counter-clockwise in 2D.
    pub triangles: Vec<[u32; 3]>,
    /// Tetrahedra, `(x1-x0, x2-x0, x3-x0)` right-handed.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Named groups.
    pub groups: BTreeMap<String, Group>,
}

impl Mesh {
    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.points.len() / self.dimension.max(1)
    }

    /// Position of vertex `i`.
    pub fn point(&self, i: usize) -> &[f64] {
        &self.points[i * self.dimension..(i + 1) * self.dimension]
    }
}
