//! Shapes at rest: elements of second order, viscosities, factors of elements, statics.

use pliant_gradient::{LossFrame, ParameterSelection, UNLIMITED, gradient, names};
use pliant_scene::Scene;

use crate::by_parameters::compare;
use crate::differences::{compare_number, compare_numbers, compare_shape};
use crate::solid::{assembled, rows};
use crate::support::{scattered, scene};

/// A block of four triangles or six tetrahedra whose corners at rest have moved by `h` along a direction,
/// held at one end; further keys of the body.
fn block(scheme: &str, (dimension, order): (usize, u32), h: f64, further: &str) -> Scene {
    let (corners, cells, gravity, held): (Vec<f64>, _, _, _) = match dimension {
        2 => (
            vec![0.0, 0.0, 0.4, 0.05, 0.9, 0.0, 0.0, 0.3, 0.5, 0.35, 0.85, 0.25],
            "triangles = [[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4]]",
            "[2.7, -9.81]",
            "[0, 3]",
        ),
        _ => (
            vec![
                0.0, 0.0, 0.0, 0.5, 0.0, 0.05, 0.0, 0.3, 0.0, 0.45, 0.35, 0.0, 0.0, 0.0, 0.4, 0.5, 0.05,
                0.35, 0.05, 0.3, 0.4, 0.5, 0.3, 0.45,
            ],
            "tetrahedra = [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], \
             [0, 5, 1, 7]]",
            "[2.7, -9.81, 2.0]",
            "[0, 2, 4, 6]",
        ),
    };
    let moved: Vec<f64> = corners.iter().zip(scattered(corners.len(), 7.0)).map(|(x, d)| x + h * d).collect();
    let text = format!(
        "[world]
         gravity = {gravity}
         [[body]]
         name = \"block\"
         order = {order}
         mesh = {{ inline = {{ points = {}, {cells} }} }}
         pin = [{{ vertices = {held} }}]
         {further}",
        rows(&moved, dimension)
    );
    scene(scheme, dimension, [0.01, 1e-3], &text)
}

const KINDS: [(usize, u32); 4] = [(2, 1), (2, 2), (3, 1), (3, 2)];

const RUNS: [(&str, u64); 4] =
    [("velocity-verlet", 40), ("implicit-euler", 10), ("generalised-alpha", 10), ("quasi-static", 2)];

/// Materials, masses and damping.
fn further(material: &str, more: &str) -> String {
    format!("elastic = {{ {material} = {{ young = 4e4, poisson = 0.35 }} }}\n{more}")
}

const MASS: &str = "mass = { density = 1000.0 }";

/// Compares derivatives by the shape at rest with differences over its steps, and then with tangents: of one
/// step in statics.
fn compare_rest(what: &str, of: impl Fn(f64) -> Scene + Copy, (scheme, steps): (&str, u64)) {
    compare_shape(what, of, ("block", 0.02), (steps, 1e-6));
    let steps = if scheme == "quasi-static" { 1 } else { steps };
    compare(what, &of(0.0), &["body.block.rest"], steps);
}

/// Compares them under these loads in the plane and in space, for all kinds of elements and all schemes.
fn compare_loads([plane, space]: [&str; 2]) {
    for (kind, (scheme, steps)) in KINDS.into_iter().flat_map(|kind| RUNS.map(|run| (kind, run))) {
        let loads = if kind.0 == 2 { plane } else { space };
        let of = |h: f64| block(scheme, kind, h, &further("neo-hookean", &format!("{MASS}\n{loads}")));
        compare_rest(&format!("{scheme}, {kind:?}"), of, (scheme, steps));
    }
}

#[test]
fn shapes_at_rest_have_derivatives() {
    for (kind, (scheme, steps)) in KINDS.into_iter().flat_map(|kind| RUNS.map(|run| (kind, run))) {
        for (material, more) in [
            ("neo-hookean", MASS),
            ("corotated", "mass = { total = 150.0 }"),
            ("stable-neo-hookean", "mass = { density = 1000.0 }\nload = [{ pressure = 300.0 }]"),
        ] {
            let of = |h: f64| block(scheme, kind, h, &further(material, more));
            compare_shape(&format!("{scheme}, {kind:?}, {material}"), of, ("block", 0.02), (steps, 1e-6));
        }
    }
}

