//! Both Gmsh formats, OBJ, and the positions of errors, on small literal files.

use std::path::{Path, PathBuf};

use super::file::{Format, MeshInput, Site};
use super::{FileTag, Mesh, MeshError, MidNodes, build};
use crate::spec::{FileSpec, MeshSpec};

/// Line of an error, and the number of the item in the file.
type Location = (u32, Option<FileTag>);

/// The mesh of a single file, or the error with its position.
pub(super) fn parse(
    format: Format,
    bytes: &[u8],
    dimension: usize,
) -> Result<Mesh, (Option<Location>, MeshError)> {
    let input = MeshInput { bytes, nodes: &[], mid_nodes: MidNodes::Refuse, spec: &FileSpec::default() };
    super::file::parse(format, &input, dimension).map_err(|(Site { line, tag, .. }, error)| {
        ((line > 0 || tag.is_some()).then_some((line, tag)), error)
    })
}

/// Written by meshio 5.3.5, `file_format="gmsh22"`.
pub(super) const MESHIO_22: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n\
$PhysicalNames\n3\n2 3 \"base\"\n3 7 \"soft\"\n3 8 \"hard part\"\n$EndPhysicalNames\n\
$Nodes\n5\n\
1 0.0000000000000000e+00 0.0000000000000000e+00 0.0000000000000000e+00\n\
2 1.0000000000000000e+00 0.0000000000000000e+00 0.0000000000000000e+00\n\
3 0.0000000000000000e+00 1.0000000000000000e+00 0.0000000000000000e+00\n\
4 0.0000000000000000e+00 0.0000000000000000e+00 1.0000000000000000e+00\n\
5 1.0000000000000000e+00 1.0000000000000000e+00 1.0000000000000000e+00\n$EndNodes\n\
$Elements\n4\n1 4 2 7 1 1 2 3 4\n2 4 2 8 1 2 3 4 5\n3 2 2 3 1 1 3 2\n4 2 2 3 1 1 2 4\n$EndElements\n";

/// Laid out as Gmsh 4.15 writes version 4.1: entities in two groups, parametric nodes, gaps in the tags,
/// an unknown section.
pub(super) const GMSH_41: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n\
$PhysicalNames\n4\n0 2 \"corner\"\n2 6 \"left\"\n2 9 \"both sides\"\n3 5 \"body\"\n$EndPhysicalNames\n\
$Entities\n1 1 2 1\n\
1 0 0 0 1 2 \n\
4 0 0 0 1 0 0 1 2 2 1 -3 \n\
1 0 0 0 0 1 1 2 6 9 2 -4 4 \n\
2 0 0 0 1 0 1 1 -9 0 \n\
1 0 0 0 1 1 1 1 5 2 1 -2 \n$EndEntities\n\
$PartitionedEntities\n2\n0 \n$EndPartitionedEntities\n\
$Nodes\n3 4 10 40\n\
0 1 0 1\n40\n0 0 0\n\
2 1 1 2\n20\n10\n1 0 0 0.25 0.75\n0 1 0 0.5 0.5\n\
3 1 0 1\n30\n0 0 1\n$EndNodes\n\
$Elements\n5 5 1 9\n\
0 1 15 1\n1 40 \n\
1 4 1 1\n2 40 20 \n\
2 1 2 1\n5 40 30 10 \n\
2 2 2 1\n6 40 20 30 \n\
3 1 4 1\n9 40 20 10 30 \n$EndElements\n";

fn gmsh(text: &str, dimension: usize) -> Result<Mesh, MeshError> {
    parse(Format::Gmsh, text.as_bytes(), dimension).map_err(|(_, error)| error)
}

fn obj(text: &str, dimension: usize) -> Result<Mesh, MeshError> {
    parse(Format::Obj, text.as_bytes(), dimension).map_err(|(_, error)| error)
}

/// Line, tag and error.
fn fault(format: Format, text: &str, dimension: usize) -> (u32, Option<FileTag>, MeshError) {
    let (place, error) = parse(format, text.as_bytes(), dimension).unwrap_err();
    let (line, tag) = place.unwrap_or_default();
    (line, tag, error)
}

