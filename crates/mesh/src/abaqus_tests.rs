//! Tests of Abaqus decks and their errors.

use std::fs;
use std::path::Path;

use super::file::{Format, files};
use super::format_tests::{fault, read, with};
use super::{FormatError, Mesh, MeshError, MidNodes};

const DECK: &str = "*HEADING
 two tetrahedra ** of a deck
** a comment
*Part, name=Part-1
*Node, nset=all
  10, 0., 0., 0.
  20, 1., 0., 0.
  30, 0., 1., 0.
  40, 0.1D0, 0.2, 7.d-1
  50, 1., 1., 1.25
*Element, type=C3D4H,
   elset=\"Set 1\"
1, 10, 20, 30, 40
7, 20, 30, 40, 50
*Nset, nset=Foot, generate
10, 30, 10
*Nset, nset=HEAD
 foot, 50,
*Elset, elset=upper
7
*Surface, type=ELEMENT, name=Skin
upper, S2
1, S1
*End Part
*Material, name=rubber
*Hyperelastic, neo hooke
1.5, 0.1
*Assembly, name=A
*Instance, name=I, part=Part-1
*End Instance
*Node
1, 9., 9., 9.
*End Assembly
*Step
*Static
";

fn changed(from: &str, to: &str) -> Vec<u8> {
    assert!(DECK.contains(from), "{from}");
    DECK.replace(from, to).into_bytes()
}

#[test]
fn sets_and_surfaces_of_a_deck_are_groups() {
    let mesh = read(Format::Abaqus, DECK.as_bytes());
    assert_eq!(mesh.points, [0., 0., 0., 1., 0., 0., 0., 1., 0., 0.1, 0.2, 0.7, 1., 1., 1.25]);
    assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3], [1, 2, 3, 4]]);
    let names: Vec<&str> = mesh.groups.keys().map(String::as_str).collect();
    assert_eq!(names, ["Foot", "HEAD", "Set 1", "Skin", "all", "upper"]);
    assert_eq!(mesh.groups["Foot"].vertices, [0, 1, 2]);
    assert_eq!(mesh.groups["HEAD"].vertices, [0, 1, 2, 4]);
    assert_eq!(mesh.groups["Set 1"].cells, [0, 1]);
    assert_eq!(mesh.groups["upper"].cells, [1]);
    // S2 of 20, 30, 40, 50 is 20, 50, 30; S1 of 10, 20, 30, 40 is 10, 20, 30.
    assert_eq!(mesh.triangles, [[1, 4, 2], [0, 1, 2]]);
    assert_eq!((mesh.groups["Skin"].topological_dimension, &mesh.groups["Skin"].cells[..]), (2, &[0, 1][..]));
}

/// Face numbers: all normals point outwards, and the faces close the surface.
#[test]
fn faces_of_every_solid_close_its_surface() {
    let nodes: [[f64; 3]; 8] = [
        [0., 0., 0.],
        [1., 0., 0.],
        [1., 1., 0.],
        [0., 1., 0.],
        [0., 0., 1.],
        [1., 0., 1.],
        [1., 1., 1.],
        [0., 1., 1.],
    ];
    let deck = |kind: &str, of: &[usize], faces: usize| {
        let mut text = String::from("*NODE\n");
        for (i, [x, y, z]) in nodes.iter().enumerate().filter(|(i, _)| of.contains(i)) {
            text += &format!("{}, {x}, {y}, {z}\n", i + 1);
        }
        let corners: Vec<String> = of.iter().map(|i| (i + 1).to_string()).collect();
        text += &format!("*ELEMENT, TYPE={kind}\n1, {}\n", corners.join(", "));
        for face in 1..=faces {
            text += &format!("*SURFACE, NAME=f{face}\n1, S{face}\n");
        }
        text
    };
    let cube = read(Format::Abaqus, deck("C3D8R", &[0, 1, 2, 3, 4, 5, 6, 7], 6).as_bytes());
    // Centres of the faces, by their numbers in the manual: below, above, then around from y = 0.
    let expected = [
        [0.5, 0.5, 0.0],
        [0.5, 0.5, 1.0],
        [0.5, 0.0, 0.5],
        [1.0, 0.5, 0.5],
        [0.5, 1.0, 0.5],
        [0.0, 0.5, 0.5],
    ];
    for (face, expected) in expected.iter().enumerate() {
        let group = &cube.groups[&format!("f{}", face + 1)];
        assert_eq!(group.vertices.len(), 4);
        let centre =
            [0, 1, 2].map(|c| group.vertices.iter().map(|&v| cube.point(v as usize)[c]).sum::<f64>() / 4.0);
        assert_eq!(centre, *expected, "face {}", face + 1);
    }
    let tetrahedron = read(Format::Abaqus, deck("C3D4", &[0, 1, 3, 4], 4).as_bytes());
    let expected: [&[u32]; 4] = [&[0, 1, 2], &[0, 1, 3], &[1, 2, 3], &[0, 2, 3]];
    for (face, expected) in expected.into_iter().enumerate() {
        assert_eq!(tetrahedron.groups[&format!("f{}", face + 1)].vertices, expected, "face {}", face + 1);
    }
}

