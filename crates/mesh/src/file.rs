//! Mesh files: choice of the format by the extension, code common to all formats, and positions of errors in
//! the file.
//!
//! # How to add a format
//! 1. Write a file in this folder whose `read` makes a `FileMesh` (points, cells, the place of each) from a
//!    `MeshInput`. `obj.rs` reads lines, `ply.rs` bytes too. A fault names its line or its offset.
//! 2. Add one line to `formats!` below, and the module to `lib.rs`.
//! 3. Let meshio write a file of it: `tests/tools/write_meshes.py`, into `tests/data/meshes`. Read it in
//!    `format_tests.rs`, and damage it in `damaged` of `fuzz_tests.rs`.
//! 4. Name the format in the documentation of `FileSpec` (`spec/mod.rs`) and in `docs/guide/contents.md`.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use super::check::{check, check_numbers, unusable_cells};
use super::clean::{clean, cures};
use super::include::{self, Stretch};
use super::quadratic::MidNodes;
use super::signature::{foreign, recognised};
use super::tokens::FileFault;
use super::{Cell, FileTag, Mesh, MeshError, MeshSize, abaqus, gmsh, medit, obj, ply, stl, tetgen, vtk, vtu};
use crate::spec::FileSpec;
use pliant_files::{disk, regular_file};

/// Limit on the named groups of one entity. Without it a short file could name `n` groups for `n` cells
/// and require `n^2` memory.
pub(super) const GROUPS_AT_ONCE: usize = 64;

/// Defines [`Format`] from one line per format: extensions, name in messages, reader.
macro_rules! formats {
    ($($variant:ident: [$($extension:literal),+], $name:literal, $read:path;)+) => {
        /// Supported formats.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(super) enum Format {
            $($variant,)+
        }

        impl Format {
            #[cfg(test)]
            pub(super) const ALL: &[Format] = &[$(Format::$variant,)+];

            /// Format of a lower-case extension.
            fn of_extension(extension: &str) -> Option<Format> {
                match extension {
                    $($($extension)|+ => Some(Format::$variant),)+
                    _ => None,
                }
            }

            fn names() -> Vec<&'static str> {
                vec![$($name,)+]
            }

            fn read(self, input: &MeshInput) -> Result<FileMesh, FileFault> {
                match self {
                    $(Format::$variant => $read(input),)+
                }
            }
        }
    };
}

formats! {
    Abaqus: ["inp"], "Abaqus `.inp`", abaqus::read;
    Gmsh: ["msh"], "Gmsh `.msh` (2.1, 2.2 and 4.1)", gmsh::read;
    Medit: ["mesh"], "Medit `.mesh`", medit::read;
    Obj: ["obj"], "Wavefront `.obj`", obj::read;
    Ply: ["ply"], "`.ply`", ply::read;
    Stl: ["stl"], "`.stl`", stl::read;
    TetGen: ["ele", "node"], "TetGen `.node` with `.ele`", tetgen::read;
    Vtk: ["vtk"], "VTK `.vtk`", vtk::read;
    Vtu: ["vtu"], "VTK `.vtu`", vtu::read;
}

/// Input of a reader.
pub(super) struct MeshInput<'a> {
    /// Content of the file; the `.ele` of a TetGen pair.
    pub bytes: &'a [u8],
    /// Content of the `.node` of a TetGen pair.
    pub nodes: &'a [u8],
    pub mid_nodes: MidNodes,
    /// Cleaning options of the file.
    pub spec: &'a FileSpec,
}

/// Position of a vertex or a cell in its file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Place {
    /// Number of the item in the file; 0 if it has none. In a binary file the byte offset.
    pub tag: u64,
    /// Line, from 1; 0 in a binary file.
    pub line: u32,
}

/// Output of a reader: a mesh without points, the points in space, and the positions of all items in the
/// file.
#[derive(Debug, Default)]
pub(super) struct FileMesh {
    /// Flat `(n, 3)` [m], for every dimension of the scene.
    pub xyz: Vec<f64>,
    /// Cells and groups.
    pub mesh: Mesh,
    pub vertices: Vec<Place>,
    /// True if the vertices come from [`MeshInput::nodes`].
    pub vertices_in_nodes: bool,
    pub edges: Vec<Place>,
    pub lines: Vec<Place>,
    pub triangles: Vec<Place>,
    pub tetrahedra: Vec<Place>,
    /// Positions of the cells of each block.
    pub blocks: Vec<Vec<Place>>,
}