#[test]
fn shapes_at_rest_of_damped_elements_have_derivatives() {
    let runs = RUNS.into_iter().filter(|(scheme, _)| *scheme != "quasi-static");
    for (kind, (scheme, steps)) in runs.flat_map(|run| KINDS.map(|kind| (kind, run))) {
        for damping in [
            "strain_rate = { shear = 30.0, second = 20.0 }, mass_proportional = 0.5",
            "stiffness_proportional = 5e-3",
        ] {
            let velocity = match kind.0 {
                2 => "velocity = { rigid = { linear = [0.5, 0.2], angular = 2.0 } }",
                _ => "velocity = { rigid = { linear = [0.5, 0.2, 0.1], angular = [0.5, 1.0, 2.0] } }",
            };
            let more = format!("{MASS}\ndamping = {{ {damping} }}\n{velocity}");
            let of = |h: f64| block(scheme, kind, h, &further("neo-hookean", &more));
            compare_shape(&format!("{scheme}, {kind:?}, {damping}"), of, ("block", 0.02), (steps, 1e-6));
        }
    }
}

#[test]
fn shapes_at_rest_of_elements_with_factors_have_derivatives() {
    for (scheme, steps) in RUNS {
        for (kind, factors) in [((2, 1), "[0.5, 2.0, 1.0, 3.0]"), ((3, 2), "[0.5, 2.0, 1.0, 3.0, 0.8, 1.4]")]
        {
            let more = format!("{MASS}\nelastic_factor = {factors}");
            let of = |h: f64| block(scheme, kind, h, &further("neo-hookean", &more));
            compare_shape(&format!("{scheme}, {kind:?}"), of, ("block", 0.02), (steps, 1e-6));
        }
    }
}

/// A force per volume, muscles and a material with fibres whose axes turn: all by the shape, in directions
/// that do not go by it.
const FURTHER: &str = "mass = { total = 150.0 }
    load = [{ body_force = ['900*cos(30*t)', '-400 - 3e4*t'] }, { body_force = [200.0, 100.0] },
        { body_force = ['2e3*X*Y', '900*sin(3*X)*(1 + 20*t)'] }]
    muscle = [
        { fibre = { direction = [2, 1] }, tension = '3e3*(1 + sin(20*t))' },
        { fibre = { per_element = [[1, 0], [0, 1], [1, 1], [1, -2]] }, tension = 2e3 },
    ]
    elastic_factor = [0.5, 2.0, 1.0, 3.0]
    elastic_axes = { first = { per_element = [[1, 0.2], [0.3, 1], [1, 1], [-1, 2]] } }
    [body.elastic.expression]
    psi = 'mu/2*(I1 - 3) - mu*log(J) + k/2*(I4 - 1)^2 + 2*k*E12^2'
    parameters = { mu = 2e4, k = 9e3 }
    fibres = [[1, 0.5]]";

/// The same in space: six elements.
fn in_space() -> String {
    FURTHER
        .replace("'-400 - 3e4*t']", "'-400 - 3e4*t', 500]")
        .replace("[200.0, 100.0]", "[200.0, 100.0, -300.0]")
        .replace("*(1 + 20*t)']", "*(1 + 20*t)', '1e3*Z^2']")
        .replace("[2, 1]", "[2, 1, 0.5]")
        .replace(
            "[[1, 0], [0, 1], [1, 1], [1, -2]]",
            "[[1, 0, 0], [0, 1, 0], [1, 1, 1], [1, -2, 0], [0, 0, 1], [1, 0, 1]]",
        )
        .replace("[0.5, 2.0, 1.0, 3.0]", "[0.5, 2.0, 1.0, 3.0, 0.8, 1.4]")
        .replace(
            "[[1, 0.2], [0.3, 1], [1, 1], [-1, 2]]",
            "[[1, 0.2, 0], [0.3, 1, 1], [1, 1, 1], [-1, 2, 0], [0, 0, 1], [1, 0, 1]]",
        )
}

#[test]
fn shapes_with_body_forces_muscles_and_axes_have_derivatives() {
    for (kind, (scheme, steps)) in KINDS.into_iter().flat_map(|kind| RUNS.map(|run| (kind, run))) {
        let more = if kind.0 == 2 { FURTHER.to_owned() } else { in_space() };
        for more in [more.clone(), more.replace("total = 150.0", "density = 1000.0")] {
            let of = |h: f64| block(scheme, kind, h, &more);
            compare_rest(&format!("{scheme}, {kind:?}"), of, (scheme, steps));
        }
    }
}

