//! Elements of a body, and which of them a triangle of the surface belongs to.

use pliant_record::read::RecordedBody;

/// Cells of a body that may be finite elements, in the order of their rows in `/elements/..`.
pub(super) struct Elements {
    /// Vertices of each, flat.
    pub(super) vertices: Vec<u32>,
    /// Vertices of one.
    pub(super) size: usize,
}

impl Elements {
    /// The cells of highest dimension; `None` for springs and particles. Triangles of a solid in space are
    /// its surface, and not among its elements.
    pub(super) fn of(body: &RecordedBody, dimension: usize) -> Option<Elements> {
        if let Some(block) = body.blocks.first() {
            return Some(Elements { vertices: block.vertices.clone(), size: block.kind.nodes });
        }
        let solids: [(&[u32], usize); 2] =
            [(body.tetrahedra.as_flattened(), 4), (body.quadratic_tetrahedra.as_flattened(), 10)];
        let flat: [(&[u32], usize); 2] =
            [(body.triangles.as_flattened(), 3), (body.quadratic_triangles.as_flattened(), 6)];
        let solids = solids.into_iter().filter(|_| dimension == 3);
        let (vertices, size) = solids.chain(flat).find(|(vertices, _)| !vertices.is_empty())?;
        Some(Elements { vertices: vertices.to_vec(), size })
    }

    /// The element of each triangle: the first that has its three vertices. `None` if one has none.
    pub(super) fn of_triangles(&self, triangles: &[[u32; 3]]) -> Option<Vec<u32>> {
        let around = self.around_vertices();
        triangles.iter().map(|corners| self.with_corners(corners, &around)).collect()
    }

    /// Elements around each vertex, ascending.
    fn around_vertices(&self) -> Vec<Vec<u32>> {
        let count = self.vertices.iter().max().map_or(0, |&largest| largest as usize + 1);
        let mut around = vec![vec![]; count];
        for (element, vertices) in (0u32..).zip(self.vertices.chunks_exact(self.size)) {
            vertices.iter().for_each(|&vertex| around[vertex as usize].push(element));
        }
        around
    }

    fn with_corners(&self, corners: &[u32; 3], around: &[Vec<u32>]) -> Option<u32> {
        let has_corners = |element: &&u32| {
            let first = **element as usize * self.size;
            let vertices = &self.vertices[first..first + self.size];
            corners.iter().all(|corner| vertices.contains(corner))
        };
        around.get(corners[0] as usize)?.iter().find(has_corners).copied()
    }
}
