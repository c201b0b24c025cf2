//! What every mesh must satisfy before anything is computed on it.

use super::geometry::measure;
use super::{Cell, Mesh, MeshError};
use crate::element::least_jacobian;

/// An element with `|det Dm| <= DEGENERATE h^d`, `h` its longest edge, has no inverse `Dm` worth using. Slivers down to
/// a height of 1e-9 h pass: they cost accuracy, not meaning.
pub(super) const DEGENERATE: f64 = 1e-12;

/// Checks coordinates, then indices, then shapes, then that every vertex is used; the first fault is returned.
pub(super) fn check(mesh: &Mesh) -> Result<(), MeshError> {
    if mesh.points.is_empty() {
        return Err(MeshError::Empty);
    }
    unusable_cells(mesh)?;
    if let Some(i) = mesh.points.iter().position(|x| !x.is_finite()) {
        let (vertex, axis) = (i / mesh.dimension, i % mesh.dimension);
        return Err(MeshError::NonFiniteCoordinate { vertex, axis, value: mesh.points[i] });
    }
    let count = mesh.vertex_count();
    indices(&mesh.edges, count, Cell::Edge)?;
    indices(&mesh.lines, count, Cell::Line)?;
    indices(&mesh.triangles, count, Cell::Triangle)?;
    indices(&mesh.tetrahedra, count, Cell::Tetrahedron)?;
    middles(&mesh.triangles, &mesh.triangle_middles, count, Cell::Triangle)?;
    middles(&mesh.tetrahedra, &mesh.tetrahedron_middles, count, Cell::Tetrahedron)?;
    edges(mesh)?;
    if !mesh.tetrahedra.is_empty() {
        shapes(mesh, &mesh.tetrahedra, Cell::Tetrahedron)?;
    } else {
        shapes(mesh, &mesh.triangles, Cell::Triangle)?;
    }
    match (mesh.order(), mesh.dimension, mesh.element_dimension()) {
        (2, 3, 3) => curved::<3, 10>(mesh, Cell::Tetrahedron)?,
        (2, 2, 2) => curved::<2, 6>(mesh, Cell::Triangle)?,
        _ => {}
    }
    unreferenced(mesh)
}

/// Curved sides fold no element.
fn curved<const D: usize, const N: usize>(mesh: &Mesh, name: fn(usize) -> Cell) -> Result<(), MeshError> {
    for (i, cell) in mesh.elements::<N>().iter().enumerate() {
        let least = least_jacobian(&mesh.nodes::<D, N>(cell));
        if least.is_nan() || least <= 0.0 {
            return Err(MeshError::Folded { cell: name(i), least });
        }
    }
    Ok(())
}

/// Solids do not fit the plane.
pub(super) fn unusable_cells(mesh: &Mesh) -> Result<(), MeshError> {
    if mesh.dimension == 2 && !mesh.tetrahedra.is_empty() {
        return Err(MeshError::TetrahedraInPlane { count: mesh.tetrahedra.len() });
    }
    Ok(())
}

/// Every index in range, no vertex twice in a cell.
fn indices<const N: usize>(
    cells: &[[u32; N]],
    count: usize,
    name: fn(usize) -> Cell,
) -> Result<(), MeshError> {
    for (i, cell) in cells.iter().enumerate() {
        for (a, &vertex) in cell.iter().enumerate() {
            if vertex as usize >= count {
                return Err(MeshError::IndexOutOfRange { cell: name(i), vertex, count });
            }
            if cell[..a].contains(&vertex) {
                return Err(MeshError::RepeatedVertex { cell: name(i), vertex });
            }
        }
    }
    Ok(())
}

/// The same of the vertices in the middle of edges.
fn middles<const N: usize, const M: usize>(
    cells: &[[u32; N]],
    middles: &[[u32; M]],
    count: usize,
    name: fn(usize) -> Cell,
) -> Result<(), MeshError> {
    indices(middles, count, name)?;
    for (i, (cell, middles)) in cells.iter().zip(middles).enumerate() {
        if let Some(&vertex) = middles.iter().find(|vertex| cell.contains(vertex)) {
            return Err(MeshError::RepeatedVertex { cell: name(i), vertex });
        }
    }
    Ok(())
}

/// Springs have a length: more than rounding leaves of the coordinates.
fn edges(mesh: &Mesh) -> Result<(), MeshError> {
    let least = DEGENERATE * mesh.diagonal();
    for (edge, &vertices) in mesh.edges.iter().enumerate() {
        let length = measure(&mesh.points, mesh.dimension, vertices).size;
        if length.is_nan() || length <= least {
            return Err(MeshError::ZeroLengthEdge { edge, vertices });
        }
    }
    Ok(())
}