/// Tension, fibres and axes of the material by formulas of the place.
#[test]
fn shapes_with_fibres_by_places_have_derivatives() {
    let plane = "mass = { total = 150.0 }
        muscle = [
            { fibre = { direction = ['1 + X', 'Y - 0.3'] }, tension = '3e3*(1 + 2*X*Y)*(1 + sin(20*t))' },
            { fibre = { direction = [1, 0] }, tension = '2e3*exp(Y)' },
        ]
        elastic_axes = { first = { direction = ['cos(X + Y)', 'sin(2*X)'] } }
        [body.elastic.expression]
        psi = 'mu/2*(I1 - 3) - mu*log(J) + k/2*(I4 - 1)^2 + 2*k*E12^2'
        parameters = { mu = 2e4, k = 9e3 }
        fibres = [[1, 0.5]]";
    let space = plane
        .replace("'Y - 0.3']", "'Y - 0.3', 'Z']")
        .replace("[1, 0] }, tension", "[1, 0, 0.2] }, tension")
        .replace("'sin(2*X)'] }", "'sin(2*X)', 'Z'] }, second = { direction = ['Y', 1, 'X*Z'] }");
    for (kind, (scheme, steps)) in KINDS.into_iter().flat_map(|kind| RUNS.map(|run| (kind, run))) {
        let of = |h: f64| block(scheme, kind, h, if kind.0 == 2 { plane } else { &space });
        compare_rest(&format!("{scheme}, {kind:?}"), of, (scheme, steps));
    }
}

/// Young's modulus and fibres of each element of second order.
#[test]
fn numbers_of_single_elements_of_second_order_have_derivatives() {
    for (d, (scheme, steps)) in [2, 3].into_iter().flat_map(|d| RUNS.map(|run| (d, run))) {
        let (what, count) = (format!("{scheme}, {d}D"), if d == 2 { 4 } else { 6 });
        let of = |young: &[f64], directions: &[f64]| {
            let factors: Vec<f64> = young.iter().map(|young| young / 4e4).collect();
            let fibres: Vec<&[f64]> = directions.chunks(d).collect();
            let more = format!(
                "{MASS}
                 elastic_factor = {factors:?}
                 muscle = [{{ fibre = {{ per_element = {fibres:?} }}, tension = '6e3*(1 + Y)*cos(9*t)' }}]"
            );
            block(scheme, (d, 2), 0.0, &further("neo-hookean", &more))
        };
        let young: Vec<f64> = scattered(count, 2.0).iter().map(|c| 4e4 * (1.0 + 0.5 * c)).collect();
        let directions: Vec<f64> = scattered(count * d, 3.0).iter().map(|c| 1.0 + 1.5 * c).collect();
        let names = ["body.block.elastic.young_per_element", "body.block.muscle.0.fibre.per_element"];
        compare_numbers(&what, |young| of(young, &directions), (names[0], &young, &young), (steps, 1e-6));
        let sizes = vec![1.0; directions.len()];
        let of_fibres = |directions: &[f64]| of(&young, directions);
        compare_numbers(&what, of_fibres, (names[1], &directions, &sizes), (steps, 1e-6));
        let steps = if scheme == "quasi-static" { 1 } else { steps };
        compare(&what, &of(&young, &directions), &names, steps);
    }
}

/// Two elements of second order that nothing holds together: of what becomes of one the other's Poisson's
/// ratio knows nothing, and its own all that the ratio of the body does.
#[test]
fn poissons_ratio_of_single_elements_of_second_order_has_derivatives() {
    for (d, (scheme, steps)) in [2, 3].into_iter().flat_map(|d| RUNS.map(|run| (d, run))) {
        let of = |poisson: f64| {
            let (points, cells, gravity) = match d {
                2 => (
                    "[[0, 0], [0.5, 0.05], [0.1, 0.4], [1, 0], [1.4, 0.1], [1.1, 0.5]]",
                    "triangles = [[0, 1, 2], [3, 4, 5]]",
                    "[2.7, -9.81]",
                ),
                _ => (
                    "[[0, 0, 0], [0.5, 0.05, 0], [0.1, 0.4, 0], [0.1, 0.1, 0.4], [1, 0, 0], [1.4, 0.1, 0], \
                     [1.1, 0.5, 0], [1, 0.1, 0.5]]",
                    "tetrahedra = [[0, 1, 2, 3], [4, 5, 6, 7]]",
                    "[2.7, -9.81, 2.0]",
                ),
            };
            let held = if d == 2 { "[0, 1, 3, 4]" } else { "[0, 1, 2, 4, 5, 6]" };
            let text = format!(
                "[world]
                 gravity = {gravity}
                 [[body]]
                 name = \"pair\"
                 order = 2
                 mesh = {{ inline = {{ points = {points}, {cells} }} }}
                 pin = [{{ vertices = {held} }}]
                 elastic = {{ neo-hookean = {{ young = 2e4, poisson = {poisson:?} }} }}
                 mass = {{ density = 1000.0 }}"
            );
            scene(scheme, d, [0.01, 1e-3], &text)
        };
        let what = format!("{scheme}, {d}D");
        let names = ["body.pair.elastic.poisson", "body.pair.elastic.poisson_per_element"];
        compare_number(&what, of, (names[0], 0.35, 0.1), (steps, 1e-6));
        for element in 0..2 {
            let (mut simulation, topology) = assembled(&of(0.35));
            let mut selection =
                ParameterSelection::new(&of(0.35), &topology, simulation.numbering(), &names).unwrap();
            // Corners of the elements lie on both sides of x = 0.8 m.
            let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
                if frame.step == steps {
                    let rest = topology.rest_positions.chunks_exact(d).zip(x_bar.chunks_exact_mut(d));
                    let own = rest.filter(|(rest, _)| (rest[0] > 0.8) == (element == 1));
                    own.enumerate().for_each(|(i, (_, bar))| bar[d - 1] = 1.0 + 0.3 * i as f64);
                }
                0.0
            };
            let found =
                gradient(&mut simulation, steps, &mut loss, selection.parameters(), UNLIMITED).unwrap();
            let parts = selection.parts(&found);
            let (whole, own, other) = (parts[0][0], parts[1][element], parts[1][1 - element]);
            assert!(whole != 0.0 && (own / whole - 1.0).abs() < 1e-11, "{what}: {own:e} of {whole:e}");
            assert!(other.abs() < 1e-12 * whole.abs(), "{what}: {other:e} of {whole:e}");
        }
        let steps = if scheme == "quasi-static" { 1 } else { steps };
        compare(&what, &of(0.35), &names, steps);
    }
}

