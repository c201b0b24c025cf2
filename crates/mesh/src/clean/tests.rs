//! Files with typical defects, and the result of cleaning them.

use proptest::prelude::*;

use super::merge::targets;
use super::{Cleaned, STEPS, cures};
use crate::Cell;
use crate::FileTag;
use crate::Mesh;
use crate::MeshError;
use crate::MidNodes;
use crate::file::{Format, MeshInput, Site, parse};
use crate::spec::FileSpec;
use crate::test_support::{build_grid, grid};

static NOTHING: FileSpec = asking(None, [false, false, false]);
static MERGE: FileSpec = asking(Some(0.0), [false, false, false]);
static DROP_DEGENERATE: FileSpec = asking(None, [true, false, false]);
static DROP_UNUSED: FileSpec = asking(None, [false, true, false]);
static ORIENT: FileSpec = asking(None, [false, false, true]);
static EVERYTHING: FileSpec = asking(Some(0.0), [true, true, true]);

const fn asking(merge: Option<f64>, [drop_degenerate, drop_unused, orient]: [bool; 3]) -> FileSpec {
    let path = std::path::PathBuf::new();
    FileSpec { path, drop_mid_nodes: false, merge, drop_degenerate, drop_unused, orient }
}

fn gmsh(text: &str, dimension: usize, spec: &FileSpec) -> Result<Mesh, (Site, MeshError)> {
    with(Format::Gmsh, text.as_bytes(), dimension, spec, MidNodes::Keep)
}

fn with(
    format: Format,
    bytes: &[u8],
    dimension: usize,
    spec: &FileSpec,
    mid_nodes: MidNodes,
) -> Result<Mesh, (Site, MeshError)> {
    parse(format, &MeshInput { bytes, nodes: &[], mid_nodes, spec }, dimension)
}

fn error(text: &str, dimension: usize) -> MeshError {
    gmsh(text, dimension, &NOTHING).unwrap_err().1
}

/// A Gmsh file of nodes `tag x y z`, tags from 1, and cells `type group nodes`.
fn file(points: &[[f64; 3]], cells: &[(u64, u64, &[u64])]) -> String {
    let mut text = format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n", points.len());
    for (i, [x, y, z]) in points.iter().enumerate() {
        text += &format!("{} {x} {y} {z}\n", i + 1);
    }
    text += &format!("$EndNodes\n$Elements\n{}\n", cells.len());
    for (i, (kind, group, nodes)) in cells.iter().enumerate() {
        let nodes: Vec<String> = nodes.iter().map(u64::to_string).collect();
        text += &format!("{} {kind} 2 {group} 1 {}\n", i + 1, nodes.join(" "));
    }
    text + "$EndElements\n"
}

const CORNERS: [[f64; 3]; 5] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [1., 1., 1.]];

fn sentence(cleaned: &Cleaned) -> String {
    let (Cleaned { verb, count, why, .. }, what) = (cleaned, cleaned.noun());
    let of = cleaned.total.map_or(String::new(), |total| format!(" of {total}"));
    format!("{verb} {count}{of} {what} {why}").trim().to_string()
}

fn sentences(mesh: &Mesh) -> Vec<String> {
    mesh.cleaned.iter().map(sentence).collect()
}

fn is_positive(mesh: &Mesh) -> bool {
    mesh.quality().elements.unwrap().smallest_volume > 0.0
}

#[test]
fn clockwise_tetrahedra_are_refused_and_oriented() {
    let text = file(&CORNERS, &[(4, 7, &[1, 3, 2, 4]), (4, 8, &[2, 3, 5, 4])]);
    assert!(matches!(error(&text, 3), MeshError::Inverted { cell: Cell::Tetrahedron(0), .. }));
    let mesh = gmsh(&text, 3, &ORIENT).unwrap();
    assert!(is_positive(&mesh));
    assert_eq!(mesh.tetrahedra, [[0, 2, 3, 1], [1, 2, 3, 4]]);
    assert_eq!(sentences(&mesh), ["oriented 2 of 2 tetrahedra"]);
    assert_eq!((&mesh.groups["8"].cells[..], &mesh.groups["7"].vertices[..]), (&[1][..], &[0, 1, 2, 3][..]));
    let plane = file(
        &[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.]],
        &[(2, 1, &[1, 3, 2]), (2, 1, &[2, 4, 3])],
    );
    assert!(matches!(error(&plane, 2), MeshError::Inverted { cell: Cell::Triangle(0), .. }));
    let mesh = gmsh(&plane, 2, &ORIENT).unwrap();
    assert_eq!((&mesh.triangles[..], is_positive(&mesh)), (&[[0, 1, 2], [1, 3, 2]][..], true));
    assert_eq!(sentences(&mesh), ["oriented 1 of 2 triangles"]);
}