#[test]
fn nodes_in_the_middle_of_edges_keep_their_order_over_two_lines() {
    let corners = [[0., 0., 0.], [2., 0., 0.], [0., 2., 0.], [0., 0., 2.]];
    let edges = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
    let mut text = String::from("*node\n");
    let middle = |[a, b]: [usize; 2]| [0, 1, 2].map(|c| 0.5 * (corners[a][c] + corners[b][c]));
    for (i, [x, y, z]) in corners.iter().copied().chain(edges.map(middle)).enumerate() {
        text += &format!("{}, {x}, {y}, {z}\n", i + 1);
    }
    text += "*element, type=C3D10M, elset=all\n1, 1, 2, 3, 4, 5, 6, 7,\n 8, 9, 10\n";
    text += "*surface, name=slope\nall, S3\n";
    let mesh = with(Format::Abaqus, text.as_bytes(), &[], 3, MidNodes::Keep).unwrap();
    assert_eq!(mesh.tetrahedra, [[0, 1, 2, 3]]);
    assert_eq!(mesh.tetrahedron_middles, [[4, 5, 6, 7, 8, 9]]);
    let slope = &mesh.groups["slope"].vertices;
    assert_eq!(slope, &[1, 2, 3, 5, 8, 9]);
    let (_, error) = with(Format::Abaqus, text.as_bytes(), &[], 3, MidNodes::Refuse).unwrap_err();
    assert!(matches!(error, MeshError::Format(FormatError::SecondOrder { .. })), "{error}");
}

#[test]
fn faults_of_decks_name_the_line() {
    for (from, to, line, words) in [
        ("7, 20, 30, 40, 50", "7, 20, 30, 40, 60", 14, "element 7 uses node 60"),
        ("7, 20, 30, 40, 50", "7, 20, 30, 40", 14, "nodes of an element of its type: 3, but it must be 4"),
        ("  20, 1., 0., 0.", "  10, 1., 0., 0.", 7, "two nodes with the tag 10"),
        ("  20, 1., 0., 0.", "  20, one, 0., 0.", 7, "expected a coordinate of a node, found `one`"),
        ("type=C3D4H", "type=C3D15", 12, "the element type \"C3D15\" is not read"),
        ("10, 30, 10", "10, 30000, 10", 16, "numbers that GENERATE makes"),
        (" foot, 50,", " feet, 50,", 18, "found `feet`"),
        ("upper, S2", "upper, S5", 22, "found `S5`"),
        ("upper, S2", "lower, S2", 22, "found `lower`"),
        ("*End Part", "*End Part\n*Part, name=other", 25, "several parts or instances"),
        ("part=Part-1\n", "part=Part-1\n1., 0., 0., 4.\n", 30, "numbers that place an instance"),
        ("part=Part-1\n", "part=Part-1\n1., 0., up\n", 30, "found `up`"),
        ("part=Part-1\n", "part=Part-1\n1.\n1., 0., 0., 1., 0., 0., 9.\n", 31, "two points that differ"),
        ("*Material, name=rubber", "*Include, input=more.inp", 25, "`*INCLUDE` is not read"),
        ("*HEADING\n", "", 1, "expected a keyword of Abaqus"),
    ] {
        let (found, _, message) = fault(Format::Abaqus, &changed(from, to));
        assert!(found == line && message.contains(words), "{from} -> {to}: line {found}: {message}");
    }
}

#[test]
fn a_mesh_of_fluent_is_told_by_name() {
    let (_, _, message) = fault(Format::Gmsh, b"(0 \"GAMBIT to Fluent File\")\n(2 3)\n");
    assert!(message.contains("a mesh of ANSYS Fluent"), "{message}");
}

/// A deck with an independent instance as Abaqus/CAE writes it, placed by these lines.
fn independent(placement: &str) -> String {
    format!(
        "*Part, name=P
*End Part
*Assembly, name=A
*Instance, name=I, part=P
{placement}*Node
 1, 0., 0., 0.
 2, 1., 0., 0.
 3, 0., 1., 0.
 4, 0., 0., 1.
*Element, type=C3D4
 1, 1, 2, 3, 4
*Nset, nset=tip, internal
 4,
*End Instance
*Node
 1, 9., 9., 9.
*Nset, nset=foot, instance=I
 1, 2, 3
*End Assembly
"
    )
}