/// Forces per volume at some vertices, of which elements have two corners, one or none.
#[test]
fn shapes_with_body_forces_on_parts_have_derivatives() {
    let plane = "load = [
        { body_force = ['900*cos(30*t)', '-400 - 3e4*t'], vertices = [1, 2] },
        { body_force = ['2e3*X*Y', '900*sin(3*X)'], half_space = { normal = [-1, 0], offset = -0.47 } },
        { body_force = [200.0, 100.0] },
    ]";
    let space = plane
        .replace("3e4*t']", "3e4*t', 500]")
        .replace("sin(3*X)']", "sin(3*X)', '1e3*Z^2']")
        .replace("normal = [-1, 0], offset = -0.47", "normal = [-1, 0, 0], offset = -0.2")
        .replace("100.0]", "100.0, -300.0]");
    compare_loads([plane, &space]);
}

/// Forces on areas and at places that go by formulas of these.
#[test]
fn shapes_with_loads_on_areas_and_places_have_derivatives() {
    let plane = "load = [
        { traction = ['900*cos(30*t) + 2e3*X*Y', -400.0], half_space = { normal = [-1, 0], offset = -0.7 } },
        { force = ['30*X^2', '20*sin(4*X*Y)'] },
        { force_per_vertex = ['5*Y', 3.0], vertices = [2, 4] },
        { pressure = '600*X^2*(1 + 10*t) + 300*Y' },
    ]";
    let space = plane
        .replace("-400.0]", "-400.0, '600*Z']")
        .replace("normal = [-1, 0], offset = -0.7", "normal = [0, 0, -1], offset = -0.3")
        .replace("'20*sin(4*X*Y)'", "'20*sin(4*X*Z)', 3.0")
        .replace("'5*Y', 3.0", "'5*Y', 3.0, 'Z'");
    compare_loads([plane, &space]);
}

/// Pins whose displacement goes by the place, under damping, and that turn besides.
#[test]
fn shapes_with_motion_by_places_have_derivatives() {
    for (kind, (scheme, steps)) in KINDS.into_iter().flat_map(|kind| RUNS.map(|run| (kind, run))) {
        let displacement = match kind.0 {
            2 => vec!["0.3*t*(1 + 2*Y + X)", "t^2*Y"],
            _ => vec!["0.3*t*(1 + 2*Y + X)", "t^2*Y*Z", "0.2*t*Z^2"],
        };
        let damping =
            if scheme == "quasi-static" { "" } else { "damping = { stiffness_proportional = 5e-3 }" };
        for turns in [false, true] {
            let of = |h: f64| {
                let mut scene =
                    block(scheme, kind, h, &further("neo-hookean", &format!("{MASS}\n{damping}")));
                let mut motion = serde_json::json!({ "displacement": displacement });
                if turns {
                    motion["rotation"] = match kind.0 {
                        2 => serde_json::json!({ "point": [0.1, 0.2], "speed": 2.0 }),
                        _ => serde_json::json!({ "point": [0.1, 0.2, 0.1], "axis": [1, 2, 0], "speed": 2.0 }),
                    };
                }
                scene.body[0].pin[0].motion = Some(serde_json::from_value(motion).unwrap());
                scene
            };
            let what = format!("{scheme}, {kind:?}, {turns}");
            compare_rest(&what, of, (scheme, steps));
        }
    }
}