/// Format by the extension.
fn format(path: &Path) -> Result<Format, MeshError> {
    let extension = path.extension().and_then(OsStr::to_str).map(str::to_ascii_lowercase);
    let extension = extension.as_deref().unwrap_or_default();
    Format::of_extension(extension).ok_or_else(|| match foreign(extension) {
        Some(foreign) => MeshError::InFile {
            path: path.to_path_buf(),
            line: None,
            tag: None,
            cures: Vec::new(),
            source: Box::new(foreign.into()),
        },
        None => {
            let supported = Format::names().join(", ");
            MeshError::UnknownFormat { path: path.to_path_buf(), supported }
        }
    })
}

/// Upper bounds from the length of the file: the shortest vertex is "1 0 0 0\n", and a polygon spends at
/// least " 1" on each further triangle. 16 bytes of memory per byte of text hold a cell and its position.
/// Binary files are no denser; a `.vtu` with compressed arrays may exceed the bounds.
pub(super) fn size(spec: &FileSpec, dimension: usize, base: &Path) -> Result<MeshSize, MeshError> {
    let path = base.join(&spec.path);
    let length = match format(&path)? {
        // The reader rejects a pair that does not fit together.
        Format::Abaqus => files(&path).iter().map(|file| length(file)).sum::<Result<u64, MeshError>>()?,
        _ => length(&path)?,
    };
    let most = |least: u64| (length / least).min(u64::from(u32::MAX));
    let bound = MeshSize {
        vertices: most(8),
        edges: most(2),
        triangles: most(2),
        tetrahedra: if dimension == 3 { most(8) } else { 0 },
        bytes: length.saturating_mul(16),
        ..MeshSize::default()
    };
    Ok(bound)
}

/// Length of a regular file [bytes]. Pipes and devices are rejected: they may never end.
fn length(path: &Path) -> Result<u64, MeshError> {
    let unreadable = |source| MeshError::Unreadable { path: path.to_path_buf(), source };
    let metadata = disk::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() {
        return Err(unreadable(std::io::Error::new(std::io::ErrorKind::InvalidInput, "not a regular file")));
    }
    Ok(metadata.len())
}

/// Reads and checks the file of a scene.
pub(super) fn build(
    spec: &FileSpec,
    dimension: usize,
    base: &Path,
    keep_mid_nodes: bool,
) -> Result<Mesh, MeshError> {
    let mid_nodes = match (spec.drop_mid_nodes, keep_mid_nodes) {
        (true, _) => MidNodes::Drop,
        (false, true) => MidNodes::Keep,
        (false, false) => MidNodes::Refuse,
    };
    Ok(read_cleaned(&base.join(&spec.path), spec, dimension, mid_nodes)?.0.mesh)
}

/// A surface or solid in space from a file, with the positions of its triangles there.
pub(super) struct SurfaceFile {
    spec: FileSpec,
    file: FileMesh,
    sources: Sources,
}

/// Reads and checks the file of a surface.
pub(super) fn read_surface(spec: FileSpec, base: &Path) -> Result<SurfaceFile, MeshError> {
    let path = base.join(&spec.path);
    let mid_nodes = if spec.drop_mid_nodes { MidNodes::Drop } else { MidNodes::Refuse };
    let (file, sources) = read_cleaned(&path, &spec, 3, mid_nodes)?;
    Ok(SurfaceFile { spec, file, sources })
}

impl SurfaceFile {
    pub(super) fn mesh(&self) -> &Mesh {
        &self.file.mesh
    }

    /// Adds the position in the file to an error about this mesh.
    pub(super) fn locate(&self, error: MeshError) -> MeshError {
        self.sources.fault(&self.spec, self.file.site(&error), error)
    }
}

