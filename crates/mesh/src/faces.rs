//! Faces of bodies, on which surface loads act.

use super::quadratic::sorted as ascending;
use super::{Mesh, MeshError, select};
use crate::spec::Selection;
use pliant::element::face_edges;

impl Mesh {
    /// Faces with `N` vertices of the surface of a body in `N` dimensions: triangles, counter-clockwise
    /// seen from outside, or edges, counter-clockwise about the body. The faces of a cloth are its
    /// triangles, those of a net without cells its edges, with their orientation in the mesh.
    ///
    /// # Panics
    /// # Panics
    /// If the mesh does not have `N` dimensions.
    pub fn faces<const N: usize>(&self) -> Vec<[u32; N]> {
        assert_eq!(N, self.dimension, "edges in two dimensions, triangles in three");
        let array = |face: &[u32]| {
            let mut array = [0; N];
            array.copy_from_slice(face);
            array
        };
        match (N, self.triangles.is_empty() && self.block().is_none()) {
            (2, true) => self.edges.iter().map(|edge| array(edge)).collect(),
            (2, false) => self.boundary_edges().iter().map(|edge| array(edge)).collect(),
            _ => self.surface_triangles().iter().map(|triangle| array(triangle)).collect(),
        }
    }

    /// Returns the [`faces`](Self::faces) of a selection: the faces of a group of faces, or the faces
    /// whose vertices all belong to the selection; without a selection, all faces.
    ///
    /// # Errors
    /// Errors of [`select`]; [`MeshError::NoFace`] if no face is selected.
    pub fn select_faces<const N: usize>(
        &self,
        selection: Option<&Selection>,
    ) -> Result<Vec<[u32; N]>, MeshError> {
        let faces = self.faces::<N>();
        let Some(selection) = selection else {
            return if faces.is_empty() { Err(MeshError::NoFace { whole: true }) } else { Ok(faces) };
        };
        let vertices = select(self, selection)?;
        let mut inside = vec![false; self.vertex_count()];
        vertices.iter().for_each(|v| inside[*v as usize] = true);
        let named = self.group_of_faces::<N>(selection);
        let is_selected = |face: &[u32; N]| match &named {
            Some(named) => named.binary_search(&sorted(*face)).is_ok(),
            None => face.iter().all(|v| inside[*v as usize]),
        };
        let selected: Vec<[u32; N]> = faces.into_iter().filter(is_selected).collect();
        if selected.is_empty() { Err(MeshError::NoFace { whole: false }) } else { Ok(selected) }
    }

    /// Returns the selected quadrilaterals of the surface of a body of hexahedra, counter-clockwise seen
    /// from outside: those whose vertices all belong to `selection`; without a selection, all.
    ///
    /// # Errors
    /// Errors of [`select_faces`](Self::select_faces).
    pub fn select_quadrilaterals(&self, selection: Option<&Selection>) -> Result<Vec<[u32; 4]>, MeshError> {
        let mut faces = self.block().map_or_else(Vec::new, |block| self.quadrilaterals(block));
        if let Some(selection) = selection {
            let vertices = select(self, selection)?;
            let named = self.group_of_quadrilaterals(selection);
            faces.retain(|face| match &named {
                Some(named) => named.binary_search(&sorted(*face)).is_ok(),
                None => face.iter().all(|v| vertices.binary_search(v).is_ok()),
            });
        }
        if faces.is_empty() { Err(MeshError::NoFace { whole: selection.is_none() }) } else { Ok(faces) }
    }

    /// Cells of a group of quadrilaterals, sorted, each with ascending vertices; `None` for any other
    /// selection.
    fn group_of_quadrilaterals(&self, selection: &Selection) -> Option<Vec<[u32; 4]>> {
        let Selection::Group(name) = selection else { return None };
        let group = self.groups.get(name).filter(|group| group.topological_dimension == 2)?;
        let block = self.blocks.iter().find(|block| block.kind.corners == 4)?.of_first_order();
        let mut cells: Vec<[u32; 4]> =
            group.cells.iter().map(|cell| sorted(block.of::<4>()[*cell as usize])).collect();
        cells.sort_unstable();
        Some(cells)
    }

    /// Completes `faces` of a second-order mesh, given by their `C` corners, with the nodes of
    /// [`element::face_points`](pliant::element::face_points): 3 nodes per face in two dimensions, 6 in
    /// three; quadrilaterals have 8, or 9 with a centre node.
    ///
    /// # Panics
    /// If the mesh is not of second order, or has no such faces.
    pub fn quadratic_faces<const C: usize, const N: usize>(&self, faces: &[[u32; C]]) -> Vec<[u32; N]> {
        let edges = match (C, N) {
            (2, _) => face_edges::<2, 3>(),
            (3, _) => face_edges::<3, 6>(),
            _ => face_edges::<3, 8>(),
        };
        let (middles, face_nodes) = (self.middles(), self.face_nodes());
        let with_middles = |face: &[u32; C]| {
            let mut nodes = [0; N];
            nodes[..C].copy_from_slice(face);
            for (node, [i, j]) in nodes[C..].iter_mut().zip(edges) {
                *node = middles[&ascending(face[*i], face[*j])];
            }
            if let (9, Some(node)) = (N, face_nodes.get(&sorted(*face)[..])) {
                nodes[N - 1] = *node;
            }
            nodes
        };
        faces.iter().map(with_middles).collect()
    }

    /// Cells of a group of faces, sorted, each with ascending vertices; `None` for any other selection.
    fn group_of_faces<const N: usize>(&self, selection: &Selection) -> Option<Vec<[u32; N]>> {
        let Selection::Group(name) = selection else { return None };
        let group = self.groups.get(name).filter(|group| group.topological_dimension + 1 == N)?;
        let cell = |i: &u32| {
            let mut cell = [0; N];
            match N {
                2 if self.lines.is_empty() => cell.copy_from_slice(&self.edges[*i as usize]),
                2 => cell.copy_from_slice(&self.lines[*i as usize]),
                _ => cell.copy_from_slice(&self.triangles[*i as usize]),
            }
            sorted(cell)
        };
        let mut cells: Vec<[u32; N]> = group.cells.iter().map(cell).collect();
        cells.sort_unstable();
        Some(cells)
    }
}

fn sorted<const N: usize>(mut face: [u32; N]) -> [u32; N] {
    face.sort_unstable();
    face
}