#[test]
fn version_2_2_as_meshio_writes_it() {
    let mesh = gmsh(MESHIO_22, 3).unwrap();
    assert_eq!(mesh.points, [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1., 1., 1., 1.]);
    assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3], [1, 2, 3, 4]]);
    assert_eq!(mesh.triangles, [[0, 2, 1], [0, 1, 3]]);
    assert_eq!(mesh.groups.keys().collect::<Vec<_>>(), ["base", "hard part", "soft"]);
    let hard = &mesh.groups["hard part"];
    assert_eq!(
        (hard.topological_dimension, &hard.cells[..], &hard.vertices[..]),
        (3, &[1][..], &[1, 2, 3, 4][..])
    );
    let base = &mesh.groups["base"];
    assert_eq!(
        (base.topological_dimension, &base.cells[..], &base.vertices[..]),
        (2, &[0, 1][..], &[0, 1, 2, 3][..])
    );
    assert_eq!(mesh.element_dimension(), 3);
}

#[test]
fn version_4_1_with_gaps_parameters_and_entities_in_several_groups() {
    let mesh = gmsh(GMSH_41, 3).unwrap();
    // Nodes 40, 20, 10, 30 become 0, 1, 2, 3.
    assert_eq!(mesh.points, [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.]);
    assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3]]);
    assert_eq!(mesh.triangles, [[0, 3, 2], [0, 1, 3]]);
    assert_eq!((&mesh.lines[..], mesh.edges.len()), (&[[0, 1]][..], 0));
    let group = |name: &str| {
        let group = &mesh.groups[name];
        (group.topological_dimension, group.cells.clone(), group.vertices.clone())
    };
    assert_eq!(group("body"), (3, vec![0], vec![0, 1, 2, 3]));
    assert_eq!(group("left"), (2, vec![0], vec![0, 2, 3]));
    assert_eq!(group("both sides"), (2, vec![0, 1], vec![0, 1, 2, 3]));
    assert_eq!(group("corner"), (0, vec![0], vec![0]));
    // Line group 2 has no name.
    assert_eq!(group("2"), (1, vec![0], vec![0, 1]));
}

#[test]
fn version_2_2_repeats_elements_once_per_group_and_they_are_merged() {
    let text =
        MESHIO_22.replace("4\n1 4 2 7", "5\n1 4 2 7").replace("3 2 2 3", "9 4 4 7 1 1 1 5 4 3 2\n3 2 2 3");
    let mesh = gmsh(&text, 3).unwrap();
    assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3], [1, 2, 3, 4]]);
    assert_eq!(mesh.groups["soft"].cells, [0, 1]);
    assert_eq!(mesh.groups["hard part"].cells, [1]);
}

#[test]
fn a_name_given_to_several_dimensions_stands_for_the_highest_and_all_vertices() {
    let mesh = gmsh(&GMSH_41.replace("both sides", "body"), 3).unwrap();
    let body = &mesh.groups["body"];
    assert_eq!(
        (body.topological_dimension, &body.cells[..], &body.vertices[..]),
        (3, &[0][..], &[0, 1, 2, 3][..])
    );
    let corner = gmsh(&GMSH_41.replace("corner", "left"), 3).unwrap();
    assert_eq!(corner.groups["left"].vertices, [0, 2, 3]);
}

#[test]
fn triangles_alone_are_a_plane_mesh_or_a_surface() {
    let text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n7 0 0 0\n8 1 0 0\n9 0 1 0\n$EndNodes\n\
                $Elements\n2\n1 1 2 4 1 7 8\n2 2 2 0 1 7 8 9\n$EndElements\n";
    let plane = gmsh(text, 2).unwrap();
    assert_eq!(
        (plane.points.len(), &plane.triangles[..], &plane.lines[..]),
        (6, &[[0, 1, 2]][..], &[[0, 1]][..])
    );
    assert_eq!((plane.groups["4"].topological_dimension, &plane.groups["4"].vertices[..]), (1, &[0, 1][..]));
    assert_eq!(gmsh(text, 3).unwrap().element_dimension(), 2);
    let strand = text.replace("2\n1 1 2 4 1 7 8\n2 2 2 0 1 7 8 9", "2\n1 1 2 4 1 7 8\n2 1 2 4 1 8 9");
    assert_eq!(gmsh(&strand, 2).unwrap().edges, [[0, 1], [1, 2]]);
}