/// Files that reading the mesh file `path` involves.
pub fn files(path: &Path) -> Vec<PathBuf> {
    let format = format(path);
    if let Ok(Format::Abaqus) = format
        && let Ok(deck) = include::join(path, &contents)
    {
        return deck.files();
    }
    let paths = format.map_or_else(|_| [path.to_path_buf(), PathBuf::new()], |format| pair(format, path));
    paths.into_iter().filter(|path| !path.as_os_str().is_empty()).collect()
}

/// Content of a regular file.
fn contents(path: &Path) -> Result<Vec<u8>, MeshError> {
    length(path)?;
    regular_file::read(path).map_err(|source| MeshError::Unreadable { path: path.to_path_buf(), source })
}

/// The file, and TetGen's node file or an empty path.
fn pair(format: Format, path: &Path) -> [PathBuf; 2] {
    match format {
        Format::TetGen => [path.with_extension("ele"), path.with_extension("node")],
        _ => [path.to_path_buf(), PathBuf::new()],
    }
}

/// Reads and checks a mesh file; the extension determines the format. Either file of a TetGen pair may be
/// named.
///
/// # Errors
/// [`MeshError::UnknownFormat`], [`MeshError::Unreadable`], [`MeshError::InFile`] with the line or the
/// byte of the error.
pub fn read(path: &Path, dimension: usize, mid_nodes: MidNodes) -> Result<Mesh, MeshError> {
    Ok(read_cleaned(path, &FileSpec::default(), dimension, mid_nodes)?.0.mesh)
}

/// Reads a mesh file and cleans it as `spec` requests.
fn read_cleaned(
    path: &Path,
    spec: &FileSpec,
    dimension: usize,
    mid_nodes: MidNodes,
) -> Result<(FileMesh, Sources), MeshError> {
    let format = format(path)?;
    let mut sources = Sources { paths: pair(format, path), stretches: Vec::new() };
    let bytes = if format == Format::Abaqus {
        let deck = include::join(path, &contents)?;
        sources.stretches = deck.stretches;
        deck.text
    } else {
        contents(&sources.paths[0])?
    };
    let nodes = if format == Format::TetGen { contents(&sources.paths[1])? } else { Vec::new() };
    let input = MeshInput { bytes: &bytes, nodes: &nodes, mid_nodes, spec };
    match parse_file(format, &input, dimension) {
        Ok(file) => Ok((file, sources)),
        Err((site, error)) => Err(sources.fault(spec, site, error)),
    }
}

/// Files that a mesh was read from.
struct Sources {
    /// The file, and TetGen's node file.
    paths: [PathBuf; 2],
    /// Parts of a deck that includes other files.
    stretches: Vec<Stretch>,
}

impl Sources {
    /// Adds the file and the position in it to an error.
    fn fault(&self, spec: &FileSpec, site: Site, error: MeshError) -> MeshError {
        let before = self.stretches.partition_point(|stretch| stretch.first <= site.line);
        let (path, line) = match before.checked_sub(1).map(|stretch| &self.stretches[stretch]) {
            Some(stretch) => (&stretch.path, site.line - stretch.first + stretch.line),
            None => (&self.paths[usize::from(site.in_nodes)], site.line),
        };
        MeshError::InFile {
            path: path.clone(),
            line: (line > 0).then_some(line),
            tag: site.tag,
            cures: cures(spec, &error),
            source: Box::new(error),
        }
    }
}

/// Position of an error in the input, as far as known.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Site {
    /// Line, from 1; 0 if there is none.
    pub line: u32,
    /// Number of the item in the file.
    pub tag: Option<FileTag>,
    /// True if the error is in [`MeshInput::nodes`].
    pub in_nodes: bool,
    /// True if the reader found the error, before there was a mesh.
    pub is_of_reader: bool,
}

/// Parses a mesh: every input gives a mesh or an error.
#[cfg(test)]
pub(super) fn parse(format: Format, input: &MeshInput, dimension: usize) -> Result<Mesh, (Site, MeshError)> {
    parse_file(format, input, dimension).map(|file| file.mesh)
}

