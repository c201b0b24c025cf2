//! Elements of a body, and the elements of surface triangles.

use pliant_record::read::RecordedBody;

/// Elements of a body in the order of their rows in `/elements/..`.
pub(super) struct Elements {
    /// Vertices of the elements, flat.
    pub(super) vertices: Vec<u32>,
    /// Number of vertices of an element.
    pub(super) size: usize,
}

impl Elements {
    /// Elements of highest dimension; `None` for springs and particles. Triangles of a 3D solid are its
    /// surface, not its elements.
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

    /// Element of each triangle: the first that has its three vertices. `None` if a triangle has no
    /// element.
    pub(super) fn of_triangles(&self, triangles: &[[u32; 3]]) -> Option<Vec<u32>> {
        let around = self.around_vertices();
        triangles.iter().map(|corners| self.with_corners(corners, &around)).collect()
    }

    /// Elements at each vertex, ascending.
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
