//! Validity checks that every mesh must pass before a computation.

use super::geometry::measure;
use super::topology::firsts;
use super::{Cell, Mesh, MeshError};
use pliant::element::least_jacobian;

/// Relative threshold of degeneracy: an element with `|det Dm| <= DEGENERATE h^d`, `h` its longest edge,
/// has no useful inverse `Dm`. Slivers down to a height of 1e-9 h pass: they reduce accuracy only.
pub(super) const DEGENERATE: f64 = 1e-12;

mod blocks;

pub use blocks::FoldedNodes;
pub(super) use blocks::flat_cells;

/// Checks coordinates, indices, shapes, unused vertices and repeated elements, in this order, and returns
/// the first error.
pub(super) fn check(mesh: &Mesh) -> Result<(), MeshError> {
    check_numbers(mesh)?;
    different_vertices(mesh)?;
    edges(mesh)?;
    blocks::check(mesh)?;
    if !mesh.tetrahedra.is_empty() {
        shapes(mesh, &mesh.tetrahedra, Cell::Tetrahedron)?;
    } else {
        shapes(mesh, &mesh.triangles, Cell::Triangle)?;
    }
    match (mesh.order(), mesh.dimension, mesh.element_dimension()) {
        _ if mesh.block().is_some() => {}
        (2, 3, 3) => curved::<3, 10>(mesh, Cell::Tetrahedron)?,
        (2, 2, 2) => curved::<2, 6>(mesh, Cell::Triangle)?,
        _ => {}
    }
    unreferenced(mesh)?;
    if mesh.block().is_some() {
        return Ok(());
    }
    match mesh.element_dimension() {
        3 => repeated(&mesh.tetrahedra, Cell::Tetrahedron),
        2 => repeated(&mesh.triangles, Cell::Triangle),
        // Two springs between the same ends may be intended.
        _ => Ok(()),
    }
}

/// Checks that there are vertices, that coordinates are finite and indices in range: all other checks
/// rely on this.
pub(super) fn check_numbers(mesh: &Mesh) -> Result<(), MeshError> {
    if mesh.points.is_empty() {
        return Err(MeshError::Empty);
    }
    unusable_cells(mesh)?;
    if let Some(i) = mesh.points.iter().position(|x| !x.is_finite()) {
        let (vertex, axis) = (i / mesh.dimension, i % mesh.dimension);
        return Err(MeshError::NonFiniteCoordinate { vertex, axis, value: mesh.points[i] });
    }
    let count = mesh.vertex_count();
    in_range(&mesh.edges, count, Cell::Edge)?;
    in_range(&mesh.lines, count, Cell::Line)?;
    in_range(&mesh.triangles, count, Cell::Triangle)?;
    in_range(&mesh.tetrahedra, count, Cell::Tetrahedron)?;
    blocks::in_range(mesh)?;
    in_range(&mesh.triangle_middles, count, Cell::Triangle)?;
    in_range(&mesh.tetrahedron_middles, count, Cell::Tetrahedron)
}

/// Checks that no cell has a vertex twice.
fn different_vertices(mesh: &Mesh) -> Result<(), MeshError> {
    different::<2, 0>(&mesh.edges, &[], Cell::Edge)?;
    different::<2, 0>(&mesh.lines, &[], Cell::Line)?;
    blocks::different_vertices(mesh)?;
    different(&mesh.triangles, &mesh.triangle_middles, Cell::Triangle)?;
    different(&mesh.tetrahedra, &mesh.tetrahedron_middles, Cell::Tetrahedron)
}

/// Checks that curved sides fold no element.
fn curved<const D: usize, const N: usize>(mesh: &Mesh, name: fn(usize) -> Cell) -> Result<(), MeshError> {
    for (i, cell) in mesh.elements::<N>().iter().enumerate() {
        let least = least_jacobian(&mesh.nodes::<D, N>(cell));
        if least.is_nan() || least <= 0.0 {
            return Err(MeshError::Folded { cell: name(i), least });
        }
    }
    Ok(())
}

/// Rejects solid cells in a plane mesh.
pub(super) fn unusable_cells(mesh: &Mesh) -> Result<(), MeshError> {
    if mesh.dimension == 2 && !mesh.tetrahedra.is_empty() {
        return Err(MeshError::TetrahedraInPlane { count: mesh.tetrahedra.len() });
    }
    blocks::usable(mesh)
}

fn in_range<const N: usize>(
    cells: &[[u32; N]],
    count: usize,
    name: fn(usize) -> Cell,
) -> Result<(), MeshError> {
    for (i, cell) in cells.iter().enumerate() {
        if let Some(&vertex) = cell.iter().find(|&&vertex| vertex as usize >= count) {
            return Err(MeshError::IndexOutOfRange { cell: name(i), vertex, count });
        }
    }
    Ok(())
}

