//! Formats read back from files that meshio and VTK wrote (`tests/tools/write_meshes.py`), and errors in
//! them.

use super::file::{Format, MeshInput, Site, parse};
use super::{FileTag, FormatError, Mesh, MeshError, MidNodes};
use crate::spec::{FileSpec, Selection};

/// The files of `tests/data/meshes`.
macro_rules! data {
    ($name:literal) => {
        include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/meshes/", $name))
    };
}

/// Coordinates of the bodies written by the script.
const POINTS: [f64; 15] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0.1, 0.2, 0.7, 1., 1., 1.25];

pub(super) const VTK: [(&str, &[u8]); 4] = [
    ("5.1 ascii", data!("solid_51_ascii.vtk")),
    ("5.1 binary", data!("solid_51_binary.vtk")),
    ("4.2 ascii", data!("solid_42_ascii.vtk")),
    ("4.2 binary", data!("solid_42_binary.vtk")),
];

/// Written by Gmsh 4.15; the script swapped the bytes of the big-endian files.
pub(super) const GMSH_BINARY: [(&str, &[u8]); 6] = [
    ("2.2 little", data!("solid_22_little.msh")),
    ("2.2 big", data!("solid_22_big.msh")),
    ("4.1 little", data!("solid_41_little.msh")),
    ("4.1 big", data!("solid_41_big.msh")),
    ("2.2 second order", data!("quadratic_22_binary.msh")),
    ("4.1 second order", data!("quadratic_41_binary.msh")),
];

/// Written by VTK 9.6, with component names (one of them empty), ranges, units, and arrays before the
/// points.
pub(super) const METADATA: [(&str, &[u8]); 4] = [
    ("4.2 ascii", data!("metadata_42_ascii.vtk")),
    ("4.2 binary", data!("metadata_42_binary.vtk")),
    ("5.1 ascii", data!("metadata_51_ascii.vtk")),
    ("5.1 binary", data!("metadata_51_binary.vtk")),
];

pub(super) const VTU: [(&str, &[u8]); 6] = [
    ("ascii", data!("solid_ascii.vtu")),
    ("binary", data!("solid_binary.vtu")),
    ("zlib", data!("solid_zlib.vtu")),
    ("appended raw", data!("solid_appended_raw.vtu")),
    ("appended base64", data!("solid_appended_base64.vtu")),
    ("appended raw zlib", data!("solid_appended_raw_zlib.vtu")),
];

pub(super) const SURFACES: [(&str, Format, &[u8]); 6] = [
    ("ply ascii", Format::Ply, data!("surface_ascii.ply")),
    ("ply little", Format::Ply, data!("surface_little.ply")),
    ("ply big", Format::Ply, data!("surface_big.ply")),
    ("stl ascii", Format::Stl, data!("surface_ascii.stl")),
    ("stl binary", Format::Stl, data!("surface_binary.stl")),
    ("polydata", Format::Vtk, data!("surface_polydata.vtk")),
];

pub(super) const MEDIT: &[u8] = data!("solid.mesh");
const NODE: &[u8] = data!("solid.node");
const ELE: &[u8] = data!("solid.ele");

pub(super) fn with(
    format: Format,
    bytes: &[u8],
    nodes: &[u8],
    dimension: usize,
    mid_nodes: MidNodes,
) -> Result<Mesh, (Site, MeshError)> {
    parse(format, &MeshInput { bytes, nodes, mid_nodes, spec: &FileSpec::default() }, dimension)
}

pub(super) fn read(format: Format, bytes: &[u8]) -> Mesh {
    with(format, bytes, &[], 3, MidNodes::Refuse).unwrap_or_else(|(site, error)| panic!("{site:?}: {error}"))
}

/// Position of the error and its message.
pub(super) fn fault(format: Format, bytes: &[u8]) -> (u32, Option<FileTag>, String) {
    let (site, error) = with(format, bytes, &[], 3, MidNodes::Refuse).unwrap_err();
    (site.line, site.tag, error.to_string())
}

/// Replaces one occurrence of `from` by `to`.
pub(super) fn changed(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    let text = String::from_utf8(bytes.to_vec()).unwrap();
    assert!(text.contains(from), "no {from:?}");
    text.replacen(from, to, 1).into_bytes()
}