#[test]
fn faults_of_gmsh_files_name_their_line() {
    use MeshError as E;
    let at = |text: String| fault(Format::Gmsh, &text, 3);
    let in22 = |from: &str, to: &str| {
        assert!(MESHIO_22.contains(from));
        at(MESHIO_22.replacen(from, to, 1))
    };
    let in41 = |from: &str, to: &str| {
        assert!(GMSH_41.contains(from));
        at(GMSH_41.replacen(from, to, 1))
    };
    let (line, tag, error) = in22("2.2 0 8", "2.2 1 8");
    assert!(line == 0 && tag == Some(FileTag::Byte(20)), "{line} {tag:?} {error}");
    assert!(error.to_string().contains("the integer 1, which shows the order of the bytes"), "{error}");
    assert!(matches!(in22("2.2 0 8", "2.2 2 8"), (2, None, E::Expected { .. })));
    assert!(
        matches!(in22("$MeshFormat\n2.2", "$NOD\n5"), (1, None, E::GmshVersion { version }) if version == "1")
    );
    assert!(matches!(in22("2.2 0 8", "4 0 8"), (2, None, E::GmshVersion { version }) if version == "4"));
    assert!(matches!(in22("$MeshFormat", "# vtk"), (1, None, E::Expected { expected: "$MeshFormat", .. })));
    assert!(matches!(in22("$PhysicalNames\n3", "$PhysicalNames\nx"), (5, _, E::Expected { .. })));
    assert!(matches!(
        in22("\"soft\"", "soft"),
        (7, _, E::Expected { expected: "a name in double quotes", .. })
    ));
    assert!(matches!(in22("2 3 \"base", "9 3 \"base"), (6, _, E::Expected { .. })));
    assert!(matches!(
        in22("$Nodes\n5", "$Nodes\n6"),
        (17, _, E::Expected { expected: "the tag of a node", .. })
    ));
    assert!(matches!(in22("$Nodes\n5", "$Nodes\n4"), (16, _, E::Expected { expected: "$EndNodes", .. })));
    assert!(matches!(in22("\n5 1.0", "\n4 1.0"), (16, _, E::RepeatedNode { node: 4 })));
    assert!(matches!(in22("2 3 4 5\n", "2 3 4 6\n"), (21, _, E::UnknownNode { element: 2, node: 6 })));
    let (line, _, error) = in22("1 4 2 7", "1 11 2 7");
    assert!(matches!(error, E::ElementType { element: 1, kind: 11, .. }) && line == 20, "{line} {error}");
    assert!(error.to_string().contains("10-node second-order tetrahedron"), "{error}");
    assert!(matches!(in22("$EndElements", ""), (_, _, E::EndOfFile { expected: "$EndElements" })));
    assert!(matches!(in22("$Elements", "$Other"), (_, _, E::EndOfFile { .. })));
    let nodes = MESHIO_22.find("$Elements").unwrap();
    assert!(matches!(at(MESHIO_22[..nodes].to_string()), (_, _, E::MissingSection { section: "$Elements" })));
    assert!(matches!(
        at("$MeshFormat\n4.1 0 8\n$EndMeshFormat".into()),
        (_, _, E::MissingSection { section: "$Nodes" })
    ));
    assert!(matches!(at(format!("{MESHIO_22}$Nodes\n")), (25, _, E::Expected { .. })));
    assert!(matches!(at(format!("{MESHIO_22}word\n")), (25, _, E::Expected { .. })));
    let elements = MESHIO_22.replace("$Nodes", "$Nod").replace("$EndNodes", "$EndNod");
    assert!(matches!(at(elements), (_, _, E::MissingSection { section: "$Nodes before $Elements" })));
    assert!(matches!(in41("3 1 4 1\n", "3 1 11 1\n"), (_, _, E::ElementType { element: 9, kind: 11, .. })));
    assert!(matches!(
        in41("2 6 9 2 -4", "2 6 x 2 -4"),
        (_, _, E::Expected { expected: "the tag of a physical group", .. })
    ));
    let many = format!("0 0 0 65 {}\n4", "3 ".repeat(65));
    assert!(matches!(in41("0 0 0 1 2 \n4", &many), (_, _, E::TooManyGroups { limit: 64 })));
}

