//! Memory required by a mesh, predicted before any of it is allocated.

use std::path::Path;

use super::MeshError;
use crate::spec::{BodyMesh, CellOrder, MeshSpec};
use pliant::element::CELL_KINDS;

/// Counts and memory of a mesh: exact for generators, upper bounds for files and surfaces from files.
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
    /// Number of cells other than simplices.
    pub blocks: u64,
    /// Number of nodes of each of those cells.
    pub block_nodes: u64,
    /// Number of lines on the boundary.
    pub lines: u64,
    /// True if cells have mid-edge nodes.
    pub quadratic: bool,
    /// Total memory [bytes]; saturates.
    pub bytes: u64,
}

impl MeshSize {
    /// Rejects counts beyond 32-bit indices; computes `bytes`.
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
            // u32::MAX is reserved: it marks "no vertex".
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

    /// Upper bounds with a node in the middle of every edge, by Euler's formula. In the plane
    /// `E <= V + T` with one hole at most. In space `E <= V + T + B/2` with `B` faces on the boundary;
    /// `B <= 2 T` in all but heaps of loose tetrahedra, for which `E <= 6 T`.
    ///
    /// Quadrilaterals have `E <= V + T` likewise, hexahedra `E <= V + 2 T + B/2` with at most `3 T + B/2`
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

    /// Rejects a mesh larger than the available memory. Requests all memory at once without touching it:
    /// single arrays might be granted one by one.
    pub(super) fn probe(&self) -> Result<(), MeshError> {
        self.reserve(&mut Vec::<u8>::new(), self.bytes)
    }

    /// Reserves memory for `count` items; returns an error instead of aborting if the allocator fails.
    pub(super) fn reserve<T>(&self, items: &mut Vec<T>, count: u64) -> Result<(), MeshError> {
        let refused = MeshError::OutOfMemory { bytes: self.bytes };
        match usize::try_from(count) {
            Ok(count) if items.try_reserve_exact(count).is_ok() => Ok(()),
            _ => Err(refused),
        }
    }
}

/// Predicts the counts and the memory that [`build`](super::build) needs for `spec`, without allocating
/// any of it.
///
/// `base` is the directory of the scene file. Counts saturate, so that no specification overflows. For a
/// file the counts are bounds from its size: no format writes a vertex in fewer than 8 bytes or a cell in
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

/// Predicts the counts and the memory for the mesh of a body, copies included.
///
/// # Errors
/// Errors of [`predicted_size`].
pub fn predicted_body_size(
    body: &BodyMesh<'_>,
    dimension: usize,
    base: &Path,
) -> Result<MeshSize, MeshError> {
    let mut size = predicted_size(body.shape, dimension, base)?;
    // The bounds of a file are far above the real need.
    let is_file = matches!(body.shape, MeshSpec::File(_));
    if body.refine > 0 && !is_file {
        let cut = |count: u64, dimension: usize| {
            let children = 1_u64.checked_shl((dimension * body.refine) as u32).unwrap_or(u64::MAX);
            count.saturating_mul(children)
        };
        size = MeshSize {
            vertices: cut(size.vertices, dimension),
            edges: cut(size.edges, 1),
            lines: cut(size.lines, 1),
            triangles: cut(size.triangles, 2),
            tetrahedra: cut(size.tetrahedra, 3),
            blocks: cut(size.blocks, dimension),
            ..size
        }
        .checked(dimension)?;
        size.probe()?;
    }
    if body.order.is_quadratic() {
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
        // A row of cells within the range of 32-bit indices: the prediction is 32 GB of points.
        let size = predicted(MeshSpec::Grid(grid(&[1_000_000_000, 1], 1.0)), 2).unwrap();
        assert_eq!((size.vertices, size.bytes), (2_000_000_002, 2_000_000_002 * 16 + 2_000_000_000 * 12));
    }
}