#[test]
fn solids_of_vtk_files_read_back_in_every_encoding() {
    for (name, bytes, format) in VTK
        .iter()
        .map(|(name, bytes)| (name, bytes, Format::Vtk))
        .chain(METADATA.iter().map(|(name, bytes)| (name, bytes, Format::Vtk)))
        .chain(VTU.iter().map(|(name, bytes)| (name, bytes, Format::Vtu)))
    {
        let mesh = read(format, bytes);
        assert_eq!(mesh.points, POINTS, "{name}");
        assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3], [1, 2, 3, 4]], "{name}");
        assert_eq!(mesh.triangles, [[0, 2, 1], [0, 1, 3]], "{name}");
        assert_eq!((mesh.order(), mesh.groups.len()), (1, 0), "{name}");
    }
}

#[test]
fn binary_gmsh_files_read_back_in_both_orders_of_bytes() {
    for (name, bytes) in &GMSH_BINARY[..4] {
        let mesh = read(Format::Gmsh, bytes);
        assert_eq!(mesh.points, POINTS, "{name}");
        assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3], [1, 2, 3, 4]], "{name}");
        assert_eq!(mesh.triangles, [[0, 2, 1], [0, 1, 3]], "{name}");
        assert_eq!(mesh.groups.keys().collect::<Vec<_>>(), ["base", "hard part", "soft"], "{name}");
        assert_eq!(
            (&mesh.groups["soft"].cells[..], &mesh.groups["hard part"].cells[..]),
            (&[0][..], &[1][..])
        );
        assert_eq!(mesh.groups["base"].vertices, [0, 1, 2, 3], "{name}");
    }
}

const CELLS: [(&str, Format, &[u8]); 4] = [
    ("vtu", Format::Vtu, data!("cells.vtu")),
    ("vtk", Format::Vtk, data!("cells.vtk")),
    ("gmsh 4.1", Format::Gmsh, data!("cells_41_binary.msh")),
    ("gmsh 2.2", Format::Gmsh, data!("cells_22.msh")),
];

#[test]
fn hexahedra_read_back_with_the_groups_of_their_sides() {
    for (name, format, bytes) in CELLS {
        let mesh = read(format, bytes);
        let kinds: Vec<(&str, usize)> = mesh.blocks.iter().map(|b| (b.kind.name, b.len())).collect();
        assert!(kinds.contains(&("hexahedron", 2)) && kinds.contains(&("quadrilateral", 1)), "{name}");
        let block = mesh.block().unwrap();
        assert_eq!(block.of::<8>(), [[0, 4, 6, 2, 1, 5, 7, 3], [4, 8, 10, 6, 5, 9, 11, 7]], "{name}");
        assert_eq!((mesh.element_count(), mesh.element_dimension(), mesh.vertex_count()), (2, 3, 12));
        assert_eq!(mesh.point(11), [2.2, 1.3, 1.1], "{name}");
        assert!(mesh.edges.is_empty() && mesh.unique_edges().len() == 20, "{name}");
        if format == Format::Gmsh {
            let end = &mesh.groups["end"];
            assert_eq!((end.topological_dimension, &end.cells[..]), (2, &[0][..]), "{name}");
            assert_eq!(end.vertices, [0, 1, 2, 3], "{name}");
            assert_eq!(
                (&mesh.groups["second"].cells[..], mesh.groups["second"].vertices.len()),
                (&[1][..], 8)
            );
            let faces = mesh.select_quadrilaterals(Some(&Selection::Group("end".into()))).unwrap();
            assert_eq!(faces, [[2, 0, 1, 3]], "{name}: outwards");
        }
        assert_eq!(mesh.select_quadrilaterals(None).unwrap().len(), 10, "{name}");
    }
    let (_, _, message) = fault(Format::Vtu, data!("quads.vtu"));
    assert!(message.contains("a surface of 2 quadrilaterals in space"), "{message}");
    let plane = with(Format::Vtu, data!("quads.vtu"), &[], 2, MidNodes::Refuse).map_err(|(_, error)| error);
    // The vertices of the upper corners are unused.
    assert!(plane.unwrap_err().to_string().contains("6 vertices belong to no element"), "unused");
    // Inverted cells.
    let turned = changed(data!("cells_22.msh"), " 1 5 7 3 2 6 8 4", " 2 6 8 4 1 5 7 3");
    let (line, _, message) = fault(Format::Gmsh, &turned);
    assert!(line > 0 && message.contains("hexahedron 0 is inverted"), "{line} {message}");
}

