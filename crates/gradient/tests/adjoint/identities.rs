//! Identities of derivatives that hold whatever the numbers are.

use pliant::simulation::Snapshot;
use pliant_gradient::{LossFrame, ParameterSelection, UNLIMITED, gradient, tangent};
use pliant_scene::Scene;

use crate::solid::{Further, assembled, rows, scene as scene_of};
use crate::support::{case, compare, compare_with_differences, dot, scattered, scene};

const SCHEMES: [&str; 6] =
    ["velocity-verlet", "rk4", "implicit-euler", "bdf2", "tr-bdf2", "generalised-alpha"];
const STEPS: u64 = 20;
const START: &str = "position";
const VELOCITY: &str = "velocity";
const GRAVITY: &str = "world.gravity";
const REST: &str = "body.beam.rest";
const YOUNG: &str = "body.beam.elastic.young";

/// Shape of a beam of six triangles at rest.
fn shape() -> Vec<f64> {
    (0..8).flat_map(|i| [0.5 * f64::from(i % 4), 0.5 * f64::from(i / 4)]).collect()
}

/// A beam that is thrown, bent, and held nowhere; its step [s].
fn thrown(scheme: &str) -> (Scene, f64) {
    thrown_in_steps(scheme, 1.0)
}

/// The same in steps of other size, by a factor.
fn thrown_in_steps(scheme: &str, factor: f64) -> (Scene, f64) {
    let bent: Vec<f64> = shape().iter().zip(scattered(16, 1.0)).map(|(x, by)| x + 0.03 * by).collect();
    let text = format!(
        "[world]\ngravity = [0.7, -9.81]\n\
         [[body]]\nname = \"beam\"\nmesh = {{ inline = {{ points = {}, \
         triangles = [[0,1,5],[0,5,4],[1,2,6],[1,6,5],[2,3,7],[2,7,6]] }} }}\n\
         elastic = {{ neo-hookean = {{ young = 5e4, poisson = 0.35 }} }}\nmass = {{ density = 1000.0 }}\n\
         position = {{ per_vertex = {} }}\nvelocity = {{ per_vertex = {} }}",
        rows(&shape(), 2),
        rows(&bent, 2),
        rows(&scattered(16, 2.0), 2)
    );
    let scene = scene(scheme, 2, [0.01 * factor, 0.002 * factor], &text);
    let step = assembled(&scene).0.step_size();
    (scene, step)
}

/// Number `component` of the last positions, and its derivatives by the numbers of each key.
fn derivatives(scene: &Scene, component: usize, keys: &[&str]) -> (f64, Vec<Vec<f64>>) {
    let (mut simulation, topology) = assembled(scene);
    let mut selection = ParameterSelection::new(scene, &topology, simulation.numbering(), keys).unwrap();
    let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
        if frame.step < STEPS {
            return 0.0;
        }
        x_bar[component] = 1.0;
        frame.x[component]
    };
    let found = gradient(&mut simulation, STEPS, &mut loss, selection.parameters(), UNLIMITED).unwrap();
    (found.value, selection.parts(&found))
}

/// Values that the scene has by these keys, flat.
fn given(scene: &Scene) -> [Vec<f64>; 5] {
    let (simulation, _) = assembled(scene);
    let [x, v] = [simulation.positions(), simulation.velocities()].map(|values| values.to_vec());
    [x, v, vec![0.7, -9.81], shape(), vec![5e4]]
}

/// Rows turned by a quarter.
fn turned(values: &[f64]) -> Vec<f64> {
    values.chunks_exact(2).flat_map(|row| [-row[1], row[0]]).collect()
}

