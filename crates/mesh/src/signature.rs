//! Detection of the kind of an unsupported file by its first bytes.

use super::FormatError;
use super::file::Format;

/// First bytes of a file, description, advice.
type Signature = (&'static [u8], &'static str, &'static str);

/// Files of other kinds and mesh files of unsupported formats.
const OTHERS: &[Signature] = &[
    (
        b"version https://git-lfs.github.com/spec/",
        "a Git LFS pointer, which stands for the file in the repository",
        "fetch the file itself: `git lfs pull`",
    ),
    (b"<!doctype html", HTML, DOWNLOAD),
    (b"<html", HTML, DOWNLOAD),
    (b"\x1f\x8b", "a file compressed by gzip", "unpack it"),
    (b"pk\x03\x04", "a zip archive", "unpack it"),
    (b"\x89hdf", "an HDF5 file", "convert it to `.vtu` (`meshio convert`)"),
    (
        b"(0 \"",
        "a mesh of ANSYS Fluent",
        "its `.msh` is another format than Gmsh's: export Gmsh, VTK or Abaqus `.inp`, or convert it \
         (`meshio convert`)",
    ),
    (
        b"(1 \"",
        "a mesh of ANSYS Fluent",
        "export Gmsh, VTK or Abaqus `.inp`, or convert it (`meshio convert`)",
    ),
    (b"mfem ", "a mesh of MFEM", "save it with `Mesh::PrintVTU` there, as `.vtu`"),
    (b"% getfem mesh", "a mesh of GetFEM", "save it with `export_to_vtu` there, as `.vtu`"),
    (b"off\n", OFF, MESHIO),
    (b"off\r", OFF, MESHIO),
    (b"\xff\xfe", UTF_16, "save it as UTF-8"),
    (b"\xfe\xff", UTF_16, "save it as UTF-8"),
];

const HTML: &str = "a page of HTML";
const DOWNLOAD: &str = "download the file itself: behind its link was a page, of a login or of an error";
const UTF_16: &str = "a text in UTF-16";

const OFF: &str = "an Object File Format (Geomview)";
const MESHIO: &str = "convert it to `.vtu` (`meshio convert`)";
const GMSH: &str = "open it in Gmsh and save it as `.msh`, or export Abaqus `.inp`";
const EXPORT: &str = "export Abaqus `.inp`, VTK or Gmsh from the program that wrote it";

/// Extensions of unsupported mesh files, description, advice. The advice names `meshio` only for formats
/// that it reads.
const EXTENSIONS: &[(&[&str], &str, &str)] = &[
    (&["off"], OFF, MESHIO),
    (&["bdf", "nas", "fem"], "bulk data of Nastran", MESHIO),
    (&["med"], "a MED file of Salome", MESHIO),
    (&["vol"], "a mesh of Netgen", MESHIO),
    (&["meshb"], "a binary file of Medit", MESHIO),
    (&["e", "exo", "ex2"], "an Exodus file", MESHIO),
    (&["xdmf", "xmf"], "an XDMF file", MESHIO),
    (&["cgns"], "a CGNS file", MESHIO),
    (&["su2"], "a mesh of SU2", MESHIO),
    (&["ugrid"], "a UGRID file", MESHIO),
    (&["cdb"], "an archive of ANSYS Mechanical APDL", EXPORT),
    (&["k", "key", "dyn"], "a keyword file of LS-DYNA", EXPORT),
    (&["unv"], "a universal file of I-DEAS", GMSH),
    (&["step", "stp", "iges", "igs", "brep"], "a geometry without a mesh", "mesh it, for example in Gmsh"),
];

/// Error for a file with this lower-case extension, if the format is known but unsupported.
pub(super) fn foreign(extension: &str) -> Option<FormatError> {
    let of = EXTENSIONS.iter().find(|(extensions, ..)| extensions.contains(&extension));
    of.map(|&(_, found, advice)| FormatError::Other { found, advice })
}

/// Signatures of supported formats, whose files may have another format's extension.
const FORMATS: &[(Format, Signature)] = &[
    (Format::Vtk, (b"# vtk datafile", "a legacy file of VTK", "name it `.vtk`")),
    (Format::Gmsh, (b"$meshformat", "a file of Gmsh", "name it `.msh`")),
    (Format::Medit, (b"meshversionformatted", "a file of Medit", "name it `.mesh`")),
    (Format::Ply, (b"ply\n", "a PLY file", "name it `.ply`")),
    (Format::Ply, (b"ply\r", "a PLY file", "name it `.ply`")),
];

/// Error for a file that is not of this format but is recognised as another kind.
pub(super) fn recognised(format: Format, bytes: &[u8]) -> Option<FormatError> {
    let start = bytes.trim_ascii_start();
    let start = start[..start.len().min(1000)].to_ascii_lowercase();
    let others = OTHERS.iter().copied();
    let formats = FORMATS.iter().filter(|(of, _)| *of != format).map(|(_, signature)| *signature);
    let found = others.chain(formats).find(|(word, ..)| start.starts_with(word));
    let found = found
        .map(|(_, found, advice)| (found, advice))
        .or_else(|| gid(&start))
        .or_else(|| xml(format, &start));
    found.map(|(found, advice)| FormatError::Other { found, advice })
}

/// Recognises GiD: `MESH "name" dimension 3 ElemType Tetrahedra Nnode 4`, the words after `MESH` in any
/// order.
fn gid(start: &[u8]) -> Option<(&'static str, &'static str)> {
    let line = start.split(|byte| *byte == b'\n').next()?;
    let has = |word: &[u8]| line.windows(word.len()).any(|window| window == word);
    (line.starts_with(b"mesh") && has(b"elemtype")).then_some(("a mesh of GiD", EXPORT))
}

fn xml(format: Format, start: &[u8]) -> Option<(&'static str, &'static str)> {
    let has = |word: &[u8]| start.windows(word.len()).any(|window| window == word);
    if format == Format::Vtu || !(start.starts_with(b"<?xml") || start.starts_with(b"<vtkfile")) {
        return None;
    }
    Some(if has(b"\"unstructuredgrid\"") {
        ("an XML file of VTK with an unstructured grid", "name it `.vtu`")
    } else if has(b"<vtkfile") {
        ("an XML file of VTK, and no unstructured grid", "save it as one, `.vtu`")
    } else {
        ("XML", "convert it to `.vtu` (`meshio convert`)")
    })
}