#[test]
fn faults_of_binary_gmsh_files_name_their_offset() {
    let [two, four] = [GMSH_BINARY[0].1, GMSH_BINARY[2].1];
    let after =
        |bytes: &[u8], word: &[u8]| bytes.windows(word.len()).position(|w| w == word).unwrap() + word.len();
    // 2.2: the type of the first packet, 2, becomes a prism's. 4.1: the tag of a node of the last element
    // changes.
    let mut prisms = two.to_vec();
    let at = after(two, b"$Elements\n4\n");
    prisms[at] = 6;
    let (_, tag, message) = fault(Format::Gmsh, &prisms);
    assert_eq!(tag, Some(FileTag::Byte(at as u64)), "{message}");
    assert!(message.contains("6-node prism"), "{message}");
    let mut unknown = four.to_vec();
    let at = after(four, b"$Elements") + 1;
    let end = four.windows(13).position(|w| w == b"\n$EndElements").unwrap();
    assert!(end > at);
    unknown[end - 8] = 99;
    let (_, tag, message) = fault(Format::Gmsh, &unknown);
    assert_eq!(tag, Some(FileTag::Byte(end as u64 - 8)), "{message}");
    assert!(message.contains("uses node 99, which the file does not define"), "{message}");
    let mut inverted = four.to_vec();
    let (last, one_before) = (end - 8, end - 16);
    for i in 0..8 {
        inverted.swap(last + i, one_before + i);
    }
    let (_, tag, message) = fault(Format::Gmsh, &inverted);
    assert!(message.contains("tetrahedron 1 is inverted") && tag.is_some(), "{message}");
    for (from, to, expected) in
        [("4.1 1 8", "4.1 1 7", "4 or 8"), ("2.2 1 8", "2.2 1 4", "real numbers of 4 bytes")]
    {
        let bytes = if from.starts_with('4') { four } else { two };
        let at = after(bytes, b"$MeshFormat\n");
        let mut changed = bytes.to_vec();
        changed[at..at + 7].copy_from_slice(to.as_bytes());
        assert_eq!(&bytes[at..at + 7], from.as_bytes());
        let (_, _, message) = fault(Format::Gmsh, &changed);
        assert!(message.contains(expected), "{message}");
    }
}

/// Some editors write the mark at the beginning of every text.
#[test]
fn a_byte_order_mark_is_passed_over() {
    let with_mark = |bytes: &[u8]| [b"\xef\xbb\xbf", bytes].concat();
    let mut files: Vec<(Format, &[u8])> = vec![
        (Format::Gmsh, super::file_tests::MESHIO_22.as_bytes()),
        (Format::Gmsh, super::file_tests::GMSH_41.as_bytes()),
        (Format::Obj, super::file_tests::SHEET.as_bytes()),
        (Format::Medit, MEDIT),
    ];
    files.extend(VTK.iter().map(|(_, bytes)| (Format::Vtk, *bytes)));
    files.extend(VTU.iter().map(|(_, bytes)| (Format::Vtu, *bytes)));
    files.extend(SURFACES[..4].iter().map(|(_, format, bytes)| (*format, *bytes)));
    for (format, bytes) in files {
        assert_eq!(read(format, &with_mark(bytes)), read(format, bytes), "{format:?}");
    }
    assert_eq!(tetgen(&with_mark(ELE), &with_mark(NODE)).unwrap(), tetgen(ELE, NODE).unwrap());
}

