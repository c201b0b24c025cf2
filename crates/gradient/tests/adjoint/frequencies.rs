//! Derivatives of natural frequencies: V9 of the reference, what scales with what, what is refused.

use pliant_gradient::{FrequencyGradient, GradientError, ParameterSelection, frequency_gradient};
use pliant_scene::Scene;
use serde_json::Value;

use crate::solid::{assembled, rows};
use crate::support::{case, compare, dot, numbers};

/// The solid of the reference at rest.
fn at_rest(setup: &Value, body: &str, world: &str) -> Scene {
    let d = if setup["cells"][0].as_array().unwrap().len() == 3 { 2 } else { 3 };
    let text = format!(
        "dimension = {d}
         [time]
         duration = 0.1
         step = 0.01
         integrator = \"symplectic-euler\"
         [world]
         {world}
         [[body]]
         name = \"beam\"
         mass = {{ density = {} }}
         elastic = {{ neo-hookean = {{ young = {}, poisson = {} }} }}
         mesh = {{ inline = {{ points = {}, {} = {} }} }}
         {body}",
        setup["density"],
        setup["young"],
        setup["poisson"],
        rows(&numbers(&setup["rest"]), d),
        if d == 2 { "triangles" } else { "tetrahedra" },
        setup["cells"],
    );
    Scene::from_toml(&text).unwrap()
}

fn found(scene: &Scene, count: usize, names: &[&str]) -> Result<FrequencyGradient, GradientError> {
    let (mut simulation, topology) = assembled(scene);
    let mut chosen = ParameterSelection::new(scene, &topology, simulation.numbering(), names)?;
    frequency_gradient(&mut simulation, count, chosen.parameters())
}

const NAMES: [(&str, &str); 6] = [
    ("body.beam.elastic.young", "young"),
    ("body.beam.elastic.poisson", "poisson"),
    ("body.beam.mass.density", "density"),
    ("body.beam.elastic.young_per_element", "young_of_element"),
    ("body.beam.elastic.poisson_per_element", "poisson_of_element"),
    ("body.beam.rest", "rest"),
];

#[test]
fn frequencies_have_the_derivatives_of_the_reference() {
    let all = case("frequencies");
    for name in ["beam", "box"] {
        let setup = &all[name]["setup"];
        let pin = format!("pin = [{{ vertices = {} }}]", setup["held"]);
        let found = found(&at_rest(setup, &pin, ""), 4, &NAMES.map(|(key, _)| key)).unwrap();
        assert_eq!(found.alike, [1; 4], "{name}");
        for (i, mode) in all[name]["modes"].as_array().unwrap().iter().enumerate() {
            let omega = found.omega[i];
            compare(&format!("{name}, omega of {i}"), &[omega], &numbers(&mode["omega"]), 1e-12);
            for ((_, key), squares) in NAMES.iter().zip(&found.squares[i]) {
                let by: Vec<f64> = squares.iter().map(|square| square / (2.0 * omega)).collect();
                let expected = numbers(&mode["gradient"][key]);
                compare(&format!("{name}, mode {i} by {key}"), &by, &expected, 1e-10);
            }
        }
    }
}

/// A cube of eight corners and five tetrahedra, in which the three axes are alike.
fn cube() -> Value {
    let corners: Vec<f64> = (0..8).flat_map(|i| [i & 1, i >> 1 & 1, i >> 2].map(f64::from)).collect();
    serde_json::json!({
        "rest": corners,
        "cells": [[0, 1, 2, 4], [3, 2, 1, 7], [5, 4, 7, 1], [6, 7, 4, 2], [1, 2, 4, 7]],
        "young": 6e4, "poisson": 0.3, "density": 900.0,
    })
}