/// Elements have a volume, and a positive one. Triangles in space have no sign.
fn shapes<const N: usize>(mesh: &Mesh, cells: &[[u32; N]], name: fn(usize) -> Cell) -> Result<(), MeshError> {
    for (i, &cell) in cells.iter().enumerate() {
        let m = measure(&mesh.points, mesh.dimension, cell);
        if m.relative.is_nan() || m.relative.abs() <= DEGENERATE {
            return Err(MeshError::Degenerate { cell: name(i), volume: m.volume, size: m.size });
        }
        if m.relative < 0.0 {
            return Err(MeshError::Inverted { cell: name(i), volume: m.volume, size: m.size });
        }
    }
    Ok(())
}

/// Every vertex belongs to an element or an edge, unless there are neither: a cloud of points.
fn unreferenced(mesh: &Mesh) -> Result<(), MeshError> {
    if mesh.element_dimension() == 0 {
        return Ok(());
    }
    let mut used = vec![false; mesh.vertex_count()];
    let mut mark = |vertices: &[u32]| vertices.iter().for_each(|&v| used[v as usize] = true);
    mesh.edges.iter().for_each(|cell| mark(cell));
    if !mesh.tetrahedra.is_empty() {
        mesh.tetrahedra.iter().for_each(|cell| mark(cell));
        mesh.tetrahedron_middles.iter().for_each(|cell| mark(cell));
    } else {
        mesh.triangles.iter().for_each(|cell| mark(cell));
        mesh.triangle_middles.iter().for_each(|cell| mark(cell));
    }
    match used.iter().position(|&u| !u) {
        None => Ok(()),
        Some(vertex) => Err(MeshError::Unreferenced { vertex, count: used.iter().filter(|&&u| !u).count() }),
    }
}

#[cfg(test)]
mod tests {
    use crate::mesh::spec::InlineSpec;
    use crate::mesh::test_support::{build_inline, points};
    use crate::mesh::{Cell, MeshError};

    fn plane(coordinates: &[[f64; 2]], triangles: &[[u32; 3]]) -> Result<crate::mesh::Mesh, MeshError> {
        let spec = InlineSpec {
            points: points(coordinates),
            triangles: triangles.to_vec(),
            ..InlineSpec::default()
        };
        build_inline(&spec, 2)
    }

    fn solid(coordinates: &[[f64; 3]], tetrahedra: &[[u32; 4]]) -> Result<crate::mesh::Mesh, MeshError> {
        let spec = InlineSpec {
            points: points(coordinates),
            tetrahedra: tetrahedra.to_vec(),
            ..InlineSpec::default()
        };
        build_inline(&spec, 3)
    }

    const CORNER: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn a_mesh_without_vertices_is_empty() {
        assert!(matches!(plane(&[], &[]), Err(MeshError::Empty)));
    }

    #[test]
    fn coordinates_are_finite() {
        let error = plane(&[[0.0, 0.0], [1.0, f64::NAN], [0.0, 1.0]], &[[0, 1, 2]]).unwrap_err();
        assert!(
            matches!(error, MeshError::NonFiniteCoordinate { vertex: 1, axis: 1, value } if value.is_nan())
        );
        let error = plane(&[[0.0, 0.0], [1.0, 0.0], [f64::NEG_INFINITY, 1.0]], &[[0, 1, 2]]).unwrap_err();
        assert!(matches!(error, MeshError::NonFiniteCoordinate { vertex: 2, axis: 0, .. }));
    }