/// Mid-edge nodes move with their edges.
#[test]
fn cells_of_second_order_are_turned_with_their_middles() {
    let middle = |a: usize, b: usize| [0, 1, 2].map(|c| 0.5 * (CORNERS[a][c] + CORNERS[b][c]));
    let mut points = CORNERS[..4].to_vec();
    // Clockwise corners 0, 2, 1, 3, and their mid-edge nodes in Gmsh's order 01, 12, 02, 03, 23, 13.
    points.extend([middle(0, 2), middle(2, 1), middle(0, 1), middle(0, 3), middle(1, 3), middle(2, 3)]);
    let text = file(&points, &[(11, 1, &[1, 3, 2, 4, 5, 6, 7, 8, 9, 10])]);
    assert!(matches!(error(&text, 3), MeshError::Inverted { .. }));
    let mesh = gmsh(&text, 3, &ORIENT).unwrap();
    crate::format_tests::middles_are_in_the_middle(&mesh);
    assert!(is_positive(&mesh));
    let flat = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0.5, 0.], [0.5, 0.5, 0.], [0.5, 0., 0.]];
    let mesh = gmsh(&file(&flat, &[(9, 1, &[1, 3, 2, 4, 5, 6])]), 2, &ORIENT).unwrap();
    crate::format_tests::middles_are_in_the_middle(&mesh);
    assert!(is_positive(&mesh));
}

#[test]
fn unused_vertices_go_with_the_sides_that_use_them() {
    let mut points = CORNERS.to_vec();
    points.insert(1, [9., 9., 9.]);
    points.push([8., 8., 8.]);
    let text = file(
        &points,
        &[
            (15, 4, &[2]),
            (2, 3, &[1, 2, 3]),
            (2, 3, &[1, 4, 3]),
            (4, 7, &[1, 3, 4, 5]),
            (4, 7, &[3, 4, 5, 6]),
        ],
    );
    assert!(matches!(error(&text, 3), MeshError::Unreferenced { vertex: 1, count: 2 }));
    let mesh = gmsh(&text, 3, &DROP_UNUSED).unwrap();
    assert_eq!(mesh.points, CORNERS.as_flattened());
    assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3], [1, 2, 3, 4]]);
    assert_eq!((&mesh.triangles[..], &mesh.groups["3"].cells[..]), (&[[0, 2, 1]][..], &[0][..]));
    assert_eq!((&mesh.groups["3"].vertices[..], mesh.groups["4"].vertices.len()), (&[0, 1, 2][..], 0));
    assert_eq!(mesh.groups["4"].cells.len(), 0);
    assert_eq!(
        sentences(&mesh),
        ["dropped 2 vertices that no element and no edge uses", "dropped 1 triangle between them"]
    );
    assert_eq!(mesh.cleaned[0].first_vertex, Some(1));
    // Points without cells are elements themselves.
    let cloud = file(&CORNERS, &[(15, 1, &[2])]);
    assert_eq!(gmsh(&cloud, 3, &DROP_UNUSED).unwrap().vertex_count(), 5);
}

