//! Memory required by a mesh, predicted before any of it is allocated.

use std::path::Path;

use super::MeshError;
use crate::spec::{BodyMesh, CellOrder, MeshSpec};
use pliant::element::CELL_KINDS;

/// Counts and memory of a mesh. Exact for generators, upper bounds for files and surfaces of files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshSize {
    /// Number of vertices.
    pub vertices: u64,
    /// Number of explicit edges.
    pub edges: u64,
    /// Number of triangles.
    pub triangles: u64,
    /// Number of tetrahedra.
    pub tetrahedra: u64,
    /// Number of cells that are no simplices.
    pub blocks: u64,
    /// Nodes of each of them.
    pub block_nodes: u64,
    /// Number of lines on the boundary.
    pub lines: u64,
    /// True if there are nodes in the middle of edges.
    pub quadratic: bool,
    /// Bytes of all of it; saturates.
    pub bytes: u64,
}

impl MeshSize {
    /// Refuses what 32-bit indices cannot count; fills in `bytes`.
    pub(super) fn checked(mut self, dimension: usize) -> Result<MeshSize, MeshError> {
        let Self { vertices, edges, triangles, tetrahedra, lines, blocks, .. } = self;
        for (what, count) in [
            ("vertices", vertices),
            ("edges", edges),
            ("triangles", triangles),
            ("tetrahedra", tetrahedra),
            ("lines", lines),
            ("cells", blocks),
        ] {
            // u32::MAX itself stays free, as a mark of "no vertex".
            if count > u64::from(u32::MAX) {
                return Err(MeshError::TooMany { what, count });
            }
        }
        // At most 2^32 of each: none of these products overflows.
        self.bytes = vertices * 8 * dimension as u64 + (edges + lines) * 8 + triangles * 12 + tetrahedra * 16;
        self.bytes += blocks * 4 * self.block_nodes;
        if self.quadratic {
            self.bytes += triangles * 12 + tetrahedra * 24;
        }
        Ok(self)
    }

    /// With a node in the middle of every edge: at most as many as these. Euler: `E = V + T` and less in the
    /// plane, with one hole at most; in space `E = V + T + B/2` and less with `B` faces on the boundary, `B
    /// <= 2 T` in all but heaps of loose tetrahedra, and `E <= 6 T` there.
    ///
    /// Quadrilaterals have `E = V + T` likewise, hexahedra `E <= V + 2 T + B/2` with at most `3 T + B/2`
    /// faces, `B <= 6 T`, and a node in each cell.
    fn quadratic(self, serendipity: bool) -> MeshSize {
        if self.blocks > 0 {
            let kind =
                CELL_KINDS.iter().find(|kind| kind.order() == 1 && kind.nodes as u64 == self.block_nodes);
            let kind = kind.and_then(|kind| kind.of_second_order(serendipity));
            let nodes = kind.map_or(self.block_nodes, |kind| kind.nodes as u64);
            let is_plane = kind.is_some_and(|kind| kind.dimension == 2);
            let more = self.blocks.saturating_mul(if is_plane { 2 } else { 12 });
            let vertices = self.vertices.saturating_mul(2).saturating_add(more);
            return MeshSize { vertices, block_nodes: nodes, quadratic: true, ..self };
        }
        let (triangles, tetrahedra) = (self.triangles, self.tetrahedra);
        let edges = if tetrahedra > 0 {
            (self.vertices.saturating_add(tetrahedra.saturating_mul(2))).min(tetrahedra.saturating_mul(6))
        } else {
            self.vertices.saturating_add(triangles).min(triangles.saturating_mul(3))
        };
        MeshSize { vertices: self.vertices.saturating_add(edges), quadratic: true, ..self }
    }

    /// Refuses a mesh larger than the memory there is. Asks for all of it at once and touches none: each
    /// array by itself might be granted.
    pub(super) fn probe(&self) -> Result<(), MeshError> {
        self.reserve(&mut Vec::<u8>::new(), self.bytes)
    }

    /// An error instead of an abort where the allocator has less than `bytes`.
    pub(super) fn reserve<T>(&self, items: &mut Vec<T>, count: u64) -> Result<(), MeshError> {
        let refused = MeshError::OutOfMemory { bytes: self.bytes };
        match usize::try_from(count) {
            Ok(count) if items.try_reserve_exact(count).is_ok() => Ok(()),
            _ => Err(refused),
        }
    }
}

