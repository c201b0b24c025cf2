//! Mesh files: the format by the extension, what all formats have in common, and where in the file a fault lies.

use std::ffi::OsStr;
use std::path::Path;

use super::check::{check, unusable_cells};
use super::tokens::Fault;
use super::{Cell, FileTag, Mesh, MeshError, MeshSize, gmsh, obj};
use crate::scene::FileSpec;

/// One entity may be in this many named groups. Without a bound a short file could name `n` groups for `n` cells and
/// ask for `n^2` memory.
pub(super) const GROUPS_AT_ONCE: usize = 64;

/// The formats there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Gmsh,
    Obj,
}

/// Where a vertex or a cell stands in its file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Place {
    /// Number by which the file calls it; 0 if it has none.
    pub tag: u64,
    /// Line, from 1.
    pub line: u32,
}

/// What a reader hands over: a mesh without points, the points in space, and the place of everything.
#[derive(Debug, Default)]
pub(super) struct FileMesh {
    /// Flat `(n, 3)` [m], in every dimension.
    pub xyz: Vec<f64>,
    /// Cells and groups.
    pub mesh: Mesh,
    pub vertices: Vec<Place>,
    pub edges: Vec<Place>,
    pub lines: Vec<Place>,
    pub triangles: Vec<Place>,
    pub tetrahedra: Vec<Place>,
}

/// The format that the extension names.
fn format(path: &Path) -> Result<Format, MeshError> {
    match path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase).as_deref() {
        Some("msh") => Ok(Format::Gmsh),
        Some("obj") => Ok(Format::Obj),
        _ => Err(MeshError::UnknownFormat { path: path.to_path_buf() }),
    }
}

/// Bounds from the length of the file: "1 0 0 0\n" is the shortest vertex, and " 1" is what a polygon spends on one
/// triangle more. 16 bytes of memory per byte of text hold a cell and its place.
pub(super) fn size(spec: &FileSpec, dimension: usize, base: &Path) -> Result<MeshSize, MeshError> {
    let path = base.join(&spec.path);
    format(&path)?;
    let length = length(&path)?;
    let most = |least: u64| (length / least).min(u64::from(u32::MAX));
    let bound = MeshSize {
        vertices: most(8),
        edges: most(2),
        triangles: most(2),
        tetrahedra: if dimension == 3 { most(8) } else { 0 },
        bytes: length.saturating_mul(16),
    };
    Ok(bound)
}

/// Length of a regular file [bytes]. Pipes and devices may never end.
fn length(path: &Path) -> Result<u64, MeshError> {
    let unreadable = |source| MeshError::Unreadable { path: path.to_path_buf(), source };
    let metadata = std::fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() {
        return Err(unreadable(std::io::Error::new(std::io::ErrorKind::InvalidInput, "not a regular file")));
    }
    Ok(metadata.len())
}

/// Reads the file and checks what it holds.
pub(super) fn build(spec: &FileSpec, dimension: usize, base: &Path) -> Result<Mesh, MeshError> {
    let path = base.join(&spec.path);
    let format = format(&path)?;
    length(&path)?;
    let bytes =
        std::fs::read(&path).map_err(|source| MeshError::Unreadable { path: path.clone(), source })?;
    parse(format, &bytes, dimension).map_err(|(place, error)| MeshError::InFile {
        path,
        line: place.map(|(line, _)| line),
        tag: place.and_then(|(_, tag)| tag),
        source: Box::new(error),
    })
}

/// The line of a fault, and what the file calls the thing at fault.
type Location = (u32, Option<FileTag>);

/// The mesh that these bytes spell; total: every input gives a mesh or an error.
pub(super) fn parse(
    format: Format,
    bytes: &[u8],
    dimension: usize,
) -> Result<Mesh, (Option<Location>, MeshError)> {
    // Names may be in any encoding; numbers are ASCII.
    let text = String::from_utf8_lossy(bytes);
    let read = match format {
        Format::Gmsh => gmsh::read(&text),
        Format::Obj => obj::read(&text),
    };
    let mut file = read.map_err(|Fault { line, error }| (Some((line, None)), error))?;
    file.mesh.dimension = dimension;
    file.mesh.points = match file.flatten(dimension) {
        Ok(points) => points,
        Err(error) => return Err((file.place(&error), error)),
    };
    match check(&file.mesh) {
        Ok(()) => Ok(file.mesh),
        Err(error) => Err((file.place(&error), error)),
    }
}

impl FileMesh {
    /// The points in as many coordinates as the scene has.
    fn flatten(&mut self, dimension: usize) -> Result<Vec<f64>, MeshError> {
        unusable_cells(&self.mesh)?;
        if dimension == 3 {
            return Ok(std::mem::take(&mut self.xyz));
        }
        let mut points = Vec::with_capacity(self.xyz.len() / 3 * 2);
        for (vertex, xyz) in self.xyz.chunks_exact(3).enumerate() {
            if xyz[2] != 0.0 {
                return Err(MeshError::OffPlane { vertex, z: xyz[2] });
            }
            points.extend_from_slice(&xyz[..2]);
        }
        Ok(points)
    }

    /// Where the vertex or cell that `error` is about stands in the file.
    fn place(&self, error: &MeshError) -> Option<Location> {
        let locate = |places: &[Place], i: usize, tag: fn(u64) -> FileTag| {
            places.get(i).map(|place| (place.line, (place.tag > 0).then(|| tag(place.tag))))
        };
        let vertex = |i: usize| locate(&self.vertices, i, FileTag::Node);
        let cell = |cell: &Cell| match *cell {
            Cell::Edge(i) => locate(&self.edges, i, FileTag::Element),
            Cell::Line(i) => locate(&self.lines, i, FileTag::Element),
            Cell::Triangle(i) => locate(&self.triangles, i, FileTag::Element),
            Cell::Tetrahedron(i) => locate(&self.tetrahedra, i, FileTag::Element),
        };
        match error {
            MeshError::OffPlane { vertex: i, .. }
            | MeshError::NonFiniteCoordinate { vertex: i, .. }
            | MeshError::Unreferenced { vertex: i, .. } => vertex(*i),
            MeshError::IndexOutOfRange { cell: c, .. }
            | MeshError::RepeatedVertex { cell: c, .. }
            | MeshError::Degenerate { cell: c, .. }
            | MeshError::Inverted { cell: c, .. } => cell(c),
            MeshError::ZeroLengthEdge { edge, .. } => cell(&Cell::Edge(*edge)),
            _ => None,
        }
    }
}