#[test]
fn files_of_another_kind_are_called_what_they_are() {
    let refused = |format, bytes: &[u8]| fault(format, bytes).2;
    let lfs = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a2146\nsize 12345\n";
    let html = b"\n<!DOCTYPE html>\n<html><head><title>404 Not Found</title></head></html>\n";
    for &format in Format::ALL {
        let message = refused(format, lfs);
        assert!(
            message.contains("a Git LFS pointer") && message.contains("git lfs pull"),
            "{format:?}: {message}"
        );
        assert!(refused(format, html).contains("a page of HTML"), "{format:?}");
        assert!(refused(format, b"\x1f\x8b\x08\0\0\0").contains("compressed by gzip"), "{format:?}");
        assert!(refused(format, b"\xff\xfe$\0M\0e\0s\0h\0").contains("UTF-16"), "{format:?}");
    }
    let message = refused(Format::Vtk, VTU[0].1);
    assert_eq!(message, "this is an XML file of VTK with an unstructured grid; name it `.vtu`");
    let poly = changed(VTU[0].1, "UnstructuredGrid", "PolyData");
    assert!(refused(Format::Vtk, &poly).contains("no unstructured grid; save it as one"));
    assert!(refused(Format::Vtu, VTK[1].1).contains("a legacy file of VTK; name it `.vtk`"));
    assert!(refused(Format::Medit, GMSH_BINARY[3].1).contains("a file of Gmsh; name it `.msh`"));
    assert!(refused(Format::Obj, SURFACES[1].2).contains("a PLY file; name it `.ply`"));
    let one = refused(Format::Gmsh, b"$NOD\n1\n1 0 0 0\n$ENDNOD\n$ELM\n0\n$ENDELM\n");
    assert!(one.contains("version 1 of the Gmsh format; supported are 2.1, 2.2 and 4.1"), "{one}");
}

#[test]
fn meshes_of_other_programs_are_called_by_their_names() {
    for (format, text, program) in [
        (Format::Medit, "MFEM mesh v1.0\n\ndimension\n3\n", "MFEM"),
        (Format::Medit, "MESH \"a\" dimension 3 ElemType Tetrahedra Nnode 4\nCoordinates\n", "GiD"),
        (Format::Gmsh, "MESH dimension 3 ElemType Tetrahedra  Nnode 4\nCoordinates\n", "GiD"),
        (Format::Medit, "% GETFEM MESH FILE\n% GETFEM VERSION 5.4\n\nBEGIN POINTS LIST\n", "GetFEM"),
        (Format::Ply, "OFF\n4 4 6\n", "Geomview"),
    ] {
        let (_, _, message) = fault(format, text.as_bytes());
        assert!(message.contains(program), "{message}");
    }
    for (name, program) in [
        ("a.off", "`meshio convert`"),
        ("a.BDF", "Nastran"),
        ("a.cdb", "ANSYS"),
        ("a.unv", "I-DEAS"),
        ("a.med", "`meshio convert`"),
        ("a.k", "LS-DYNA"),
    ] {
        let message = super::read(name.as_ref(), 3, MidNodes::Refuse).unwrap_err().to_string();
        assert!(message.starts_with(name) && message.contains(program), "{message}");
    }
}

#[test]
fn hexahedra_of_medit_are_cells_with_groups() {
    let text = "MeshVersionFormatted 2
Dimension 3
Vertices 8
0 0 0 0  1 0 0 0  1 1 0 0  0 1 0 0  0 0 1 0  1 0 1 0  1 1 1 0  0 1 1 0
Quadrilaterals 1
1 4 3 2 7
Hexahedra 1
1 2 3 4 5 6 7 8 7
End";
    let mesh = read(Format::Medit, text.as_bytes());
    let names: Vec<(usize, &str)> = mesh.blocks.iter().map(|block| (block.len(), block.kind.name)).collect();
    assert_eq!(names, [(1, "quadrilateral"), (1, "hexahedron")]);
    assert_eq!(mesh.groups["quadrilateral_7"].vertices, [0, 1, 2, 3]);
    assert_eq!(mesh.groups["hexahedron_7"].cells, [0]);
    let (line, _, message) = fault(Format::Medit, text.replace("7 8 7", "7 9 7").as_bytes());
    assert!(line == 8 && message.contains("there is no vertex 9"), "{line} {message}");
}

#[test]
fn gmsh_2_1_is_read_as_2_2() {
    let old = super::file_tests::MESHIO_22.replace("\n2.2 ", "\n2.1 ");
    assert!(old.contains("2.1 0 8"));
    assert_eq!(
        read(Format::Gmsh, old.as_bytes()),
        read(Format::Gmsh, super::file_tests::MESHIO_22.as_bytes())
    );
}