// Moved as a whole, thrown faster, or in another field, a free body is where that takes it.
#[test]
fn free_bodies_are_moved_as_a_whole() {
    for scheme in SCHEMES {
        let (scene, h) = thrown(scheme);
        let t = h * STEPS as f64;
        for component in [10, 11] {
            let (_, parts) = derivatives(&scene, component, &[START, VELOCITY, GRAVITY, REST]);
            let [start, velocity, gravity, rest] = &parts[..] else { panic!("four") };
            let sum = |part: &[f64]| {
                part.chunks_exact(2).fold([0.0; 2], |sum, row| [sum[0] + row[0], sum[1] + row[1]])
            };
            let along = [f64::from(component == 10), f64::from(component == 11)];
            compare(&format!("{scheme}, start"), &sum(start), &along, 1e-12);
            compare(&format!("{scheme}, velocity"), &sum(velocity), &along.map(|a| a * t), 1e-12);
            let size = rest.iter().fold(0.0, |m: f64, r| m.max(r.abs()));
            assert!(
                size > 1e-3 && sum(rest).iter().all(|sum| sum.abs() < 1e-12 * size),
                "{scheme}: {rest:?}"
            );
            let n = STEPS as f64;
            let fallen = match scheme {
                "velocity-verlet" | "rk4" | "tr-bdf2" => 0.5 * t * t,
                "implicit-euler" => 0.5 * h * h * n * (n + 1.0),
                _ => continue,
            };
            compare(&format!("{scheme}, gravity"), gravity, &along.map(|a| a * fallen), 1e-12);
        }
    }
}

// Turned as a whole, with its velocity and its field, a body is where that turns it; the shape at rest
// alone may be turned as it likes.
#[test]
fn bodies_are_turned_as_a_whole() {
    for scheme in SCHEMES {
        let (scene, _) = thrown(scheme);
        let [x, v, g, rest, _] = given(&scene);
        let places: Vec<f64> = [10, 11].map(|k| derivatives(&scene, k, &[]).0).to_vec();
        for (k, expected) in turned(&places).into_iter().enumerate() {
            let (_, parts) = derivatives(&scene, 10 + k, &[START, VELOCITY, GRAVITY, REST]);
            let of = |part: usize, by: &[f64]| dot(&parts[part], &turned(by));
            compare(&format!("{scheme} {k}"), &[of(0, &x) + of(1, &v) + of(2, &g)], &[expected], 1e-12);
            let each = parts[3].iter().zip(turned(&rest)).fold(0.0, |sum: f64, (a, b)| sum + (a * b).abs());
            assert!(of(3, &rest).abs() < 1e-12 * each, "{scheme} {k}: {} of {each}", of(3, &rest));
        }
    }
}

// Lengths, velocities and the field once, Young's modulus twice: all places are so many times as far.
#[test]
fn lengths_are_in_proportion() {
    for scheme in SCHEMES {
        let (scene, _) = thrown(scheme);
        let all = given(&scene);
        let (place, parts) = derivatives(&scene, 10, &[START, VELOCITY, GRAVITY, REST, YOUNG]);
        let works: Vec<f64> = parts.iter().zip(&all).map(|(part, value)| dot(part, value)).collect();
        let sum = works[..4].iter().sum::<f64>() + 2.0 * works[4];
        let largest = works.iter().fold(place.abs(), |m, work| m.max(work.abs()));
        assert!((sum - place).abs() < 1e-12 * largest, "{scheme}: {works:?} make {sum}, not {place}");
    }
}

// All moduli of elements together are that of the body; of stiffness over density alone depends where it is.
#[test]
fn elements_make_up_the_body() {
    let keys = [
        YOUNG,
        "body.beam.elastic.young_per_element",
        "body.beam.elastic.poisson",
        "body.beam.elastic.poisson_per_element",
        "body.beam.mass.density",
    ];
    for scheme in SCHEMES {
        let (scene, _) = thrown(scheme);
        let (_, parts) = derivatives(&scene, 10, &keys);
        for pair in [0, 2] {
            let sum: f64 = parts[pair + 1].iter().sum();
            compare(&format!("{scheme}, {}", keys[pair]), &[sum], &parts[pair], 1e-12);
        }
        let [young, density] = [5e4 * parts[0][0], 1000.0 * parts[4][0]];
        assert!((young + density).abs() < 1e-12 * young.abs(), "{scheme}: {young} and {density}");
    }
}