// A free cube: six rigid motions, and modes of one frequency, of which single ones have no derivative.
#[test]
fn modes_of_one_frequency_share_the_derivative_of_their_mean() {
    let setup = cube();
    let scene = at_rest(&setup, "", "");
    let names = ["body.beam.elastic.young", "body.beam.mass.density", "body.beam.rest"];
    let found = found(&scene, 10, &names).unwrap();
    assert_eq!(found.alike[..6], [6; 6], "rigid motion");
    let several = (6..10).filter(|i| found.alike[*i] > 1).count();
    assert!(several > 1, "{:?}", found.alike);
    let rest = numbers(&setup["rest"]);
    for (i, (omega, by)) in found.omega.iter().zip(&found.squares).enumerate() {
        let square = omega * omega;
        let of = if i < 6 { found.omega[9] * found.omega[9] } else { square };
        // omega^2 is in proportion to E/rho, and to 1/L^2.
        let scaled = [by[0][0] * 6e4, -by[1][0] * 900.0, -0.5 * dot(&by[2], &rest)];
        for scaled in scaled {
            assert!((scaled - square).abs() <= 1e-10 * of, "mode {i}: {scaled:e}, expected {square:e}");
        }
        // To move it changes nothing, and to turn it neither.
        let along = |axis: usize| by[2].iter().skip(axis).step_by(3).sum::<f64>();
        let turned: f64 =
            by[2].chunks_exact(3).zip(rest.chunks_exact(3)).map(|(by, x)| by[1] * x[0] - by[0] * x[1]).sum();
        for moved in [along(0), along(1), along(2), turned] {
            assert!(moved.abs() <= 1e-10 * of, "mode {i}: {moved:e}");
        }
    }
    // The mean of a group, by the shape, against differences of the means of the group.
    let group = found.alike[6];
    let change: Vec<f64> = crate::support::scattered(rest.len(), 1.0);
    let mean = |h: f64| {
        let mut changed = setup.clone();
        let moved: Vec<f64> = rest.iter().zip(&change).map(|(x, c)| x + h * c).collect();
        changed["rest"] = moved.into();
        let squares = assembled(&at_rest(&changed, "", "")).0.modes(6 + group).unwrap().modes;
        squares[6..].iter().map(|mode| mode.omega.powi(2)).sum::<f64>() / group as f64
    };
    let by = dot(&found.squares[6][2], &change);
    let difference = (mean(1e-4) - mean(-1e-4)) / 2e-4;
    assert!((by - difference).abs() < 1e-6 * difference.abs(), "{by:e}, by differences {difference:e}");
}