#[test]
fn faults_of_the_mesh_name_the_numbers_of_the_file() {
    use MeshError as E;
    let (line, tag, error) = fault(Format::Gmsh, &MESHIO_22.replace("8 1 2 3 4 5", "8 1 2 3 5 4"), 3);
    assert!(matches!(error, E::Inverted { cell: super::Cell::Tetrahedron(1), .. }), "{error}");
    assert_eq!((line, tag), (21, Some(FileTag::Element(2))));
    let (line, tag, error) = fault(Format::Gmsh, &MESHIO_22.replace("8 1 2 3 4 5", "8 1 2 3 4 4"), 3);
    assert!(matches!(error, E::RepeatedVertex { vertex: 3, .. }), "{error}");
    assert_eq!((line, tag), (21, Some(FileTag::Element(2))));
    let (line, tag, error) = fault(Format::Gmsh, &GMSH_41.replace("0 1 0 0.5 0.5", "0 nan 0 0.5 0.5"), 3);
    assert!(matches!(error, E::NonFiniteCoordinate { vertex: 2, axis: 1, .. }), "{error}");
    // This format lists positions apart from tags: the line is the position's.
    assert_eq!((line, tag), (32, Some(FileTag::Node(10))));
    let (_, tag, error) = fault(
        Format::Gmsh,
        &MESHIO_22.replace("4\n1 4 2 7", "3\n1 4 2 7").replace("2 4 2 8 1 2 3 4 5\n", ""),
        3,
    );
    assert!(matches!(error, E::Unreferenced { vertex: 4, count: 1 }), "{error}");
    assert_eq!(tag, Some(FileTag::Node(5)));
    let (_, _, error) = fault(Format::Gmsh, MESHIO_22, 2);
    assert!(matches!(error, E::TetrahedraInPlane { count: 2 }), "{error}");
}

pub(super) const SHEET: &str = "# a sheet\nmtllib none.mtl\no two tiles\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0\nv 0 \
                                1 0\nvn 0 0 1\n\
g first all\nusemtl red\nf 1/1/1 2//1 3\ng all # the rest\nf -4 -2 \\\n -1\ng\nl 1 2 3\n";