// Time has no scale of its own: what changes with the step changes with velocities, accelerations and
// stiffness.
#[test]
fn steps_are_in_proportion_to_velocities() {
    for scheme in SCHEMES {
        let (scene, _) = thrown(scheme);
        let [_, v, g, _, young] = given(&scene);
        let (_, parts) = derivatives(&scene, 10, &[VELOCITY, GRAVITY, YOUNG]);
        let works = [dot(&parts[0], &v), 2.0 * dot(&parts[1], &g), 2.0 * dot(&parts[2], &young)];
        let size = works.iter().fold(0.0, |size: f64, work| size.max(work.abs()));
        let place = |change: f64| derivatives(&thrown_in_steps(scheme, 1.0 + change).0, 10, &[]).0;
        compare_with_differences(scheme, (works.iter().sum(), size), (0.03, 1e-8), place);
    }
}

// What goes back the way it came has changed by what it began with.
#[test]
fn changes_are_undone_by_the_way_back() {
    let (mut simulation, _) = assembled(&thrown("velocity-verlet").0);
    let [dx, dv] = [3.0, 4.0].map(|seed| scattered(16, seed));
    let backwards = |v: &[f64]| -> Vec<f64> { v.iter().map(|v| -v).collect() };
    let there = tangent(&mut simulation, 100, (&dx, &dv), &mut |_, _| {}).unwrap();
    let (x, v) = (simulation.positions().into_owned(), backwards(&simulation.velocities()));
    simulation.restore(&Snapshot::new(0, 0.0, x, v)).unwrap();
    let way = (&there.position[..], &backwards(&there.velocity)[..]);
    let back = tangent(&mut simulation, 100, way, &mut |_, _| {}).unwrap();
    let grown = there.position.iter().fold(0.0, |m: f64, dot| m.max(dot.abs()));
    assert!(grown > 0.1 && there.position != dx, "{there:?}");
    compare("positions", &back.position, &dx, 1e-12);
    compare("velocities", &backwards(&back.velocity), &dv, 1e-12);
}

// Forces at equilibrium are a gradient: the compliance is symmetric, and loads over stiffness decide.
#[test]
fn compliances_are_symmetric() {
    let case = case("statics");
    let body = "load = [{ vertices = [6, 7], force_per_vertex = [300.0, -900.0] }]";
    let keys = ["body.beam.load.0.force_per_vertex", YOUNG, "body.beam.mass.density"];
    for material in case["runs"].as_object().unwrap().keys() {
        let further = Further { body, ..Further::default() };
        let scene = scene_of(&case["setup"], material, "quasi-static", 1, further);
        let by = |axis: usize| {
            let (mut simulation, topology) = assembled(&scene);
            let mut selection =
                ParameterSelection::new(&scene, &topology, simulation.numbering(), &keys).unwrap();
            let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
                let is_last = f64::from(u8::from(frame.step == 1));
                for vertex in [6, 7] {
                    x_bar[2 * vertex + axis] = is_last;
                }
                is_last * (frame.x[12 + axis] + frame.x[14 + axis])
            };
            let found = gradient(&mut simulation, 1, &mut loss, selection.parameters(), UNLIMITED).unwrap();
            selection.parts(&found)
        };
        let [of_x, of_y] = [by(0), by(1)];
        compare(&format!("{material}, compliance"), &of_x[0][1..], &of_y[0][..1], 1e-12);
        let [young, density] = [2e5 * of_y[1][0], 1000.0 * of_y[2][0]];
        let load = dot(&of_y[0], &[300.0, -900.0]);
        assert!((young + density + load).abs() < 1e-12 * young.abs(), "{material}: {young} {density} {load}");
    }
}
