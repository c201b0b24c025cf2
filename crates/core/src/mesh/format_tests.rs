//! Formats read back from files that meshio and VTK wrote (`tests/tools/write_meshes.py`), and their faults.

use super::file::{Format, Input, Site, parse};
use super::{FileTag, FormatError, Mesh, MeshError, MidNodes};

/// The files of `tests/data/meshes`.
macro_rules! data {
    ($name:literal) => {
        include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/meshes/", $name))
    };
}

/// Coordinates of the bodies that the script writes.
const POINTS: [f64; 15] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0.1, 0.2, 0.7, 1., 1., 1.25];

pub(super) const VTK: [(&str, &[u8]); 4] = [
    ("5.1 ascii", data!("solid_51_ascii.vtk")),
    ("5.1 binary", data!("solid_51_binary.vtk")),
    ("4.2 ascii", data!("solid_42_ascii.vtk")),
    ("4.2 binary", data!("solid_42_binary.vtk")),
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
    parse(format, &Input { bytes, nodes, mid_nodes }, dimension)
}

pub(super) fn read(format: Format, bytes: &[u8]) -> Mesh {
    with(format, bytes, &[], 3, MidNodes::Refuse).unwrap_or_else(|(site, error)| panic!("{site:?}: {error}"))
}

/// The place of the fault, and what is said.
pub(super) fn fault(format: Format, bytes: &[u8]) -> (u32, Option<FileTag>, String) {
    let (site, error) = with(format, bytes, &[], 3, MidNodes::Refuse).unwrap_err();
    (site.line, site.tag, error.to_string())
}

/// `from` exchanged for `to`, once.
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
fn surfaces_read_back_with_shared_vertices() {
    for (name, format, bytes) in SURFACES {
        let mesh = read(format, bytes);
        assert_eq!(
            (mesh.vertex_count(), mesh.triangles.len(), mesh.element_dimension()),
            (4, 4, 2),
            "{name}"
        );
        assert!(mesh.boundary_edges().is_empty(), "{name}");
        // STL numbers vertices as they come, and stores single precision.
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
    let plane = "MeshVersionFormatted 1 # as in the report\nDimension 2\nVertices 3\n0 0 0\n1 0 0\n0 1 4\nRidges 1\n1\n\
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
    // Left-handed throughout, as TetGen has it: two vertices change places.
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
    assert!(in_nodes && line == 6 && message.contains("number 7 where 3 comes next"), "{line} {message}");
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
    let solids: [(&str, Format, &[u8]); 4] = [
        ("vtk ascii", Format::Vtk, data!("quadratic_ascii.vtk")),
        ("vtk binary", Format::Vtk, data!("quadratic_binary.vtk")),
        ("vtu", Format::Vtu, data!("quadratic.vtu")),
        ("gmsh", Format::Gmsh, data!("quadratic.msh")),
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

/// In the order that [`quadratic`](super::quadratic) documents.
fn middles_are_in_the_middle(mesh: &Mesh) {
    let check = |edges: &[[usize; 2]], cell: &[u32], middles: &[u32]| {
        for (&[a, b], &middle) in edges.iter().zip(middles) {
            let (a, b) = (mesh.point(cell[a] as usize), mesh.point(cell[b] as usize));
            for (axis, &x) in mesh.point(middle as usize).iter().enumerate() {
                assert!((x - 0.5 * (a[axis] + b[axis])).abs() < 1e-15, "{cell:?} {middles:?}");
            }
        }
    };
    for (cell, middles) in mesh.tetrahedra.iter().zip(&mesh.tetrahedron_middles) {
        check(&crate::element::TETRAHEDRON_EDGES, cell, middles);
    }
    for (cell, middles) in mesh.triangles.iter().zip(&mesh.triangle_middles) {
        check(&crate::element::TRIANGLE_EDGES, cell, middles);
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
    // The face that both share: nodes 12, 23, 13 of the first are 01, 12, 02 of the second.
    let [first, second] = quadratic.tetrahedron_middles[..] else { panic!() };
    assert_eq!([first[1], first[5], first[4]], [second[0], second[1], second[2]]);
    // Four corners and five edges of the two triangles; the tetrahedra have ten nodes.
    assert_eq!(quadratic.groups["triangle_3"].vertices.len(), 4 + 5);
    assert_eq!(quadratic.groups["tetrahedron_8"].vertices.len(), 10);
    assert_eq!(quadratic.promoted_to_quadratic().unwrap(), quadratic);
}

#[test]
fn mixed_orders_are_refused() {
    let text = "# vtk DataFile Version 4.2\n\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 7 float\n0 0 0 1 0 0 0 1 0 .5 0 0 .5 .5 0 \
                0 .5 0 -1 0 0\nCELLS 2 11\n6 0 1 2 3 4 5\n3 0 2 6\nCELL_TYPES 2\n22 5\n";
    let (site, error) = with(Format::Vtk, text.as_bytes(), &[], 2, MidNodes::Keep).unwrap_err();
    assert!(
        matches!(error, MeshError::Format(FormatError::MixedOrder)) && site.line == 9,
        "{site:?} {error}"
    );
    let dropped = with(Format::Vtk, text.as_bytes(), &[], 2, MidNodes::Drop).unwrap();
    assert_eq!((dropped.vertex_count(), &dropped.triangles[..]), (4, &[[0, 1, 2], [0, 2, 3]][..]));
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
    let mesh = read(Format::Stl, format!("solid\n{}endsolid\n{text}", facet("0")).as_bytes());
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 1, 2], [3, 1, 2]]);
    assert_eq!(mesh.groups.keys().collect::<Vec<_>>(), ["far", "near part"]);
    assert_eq!(mesh.groups["far"].vertices, [1, 2, 3]);
}