#[test]
fn degenerate_and_repeated_cells_are_refused_and_dropped() {
    let mut points = CORNERS.to_vec();
    points.push([0.5, 0.5, 0.]);
    let good: [(u64, u64, &[u64]); 3] = [(4, 7, &[1, 2, 3, 4]), (4, 7, &[2, 3, 4, 5]), (4, 7, &[2, 6, 4, 5])];
    let bad = |cell: (u64, u64, &'static [u64])| {
        let mut cells = good.to_vec();
        cells.insert(0, cell);
        file(&points, &cells)
    };
    let flat = bad((4, 9, &[1, 2, 3, 6]));
    assert!(matches!(error(&flat, 3), MeshError::Degenerate { cell: Cell::Tetrahedron(0), .. }));
    let twice = bad((4, 9, &[1, 2, 3, 1]));
    assert!(matches!(error(&twice, 3), MeshError::RepeatedVertex { vertex: 0, .. }));
    for text in [flat, twice] {
        let mesh = gmsh(&text, 3, &DROP_DEGENERATE).unwrap();
        assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3], [1, 2, 3, 4], [1, 5, 3, 4]]);
        let expected = ["dropped 1 tetrahedron without a volume", "dropped 0 tetrahedra repeating another"];
        assert_eq!(sentences(&mesh), expected);
        assert_eq!((&mesh.groups["7"].cells[..], mesh.groups["9"].cells.len()), (&[0, 1, 2][..], 0));
    }
    // Version 4.1 does not repeat a cell for each of its groups.
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\ng a\nf 1 2 3\nf 1 3 4\ng b\nf 4 3 1\nf 1 2 2\n";
    let read = |spec| with(Format::Obj, obj.as_bytes(), 3, spec, MidNodes::Refuse);
    assert!(matches!(read(&NOTHING).unwrap_err().1, MeshError::RepeatedVertex { .. }));
    let repeated = obj.replace("f 1 2 2\n", "");
    let (site, refused) = with(Format::Obj, repeated.as_bytes(), 3, &NOTHING, MidNodes::Refuse).unwrap_err();
    assert!(
        matches!(refused, MeshError::RepeatedCell { cell: Cell::Triangle(2), first: 1, count: 1 }),
        "{refused}"
    );
    assert_eq!(site.line, 9);
    assert!(refused.to_string().starts_with("triangle 2 has the same vertices as triangle 1;"), "{refused}");
    let mesh = read(&DROP_DEGENERATE).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(
        sentences(&mesh),
        ["dropped 1 triangle without an area", "dropped 1 triangle repeating another"]
    );
    // The group of the repeated cell now has the cell that represents it.
    assert_eq!((&mesh.groups["a"].cells[..], &mesh.groups["b"].cells[..]), (&[0, 1][..], &[1][..]));
    let only =
        with(Format::Obj, b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", 3, &DROP_DEGENERATE, MidNodes::Refuse);
    assert!(matches!(only.unwrap_err().1, MeshError::NothingLeft { count: 1 }));
}

#[test]
fn springs_without_length_are_dropped_or_their_ends_joined() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 0 0\nv 2 0 0\nl 1 2 3 4\n";
    let read = |spec: &FileSpec| with(Format::Obj, text.as_bytes(), 3, spec, MidNodes::Refuse);
    assert!(matches!(read(&NOTHING).unwrap_err().1, MeshError::ZeroLengthEdge { edge: 1, .. }));
    let joined = read(&EVERYTHING).unwrap();
    assert_eq!((&joined.edges[..], joined.contents().pieces), (&[[0, 1], [1, 2]][..], 1));
    let apart = read(&DROP_DEGENERATE).unwrap();
    assert_eq!((&apart.edges[..], apart.contents().pieces), (&[[0, 1], [2, 3]][..], 2));
    assert_eq!(apart.contents().coincident_vertices, 1);
}

/// Each cell has vertices of its own, as in formats that store triangles without connectivity.
#[test]
fn cells_that_share_no_vertices_are_joined() {
    let whole = build_grid(&grid(&[2, 2, 2], 0.5), 3).unwrap();
    let mut points = Vec::new();
    let mut cells = Vec::new();
    for cell in &whole.tetrahedra {
        let first = points.len() as u64;
        points.extend(cell.map(|v| [0, 1, 2].map(|c| whole.point(v as usize)[c])));
        cells.push([1, 2, 3, 4].map(|i| first + i));
    }
    let cells: Vec<(u64, u64, &[u64])> = cells.iter().map(|cell| (4, 5, &cell[..])).collect();
    let text = file(&points, &cells);
    let apart = gmsh(&text, 3, &NOTHING).unwrap().contents();
    assert_eq!((apart.pieces, apart.coincident_vertices), (48, 4 * 48 - 27));
    let mesh = gmsh(&text, 3, &MERGE).unwrap();
    assert_eq!(
        (mesh.vertex_count(), mesh.contents().pieces, mesh.contents().coincident_vertices),
        (27, 1, 0)
    );
    assert_eq!(sentences(&mesh), ["merged 165 vertices"]);
    assert_eq!(mesh.surface_triangles().len(), 48);
    assert_eq!(mesh.groups["5"].vertices, (0..27).collect::<Vec<_>>());
    // Rounding errors in the coordinates need a tolerance.
    let near: Vec<[f64; 3]> =
        (0..).zip(&points).map(|(i, p)| p.map(|x| x + 1e-9 * f64::from(i * 7 % 5 - 2))).collect();
    let text = file(&near, &cells);
    assert!(gmsh(&text, 3, &MERGE).unwrap().contents().pieces > 1);
    let mesh = gmsh(&text, 3, &asking(Some(1e-7), [false; 3])).unwrap();
    assert_eq!((mesh.vertex_count(), mesh.contents().pieces), (27, 1));
}

