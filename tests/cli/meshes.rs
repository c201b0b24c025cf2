//! Mesh files as they come: refused with the key that mends them, mended, and counted.

use super::Bench;

const SCENE: &str = r#"
dimension = 3
[time]
integrator = "symplectic-euler"
step = 1e-4
duration = 1e-3
[[body]]
name = "part"
mesh = { file = { path = "part.msh" } }
elastic = { linear = { young = 1e5, poisson = 0.3 } }
mass = { density = 1000.0 }
pin = [{ vertices = [0] }]
"#;

/// Two clockwise tetrahedra that share a side but not its vertices, and the second once more; a flat one; a
/// node of no element in front.
const PART: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n13\n\
    1 9 9 9\n2 0 0 0\n3 1 0 0\n4 0 1 0\n5 0 0 1\n6 1 0 0\n7 0 1 0\n8 0 0 1\n9 1 1 1\n\
    10 1 0 0\n11 0 1 0\n12 1 1 1\n13 0 0 1\n$EndNodes\n\
    $Elements\n4\n1 4 2 1 1 2 3 5 4\n2 4 2 1 1 6 7 9 8\n3 4 2 1 1 10 11 12 13\n4 4 2 1 1 6 6 9 \
    8\n$EndElements\n";

/// The text without its line breaks, which depend on the width of the terminal.
#[track_caller]
fn holds(text: &str, parts: &[&str]) {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in parts {
        assert!(text.contains(part), "no {part:?} in:\n{text}");
    }
}

fn bench(part: &str) -> Bench {
    let bench = Bench::new(SCENE);
    std::fs::write(bench.path("part.msh"), part).unwrap();
    bench
}

#[test]
fn a_refused_file_is_mended_by_the_keys_that_the_messages_name() {
    let bench = bench(PART);
    let mut keys = "path = 'part.msh'".to_owned();
    let check = |keys: &str| {
        let set = format!("body.0.mesh.file={{ {keys} }}");
        bench.pliant(["check", "scene.toml", "--set", &set])
    };
    for (key, fault) in [
        ("drop_degenerate = true", "tetrahedron 3 uses vertex 5 more than once"),
        ("orient = true", "tetrahedron 0 is inverted"),
        ("drop_unused = true", "1 vertex belongs to no element and no edge, the first is vertex 0"),
    ] {
        holds(&check(&keys).ended_with(2).stderr, &[fault, &format!("`{key}` next to `path`")]);
        keys += &format!(", {key}");
    }
    // A side of two sets of vertices is legal: it is counted.
    let counted = [
        "`part`: 3 tetrahedra in 3 unconnected pieces",
        "7 vertices at the position of another, not joined",
        "dropped 1 tetrahedron without a volume",
        "dropped 1 vertex that no element and no edge uses",
        "oriented 3 of 3 tetrahedra",
        "vertices from 0 on are renumbered",
    ];
    holds(&check(&keys).succeeded().stdout, &counted);
    keys += ", merge = '1 um'";
    let counted = [
        "`part`: 2 tetrahedra in 1 piece",
        "merged 7 vertices",
        "dropped 1 tetrahedron repeating another",
        "oriented 2 of 2 tetrahedra",
    ];
    holds(&check(&keys).succeeded().stdout, &counted);
    let set = format!("body.0.mesh.file={{ {keys} }}");
    let json = bench.pliant(["check", "scene.toml", "--json", "--set", &set]).succeeded().json();
    let contents = &json["report"]["bodies"][0]["contents"];
    assert_eq!((contents["pieces"].as_u64(), contents["tetrahedra"].as_u64()), (Some(1), Some(2)));
    let steps = contents["cleaned"].as_array().unwrap();
    let keys: Vec<&str> = steps.iter().map(|step| step["key"].as_str().unwrap()).collect();
    assert_eq!(keys, ["merge", "drop_degenerate", "drop_degenerate", "drop_unused", "orient"]);
    // Five vertices of two tetrahedra of 1/6 and 1/3 m^3.
    assert_eq!(json["report"]["vertices"].as_u64(), Some(5));
    let mass = json["report"]["mass"].as_f64().unwrap();
    assert!((mass - 500.0).abs() < 1e-9, "{mass}");
}

#[test]
fn triangles_in_place_of_tetrahedra_are_met_with_what_would_be_right() {
    let surface = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n\
                   $Elements\n1\n1 2 2 1 1 1 2 3\n$EndElements\n";
    let said = [
        "the mesh has no tetrahedra, it is a surface of 1 triangle;",
        "`membrane = { thickness = \"1 mm\" }`",
        "`dimension = 2`",
    ];
    holds(&bench(surface).pliant(["check", "scene.toml"]).ended_with(2).stderr, &said);
}

#[test]
fn a_tolerance_below_zero_is_refused_where_it_stands() {
    let set = "body.0.mesh.file={ path = 'part.msh', merge = '-1 mm' }";
    bench(PART).pliant(["check", "scene.toml", "--set", set]).ended_with(2).says(&["merge", "0 or more"]);
}

#[test]
fn meshes_are_counted_by_kinds_of_cells_and_pieces() {
    let bench = Bench::new(&SCENE.replace(
        "mesh = { file = { path = \"part.msh\" } }",
        "mesh = { grid = { cells = [1, 1, 1], spacing = 1.0 } }\nrepeat = { count = [3, 1, 1], spacing = \
         [2.0, 2.0, 2.0] }",
    ));
    let text = bench.pliant(["check", "scene.toml"]).succeeded().stdout;
    holds(&text, &["`part`: 18 tetrahedra", "in 3 unconnected pieces"]);
}

/// A deck's materials, supports and loads are not read, in silence least of all.
#[test]
fn what_a_deck_says_beside_its_mesh_is_told() {
    let bench = Bench::new(&SCENE.replace("part.msh", "part.inp"));
    let deck = "*Node\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n*Element, type=C3D4, elset=all\n1, \
                1, 2, 3, 4\n";
    let model = "*Solid section, elset=all, material=steel\n*Material, name=steel\n*Elastic\n210e3, 0.3\n\
                 *Step\n*Static\n*Boundary\n1, 1, 3\n*Cload\n2, 3, -1.0\n*Cload\n3, 3, -1.0\n*End step\n";
    std::fs::write(bench.path("part.inp"), format!("{deck}{model}")).unwrap();
    let told = "the file of `part` holds *MATERIAL, *BOUNDARY, *CLOAD, which are not read";
    holds(&bench.pliant(["check", "scene.toml"]).succeeded().stderr, &[told]);
    std::fs::write(bench.path("part.inp"), deck).unwrap();
    let run = bench.pliant(["check", "scene.toml"]).succeeded();
    assert!(!run.stderr.contains("not read"), "{}", run.stderr);
}
