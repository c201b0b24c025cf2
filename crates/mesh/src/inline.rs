//! Vertices and cells written in the scene.

use super::{Mesh, MeshError, MeshSize};
use crate::spec::InlineSpec;

/// Counts of the listed items.
pub(super) fn size(spec: &InlineSpec, dimension: usize) -> Result<MeshSize, MeshError> {
    MeshSize {
        vertices: spec.points.len() as u64,
        edges: spec.edges.len() as u64,
        triangles: spec.triangles.len() as u64,
        tetrahedra: spec.tetrahedra.len() as u64,
        blocks: (spec.quadrilaterals.len() + spec.hexahedra.len()) as u64,
        block_nodes: if spec.hexahedra.is_empty() { 4 } else { 8 },
        ..MeshSize::default()
    }
    .checked(dimension)
}

/// Copies the points and cells.
pub(super) fn build(spec: &InlineSpec, dimension: usize) -> Result<Mesh, MeshError> {
    size(spec, dimension)?;
    for (vertex, point) in spec.points.iter().enumerate() {
        if point.len() != dimension {
            return Err(MeshError::PointComponents { vertex, expected: dimension, found: point.len() });
        }
    }
    Ok(Mesh {
        dimension,
        points: spec.points.iter().flatten().copied().collect(),
        edges: spec.edges.clone(),
        triangles: spec.triangles.clone(),
        tetrahedra: spec.tetrahedra.clone(),
        blocks: spec.blocks(),
        ..Mesh::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::{build_inline, points};

    #[test]
    fn points_and_cells_are_taken_as_they_stand() {
        let spec = InlineSpec {
            points: points(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
            edges: vec![[2, 0]],
            triangles: vec![[1, 2, 0]],
            ..InlineSpec::default()
        };
        let mesh = build_inline(&spec, 2).unwrap();
        assert_eq!(mesh.points, [0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
        assert_eq!((mesh.edges, mesh.triangles), (spec.edges, spec.triangles));
    }

    #[test]
    fn a_point_with_the_wrong_number_of_coordinates_is_named() {
        let spec = InlineSpec { points: vec![vec![0.0; 3], vec![0.0; 2]], ..InlineSpec::default() };
        assert!(matches!(
            build_inline(&spec, 3),
            Err(MeshError::PointComponents { vertex: 1, expected: 3, found: 2 })
        ));
    }
}