#[test]
fn merged_vertices_are_within_the_tolerance_and_do_not_draw_others_along() {
    let line = |x: &[f64]| Mesh {
        dimension: 2,
        points: x.iter().flat_map(|&x| [x, 0.0]).collect(),
        ..Mesh::default()
    };
    assert_eq!(targets(&line(&[0.0, 0.6, 1.2, 1.8, 2.4]), 1.0), [0, 0, 2, 2, 4]);
    assert_eq!(targets(&line(&[1.0, 0.0, 2.0, 1.0]), 1.0), [0, 0, 0, 0]);
    assert_eq!(targets(&line(&[0.0, -0.0, 1e-320]), 0.0), [0, 0, 2]);
    assert_eq!(targets(&line(&[1e300, -1e300, 1e300]), 1e-9), [0, 1, 0]);
    assert_eq!(targets(&line(&[1e300, -1e300, 0.0]), 1e308), [0, 0, 0]);
}

/// All defects at once, in a file that is a grid otherwise.
#[test]
fn steps_are_taken_in_an_order_in_which_one_needs_no_other() {
    let whole = build_grid(&grid(&[1, 1, 1], 1.0), 3).unwrap();
    let mut points: Vec<[f64; 3]> = whole.points.as_chunks::<3>().0.to_vec();
    // An unused vertex at the beginning, copies of all vertices at the end.
    points.insert(0, [7.0; 3]);
    points.extend(points.clone());
    let mut cells: Vec<(u64, u64, Vec<u64>)> = Vec::new();
    for (i, &[a, b, c, d]) in whole.tetrahedra.iter().enumerate() {
        let tags = [a, b, d, c].map(|v| u64::from(v) + 2 + 9 * (i as u64 % 2));
        cells.push((4, 1, tags.to_vec()));
    }
    // The first cell again with copied vertices, and a cell that degenerates by merging.
    cells.push((4, 2, cells[0].2.iter().map(|tag| tag + 9).collect()));
    cells.push((4, 2, vec![2, 3, 4, 11]));
    let cells: Vec<(u64, u64, &[u64])> =
        cells.iter().map(|(kind, group, nodes)| (*kind, *group, &nodes[..])).collect();
    let mesh = gmsh(&file(&points, &cells), 3, &EVERYTHING).unwrap();
    assert_eq!((&mesh.points, mesh.tetrahedra.len(), is_positive(&mesh)), (&whole.points, 6, true));
    assert_eq!(mesh.groups["2"].cells, [0]);
    assert_eq!(
        sentences(&mesh),
        [
            "merged 9 vertices",
            "dropped 1 tetrahedron without a volume",
            "dropped 1 tetrahedron repeating another",
            "dropped 1 vertex that no element and no edge uses",
            "oriented 6 of 6 tetrahedra"
        ]
    );
    assert_eq!(mesh.contents().pieces, 1);
}

#[test]
fn refusals_name_the_keys_that_would_mend_them_unless_they_are_given() {
    let unreferenced = MeshError::Unreferenced { vertex: 0, count: 1 };
    assert!(matches!(&cures(&NOTHING, &unreferenced)[..], [cure] if cure.starts_with("`drop_unused = true` \
             next to `path`")));
    assert!(cures(&DROP_UNUSED, &unreferenced).is_empty());
    let inverted = error(&file(&CORNERS[..4], &[(4, 7, &[1, 3, 2, 4])]), 3);
    assert!(matches!(&cures(&NOTHING, &inverted)[..], [cure] if cure.starts_with("`orient = true`")));
    let short = MeshError::ZeroLengthEdge { edge: 0, vertices: [0, 1] };
    assert!(matches!(&cures(&NOTHING, &short)[..], [a, b] if a.starts_with("`merge \
             =") && b.starts_with("`drop_degenerate =")));
    let repeated = MeshError::RepeatedCell { cell: Cell::Triangle(1), first: 0, count: 1 };
    assert!(matches!(&cures(&MERGE, &repeated)[..], [cure] if cure.starts_with("`drop_degenerate = true`")));
    assert!(cures(&NOTHING, &MeshError::Empty).is_empty());
    for step in STEPS {
        assert!((step.asked)(&EVERYTHING) && !(step.asked)(&NOTHING));
    }
}