#[test]
fn tangents_by_shapes_are_the_transpose_of_gradients() {
    let more = "mass = { density = 1000.0 }
                elastic_factor = 1.3
                damping = { strain_rate = { shear = 30.0, second = 20.0 } }";
    for kind in KINDS {
        for (scheme, steps) in RUNS.into_iter().filter(|(scheme, _)| *scheme != "quasi-static") {
            let scene = block(scheme, kind, 0.0, &further("neo-hookean", more));
            compare(&format!("{scheme}, {kind:?}"), &scene, &["body.block.rest"], steps);
        }
        let scene = block("quasi-static", kind, 0.0, &further("neo-hookean", MASS));
        compare(&format!("statics, {kind:?}"), &scene, &["body.block.rest"], 2);
    }
}

#[test]
fn shapes_of_which_more_is_made_are_not_offered() {
    let has = |scheme: &str, material: &str, more: &str| {
        let scene = block(scheme, (2, 1), 0.0, &further(material, more));
        names(&scene, &assembled(&scene).1).iter().any(|name| name == "body.block.rest")
    };
    let proportional = format!("{MASS}\ndamping = {{ stiffness_proportional = 1e-3 }}");
    assert!(has("rk4", "neo-hookean", &proportional) && !has("rk4", "linear", &proportional));
    let by_masses = format!("{MASS}\ndamping = {{ mass_proportional = 1.0 }}");
    assert!(has("rk4", "linear", &by_masses) && !has("quasi-static", "linear", &by_masses));
}

/// The block of [`block`], its shape changed by `h`, tied to the nearest points of a strand and of dust, and
/// dust tied to its own; further keys of the ties.
fn tied(scheme: &str, (dimension, order): (usize, u32), h: f64, of_ties: &str) -> Scene {
    let mut scene = block(scheme, (dimension, order), h, &further("neo-hookean", MASS));
    let places = |each: [[f64; 3]; 3]| each.map(|place| place[..dimension].to_vec());
    // Inside of the block, beside a face of it, beyond a corner of it.
    let dust = places([[0.3, 0.15, 0.2], [0.55, 0.4, 0.2], [1.0, -0.1, -0.05]]);
    let strand = places([[0.6, 0.5, 0.5], [0.9, 0.45, 0.5], [1.2, 0.5, 0.6]]);
    let bodies = serde_json::json!([
        { "name": "dust", "mesh": { "inline": { "points": dust } }, "mass": { "total": 20.0 } },
        {
            "name": "strand",
            "mesh": { "inline": { "points": strand, "edges": [[0, 1], [1, 2]] } },
            "springs": { "stiffness": 2e3 },
            "mass": { "total": 20.0 },
        },
    ]);
    let bodies: Vec<pliant_scene::Body> = serde_json::from_value(bodies).unwrap();
    scene.body.extend(bodies);
    let tip = if dimension == 2 { 4 } else { 7 };
    let mut targets = vec![("block", vec![tip], "strand"), ("block", vec![tip - 1], "dust")];
    if order == 1 {
        // What starts at length zero has no direction there.
        let first = usize::from(of_ties.contains("rest_length"));
        targets.push(("dust", [0, 1, 2][first..].to_vec(), "block"));
    }
    for (from, vertices, target) in targets {
        let mut tie = serde_json::json!({
            "body": from, "vertices": vertices, "stiffness": 900.0,
            "target": { "body": target, "nearest_point": 1.0 },
        });
        let more: serde_json::Value = serde_json::from_str(of_ties).unwrap();
        tie.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        scene.attachment.push(serde_json::from_value(tie).unwrap());
    }
    scene
}

/// Nearest points of shapes at rest move with these: inside of elements, on faces, edges and corners.
#[test]
fn shapes_at_rest_that_ties_go_by_have_derivatives() {
    for (kind, (scheme, steps)) in KINDS.into_iter().flat_map(|kind| RUNS.map(|run| (kind, run))) {
        for ties in ["{}", "{ \"rest_length\": 0.04, \"dashpot\": 30.0 }"] {
            // Statics of dust that hangs on ties of a length alone are singular.
            if scheme == "quasi-static" {
                continue;
            }
            let of = |h: f64| tied(scheme, kind, h, ties);
            compare_rest(&format!("{scheme}, {kind:?}, {ties}"), of, (scheme, steps));
        }
    }
}