    #[test]
    fn indices_are_in_range_and_differ() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let error = plane(&square, &[[0, 1, 2], [0, 2, 4]]).unwrap_err();
        let MeshError::IndexOutOfRange { cell: Cell::Triangle(1), vertex: 4, count: 4 } = error else {
            panic!("{error}")
        };
        let error = plane(&square, &[[0, 1, 2], [0, 2, 0]]).unwrap_err();
        assert!(matches!(error, MeshError::RepeatedVertex { cell: Cell::Triangle(1), vertex: 0 }));
        assert!(matches!(
            solid(&CORNER, &[[0, 1, 2, u32::MAX]]),
            Err(MeshError::IndexOutOfRange { cell: Cell::Tetrahedron(0), vertex: u32::MAX, count: 4 })
        ));
    }

    #[test]
    fn flat_and_inverted_elements_are_told_apart() {
        let collinear = plane(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]], &[[0, 1, 2]]).unwrap_err();
        let MeshError::Degenerate { cell: Cell::Triangle(0), volume: 0.0, size } = collinear else {
            panic!("{collinear}")
        };
        assert!((size - 8.0_f64.sqrt()).abs() < 1e-15);
        let inverted = solid(&CORNER, &[[0, 2, 1, 3]]).unwrap_err();
        let MeshError::Inverted { cell: Cell::Tetrahedron(0), volume, .. } = inverted else {
            panic!("{inverted}")
        };
        assert_eq!(volume, -1.0 / 6.0);
        assert!(inverted.to_string().contains("swap two of its vertices"), "{inverted}");
        assert!(matches!(
            plane(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], &[[0, 2, 1]]),
            Err(MeshError::Inverted { cell: Cell::Triangle(0), volume: -0.5, .. })
        ));
        // Two vertices at the same place.
        let mut flat = CORNER;
        flat[3] = flat[1];
        assert!(matches!(solid(&flat, &[[0, 1, 2, 3]]), Err(MeshError::Degenerate { .. })));
    }

    /// The threshold is relative: slivers of height 1e-9 pass and 1e-13 do not, at every scale.
    #[test]
    fn slivers_pass_at_every_scale() {
        for scale in [1e-150, 1e-9, 1.0, 1e100] {
            let sliver =
                |height: f64| plane(&[[0.0, 0.0], [scale, 0.0], [0.5 * scale, height * scale]], &[[0, 1, 2]]);
            assert!(sliver(1e-3).is_ok() && sliver(1e-9).is_ok(), "{scale}");
            assert!(matches!(sliver(1e-13), Err(MeshError::Degenerate { .. })), "{scale}");
            assert!(matches!(sliver(-1e-9), Err(MeshError::Inverted { .. })), "{scale}");
            let flat = |height: f64| {
                let corner = CORNER.map(|p| [p[0] * scale, p[1] * scale, p[2] * scale * height]);
                solid(&corner, &[[0, 1, 2, 3]])
            };
            assert!(flat(1e-9).is_ok(), "{scale}");
            assert!(matches!(flat(1e-13), Err(MeshError::Degenerate { .. })), "{scale}");
        }
    }

    #[test]
    fn triangles_in_space_have_no_orientation() {
        let surface = |triangle| InlineSpec {
            points: points(&CORNER[..3]),
            triangles: vec![triangle],
            ..InlineSpec::default()
        };
        assert!(build_inline(&surface([0, 1, 2]), 3).is_ok());
        assert!(build_inline(&surface([0, 2, 1]), 3).is_ok());
    }

    #[test]
    fn every_vertex_is_used_unless_there_are_only_points() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 2.0]];
        assert!(matches!(plane(&square, &[[0, 1, 2]]), Err(MeshError::Unreferenced { vertex: 3, count: 2 })));
        assert!(plane(&square, &[]).is_ok());
        // A spring is enough to hold a vertex; a boundary triangle of a solid is not.
        let mut spec =
            InlineSpec { points: points(&square), edges: vec![[2, 3], [3, 4]], ..InlineSpec::default() };
        spec.triangles = vec![[0, 1, 2]];
        assert!(build_inline(&spec, 2).is_ok());
        let mut spec =
            InlineSpec { points: points(&CORNER), tetrahedra: vec![[0, 1, 2, 3]], ..InlineSpec::default() };
        spec.points.push(vec![2.0, 0.0, 0.0]);
        spec.triangles = vec![[1, 4, 2]];
        assert!(matches!(build_inline(&spec, 3), Err(MeshError::Unreferenced { vertex: 4, count: 1 })));
    }

    #[test]
    fn springs_have_a_length() {
        let spec = InlineSpec {
            points: points(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]]),
            edges: vec![[0, 1], [1, 2]],
            ..InlineSpec::default()
        };
        assert!(matches!(
            build_inline(&spec, 2),
            Err(MeshError::ZeroLengthEdge { edge: 1, vertices: [1, 2] })
        ));
        assert!(build_inline(&InlineSpec { edges: vec![[0, 1], [0, 2]], ..spec }, 2).is_ok());
    }

    #[test]
    fn a_plane_holds_no_tetrahedra() {
        let spec = InlineSpec {
            points: points(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]),
            tetrahedra: vec![[0, 1, 2, 3]],
            ..InlineSpec::default()
        };
        assert!(matches!(build_inline(&spec, 2), Err(MeshError::TetrahedraInPlane { count: 1 })));
    }
}