#[test]
fn remarks_stand_anywhere_in_a_header_of_ply() {
    let plain =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z
element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let mesh = read(Format::Ply, plain.as_bytes());
    let lines: Vec<&str> = plain.lines().collect();
    for remark in ["comment", "comment element vertex 9", "obj_info property", "", "  "] {
        for at in 1..9 {
            let mut remarked = lines.clone();
            remarked.insert(at, remark);
            assert_eq!(read(Format::Ply, (remarked.join("\n") + "\n").as_bytes()), mesh, "{remark} at {at}");
        }
    }
}

#[test]
fn surfaces_read_back_with_shared_vertices() {
    for (name, format, bytes) in SURFACES {
        let mesh = read(format, bytes);
        assert_eq!(
            (mesh.vertex_count(), mesh.triangles.len(), mesh.element_dimension()),
            (4, 4, 2),
            "{name}"
        );
        assert!(mesh.boundary_edges().is_empty(), "{name}");
        // STL has no vertex numbers and stores single precision.
        let corner = |cell: usize, corner: usize| mesh.point(mesh.triangles[cell][corner] as usize);
        let tolerance = if format == Format::Stl || name == "polydata" { 1e-7 } else { 0.0 };
        for (cell, vertices) in [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].iter().enumerate() {
            for (i, &vertex) in vertices.iter().enumerate() {
                for axis in 0..3 {
                    let error = (corner(cell, i)[axis] - POINTS[3 * vertex + axis]).abs();
                    assert!(error <= tolerance, "{name}: {error:e}");
                }
            }
        }
    }
}

#[test]
fn references_of_medit_files_are_groups_by_kind() {
    let mesh = read(Format::Medit, MEDIT);
    assert_eq!((&mesh.points[..], mesh.triangles.len()), (&POINTS[..], 2));
    assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3], [1, 2, 3, 4]]);
    let names: Vec<&str> = mesh.groups.keys().map(String::as_str).collect();
    assert_eq!(names, ["tetrahedron_7", "tetrahedron_8", "triangle_3", "vertex_1"]);
    assert_eq!(mesh.groups["tetrahedron_8"].cells, [1]);
    assert_eq!(mesh.groups["triangle_3"].vertices, [0, 1, 2, 3]);
    assert_eq!((mesh.groups["vertex_1"].topological_dimension, mesh.groups["vertex_1"].cells.len()), (0, 5));
    let plane = "MeshVersionFormatted 1 # as in the report\nDimension 2\nVertices 3\n0 0 0\n1 0 0\n0 1 \
                 4\nRidges 1\n1\n\
                 Edges 1\n1 2 -6\nTriangles 1\n1 2 3 0\nQuadrilaterals 0\nEnd";
    let mesh = with(Format::Medit, plane.as_bytes(), &[], 2, MidNodes::Refuse).unwrap();
    assert_eq!(
        (mesh.points.len(), &mesh.lines[..], &mesh.triangles[..]),
        (6, &[[0, 1]][..], &[[0, 1, 2]][..])
    );
    assert_eq!(mesh.groups.keys().collect::<Vec<_>>(), ["edge_-6", "vertex_4"]);
}

fn tetgen(elements: &[u8], nodes: &[u8]) -> Result<Mesh, (Site, MeshError)> {
    with(Format::TetGen, elements, nodes, 3, MidNodes::Refuse)
}