// Two springs in line and three masses: omega^2 is 0, k/m and k (2/M + 1/m).
#[test]
fn springs_and_masses_are_parameters_of_frequencies() {
    let scene = Scene::from_toml(
        "dimension = 2
         [time]
         duration = 0.1
         step = 0.01
         integrator = \"symplectic-euler\"
         [[body]]
         name = \"beam\"
         mesh = { strand = { segments = 2, start = [0, 0], end = [2, 0] } }
         springs = { stiffness = 50.0 }
         mass = { per_vertex = [1.0, 4.0, 1.0] }
         pin = [{ vertices = [0, 1, 2], axes = [\"y\"] }]",
    )
    .unwrap();
    let found = found(&scene, 3, &["body.beam.springs.stiffness", "body.beam.mass.per_vertex"]).unwrap();
    let expected = [0.0, 50.0, 75.0];
    for (i, (omega, expected)) in found.omega.iter().zip(expected).enumerate() {
        assert!((omega * omega - expected).abs() < 1e-10, "{omega}");
        let by_stiffness = found.squares[i][0][0];
        assert!((by_stiffness - expected / 50.0).abs() < 1e-12, "mode {i}: {by_stiffness:e}");
    }
    compare("even by masses", &found.squares[1][1], &[-25.0, 0.0, -25.0], 1e-10);
    // d(k (2/M + 1/m)): -2 k/M^2 by the middle one; by both outer ones together -k/m^2.
    compare("odd by masses", &found.squares[2][1], &[-25.0, -6.25, -25.0], 1e-10);
}

#[test]
fn frequencies_under_a_load_and_by_what_is_unknown_are_refused() {
    let setup = case("frequencies")["beam"]["setup"].clone();
    let pin = "pin = [{ vertices = [0, 1] }]";
    let by_young = &["body.beam.elastic.young"][..];
    let error = found(&at_rest(&setup, pin, "gravity = [0, -9.81]"), 2, by_young).unwrap_err();
    assert!(matches!(error, GradientError::Unsupported { .. }), "{error}");
    assert!(error.to_string().contains("gravity"), "{error}");
    let start: Vec<f64> = numbers(&setup["rest"]).iter().map(|x| 1.1 * x).collect();
    let stretched = format!("{pin}\nposition = {{ per_vertex = {} }}", rows(&start, 2));
    let error = found(&at_rest(&setup, &stretched, ""), 2, by_young).unwrap_err();
    assert!(error.to_string().contains("reference configuration"), "{error}");
    let names = &["body.beam.elastic.young", "velocity", "world.gravity"];
    let error = found(&at_rest(&setup, pin, ""), 2, names).unwrap_err();
    assert_eq!(error, GradientError::FrequencyParameter { number: 1 });
    let error = found(&at_rest(&setup, pin, ""), 100, by_young).unwrap_err();
    assert!(matches!(error, GradientError::Modes(_)), "{error}");
}

/// Compares the derivatives of the squares of `count` frequencies by a shape of so many coordinates with
/// differences over `step`, extrapolated, in scenes whose shape goes `h` along a direction.
fn compare_shape(scene: fn(f64) -> Scene, (name, coordinates): (&str, usize), count: usize, step: f64) {
    let found = found(&scene(0.0), count, &[name]).unwrap();
    let direction = crate::support::scattered(coordinates, 2.0);
    for i in 0..count {
        let square = |h: f64| assembled(&scene(h)).0.modes(count).unwrap().modes[i].omega.powi(2);
        let by = dot(&found.squares[i][0], &direction);
        let size = found.omega[i].powi(2);
        let difference = |h: f64| (square(h) - square(-h)) / (2.0 * h);
        let [near, far] = [step, 2.0 * step].map(difference);
        let error = ((4.0 * near - far) / 3.0 - by).abs();
        assert!(by.abs() > 0.1 * size, "mode {i}: nothing to compare");
        assert!(error <= 1e-7 * by.abs(), "mode {i}: {by:e}, off by {:e}", error / by.abs());
    }
}

/// A free block of two cells at rest, its nodes moved by `h` along a direction.
fn cells(h: f64) -> Scene {
    let direction = crate::support::scattered(36, 2.0);
    let node = |i: usize| [(i % 3) as f64 * 0.3, (i / 3 % 2) as f64 * 0.2, (i / 6) as f64 * 0.25];
    let bend = crate::support::scattered(36, 5.0);
    let places: Vec<f64> = (0..12).flat_map(node).collect();
    let places: Vec<f64> = (0..36).map(|i| places[i] + 0.03 * bend[i] + h * direction[i]).collect();
    let text = format!(
        "dimension = 3
         [time]
         duration = 0.1
         step = 1e-4
         integrator = \"symplectic-euler\"
         [[body]]
         name = \"beam\"
         mass = {{ density = 900.0 }}
         elastic = {{ neo-hookean = {{ young = 6e4, poisson = 0.35 }} }}
         mesh = {{ inline = {{ points = {}, hexahedra = [
             [0, 1, 4, 3, 6, 7, 10, 9], [1, 2, 5, 4, 7, 8, 11, 10],
         ] }} }}
         {}",
        rows(&places, 3),
        "pin = [{ vertices = [0, 3, 6, 9] }]",
    );
    Scene::from_toml(&text).unwrap()
}

#[test]
fn frequencies_of_cells_have_derivatives_by_their_shape() {
    compare_shape(cells, ("body.beam.rest", 36), 3, 1e-3);
}

/// A block held at one side, its vertices moved by `h` along a direction, and a grain that hangs on two
/// ties to it, one to its nearest point; a corner is tied to a place. All are as long as at rest for `h = 0`.
fn tied(h: f64) -> Scene {
    let direction = crate::support::scattered(12, 2.0);
    let points = [0.0, 0.0, 0.3, 0.0, 0.6, 0.0, 0.0, 0.3, 0.3, 0.3, 0.6, 0.3];
    let points: Vec<f64> = points.iter().zip(&direction).map(|(x, along)| x + h * along).collect();
    let text = format!(
        "dimension = 2
         [time]
         duration = 0.1
         step = 1e-4
         integrator = \"symplectic-euler\"
         [[body]]
         name = \"block\"
         mass = {{ density = 900.0 }}
         elastic = {{ neo-hookean = {{ young = 6e4, poisson = 0.35 }} }}
         mesh = {{ inline = {{ points = {}, triangles = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]] }} }}
         pin = [{{ vertices = [0, 3] }}]
         [[body]]
         name = \"grain\"
         mesh = {{ inline = {{ points = [[0.25, 0.4]] }} }}
         mass = {{ total = 20.0 }}
         [[attachment]]
         body = \"grain\"
         vertices = [0]
         stiffness = 3e4
         rest_length = 0.1
         target = {{ body = \"block\", nearest_point = 1.0 }}
         [[attachment]]
         body = \"grain\"
         vertices = [0]
         stiffness = 2e4
         rest_length = {:?}
         target = {{ body = \"block\", vertices = [5] }}
         [[attachment]]
         body = \"block\"
         vertices = [2]
         stiffness = 5e4
         rest_length = 0.5
         points = [[0.9, -0.4]]",
        rows(&points, 2),
        0.35_f64.hypot(0.1),
    );
    Scene::from_toml(&text).unwrap()
}

#[test]
fn frequencies_have_derivatives_by_shapes_that_ties_of_a_length_go_by() {
    compare_shape(tied, ("body.block.rest", 12), 4, 1e-4);
}
