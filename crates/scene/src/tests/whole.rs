//! Mistakes that concern several parts of a scene at once.

use super::*;

/// Bodies that need nothing of the rest of `GOOD`.
#[test]
fn particles() {
    let lone = |mesh: &str, mass: &str| {
        changed(MESH, mesh)
            .replace(MASS, mass)
            .replace(&format!("springs = {SPRINGS}\n"), "")
            .replace(&format!("pin = {PIN}\n"), "")
    };
    let disk = "{ disk = { count = 3, radius = 2, inner_radius = 1, centre = [0, 1], seed = \
                18446744073709551615 } }";
    assert!(read(&lone(disk, MASS)).is_ok());
    assert!(read(&lone("{ inline = { points = [[0, 0]] } }", MASS)).is_ok());
    for (mesh, mass, expected) in [
        (
            "{ disk = { count = 0, radius = 1 } }",
            MASS,
            "13:27 body.0.mesh.disk.count: `count` must be 1 or more, got 0",
        ),
        (
            "{ disk = { count = 1, radius = 0 } }",
            MASS,
            "13:39 body.0.mesh.disk.radius: `radius` must be positive and finite, got 0.0 [m]",
        ),
        (
            "{ disk = { count = 1, radius = 1, inner_radius = 1 } }",
            MASS,
            "13:57 body.0.mesh.disk.inner_radius: `inner_radius` must be less than `radius`, got 1.0 and \
             1.0 [m]",
        ),
        (
            "{ disk = { count = 1, radius = 1, thickness = 0.5 } }",
            MASS,
            "13:54 body.0.mesh.disk.thickness: `thickness` is for 3D only, and `dimension` is 2",
        ),
        (
            "{ disk = { count = 1, radius = 1, centre = [0] } }",
            MASS,
            "13:51 body.0.mesh.disk.centre: `centre` has 1 number, but `dimension` is 2: 2 are needed",
        ),
        (
            "{ inline = { points = [] } }",
            "{ total = 1 }",
            "13:30 body.0.mesh.inline.points: `points` is empty: the body needs a vertex",
        ),
        (
            disk,
            "{ density = 1 }",
            "14:10 body.0.mass.density: `density` fills cells and edges, and this disk has none",
        ),
        (MESH, MASS, "13:1 body.0.mesh: nothing holds this grid together"),
        (
            "{ strand = { segments = 2, start = [0, 0], end = [1, 0] } }",
            MASS,
            "13:1 body.0.mesh: nothing holds this strand together",
        ),
        (
            "{ inline = { points = [[0, 0], [0, 1]], edges = [[0, 1]] } }",
            MASS,
            "13:1 body.0.mesh: nothing holds this inline together",
        ),
    ] {
        assert_eq!(briefly(&error(&lone(mesh, mass))), [expected], "{mesh}");
    }
    // A lattice of stars: attraction is what acts on it.
    let attracted = lone(MESH, MASS).replace("[0.0, -9.8]", "[0.0, -9.8]\nnbody = { constant = 1.0 }");
    assert!(read(&attracted).is_ok());
}

#[test]
fn springs_need_edges() {
    let disk = "{ disk = { count = 3, radius = 2 } }";
    let text = changed(MESH, disk).replace(&format!("pin = {PIN}\n"), "");
    assert_eq!(
        briefly(&error(&text)),
        ["14:1 body.0.springs: `springs` run along edges, and this disk has none"]
    );
    let strand = "{ strand = { segments = 3, start = [0, 0], end = [1, 0] } }";
    let text = changed(MESH, strand).replace("100.0", "[1, 2]");
    let failed = error(&text);
    assert_eq!(
        briefly(&failed),
        ["14:25 body.0.springs.stiffness: `stiffness` lists 2 numbers, but the body has 3 edges"]
    );
    assert_eq!(failed.problems()[0].help, ["give one number for all, or 3"]);
}

#[test]
fn three_dimensions() {
    let text = changed("dimension = 2", "dimension = 3")
        .replace("[0.0, -9.8]", "[0, 0, -9.8]")
        .replace("cells = [2, 3]", "cells = [2, 3, 4]")
        .replace(PIN, "[]\nvelocity = { rigid = { angular = [0, 0, 1] } }");
    assert!(read(&text).is_ok(), "{}", error(&text));
    assert_eq!(
        briefly(&error(&text.replace("angular = [0, 0, 1]", "angular = 1"))),
        ["17:34 body.0.velocity.rigid.angular: `angular` takes three numbers in 3D, got 1"]
    );
    let cloth = "{ cloth = { cells = [1, 1], origin = [0, 0, 0], u = [1, 2, 3], v = [2, 4, 6] } }";
    assert_eq!(
        briefly(&error(&text.replace("{ grid = { cells = [2, 3, 4], spacing = 0.1 } }", cloth))),
        ["13:75 body.0.mesh.cloth.v: `u` and `v` are parallel: they span no sheet"]
    );
}

/// Vectors have no right length in a scene of four dimensions: only the dimension is reported.
#[test]
fn a_wrong_dimension_is_one_problem() {
    let text = changed("dimension = 2", "dimension = 4")
        .replace(PIN, "[]\nvelocity = { rigid = { angular = [1] } }");
    assert_eq!(briefly(&error(&text)), ["1:13 dimension: `dimension` must be 2 or 3, got 4"]);
}

#[test]
fn an_empty_scene() {
    let text = "dimension = 2\ntime = { integrator = 'symplectic-euler', step = 1, duration = 1 }";
    assert_eq!(briefly(&error(text)), ["1:1 body: the scene has no body"]);
}

#[test]
fn all_at_once() {
    let text = GOOD
        .replace("dimension = 2", "dimension = 3")
        .replace("1e-3", "-1e-3")
        .replace("rate = 60.0", "rate = nan")
        .replace("100.0", "0");
    let places: Vec<_> =
        error(&text).problems().iter().map(|p| (p.line.unwrap(), p.column.unwrap())).collect();
    assert_eq!(places, [(5, 8), (9, 11), (13, 27), (14, 25), (16, 24), (16, 42), (19, 8)]);
}

/// A list of a million wrong entries is one mistake.
#[test]
fn long_lists_report_once() {
    let points = vec!["[nan, 0, 1]"; 10_000].join(", ");
    let mesh = format!(
        "{{ inline = {{ points = [{points}], edges = [{}] }} }}",
        vec!["[0, 99999]"; 1000].join(", ")
    );
    assert_eq!(error(&changed(MESH, &mesh)).problems().len(), 3);
}