#[test]
fn tetgen_pairs_count_from_zero_or_one_and_carry_markers() {
    let mesh = tetgen(ELE, NODE).unwrap();
    assert_eq!((&mesh.points[..], &mesh.tetrahedra[..]), (&POINTS[..], &[[0, 1, 2, 3], [1, 2, 3, 4]][..]));
    let nodes = b"# by hand\n4 3 1 1\n1 0 0 0 0.5 2\n2 1 0 0 .5 0\n3 0 1 0 .5 0 # a comment\n4 0 0 1 .5 -1\n";
    let elements = b"1 4 2\n1 1 2 3 4  6 0.25\n";
    let mesh = tetgen(elements, nodes).unwrap();
    assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3]]);
    assert_eq!(mesh.groups.keys().collect::<Vec<_>>(), ["tetrahedron_6", "vertex_-1", "vertex_2"]);
    assert_eq!(mesh.groups["vertex_-1"].vertices, [3]);
    // TetGen's tetrahedra are left-handed: two vertices are exchanged.
    let left = tetgen(b"1 4 0\n1 1 3 2 4\n", nodes).unwrap();
    assert_eq!(left.tetrahedra, [[0, 2, 3, 1]]);
    let plane =
        with(Format::TetGen, b"1 3 0\n0 0 1 2\n", b"3 2 0 0\n0 0 0\n1 1 0\n2 0 1\n", 2, MidNodes::Refuse);
    assert_eq!(plane.unwrap().triangles, [[0, 1, 2]]);
}

#[test]
fn faults_of_tetgen_pairs_name_the_file_and_the_line() {
    let fault = |elements: &[u8], nodes: &[u8]| {
        let (site, error) = tetgen(elements, nodes).unwrap_err();
        (site.in_nodes, site.line, site.tag, error.to_string())
    };
    let (in_nodes, line, _, message) = fault(&changed(ELE, "1 1 2 3 4", "1 1 2 3 5"), NODE);
    assert_eq!(
        (in_nodes, line, &message[..]),
        (false, 4, "there is no vertex 5: the file has 5, numbered from 0")
    );
    let (in_nodes, line, tag, message) = fault(ELE, &changed(NODE, "1.2500000000000000e+00", "nan"));
    assert_eq!((in_nodes, line, tag), (true, 7, Some(FileTag::Node(4))), "{message}");
    let (in_nodes, line, _, message) = fault(ELE, &changed(NODE, "\n3 ", "\n7 "));
    assert!(in_nodes && line == 6 && message.contains("number 7, expected 3"), "{line} {message}");
    let (in_nodes, _, _, message) = fault(ELE, &changed(NODE, "5 3 0 0", "6 3 0 0"));
    assert!(in_nodes && message.contains("the file ends where the number of a node"), "{message}");
    let (in_nodes, line, _, message) = fault(&changed(ELE, "2 4 0", "2 10 0"), NODE);
    assert!(!in_nodes && line == 2 && message.contains("an element with 10 nodes"), "{message}");
    let (_, line, tag, message) = fault(&changed(ELE, "1 1 2 3 4", "1 1 3 2 4"), NODE);
    assert!(message.contains("inverted"), "{message}");
    assert_eq!((line, tag), (4, Some(FileTag::Element(1))));
}

#[test]
fn cells_of_second_order_are_refused_dropped_or_kept() {
    let solids: [(&str, Format, &[u8]); 6] = [
        ("vtk ascii", Format::Vtk, data!("quadratic_ascii.vtk")),
        ("vtk binary", Format::Vtk, data!("quadratic_binary.vtk")),
        ("vtu", Format::Vtu, data!("quadratic.vtu")),
        ("gmsh", Format::Gmsh, data!("quadratic.msh")),
        ("gmsh 2.2 binary", Format::Gmsh, data!("quadratic_22_binary.msh")),
        ("gmsh 4.1 binary", Format::Gmsh, data!("quadratic_41_binary.msh")),
    ];
    for (name, format, bytes) in solids {
        let (_, error) = with(format, bytes, &[], 3, MidNodes::Refuse).unwrap_err();
        assert!(error.to_string().contains("drop_mid_nodes = true"), "{name}: {error}");
        let linear = with(format, bytes, &[], 3, MidNodes::Drop).unwrap();
        assert_eq!((&linear.points[..], linear.order()), (&POINTS[..], 1), "{name}");
        assert_eq!(linear.tetrahedra, [[0, 1, 2, 3], [1, 2, 3, 4]], "{name}");
        let quadratic = with(format, bytes, &[], 3, MidNodes::Keep).unwrap();
        assert_eq!((quadratic.vertex_count(), quadratic.order()), (5 + 9, 2), "{name}");
        middles_are_in_the_middle(&quadratic);
    }
    for (format, bytes) in [(Format::Vtu, &data!("plane.vtu")[..]), (Format::Gmsh, data!("plane.msh"))] {
        let plane = with(format, bytes, &[], 2, MidNodes::Keep).unwrap();
        assert_eq!(plane.triangle_middles, [[4, 5, 6], [6, 7, 8]]);
        middles_are_in_the_middle(&plane);
    }
}