#[test]
fn faults_in_a_cleaned_mesh_still_name_their_place_in_the_file() {
    let mut points = CORNERS.to_vec();
    points.insert(0, [9.0; 3]);
    let text = file(&points, &[(4, 1, &[2, 3, 4, 2]), (4, 1, &[2, 3, 4, 5]), (4, 1, &[3, 4, 6, 5])]);
    let spec = asking(Some(0.0), [true, true, false]);
    let (site, error) = gmsh(&text, 3, &spec).unwrap_err();
    assert!(matches!(error, MeshError::Inverted { cell: Cell::Tetrahedron(1), .. }), "{error}");
    assert_eq!((site.line, site.tag), (17, Some(FileTag::Element(3))));
}

fn surface(points: &[f64], triangles: &[[u32; 3]]) -> Mesh {
    Mesh { dimension: 3, points: points.to_vec(), triangles: triangles.to_vec(), ..Mesh::default() }
}

/// Writes the mesh as OBJ and reads it back with `orient`.
fn oriented(mesh: &Mesh) -> Result<Mesh, MeshError> {
    let mut text = String::new();
    mesh.points.chunks_exact(3).for_each(|x| text += &format!("v {} {} {}\n", x[0], x[1], x[2]));
    mesh.triangles.iter().for_each(|t| text += &format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1));
    with(Format::Obj, text.as_bytes(), 3, &ORIENT, MidNodes::Refuse).map_err(|(_, error)| error)
}

fn flipped(mesh: &Mesh, flips: &[bool]) -> Mesh {
    let mut mesh = mesh.clone();
    mesh.triangles.iter_mut().zip(flips).filter(|(_, flip)| **flip).for_each(|(t, _)| t.swap(0, 1));
    mesh
}

