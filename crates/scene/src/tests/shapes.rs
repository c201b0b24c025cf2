//! Generated shapes, and where bodies put them: each mistake at its key.

use super::*;

/// Path and message of every problem of `GOOD` with another mesh and more keys after it.
fn problems(dimension: usize, mesh: &str, more: &str) -> Vec<(String, String)> {
    let text = changed(MESH, &format!("{mesh}\n{more}"))
        .replace("dimension = 2", &format!("dimension = {dimension}"))
        .replace(SPRINGS, "{ stiffness = 1.0 }")
        .replace(&format!("pin = {PIN}"), "");
    let text = if dimension == 3 { text.replace("[0.0, -9.8]", "[0.0, 0.0, -9.8]") } else { text };
    match read(&text) {
        Ok(_) => Vec::new(),
        Err(failed) => failed.problems().iter().map(|p| (p.path.to_string(), p.message.clone())).collect(),
    }
}

#[track_caller]
fn only(dimension: usize, mesh: &str, more: &str, path: &str, part: &str) {
    let problems = problems(dimension, mesh, more);
    assert_eq!(problems.len(), 1, "{problems:?}");
    assert_eq!(problems[0].0, path);
    assert!(problems[0].1.contains(part), "{}", problems[0].1);
}

const BALL: &str = "{ ball = { radius = 1.0, cells = 2 } }";

#[test]
fn every_shape_is_read_with_its_keys() {
    for (dimension, mesh) in [
        (3, BALL),
        (3, "{ ball = { radius = 1.0, cells = 2, centre = [1, 2, 3] } }"),
        (3, "{ sphere = { radius = 1.0, cells = 2 } }"),
        (3, "{ cylinder = { radius = 1.0, height = 2.0, cells = [2, 4], origin = [1, 2, 3] } }"),
        (3, "{ tube = { inner_radius = 1.0, outer_radius = 2.0, height = 2.0, cells = [2, 8, 4] } }"),
        (2, "{ annulus = { inner_radius = 1.0, outer_radius = 2.0, cells = [2, 8] } }"),
        (2, "{ cooks_membrane = { cells = [2, 2] } }"),
        (2, "{ tapered_beam = { cells = [2, 2] } }"),
        (2, "{ tapered_beam = { cells = [2, 2], length = 1.0, heights = [1.0, 0.5] } }"),
        (2, "{ notched_beam = { length = 4.0, height = 1.0, depth = 0.2, width = 0.4, cells = [3, 1, 3] } }"),
        (2, "{ elliptic_membrane = { cells = [2, 2] } }"),
    ] {
        assert_eq!(problems(dimension, mesh, ""), [], "{mesh}");
    }
}

#[test]
fn mistakes_of_shapes_are_at_their_keys() {
    only(2, BALL, "", "body.0.mesh.ball", "3-dimensional, and `dimension` is 2");
    only(3, "{ cooks_membrane = { cells = [1, 1] } }", "", "body.0.mesh.cooks_membrane", "2-dimensional");
    only(3, &BALL.replace("1.0", "0.0"), "", "body.0.mesh.ball.radius", "positive");
    only(3, &BALL.replace("cells = 2", "cells = 0"), "", "body.0.mesh.ball.cells", "1 or more");
    only(
        3,
        &BALL.replace("cells = 2", "cells = 100000"),
        "",
        "body.0.mesh.ball",
        "more than 4294967295 vertices",
    );
    let ring = "{ annulus = { inner_radius = 2.0, outer_radius = 2.0, cells = [2, 8] } }";
    only(2, ring, "", "body.0.mesh.annulus.inner_radius", "less than `outer_radius`");
    let ring = "{ annulus = { inner_radius = 1.0, outer_radius = 2.0, cells = [2, 2] } }";
    only(2, ring, "", "body.0.mesh.annulus.cells.1", "3 or more");
    let beam =
        "{ notched_beam = { length = 4.0, height = 1.0, depth = 1.0, width = 0.4, cells = [3, 1, 3] } }";
    only(2, beam, "", "body.0.mesh.notched_beam.depth", "less than `height`");
    let ring = "{ elliptic_membrane = { cells = [2, 2], inner = [2.0, 3.0] } }";
    only(2, ring, "", "body.0.mesh.elliptic_membrane.inner.1", "less than `outer`");
}

#[test]
fn mistakes_of_transformations_are_at_their_keys() {
    let good = "transform = { scale = [1, -2, 3], rotate = { axis = [0, 0, 1], angle = 1.5 }, centre = [0, \
                0, 1], translate = [1, 2, 3] }\n\
                repeat = { count = [2, 1, 3], spacing = [3.0, 0.0, 3.0] }";
    assert_eq!(problems(3, BALL, good), []);
    let wrong = |more: &str, path: &str, part: &str| only(3, BALL, more, path, part);
    wrong("transform = { scale = [1, 0, 1] }", "body.0.transform.scale", "leaves nothing");
    wrong("transform = { scale = 0 }", "body.0.transform.scale", "leaves nothing");
    wrong("transform = { scale = [1, 2] }", "body.0.transform.scale", "3 are needed");
    wrong("transform = { scale = nan }", "body.0.transform.scale", "finite");
    wrong("transform = { rotate = { angle = 1 } }", "body.0.transform.rotate", "needs an `axis`");
    wrong(
        "transform = { rotate = { axis = [0, 0, 0], angle = 1 } }",
        "body.0.transform.rotate.axis",
        "is zero",
    );
    wrong(
        "transform = { rotate = { axis = [0, 0, 1], angle = inf } }",
        "body.0.transform.rotate.angle",
        "finite",
    );
    wrong("transform = { translate = [1, 2] }", "body.0.transform.translate", "3 are needed");
    wrong("repeat = { count = [2, 1], spacing = [1, 1, 1] }", "body.0.repeat.count", "3 are needed");
    wrong("repeat = { count = [2, 0, 1], spacing = [1, 1, 1] }", "body.0.repeat.count.1", "1 or more");
    wrong(
        "repeat = { count = [2, 1, 1], spacing = [0, 1, 1] }",
        "body.0.repeat.spacing.0",
        "at the same position",
    );
    wrong(
        "repeat = { count = [100000, 100000, 1], spacing = [1, 1, 1] }",
        "body.0.repeat",
        "more than 4294967295 vertices",
    );
    let plane = "{ annulus = { inner_radius = 1.0, outer_radius = 2.0, cells = [2, 8] } }";
    let rotate = "transform = { rotate = { axis = [0, 0, 1], angle = 1 } }";
    only(2, plane, rotate, "body.0.transform.rotate.axis", "3D only");
}

/// Lists with one entry per vertex count the copies too.
#[test]
fn copies_count() {
    let mesh = "{ strand = { segments = 1, start = [0, 0], end = [1, 0] } }";
    let repeat = "repeat = { count = [1, 3], spacing = [1, 1] }\nvelocity = { per_vertex = [[0, 0], [0, 0], \
                  [0, 0], [0, 0], [0, 0], [0, 0]] }";
    assert_eq!(problems(2, mesh, repeat), []);
    let wrong = repeat.replace("[1, 3]", "[1, 2]");
    assert!(problems(2, mesh, &wrong)[0].1.contains('4'), "{:?}", problems(2, mesh, &wrong));
}