/// Checks the node order documented in [`quadratic`](super::quadratic).
pub(super) fn middles_are_in_the_middle(mesh: &Mesh) {
    let check = |edges: &[[usize; 2]], cell: &[u32], middles: &[u32]| {
        for (&[a, b], &middle) in edges.iter().zip(middles) {
            let (a, b) = (mesh.point(cell[a] as usize), mesh.point(cell[b] as usize));
            for (axis, &x) in mesh.point(middle as usize).iter().enumerate() {
                assert!((x - 0.5 * (a[axis] + b[axis])).abs() < 1e-15, "{cell:?} {middles:?}");
            }
        }
    };
    for (cell, middles) in mesh.tetrahedra.iter().zip(&mesh.tetrahedron_middles) {
        check(&pliant::element::TETRAHEDRON_EDGES, cell, middles);
    }
    for (cell, middles) in mesh.triangles.iter().zip(&mesh.triangle_middles) {
        check(&pliant::element::TRIANGLE_EDGES, cell, middles);
    }
    assert!(!mesh.triangle_middles.is_empty() || !mesh.tetrahedron_middles.is_empty());
}

#[test]
fn promoted_meshes_share_the_nodes_of_their_edges() {
    let mesh = read(Format::Medit, MEDIT);
    let quadratic = mesh.promoted_to_quadratic().unwrap();
    assert_eq!(quadratic.vertex_count(), 5 + mesh.unique_edges().len());
    assert_eq!(quadratic.points[..15], mesh.points);
    middles_are_in_the_middle(&quadratic);
    super::check::check(&quadratic).unwrap();
    // The shared face: nodes 12, 23, 13 of the first cell are 01, 12, 02 of the second.
    let [first, second] = quadratic.tetrahedron_middles[..] else { panic!() };
    assert_eq!([first[1], first[5], first[4]], [second[0], second[1], second[2]]);
    // Four corners and five edges of the two triangles; the tetrahedra have ten nodes.
    assert_eq!(quadratic.groups["triangle_3"].vertices.len(), 4 + 5);
    assert_eq!(quadratic.groups["tetrahedron_8"].vertices.len(), 10);
    assert_eq!(quadratic.promoted_to_quadratic().unwrap(), quadratic);
}

#[test]
fn mixed_orders_are_refused() {
    let text = "# vtk DataFile Version 4.2\n\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 7 float\n0 0 0 1 0 0 \
                0 1 0 .5 0 0 .5 .5 0 0 .5 0 -1 0 0\nCELLS 2 11\n6 0 1 2 3 4 5\n3 0 2 6\nCELL_TYPES 2\n22 5\n";
    let (site, error) = with(Format::Vtk, text.as_bytes(), &[], 2, MidNodes::Keep).unwrap_err();
    assert!(
        matches!(error, MeshError::Format(FormatError::MixedOrder)) && site.line == 9,
        "{site:?} {error}"
    );
    let dropped = with(Format::Vtk, text.as_bytes(), &[], 2, MidNodes::Drop).unwrap();
    assert_eq!((dropped.vertex_count(), &dropped.triangles[..]), (4, &[[0, 1, 2], [0, 2, 3]][..]));
}