/// Parses a mesh, with the positions of its cells.
fn parse_file(format: Format, input: &MeshInput, dimension: usize) -> Result<FileMesh, (Site, MeshError)> {
    let text =
        |bytes| if format == Format::Stl && stl::is_binary(bytes) { bytes } else { without_mark(bytes) };
    let input = MeshInput { bytes: text(input.bytes), nodes: text(input.nodes), ..*input };
    read_and_check(format, &input, dimension).map_err(|(site, error)| {
        // A reader that skips unknown content finds no vertices in a file of another kind.
        let unread = matches!(error, MeshError::Empty) || site.is_of_reader;
        match recognised(format, input.bytes).filter(|_| unread) {
            Some(other) => (Site::default(), other.into()),
            None => (site, error),
        }
    })
}

/// Strips the UTF-8 byte order mark that some editors write.
pub(super) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

fn read_and_check(
    format: Format,
    input: &MeshInput,
    dimension: usize,
) -> Result<FileMesh, (Site, MeshError)> {
    let mut file = format.read(input).map_err(|FileFault { line, byte, in_nodes, error }| {
        (Site { line, tag: byte.map(FileTag::Byte), in_nodes, is_of_reader: true }, error)
    })?;
    match file.finish(input.spec, dimension) {
        Ok(()) => Ok(file),
        Err(error) => Err((file.site(&error), error)),
    }
}

impl FileMesh {
    /// Sets the points of the mesh, cleans and checks it.
    fn finish(&mut self, spec: &FileSpec, dimension: usize) -> Result<(), MeshError> {
        self.mesh.dimension = dimension;
        self.mesh.points = self.flatten(dimension)?;
        check_numbers(&self.mesh)?;
        clean(spec, self)?;
        check(&self.mesh)
    }

    /// Points with as many coordinates as the scene has dimensions.
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

    /// Position in the file of the vertex or cell that `error` concerns.
    fn site(&self, error: &MeshError) -> Site {
        let locate = |places: &[Place], i: usize, tag: fn(u64) -> FileTag| {
            let Place { tag: number, line } = places.get(i).copied().unwrap_or_default();
            let tag = if line == 0 { FileTag::Byte } else { tag };
            Site { line, tag: (number > 0).then(|| tag(number)), ..Site::default() }
        };
        let vertex = |i: usize| {
            let site = locate(&self.vertices, i, FileTag::Node);
            Site { in_nodes: self.vertices_in_nodes, ..site }
        };
        let cell = |cell: &Cell| match *cell {
            Cell::Edge(i) => locate(&self.edges, i, FileTag::Element),
            Cell::Line(i) => locate(&self.lines, i, FileTag::Element),
            Cell::Triangle(i) => locate(&self.triangles, i, FileTag::Element),
            Cell::Tetrahedron(i) => locate(&self.tetrahedra, i, FileTag::Element),
            Cell::Other(kind, i) => {
                let block = self.mesh.blocks.iter().position(|block| block.kind == kind);
                let places = block.and_then(|block| self.blocks.get(block));
                locate(places.map_or(&[], |places| places), i, FileTag::Element)
            }
        };
        match error {
            MeshError::OffPlane { vertex: i, .. }
            | MeshError::NonFiniteCoordinate { vertex: i, .. }
            | MeshError::Unreferenced { vertex: i, .. } => vertex(*i),
            MeshError::IndexOutOfRange { cell: c, .. }
            | MeshError::RepeatedVertex { cell: c, .. }
            | MeshError::RepeatedCell { cell: c, .. }
            | MeshError::Degenerate { cell: c, .. }
            | MeshError::Folded { cell: c, .. }
            | MeshError::FoldedCell { cell: c, .. }
            | MeshError::Inverted { cell: c, .. } => cell(c),
            MeshError::ZeroLengthEdge { edge, .. } => cell(&Cell::Edge(*edge)),
            // The boundary of solid cells has no position in the file.
            MeshError::Surface(error) if self.mesh.element_dimension() == 2 => {
                error.triangle().map_or_else(Site::default, |i| cell(&Cell::Triangle(i)))
            }
            _ => Site::default(),
        }
    }
}