/// The triangle rotated so that its lowest corner comes first.
fn cyclic(triangle: [u32; 3]) -> [u32; 3] {
    let [a, b, c] = triangle;
    [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap()
}

#[test]
fn open_surfaces_keep_the_side_that_most_triangles_have() {
    // A strip of six triangles.
    let points: Vec<f64> = (0..8).flat_map(|i| [f64::from(i / 2), f64::from(i % 2), 0.0]).collect();
    let strip: Vec<[u32; 3]> =
        (0..3).flat_map(|i| [[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]]).collect();
    let mesh = surface(&points, &strip);
    assert!(mesh.hinges().is_ok());
    for (flips, turned) in [
        ([false; 6], 0),
        ([true, false, false, true, false, false], 2),
        ([true, true, true, false, true, true], 1),
    ] {
        let found = oriented(&flipped(&mesh, &flips)).unwrap();
        assert!(found.hinges().is_ok());
        assert_eq!(sentences(&found), [format!("oriented {turned} of 6 triangles")]);
    }
    // The orientation does not propagate across an edge of three triangles.
    let fin = surface(&[points, vec![0.5, 0.5, 1.0]].concat(), &[strip, vec![[0, 3, 8]]].concat());
    assert_eq!(sentences(&oriented(&fin).unwrap()), ["oriented 0 of 7 triangles"]);
}

#[test]
fn a_surface_with_one_side_is_refused() {
    let turn = |i: usize| std::f64::consts::TAU * i as f64 / 8.0;
    let rim = |i: usize, side: f64| {
        let (angle, tilt) = (turn(i), 0.5 * turn(i));
        let radius = 1.0 + 0.3 * side * tilt.cos();
        [radius * angle.cos(), radius * angle.sin(), 0.3 * side * tilt.sin()]
    };
    let points: Vec<f64> = (0..8).flat_map(|i| [rim(i, -1.0), rim(i, 1.0)]).flatten().collect();
    let vertex = |i: u32, side: u32| if i < 8 { 2 * i + side } else { 1 - side };
    let band: Vec<[u32; 3]> = (0..8)
        .flat_map(|i| {
            let [a, b, c, d] = [vertex(i, 0), vertex(i, 1), vertex(i + 1, 0), vertex(i + 1, 1)];
            [[a, c, d], [a, d, b]]
        })
        .collect();
    let found = oriented(&surface(&points, &band));
    assert!(matches!(found, Err(MeshError::NotOrientable { .. })), "{found:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// Two closed surfaces with any of their triangles turned: cleaning restores the surface of the
    /// solids.
    #[test]
    fn closed_surfaces_are_turned_outside_out(flips in prop::collection::vec(any::<bool>(), 24 + 24)) {
        let cube = build_grid(&grid(&[1, 1, 2], 1.0), 3).unwrap();
        let faces = cube.surface_triangles();
        let other = faces.iter().map(|t| t.map(|v| v + cube.vertex_count() as u32));
        let beside = cube.points.iter().map(|x| x + 5.0);
        let points: Vec<f64> = cube.points.iter().copied().chain(beside).collect();
        let whole = surface(&points, &faces.iter().copied().chain(other).collect::<Vec<_>>());
        let count = flips.iter().take(whole.triangles.len()).filter(|flip| **flip).count();
        let found = oriented(&flipped(&whole, &flips)).unwrap();
        let normal = |mesh: &Mesh| mesh.triangles.iter().copied().map(cyclic).collect::<Vec<_>>();
        prop_assert_eq!(normal(&found), normal(&whole));
        prop_assert_eq!(sentences(&found), [format!("oriented {count} of {} \
                                                     triangles", whole.triangles.len())]);
    }

    /// Agrees with comparing every vertex with all earlier ones.
    #[test]
    fn merging_finds_what_comparing_all_pairs_finds(
        points in prop::collection::vec(
            [-3..4_i32, -3..4, -1..2].prop_map(|p| p.map(|x| f64::from(x) * 0.25)), 1..60
        ),
        tolerance in prop::sample::select(vec![0.0, 0.1, 0.25, 0.26, 0.36, 0.5, 0.9, 3.0]),
        shift in prop::sample::select(vec![0.0, 1e6, -1024.0]),
    ) {
        let flat: Vec<f64> = points.iter().flatten().map(|x| x + shift).collect();
        let mesh = Mesh { dimension: 3, points: flat, ..Mesh::default() };
        let mut naive: Vec<u32> = Vec::new();
        for (i, a) in points.iter().enumerate() {
            let near = |j: &usize| {
                let d: f64 = a.iter().zip(points[*j]).fold(0.0, |sum: f64, (a, b)| sum.hypot(a - b));
                naive[*j] as usize == *j && d <= tolerance
            };
            let target = (0..i).find(near).unwrap_or(i);
            naive.push(target as u32);
        }
        prop_assert_eq!(targets(&mesh, tolerance), naive);
    }
}

/// Two quadrilaterals, the second repeated in the opposite order, a flat one, an unused vertex, and a
/// boundary line in a group.
#[test]
fn quadrilaterals_are_cleaned_as_triangles_are() {
    let points =
        [[0., 0., 0.], [1., 0., 0.], [2., 0., 0.], [0., 1., 0.], [1., 1., 0.], [2., 1., 0.], [9., 9., 0.]];
    let text = file(
        &points,
        &[
            (3, 1, &[1, 2, 5, 4]),
            (3, 2, &[2, 5, 6, 3]),
            (3, 3, &[6, 3, 2, 5]),
            (3, 4, &[1, 2, 3, 2]),
            (1, 5, &[1, 2]),
        ],
    );
    assert!(matches!(error(&text, 2), MeshError::RepeatedVertex { cell: Cell::Other(kind, 2), vertex: 1 }
        if kind.name == "quadrilateral"));
    let mesh = gmsh(&text, 2, &EVERYTHING).unwrap();
    assert_eq!(mesh.block().unwrap().of::<4>(), [[0, 1, 4, 3], [1, 2, 5, 4]]);
    assert_eq!(mesh.vertex_count(), 6);
    assert!((mesh.quality().elements.unwrap().total_volume - 2.0).abs() < 1e-15);
    // The cell that represents the repeated one joins its group.
    assert_eq!((&mesh.groups["2"].cells[..], &mesh.groups["3"].cells[..]), (&[1][..], &[1][..]));
    assert!(mesh.groups["4"].cells.is_empty() && mesh.lines == [[0, 1]]);
    let said: Vec<String> = mesh.cleaned.iter().map(sentence).collect();
    assert!(said.iter().any(|text| text.contains("1 of 2 quadrilaterals")), "{said:?}");
}