/// Lines of both orders between the same corners, in either order in the file.
#[test]
fn lines_of_both_orders_are_refused_or_read_by_their_corners() {
    let file = |lines: &str| {
        format!(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n6\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 .5 0 0\n5 .5 .5 \
             0\n6 0 .5 0\n$EndNodes\n\
             $Elements\n4\n{lines}4 9 2 3 1 1 2 3 4 5 6\n$EndElements\n"
        )
    };
    for (lines, first) in [
        ("1 1 2 1 1 3 1\n2 8 2 1 1 1 2 4\n3 1 2 2 1 2 1\n", 15),
        ("1 8 2 1 1 1 2 4\n2 1 2 2 1 2 1\n3 1 2 1 1 3 1\n", 16),
        ("1 1 2 2 1 2 1\n2 8 2 1 1 1 2 4\n3 1 2 1 1 3 1\n", 15),
    ] {
        let text = file(lines);
        let (site, error) = with(Format::Gmsh, text.as_bytes(), &[], 2, MidNodes::Keep).unwrap_err();
        assert!(matches!(error, MeshError::Format(FormatError::MixedOrder)), "{error}");
        assert_eq!(site.line, first);
        let corners = with(Format::Gmsh, text.as_bytes(), &[], 2, MidNodes::Drop).unwrap();
        assert_eq!((corners.points.len(), &corners.triangles[..]), (6, &[[0, 1, 2]][..]));
        assert_eq!((corners.lines.len(), corners.groups["2"].vertices.len()), (2, 2), "{lines}");
        assert_eq!(corners.groups["1"].cells, [0, 1], "{lines}");
    }
}

#[test]
fn solids_of_an_stl_file_are_groups_and_only_equal_vertices_are_merged() {
    let facet = |z: &str| {
        format!(
            "facet normal 0 0 1\nouter loop\nvertex 0 0 {z}\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
        )
    };
    let text = format!(
        "solid near part\n{}endsolid near part\nSOLID far\n{}endsolid\n",
        facet("-0"),
        facet("1e-300")
    );
    let mesh = read(Format::Stl, format!("solid\n{}endsolid\n{text}", facet("-1")).as_bytes());
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 1, 2], [4, 1, 2]]);
    assert_eq!(mesh.groups.keys().collect::<Vec<_>>(), ["far", "near part"]);
    assert_eq!(mesh.groups["far"].vertices, [1, 2, 4]);
    let zeros = format!("solid\n{}{}endsolid\n", facet("0"), facet("-0"));
    let (_, error) = with(Format::Stl, zeros.as_bytes(), &[], 3, MidNodes::Refuse).unwrap_err();
    assert!(matches!(error, MeshError::RepeatedCell { .. }), "{error}");
}

/// Spellings used by writers of STL.
#[test]
fn ascii_stl_is_read_as_it_is_written() {
    let stl = SURFACES[3].2;
    let whole = read(Format::Stl, stl);
    let text = String::from_utf8(stl.to_vec()).unwrap();
    let normal = text.lines().find(|line| line.contains("facet normal")).unwrap().trim();
    for (name, spelled) in [
        (
            "two words",
            text.replace("endsolid", "end solid")
                .replace("endfacet", "end facet")
                .replace("endloop", "end loop"),
        ),
        ("named end", text.replace("endsolid", "endsolid a part of it")),
        ("upper case", text.to_ascii_uppercase().replace("SOLID\n", "SOLID \n")),
        ("one word", text.replace("outer loop", "outerloop")),
        (
            "no normal",
            text.lines()
                .map(|l| if l.contains("normal") { "facet\n".into() } else { format!("{l}\n") })
                .collect(),
        ),
        ("normal of no number", text.replacen(normal, "facet normal -nan(ind) 1.#QNAN nan", 1)),
        ("line ends", text.replace('\n', "\r\n")),
        ("indented", text.replace('\n', "\n\t  ")),
        ("leading blanks", format!("\n  {text}")),
    ] {
        let mesh = with(Format::Stl, spelled.as_bytes(), &[], 3, MidNodes::Refuse);
        let mesh = mesh.unwrap_or_else(|(site, error)| panic!("{name}: {site:?} {error}"));
        assert_eq!((&mesh.points, &mesh.triangles), (&whole.points, &whole.triangles), "{name}");
    }
    // A truncated binary file that begins with the same word: the message is about its bytes.
    let mut binary = SURFACES[4].2.to_vec();
    binary[..5].copy_from_slice(b"solid");
    assert_eq!(read(Format::Stl, &binary).triangles, whole.triangles);
    let (_, _, message) = fault(Format::Stl, &binary[..binary.len() - 1]);
    assert!(message.contains("199, but it must be 200"), "{message}");
    let (_, _, message) = fault(Format::Stl, text.replace("endsolid", "").trim_end().as_bytes());
    assert!(message.contains("the file ends where facet or endsolid should be"), "{message}");
}