/// Counts and memory that [`build`](super::build) will need for `spec`, without allocating any of it.
///
/// `base` is the directory of the scene file. Counts saturate, so that no specification overflows. For a
/// file the counts are bounds from its size: no format spells a vertex in fewer than 8 bytes or a cell in
/// fewer than 2.
///
/// # Errors
/// The errors of the specification itself (wrong number of components, zero cells), [`MeshError::TooMany`]
/// above 2^32 - 1 vertices or cells of one kind, [`MeshError::Unreadable`] for a missing file.
pub fn predicted_size(spec: &MeshSpec, dimension: usize, base: &Path) -> Result<MeshSize, MeshError> {
    if !(2..=3).contains(&dimension) {
        return Err(MeshError::Dimension { dimension });
    }
    match spec {
        MeshSpec::Grid(grid) => super::grid::size(grid, dimension),
        MeshSpec::Cloth(cloth) => super::cloth::size(cloth, dimension),
        MeshSpec::Strand(strand) => super::strand::size(strand, dimension),
        MeshSpec::Disk(disk) => super::disk::size(disk, dimension),
        MeshSpec::Inline(inline) => super::inline::size(inline, dimension),
        MeshSpec::File(file) => super::file::size(file, dimension, base),
        MeshSpec::Surface(spec) => super::surface::size(spec, dimension, base),
        MeshSpec::Ball(spec) => super::ball::size(spec, dimension),
        MeshSpec::Sphere(spec) => super::sphere::size(spec, dimension),
        MeshSpec::Cylinder(spec) => super::cylinder::size(spec, dimension),
        MeshSpec::Tube(spec) => super::tube::size(spec, dimension),
        MeshSpec::Annulus(spec) => super::annulus::size(spec, dimension),
        MeshSpec::CooksMembrane(spec) => super::cooks_membrane::size(spec, dimension),
        MeshSpec::TaperedBeam(spec) => super::tapered_beam::size(spec, dimension),
        MeshSpec::NotchedBeam(spec) => super::notched_beam::size(spec, dimension),
        MeshSpec::EllipticMembrane(spec) => super::elliptic_membrane::size(spec, dimension),
    }
}

/// The same for the mesh of a body, copies included.
///
/// # Errors
/// As [`predicted_size`].
pub fn predicted_body_size(
    body: &BodyMesh<'_>,
    dimension: usize,
    base: &Path,
) -> Result<MeshSize, MeshError> {
    let mut size = predicted_size(body.shape, dimension, base)?;
    if body.order.is_quadratic() {
        // The bounds of a file are far above what it takes.
        let is_file = matches!(body.shape, MeshSpec::File(_));
        size = if is_file {
            MeshSize { quadratic: true, ..size }
        } else {
            size.quadratic(body.order == CellOrder::Serendipity).checked(dimension)?
        };
    }
    let Some(repeat) = body.repeat else { return Ok(size) };
    let times = |count: u64| count.saturating_mul(repeat.copies());
    MeshSize {
        vertices: times(size.vertices),
        edges: times(size.edges),
        triangles: times(size.triangles),
        tetrahedra: times(size.tetrahedra),
        lines: times(size.lines),
        blocks: times(size.blocks),
        ..size
    }
    .checked(dimension)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::ClothSpec;
    use crate::test_support::grid;

    fn predicted(spec: MeshSpec, dimension: usize) -> Result<MeshSize, MeshError> {
        predicted_size(&spec, dimension, Path::new("."))
    }

    #[test]
    fn predictions_are_what_is_built() {
        let cloth =
            ClothSpec { cells: [3, 4], origin: vec![0.0; 3], u: vec![1.0, 0.0, 0.0], v: vec![0.0, 1.0, 0.0] };
        for (spec, dimension) in [
            (MeshSpec::Grid(grid(&[3, 4], 1.0)), 2),
            (MeshSpec::Grid(grid(&[3, 4, 5], 1.0)), 3),
            (MeshSpec::Cloth(cloth), 3),
        ] {
            let size = predicted(spec.clone(), dimension).unwrap();
            let mesh = crate::build(&spec, dimension, Path::new(".")).unwrap();
            assert_eq!(size.vertices, mesh.vertex_count() as u64);
            assert_eq!(size.edges, mesh.edges.len() as u64);
            assert_eq!(size.triangles, mesh.triangles.len() as u64);
            assert_eq!(size.tetrahedra, mesh.tetrahedra.len() as u64);
            let bytes = size_of_val(&mesh.points[..])
                + size_of_val(&mesh.edges[..])
                + size_of_val(&mesh.triangles[..])
                + size_of_val(&mesh.tetrahedra[..]);
            assert_eq!(size.bytes, bytes as u64);
        }
    }

    #[test]
    fn a_mesh_larger_than_memory_is_refused_without_allocating_it() {
        let bytes = 1 << 50;
        assert!(matches!(
            MeshSize { bytes, ..MeshSize::default() }.probe(),
            Err(MeshError::OutOfMemory { bytes: refused }) if refused == bytes
        ));
        // A line of cells that 32-bit indices can count: 32 GB of points are predicted at once.
        let size = predicted(MeshSpec::Grid(grid(&[1_000_000_000, 1], 1.0)), 2).unwrap();
        assert_eq!((size.vertices, size.bytes), (2_000_000_002, 2_000_000_002 * 16 + 2_000_000_000 * 12));
    }
}