#[test]
fn an_instance_has_its_own_nodes_and_is_placed() {
    let unmoved = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
    let points = |placement: &str| {
        let mesh = read(Format::Abaqus, independent(placement).as_bytes());
        assert_eq!((mesh.tetrahedra.len(), mesh.groups["foot"].vertices.len()), (1, 3));
        mesh.points.as_chunks::<3>().0.to_vec()
    };
    assert_eq!(points(""), unmoved);
    assert_eq!(points(" 5., 0., 0.\n"), unmoved.map(|[x, y, z]| [x + 5.0, y, z]));
    // Translation first, then a quarter turn about the line through (1, 0, 0) along z, right-handed.
    let turned = unmoved.map(|[x, y, z]| [1.0 - y, (x + 5.0) - 1.0, z]);
    assert_eq!(points(" 5., 0., 0.\n 1., 0., 0., 1., 0., 7., 90.\n"), turned);
    // A third of a turn about the space diagonal permutes the axes.
    for (c, axis) in points(" 0., 0., 0.\n0., 0., 0., 1., 1., 1., 120.\n")[1..].iter().enumerate() {
        let error =
            (0..3).map(|i| (axis[i] - f64::from(u8::from(i == (c + 1) % 3))).abs()).fold(0.0, f64::max);
        assert!(error < 1e-15, "{axis:?}");
    }
}

/// Reads a deck whose files are written to a folder first.
fn deck(folder: &Path, files: &[(&str, &str)]) -> Result<Mesh, MeshError> {
    for (name, text) in files {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    super::file::read(&folder.join(files[0].0), 3, MidNodes::Refuse)
}

const NODES: &str = "1, 0., 0., 0.\n2, 1., 0., 0.\n3, 0., 1., 0.\n4, 0., 0., 1.\n";
const CELLS: &str = "*Element, type=C3D4\n1, 1, 2, 3, 4";

#[test]
fn files_that_a_deck_names_are_read_in_their_places() {
    let folder = tempfile::tempdir().unwrap();
    let main = "*Heading\n*Node\n*INCLUDE, input=parts/nodes.inp\n*include,\n ** a remark\n \
                input=\"./cells.inp\"\n*Nset, nset=tip, input=parts\\tip.inp\n*Step\n*Include, input=none.inp\n";
    let all = [("a.inp", main), ("parts/nodes.inp", NODES), ("cells.inp", CELLS), ("parts/tip.inp", "4\n")];
    let mesh = deck(folder.path(), &all).unwrap();
    assert_eq!((mesh.vertex_count(), &mesh.tetrahedra[..]), (4, &[[0, 1, 2, 3]][..]));
    assert_eq!(mesh.groups["tip"].vertices, [3]);
    let read = files(&folder.path().join("a.inp"));
    assert_eq!(
        read,
        ["a.inp", "parts/nodes.inp", "cells.inp", "parts/tip.inp"].map(|f| folder.path().join(f))
    );
    // Errors name the file that contains them.
    let place = |all: &[(&str, &str)]| match deck(folder.path(), all).unwrap_err() {
        MeshError::InFile { path, line, source, .. } => {
            let name = path.strip_prefix(folder.path()).unwrap().to_string_lossy().into_owned();
            (name, line.unwrap(), source.to_string())
        }
        error => panic!("{error}"),
    };
    let (file, line, _) = place(&[("a.inp", main), ("parts/nodes.inp", &NODES.replace("2, 1.", "2, one"))]);
    assert_eq!((file.as_str(), line), ("parts/nodes.inp", 2));
    // The error comes after the lines of three files.
    let wrong = main.replace("*Step", "*Nset, nset=x\n9\n*Step");
    let (file, line, message) = place(&[("a.inp", &wrong), ("parts/nodes.inp", NODES)]);
    assert_eq!((file.as_str(), line), ("a.inp", 9), "{message}");
}

#[test]
fn a_deck_reads_no_file_outside_of_its_folder_and_none_without_end() {
    let folder = tempfile::tempdir().unwrap();
    let outside = folder.path().join("outside.inp");
    fs::write(&outside, NODES).unwrap();
    let inside = folder.path().join("inside");
    fs::create_dir(&inside).unwrap();
    for (named, words) in [
        ("../outside.inp", "not in the folder of the deck"),
        ("parts/../../outside.inp", "not in the folder of the deck"),
        ("..\\outside.inp", "not in the folder of the deck"),
        (outside.to_str().unwrap(), "not in the folder of the deck"),
        ("a.inp", "a second time"),
        ("none.inp", "cannot be read"),
        ("1.inp", "6 files deep"),
    ] {
        let main = format!("*Node\n*Include, input={named}\n{CELLS}\n");
        let chain: Vec<(String, String)> =
            (1..8).map(|i| (format!("{i}.inp"), format!("*Include, input={}.inp\n", i + 1))).collect();
        let mut all = vec![("a.inp", main.as_str())];
        all.extend(chain.iter().map(|(name, text)| (name.as_str(), text.as_str())));
        let message = deck(&inside, &all).unwrap_err().to_string();
        assert!(message.contains(words), "{named}: {message}");
    }
}