#[test]
fn obj_faces_lines_groups_and_objects() {
    let mesh = obj(SHEET, 3).unwrap();
    assert_eq!(mesh.points, [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.edges, [[0, 1], [1, 2]]);
    assert_eq!(mesh.groups.keys().collect::<Vec<_>>(), ["all", "first", "two tiles"]);
    assert_eq!(
        (&mesh.groups["first"].cells[..], &mesh.groups["first"].vertices[..]),
        (&[0][..], &[0, 1, 2][..])
    );
    assert_eq!((&mesh.groups["all"].cells[..], mesh.groups["all"].topological_dimension), (&[0, 1][..], 2));
    assert_eq!(mesh.groups["two tiles"].vertices, [0, 1, 2, 3]);
    assert_eq!(obj(SHEET, 2).unwrap().points.len(), 8);
    let pentagon = "v 0 0 0\nv 2 0 0\nv 3 1 0\nv 1 3 0\nv 0 1 0\nf 1 2 3 4 5";
    assert_eq!(obj(pentagon, 2).unwrap().triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    let polyline = obj("v 0 0 0\nv 2 0 0\nv 3 1 0\ng rope\nl 1 2 3", 3).unwrap();
    assert_eq!((polyline.element_dimension(), polyline.groups["rope"].topological_dimension), (1, 1));
}

#[test]
fn faults_of_obj_files_name_their_line() {
    use MeshError as E;
    let at = |from: &str, to: &str, dimension| {
        assert!(SHEET.contains(from));
        fault(Format::Obj, &SHEET.replacen(from, to, 1), dimension)
    };
    assert!(matches!(at("v 1 1 0", "v 1 y 0", 3), (6, _, E::Expected { expected: "y of a vertex", .. })));
    assert!(matches!(at("v 1 1 0", "v 1 1", 3), (6, _, E::Expected { expected: "z of a vertex", .. })));
    assert!(matches!(
        at("v 1 1 0", "v 1 1 0.5", 2),
        (6, Some(FileTag::Node(3)), E::OffPlane { vertex: 2, z: 0.5 })
    ));
    assert!(matches!(at("2//1 3", "2//1 5", 3), (11, _, E::ObjIndex { index: 5, count: 4 })));
    assert!(matches!(at("2//1 3", "2//1 0", 3), (11, _, E::ObjIndex { index: 0, count: 4 })));
    assert!(matches!(at("-4 -2", "-5 -2", 3), (14, _, E::ObjIndex { index: -5, count: 4 })));
    assert!(matches!(at("2//1 3", "2//1 x", 3), (11, _, E::Expected { .. })));
    assert!(matches!(
        at("2//1 3", "2//1", 3),
        (11, _, E::Expected { expected: "three vertices of a face", .. })
    ));
    assert!(matches!(
        at("l 1 2 3", "l 1", 3),
        (16, _, E::Expected { expected: "two vertices of a line", .. })
    ));
    assert!(matches!(at("2//1 3", "3 2", 2), (11, None, E::Inverted { .. })));
    let groups: Vec<String> = (0..65).map(|i| format!("n{i}")).collect();
    assert!(matches!(
        at("g\n", &format!("g {}\n", groups.join(" ")), 3),
        (15, _, E::TooManyGroups { limit: 64 })
    ));
    assert!(matches!(fault(Format::Obj, "", 3), (0, None, E::Empty)));
}

fn file(name: &str, base: &Path) -> Result<Mesh, MeshError> {
    build(&MeshSpec::File(FileSpec { path: PathBuf::from(name), ..FileSpec::default() }), 3, base)
}

#[test]
fn files_are_found_beside_the_scene_and_faults_read_like_a_compilers() {
    let directory = tempfile::tempdir().unwrap();
    let base = directory.path();
    std::fs::write(base.join("a.msh"), MESHIO_22).unwrap();
    std::fs::write(base.join("b.MSH"), MESHIO_22.replace("8 1 2 3 4 5", "8 1 2 3 5 4")).unwrap();
    std::fs::write(base.join("c.obj"), SHEET).unwrap();
    std::fs::write(base.join("d.dxf"), "").unwrap();
    assert_eq!(file("a.msh", base).unwrap(), gmsh(MESHIO_22, 3).unwrap());
    assert_eq!(file("c.obj", base).unwrap().triangles.len(), 2);
    let message = file("b.MSH", base).unwrap_err().to_string();
    let start = format!(
        "{}:21: element 2 of the file: tetrahedron 1 is inverted: its volume is -",
        base.join("b.MSH").display()
    );
    let end =
        "swap two of its vertices; or `orient = true` next to `path` does so for every element that needs it";
    assert!(message.starts_with(&start) && message.ends_with(end), "{message}");
    assert!(matches!(file("d.dxf", base), Err(MeshError::UnknownFormat { .. })));
    assert!(matches!(file("none.msh", base), Err(MeshError::Unreadable { .. })));
    std::fs::create_dir(base.join("e.obj")).unwrap();
    assert!(matches!(file("e.obj", base), Err(MeshError::Unreadable { .. })));
    let spec = MeshSpec::File(FileSpec { path: "a.msh".into(), ..FileSpec::default() });
    let size = super::predicted_size(&spec, 3, base).unwrap();
    assert!(size.vertices >= 5 && size.tetrahedra >= 2 && size.bytes == 16 * MESHIO_22.len() as u64);
}

#[test]
fn the_bunny_is_what_its_note_says() {
    let base = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/meshes");
    let mesh = file("bunny.msh", &base).unwrap();
    assert_eq!((mesh.vertex_count(), mesh.tetrahedra.len()), (2353, 8061));
    assert!(mesh.boundary_edges().is_empty());
    let q = mesh.quality().elements.unwrap();
    assert!((q.total_volume - 5.818e-3).abs() < 0.5e-6, "{q:?}");
    assert!(
        (q.smallest_volume - 7.7e-9).abs() < 0.05e-9 && (q.largest_volume - 5.3e-6).abs() < 0.05e-6,
        "{q:?}"
    );
    assert!(
        q.worst_mean_ratio > 0.0 && q.worst_mean_ratio < q.average_mean_ratio && q.average_mean_ratio < 1.0
    );
}