/// Checks that no second-order cell has a vertex twice, mid-edge nodes included.
fn different<const N: usize, const M: usize>(
    cells: &[[u32; N]],
    middles: &[[u32; M]],
    name: fn(usize) -> Cell,
) -> Result<(), MeshError> {
    for (i, cell) in cells.iter().enumerate() {
        let middles = middles.get(i).map_or(&[][..], |middles| middles);
        let repeated = |nodes: &[u32], earlier: &[u32]| {
            let found =
                nodes.iter().enumerate().find(|(a, v)| earlier.contains(v) || nodes[..*a].contains(v));
            found.map(|(_, &vertex)| vertex)
        };
        if let Some(vertex) = repeated(cell, &[]).or_else(|| repeated(middles, cell)) {
            return Err(MeshError::RepeatedVertex { cell: name(i), vertex });
        }
    }
    Ok(())
}

/// Checks that no element occurs twice: its stiffness and mass would count twice.
fn repeated<const N: usize>(cells: &[[u32; N]], name: fn(usize) -> Cell) -> Result<(), MeshError> {
    let firsts = firsts(cells, &[]);
    let is_repeated = |i: &usize| firsts[*i] as usize != *i;
    match (0..cells.len()).find(is_repeated) {
        None => Ok(()),
        Some(i) => {
            let count = (0..cells.len()).filter(is_repeated).count();
            Err(MeshError::RepeatedCell { cell: name(i), first: firsts[i] as usize, count })
        }
    }
}

/// True for a degenerate cell: an edge too short relative to the mesh's `diagonal` [m], or another cell
/// with `|det Dm|` of nearly 0.
pub(super) fn is_flat<const N: usize>(mesh: &Mesh, diagonal: f64, cell: [u32; N]) -> bool {
    let m = measure(&mesh.points, mesh.dimension, cell);
    let (measure, least) =
        if N == 2 { (m.size, DEGENERATE * diagonal) } else { (m.relative.abs(), DEGENERATE) };
    measure.is_nan() || measure <= least
}

/// Checks that springs are longer than the rounding error of the coordinates.
fn edges(mesh: &Mesh) -> Result<(), MeshError> {
    let diagonal = mesh.diagonal();
    for (edge, &vertices) in mesh.edges.iter().enumerate() {
        if is_flat(mesh, diagonal, vertices) {
            return Err(MeshError::ZeroLengthEdge { edge, vertices });
        }
    }
    Ok(())
}

/// Checks that elements have a positive volume. Triangles in space have no sign.
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

/// Checks that every vertex belongs to an element or an edge; a point cloud has neither.
fn unreferenced(mesh: &Mesh) -> Result<(), MeshError> {
    let Some(used) = used_vertices(mesh) else { return Ok(()) };
    match used.iter().position(|&u| !u) {
        None => Ok(()),
        Some(vertex) => Err(MeshError::Unreferenced { vertex, count: used.iter().filter(|&&u| !u).count() }),
    }
}

/// True for each vertex that belongs to an element or an edge; `None` for a point cloud, whose vertices
/// all count as used.
pub(super) fn used_vertices(mesh: &Mesh) -> Option<Vec<bool>> {
    if mesh.element_dimension() == 0 {
        return None;
    }
    let mut used = vec![false; mesh.vertex_count()];
    let mut mark = |vertices: &[u32]| vertices.iter().for_each(|&v| used[v as usize] = true);
    mark(mesh.edges.as_flattened());
    if let Some(block) = mesh.block() {
        mark(&block.vertices);
    } else if !mesh.tetrahedra.is_empty() {
        mark(mesh.tetrahedra.as_flattened());
        mark(mesh.tetrahedron_middles.as_flattened());
    } else {
        mark(mesh.triangles.as_flattened());
        mark(mesh.triangle_middles.as_flattened());
    }
    Some(used)
}

#[cfg(test)]
mod tests {
    use crate::Cell;
    use crate::MeshError;
    use crate::spec::InlineSpec;
    use crate::test_support::{build_inline, points};

    fn plane(coordinates: &[[f64; 2]], triangles: &[[u32; 3]]) -> Result<crate::Mesh, MeshError> {
        let spec = InlineSpec {
            points: points(coordinates),
            triangles: triangles.to_vec(),
            ..InlineSpec::default()
        };
        build_inline(&spec, 2)
    }

    fn solid(coordinates: &[[f64; 3]], tetrahedra: &[[u32; 4]]) -> Result<crate::Mesh, MeshError> {
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
        // Two vertices at the same position.
        let mut flat = CORNER;
        flat[3] = flat[1];
        assert!(matches!(solid(&flat, &[[0, 1, 2, 3]]), Err(MeshError::Degenerate { .. })));
    }

    /// The threshold is relative: slivers of height 1e-9 pass and slivers of 1e-13 do not, at every
    /// scale.
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
        // A spring makes a vertex used; a boundary triangle of a solid does not.
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
