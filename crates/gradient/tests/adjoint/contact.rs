//! Surfaces that touch: gradients against central differences of the program's own runs.

use pliant::energy::TouchingPair;
use pliant::integrator::IntegratorSpec;
use pliant::material::MaterialSpec;
use pliant::simulation::Simulation;
use pliant_gradient::{ContactEvents, LossFrame, ParameterSelection, UNLIMITED, gradient, names};
use pliant_scene::{BodyContactSpec, MassSpec, OverTime, Scene};

use crate::by_parameters;
use crate::differences::{compare_number, compare_shape, compare_starts};
use crate::solid::{assembled, rows};
use crate::support::{
    compare as compare_numbers, compare_with_differences, dot, method, scattered, scene, schemes,
};
use crate::tangents::compare_with_tangents;

/// A square of rubber that falls on a slope and slides down it; without friction unless `contact` says more.
fn slope(scheme: &str, contact: &str) -> Scene {
    let solves = method(scheme).documentation.solves > 0;
    let (step, solver) = if solves { (2e-3, "solver = { tolerance = 1e-14 }") } else { (2e-4, "") };
    let text = format!(
        "dimension = 2
         [time]
         integrator = \"{scheme}\"
         duration = 0.1
         step = {step}
         {solver}
         [world]
         gravity = [1.0, -9.81]
         [contact]
         distance = 2e-3
         stiffness = 1e5
         {contact}
         [[body]]
         name = \"block\"
         mesh = {{ grid = {{ cells = [2, 2], size = [0.1, 0.1], origin = [0.0, 0.0015] }} }}
         elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}
         mass = {{ density = 1000.0 }}
         velocity = {{ rigid = {{ linear = [0.3, -0.4], angular = 0.5 }} }}
         [[obstacle]]
         name = \"slope\"
         shape = {{ half_space = {{ normal = [0.05, 1.0], offset = 0.0 }} }}"
    );
    Scene::from_toml(&text).unwrap()
}

/// A cube of tetrahedra that falls on another, held one, with an edge across its border: vertices over
/// triangles, edges over edges.
fn cubes(scheme: &str, contact: &str) -> Scene {
    Scene::from_toml(&cubes_text(scheme, contact)).unwrap()
}

fn cubes_text(scheme: &str, contact: &str) -> String {
    format!(
        "dimension = 3
         [time]
         integrator = \"{scheme}\"
         duration = 0.1
         step = 2e-3
         solver = {{ tolerance = 1e-14 }}
         [world]
         gravity = [0.0, 0.0, -9.81]
         [contact]
         distance = 4e-3
         stiffness = 1e5
         {contact}
         [[body]]
         name = \"upper\"
         mesh = {{ grid = {{ cells = [1, 1, 1], size = [0.1, 0.1, 0.1] }} }}
         elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}
         mass = {{ density = 1000.0 }}
         velocity = {{ rigid = {{ linear = [0.1, 0.05, -0.5] }} }}
         [body.transform]
         centre = [0.05, 0.05, 0.05]
         rotate = {{ axis = [0.02, 1.0, 0.05], angle = \"42 deg\" }}
         translate = [0.01, 0.047, 0.1242]
         [[body]]
         name = \"lower\"
         mesh = {{ grid = {{ cells = [1, 1, 1], size = [0.1, 0.1, 0.1] }} }}
         elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}
         mass = {{ density = 1000.0 }}
         pin = [{{ half_space = {{ normal = [0, 0, 1], offset = 0 }} }}]"
    )
}

/// The same cubes, the upper one pressed on the other and dragged over it by a pin on its upper side: solves
/// begin where surfaces touch.
fn dragged_cubes(scheme: &str, contact: &str) -> Scene {
    let pin = "pin = [{ half_space = { normal = [0, 0, -1], offset = -0.22 }, \
               motion = { displacement = [\"0.1*t\", \"0.2*t\", \"-0.1*t\"] } }]";
    let falls = "velocity = { rigid = { linear = [0.1, 0.05, -0.5] } }";
    let text = cubes_text(scheme, contact).replace(falls, pin).replace("0.047, 0.1242", "0.047, 0.1253");
    Scene::from_toml(&text).unwrap()
}

/// Pairs that touch.
fn touching(simulation: &Simulation) -> usize {
    let state = simulation.state();
    let terms = simulation.system().terms().iter().filter_map(|term| term.touching());
    terms.map(|term| term.contacts(state.x(), state.v()).len()).sum()
}

/// Fails unless more than `pairs` touch in more than two of these steps.
fn expect_touching(what: &str, scene: &Scene, (steps, pairs): (u64, usize)) {
    let mut alone = assembled(scene).0;
    let touched = (0..steps).filter(|_| {
        alone.step().unwrap();
        touching(&alone) > pairs
    });
    assert!(touched.count() > 2, "{what}: nothing touches");
}

/// Compares with differences of runs in which surfaces touch.
fn compare(what: &str, scene: &Scene, steps: u64, tolerance: f64) {
    compare_starts(what, scene, (steps, tolerance), |simulation| touching(simulation) > 0);
}

/// A block pressed onto a slope by a load, in one equilibrium after another.
const PRESSED: &str = "
    dimension = 2
    [time]
    integrator = \"quasi-static\"
    duration = 2.0
    step = 1.0
    solver = { tolerance = 1e-14 }
    [contact]
    distance = 2e-3
    stiffness = 1e5
    [[body]]
    name = \"block\"
    mesh = { grid = { cells = [2, 2], size = [0.1, 0.1], origin = [0.0, 0.0015] } }
    elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }
    mass = { density = 1000.0 }
    pin = [{ half_space = { normal = [-1.0, 0.0], offset = -0.02 } }]
    load = [{ half_space = { normal = [0.0, -1.0], offset = -0.09 }, force = [20.0, \"-100*t\"] }]
    [[obstacle]]
    name = \"slope\"
    shape = { half_space = { normal = [0.05, 1.0], offset = 0.0 } }";

// A pair that comes within reach brings no kink with it: its energy has two continuous derivatives there.
#[test]
fn contact_has_the_derivatives_of_its_steps() {
    let holding = schemes().into_iter().filter(|scheme| method(scheme).holds_contact());
    let solved: Vec<_> = holding.filter(|scheme| method(scheme).documentation.solves > 0).collect();
    assert!(solved.len() > 8, "{solved:?}");
    for scheme in solved {
        if !method(scheme).is_static() {
            compare(&format!("slope, {scheme}"), &slope(scheme, ""), 20, 1e-7);
        }
    }
    for scheme in ["implicit-euler", "tr-bdf2"] {
        compare(&format!("cubes, {scheme}"), &cubes(scheme, ""), 12, 1e-7);
    }
    compare("pressed", &Scene::from_toml(PRESSED).unwrap(), 2, 1e-7);
}

// The law of explicit steps, whichever steps it is in.
#[test]
fn contact_of_explicit_steps_has_their_derivatives() {
    for scheme in ["symplectic-euler", "velocity-verlet", "yoshida4", "rk4"] {
        compare(&format!("slope, {scheme}"), &slope(scheme, ""), 200, 1e-7);
    }
    for integrator in [IntegratorSpec::ImplicitEuler, IntegratorSpec::Gauss2] {
        let mut scene = slope("implicit-euler", "");
        scene.time.integrator = integrator;
        scene.contact.as_mut().unwrap().explicit_law = Some(true);
        compare(&format!("slope, {integrator:?}"), &scene, 20, 1e-7);
    }
}

// As of elements, see `tangents`.
#[test]
fn tangents_and_adjoints_agree_where_surfaces_touch() {
    for (scheme, steps) in [("implicit-euler", 20), ("bdf2", 20), ("velocity-verlet", 200)] {
        compare_with_tangents(scheme, &slope(scheme, ""), steps);
    }
    compare_with_tangents("cubes", &cubes("trapezoid", ""), 12);
    let law = "friction = 0.4\nthreshold_speed = 0.02";
    for scheme in ["implicit-euler", "bdf2", "tr-bdf2"] {
        compare_with_tangents(&format!("friction, {scheme}"), &dragged_cubes(scheme, law), 12);
        compare_with_tangents(&format!("slope, {scheme}"), &slope(scheme, law), 20);
    }
    compare_with_tangents("friction, velocity-verlet", &slope("velocity-verlet", law), 200);
    // They part before the end: the matrices of the way back gain the pairs that touch.
    compare_with_tangents("cubes that part", &cubes("implicit-euler", ""), 36);
}

// The stiffness of contact follows from moduli, or from masses, unless the scene says it.
#[test]
fn numbers_that_contact_is_made_of_in_other_ways_are_no_parameters() {
    let all = |scene: &Scene| names(scene, &assembled(scene).1);
    let has = |scene: &Scene, key: &str| all(scene).contains(&format!("body.block.{key}"));
    for scheme in ["implicit-euler", "velocity-verlet"] {
        let given = slope(scheme, "");
        let mut free = given.clone();
        (free.contact.as_mut().unwrap().stiffness, free.contact.as_mut().unwrap().distance) = (None, None);
        let mut thick = free.clone();
        thick.body[0].contact = Some(BodyContactSpec { radius: Some(1e-3), ..BodyContactSpec::default() });
        for key in ["elastic.young", "elastic.poisson", "mass.density", "rest"] {
            let of = [&given, &free, &thick].map(|scene| has(scene, key));
            assert_eq!(of, [true; 3], "{scheme}, {key}");
        }
    }
    let mut free = slope("velocity-verlet", "");
    let material = serde_json::json!({ "mooney-rivlin": { "c10": 2e4, "c01": 1e4, "poisson": 0.4 } });
    free.body[0].elastic = Some(serde_json::from_value(material).unwrap());
    assert!(has(&free, "elastic.c10"));
    free.contact.as_mut().unwrap().stiffness = None;
    let (simulation, topology) = assembled(&free);
    let select = |name| ParameterSelection::new(&free, &topology, simulation.numbering(), &[name]);
    let error = select("body.block.elastic.c10").err().unwrap().to_string();
    assert!(error.contains("how stiff contact is: give a `stiffness` in [contact];"), "{error}");
    let mut apart = slope("implicit-euler", "");
    apart.contact = None;
    apart.obstacle.clear();
    assert!(has(&apart, "rest") && has(&apart, "elastic.young"));
}

/// A square on a corner above another in the plane: vertices over edges and over vertices.
const CORNERS: &str = "
    dimension = 2
    [time]
    integrator = \"implicit-euler\"
    duration = 0.1
    step = 2e-3
    solver = { tolerance = 1e-14 }
    [contact]
    distance = 4e-3
    stiffness = 1e5
    friction = 0.4
    [[body]]
    name = \"upper\"
    mesh = { grid = { cells = [1, 1], size = [0.1, 0.1] } }
    transform = { rotate = { angle = \"40 deg\" }, translate = [0.1015, 0.1025] }
    elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }
    mass = { density = 1000.0 }
    velocity = { rigid = { linear = [0.1, -0.5] } }
    [[body]]
    name = \"lower\"
    mesh = { grid = { cells = [1, 1], size = [0.1, 0.1] } }
    elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }
    mass = { density = 1000.0 }
    pin = [{ half_space = { normal = [0, 1], offset = 0 } }]";

/// Two boxes with parallel edges crosswise over each other, less than the reach apart.
const PARALLEL: &str = "
    dimension = 3
    [time]
    integrator = \"implicit-euler\"
    duration = 0.1
    step = 2e-3
    [contact]
    distance = 4e-3
    stiffness = 1e5
    friction = 0.4
    [[body]]
    name = \"upper\"
    mesh = { grid = { cells = [1, 1, 1], size = [0.1, 0.1, 0.1] } }
    transform = { rotate = { axis = [0, 0, 1], angle = \"1 deg\" }, translate = [0.052, 0.101, 0.102] }
    elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }
    mass = { density = 1000.0 }
    [[body]]
    name = \"lower\"
    mesh = { grid = { cells = [1, 1, 1], size = [0.1, 0.1, 0.1] } }
    elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }
    mass = { density = 1000.0 }";

// Normal forces, normals and closest points move with the vertices; speeds from far below the threshold, 1e-4
// m/s, to far above it.
#[test]
fn friction_knows_how_it_changes_with_positions() {
    let mut scenes = vec![
        ("slope", slope("implicit-euler", "friction = 0.4")),
        ("cubes", cubes("implicit-euler", "friction = 0.4")),
        ("corners", Scene::from_toml(CORNERS).unwrap()),
        ("parallel", Scene::from_toml(PARALLEL).unwrap()),
    ];
    for (what, scene) in &mut scenes {
        scene.contact.as_mut().unwrap().threshold_speed = Some(1e-3);
        let mut simulation = assembled(scene).0;
        let (x, n) = (simulation.state().x().to_vec(), simulation.state().x().len());
        let system = simulation.system_mut();
        let [p, dx, directions] = [1.0, 2.0, 3.0].map(|seed| scattered(n, seed));
        for speed in [3e-5, 3e-4, 1.0] {
            let v: Vec<f64> = directions.iter().map(|direction| speed * direction).collect();
            let mut product = vec![0.0; n];
            assert!(system.position_product(&x, &v, &p, &mut product));
            let parts: Vec<f64> = product.iter().zip(&dx).map(|(product, dx)| product * dx).collect();
            let found = (parts.iter().sum(), dot(&parts, &parts).sqrt());
            compare_with_differences(&format!("{what} at {speed} m/s"), found, (1e-5, 1e-8), |h| {
                let moved: Vec<f64> = x.iter().zip(&dx).map(|(x, dx)| x + h * dx).collect();
                let mut force = vec![0.0; n];
                system.dissipative_force(&moved, &v, &mut force);
                dot(&p, &force)
            });
        }
    }
}

// Normal forces and tangents are those at the end of a solve, and so are their derivatives.
#[test]
fn friction_has_the_derivatives_of_its_steps() {
    for (threshold, what) in [(1.0, "sticks"), (2e-2, "slides")] {
        let law = format!("friction = 0.4\nthreshold_speed = {threshold:?}");
        for scheme in ["implicit-euler", "bdf2", "tr-bdf2"] {
            compare(&format!("{what}, {scheme}"), &dragged_cubes(scheme, &law), 12, 1e-6);
        }
    }
    // What lands rubs in the step in which it lands.
    for scheme in ["implicit-euler", "bdf2", "tr-bdf2"] {
        let law = "friction = 0.4\nthreshold_speed = 0.2";
        compare(&format!("lands, {scheme}"), &slope(scheme, law), 40, 1e-6);
    }
    for scheme in ["symplectic-euler", "velocity-verlet", "rk4"] {
        let law = "friction = 0.4\nthreshold_speed = 0.2";
        compare(&format!("slope, {scheme}"), &slope(scheme, law), 200, 1e-6);
    }
}

/// The pressed block that rubs.
fn pressed(threshold: f64) -> Scene {
    let law = format!("stiffness = 1e5\n    friction = 0.3\n    threshold_speed = {threshold:?}");
    Scene::from_toml(&PRESSED.replacen("stiffness = 1e5", &law, 1)).unwrap()
}

// The force of friction in an equilibrium is that of the way from the last one: it remembers.
#[test]
fn friction_in_statics_has_the_derivatives_of_its_increments() {
    for (what, threshold) in [("sticks", 2e-2), ("slides", 2e-4)] {
        let scene = pressed(threshold);
        let found = compare_starts(what, &scene, (2, 1e-6), |simulation| touching(simulation) > 0);
        assert!(found.position.iter().any(|by| by.abs() > 1e-6), "{what}: nothing is remembered");
        compare_with_tangents(what, &scene, 2);
    }
    let mut viscous = Scene::from_toml(PRESSED).unwrap();
    let damping = serde_json::json!({ "stiffness_proportional": 0.5 });
    viscous.body[0].damping = Some(serde_json::from_value(damping).unwrap());
    compare("viscous", &viscous, 2, 1e-7);
    compare_with_tangents("viscous", &viscous, 2);
    // Masses resist the way, too.
    let by_masses = |alpha: f64, density: f64| {
        let mut scene = Scene::from_toml(PRESSED).unwrap();
        scene.world.gravity = Some([1.0, -9.81].map(OverTime::Constant).to_vec());
        let damping = serde_json::json!({ "mass_proportional": alpha });
        scene.body[0].damping = Some(serde_json::from_value(damping).unwrap());
        scene.body[0].mass = MassSpec::Density(density.into());
        scene
    };
    compare("by masses", &by_masses(9.0, 1e3), 2, 1e-7);
    compare_with_tangents("by masses", &by_masses(9.0, 1e3), 2);
    let alpha = |alpha| by_masses(alpha, 1e3);
    compare_number("statics", alpha, ("body.block.damping.mass_proportional", 9.0, 9.0), (2, 1e-6));
    let density = |density| by_masses(9.0, density);
    compare_number("statics", density, ("body.block.mass.density", 1e3, 1e3), (2, 1e-6));
    let of = |change: &dyn Fn(&mut Scene)| {
        let mut scene = pressed(2e-3);
        change(&mut scene);
        scene
    };
    let friction = |mu| of(&|scene| scene.contact.as_mut().unwrap().friction = mu);
    compare_number("statics", friction, ("contact.friction", 0.3, 0.3), (2, 1e-6));
    let motion = |a: f64| {
        of(&|scene| {
            let displacement = [format!("A*t^2 where A = {a:?}"), format!("-A*t where A = {a:?}")];
            let motion = serde_json::json!({ "displacement": displacement });
            scene.body[0].pin[0].motion = Some(serde_json::from_value(motion).unwrap());
        })
    };
    compare_number("statics", motion, ("body.block.pin.0.motion.parameters.A", 1e-3, 1e-3), (2, 1e-6));
}

// Normal forces and tangents that are those of the start of the step bring its positions into the step, those
// of what is moved among them.
#[test]
fn friction_of_the_start_of_a_step_has_the_derivatives_of_its_steps() {
    for (threshold, what) in [(1.0, "sticks"), (3e-2, "slides")] {
        let law = format!("friction = 0.4\nfriction_iterations = 1\nthreshold_speed = {threshold:?}");
        for scheme in ["implicit-euler", "bdf2", "tr-bdf2", "newmark"] {
            let scene = dragged_cubes(scheme, &law);
            compare(&format!("{what}, {scheme}"), &scene, 12, 1e-6);
            compare_with_tangents(&format!("{what}, {scheme}"), &scene, 12);
        }
    }
    for scheme in ["implicit-euler", "bdf2", "sdirk2"] {
        let scene = slope(scheme, "friction = 0.4\nfriction_iterations = 1\nthreshold_speed = 0.2");
        compare(&format!("lands, {scheme}"), &scene, 40, 1e-6);
        compare_with_tangents(&format!("lands, {scheme}"), &scene, 40);
    }
    for (what, threshold) in [("sticks", 2e-2), ("slides", 2e-4)] {
        let mut scene = pressed(threshold);
        scene.contact.as_mut().unwrap().friction_iterations = Some(1);
        compare(&format!("{what}, statics"), &scene, 3, 1e-6);
        compare_with_tangents(&format!("{what}, statics"), &scene, 3);
    }
    for scheme in ["implicit-euler", "tr-bdf2"] {
        let with = |change: &dyn Fn(&mut Scene)| {
            let law = "friction = 0.4\nfriction_iterations = 1\nthreshold_speed = 0.02";
            let mut scene = dragged_cubes(scheme, law);
            change(&mut scene);
            scene
        };
        let stiffness = |kappa| with(&|scene| scene.contact.as_mut().unwrap().stiffness = Some(kappa));
        compare_number(scheme, stiffness, ("contact.stiffness", 1e5, 1e5), (12, 1e-6));
        let friction = |mu| with(&|scene| scene.contact.as_mut().unwrap().friction = mu);
        compare_number(scheme, friction, ("contact.friction", 0.4, 0.4), (12, 1e-6));
        let motion = |a: f64| {
            with(&|scene| {
                let displacement = ["0.1*t".into(), "0.2*t".into(), format!("-A*t where A = {a:?}")];
                let motion = serde_json::json!({ "displacement": displacement });
                scene.body[0].pin[0].motion = Some(serde_json::from_value(motion).unwrap());
            })
        };
        compare_number(scheme, motion, ("body.upper.pin.0.motion.parameters.A", 0.1, 0.1), (12, 1e-6));
    }
    let of_slope = |f: f64| {
        let law = "friction = 0.4\nfriction_iterations = 1\nthreshold_speed = 0.2";
        let mut scene = slope("implicit-euler", law);
        let motion = serde_json::json!({ "velocity": [0.1 * f, 0.2 * f] });
        scene.obstacle[0].motion = Some(serde_json::from_value(motion).unwrap());
        scene
    };
    compare_number("slope", of_slope, ("obstacle.slope.motion.factor", 1.0, 1.0), (20, 1e-6));
}

// Implicit Euler's friction goes by the way of what is moved in a step, and not by its speed at the end.
#[test]
fn friction_on_what_speeds_up_and_turns_has_the_derivatives_of_its_steps() {
    let moved = |motion: serde_json::Value| {
        let mut scene = slope("implicit-euler", "friction = 0.4\nthreshold_speed = 0.2");
        scene.obstacle[0].motion = Some(serde_json::from_value(motion).unwrap());
        scene
    };
    let factor = |f: f64| {
        let displacement = [format!("{f:?}*(0.1*t - 20*t^2)"), format!("{f:?}*(0.1*t + 3*t^2)")];
        moved(serde_json::json!({ "displacement": displacement }))
    };
    compare("speeds up", &factor(1.0), 20, 1e-6);
    compare_with_tangents("speeds up", &factor(1.0), 20);
    compare_number("speeds up", factor, ("obstacle.slope.motion.factor", 1.0, 1.0), (20, 1e-6));
    let names = &["obstacle.slope.motion.factor"];
    by_parameters::compare("speeds up", &factor(1.0), names, 20);
    let turning = moved(serde_json::json!({ "rotation": { "point": [0.05, 0.0], "angle": "t + 30*t^2" } }));
    compare("turns", &turning, 20, 1e-6);
    compare_with_tangents("turns", &turning, 20);
}

#[test]
fn friction_that_does_not_settle_is_counted_or_refused() {
    let found = |scheme: &str, law: &str, steps| {
        let mut simulation = assembled(&dragged_cubes(scheme, law)).0;
        gradient(
            &mut simulation,
            steps,
            &mut |_: &LossFrame<'_>, _: &mut [f64], _: &mut [f64]| 0.0,
            &mut [],
            0,
        )
    };
    let unsettled = |law: &str| found("implicit-euler", law, 12).unwrap().unsettled;
    assert_eq!(unsettled("friction = 0.4"), 0);
    // Of a tolerance of rounding, two renewals are too few; steps that are taken again are counted once.
    let few = unsettled("friction = 0.4\nfriction_iterations = 2");
    assert!((1..=12).contains(&few), "{few}");
    assert_eq!(unsettled("friction = 0.4\nfriction_iterations = 1"), 0, "never renewed");
    let scene = slope("velocity-verlet", "friction = 0.4");
    let mut simulation = assembled(&scene).0;
    let mut loss = |_: &LossFrame<'_>, _: &mut [f64], _: &mut [f64]| 0.0;
    let error = gradient(&mut simulation, 1, &mut loss, &mut [], UNLIMITED).unwrap_err();
    assert!(error.to_string().contains("friction of a given `threshold_speed`"), "{error}");
}

/// The same scene with a grid of another size and of an origin that goes with it as its first body.
fn sized<const D: usize>(mut scene: Scene, cells: [u32; D], size: [f64; D], origin: [f64; D]) -> Scene {
    let grid = serde_json::json!({
        "grid": { "cells": cells.to_vec(), "size": size.to_vec(), "origin": origin.to_vec() }
    });
    scene.body[0].mesh = serde_json::from_value(grid).unwrap();
    scene
}

/// The block of [`slope`] or of [`PRESSED`], its shape changed by `h`.
fn stretched(scene: Scene, h: f64) -> Scene {
    sized(scene, [2, 2], [0.1 + h, 0.1 - 0.4 * h], [-0.3 * h, 0.0015])
}

/// The upper cube of [`cubes`], its shape changed by `h`.
fn stretched_cube(scene: Scene, h: f64) -> Scene {
    sized(scene, [1; 3], [0.1 + h, 0.1 + 0.5 * h, 0.1 - 0.7 * h], [0.0, 0.0, 0.7 * h])
}

// Areas that contact stands for are those of the shape at rest.
#[test]
fn shapes_at_rest_have_derivatives_where_surfaces_touch() {
    let law = "friction = 0.4\nthreshold_speed = 0.2";
    let once = "friction = 0.4\nfriction_iterations = 1\nthreshold_speed = 0.2";
    for (scheme, law, steps) in [
        ("implicit-euler", "", 20),
        ("implicit-euler", law, 20),
        ("bdf2", once, 20),
        ("tr-bdf2", law, 20),
        ("velocity-verlet", law, 200),
    ] {
        let of = |h: f64| stretched(slope(scheme, law), h);
        compare_shape(&format!("slope, {scheme}, {law}"), of, ("block", 0.02), (steps, 1e-6));
        by_parameters::compare(&format!("{scheme}, {law}"), &of(0.0), &["body.block.rest"], steps);
    }
    for (scheme, law) in [("implicit-euler", law), ("tr-bdf2", once)] {
        let of = |h: f64| stretched_cube(dragged_cubes(scheme, law), h);
        compare_shape(&format!("cubes, {scheme}, {law}"), of, ("upper", 0.01), (12, 1e-6));
        by_parameters::compare(&format!("cubes, {scheme}, {law}"), &of(0.0), &["body.upper.rest"], 12);
    }
    for threshold in [2e-2, 2e-4] {
        let of = |h: f64| stretched(pressed(threshold), h);
        compare_shape(&format!("statics, {threshold}"), of, ("block", 0.02), (2, 1e-6));
    }
    // Walls, whose reach is given.
    let walls = |h: f64| {
        let mut scene = stretched(slope("implicit-euler", ""), h);
        scene.obstacle.clear();
        let wall = serde_json::json!({ "normal": [0.05, 1.0], "offset": 0.0 });
        scene.world.walls = serde_json::from_value(serde_json::json!([wall])).unwrap();
        scene
    };
    compare_shape("walls", walls, ("block", 0.02), (20, 1e-6));
}

fn scheme_named(name: &str) -> IntegratorSpec {
    let mut all = IntegratorSpec::ALL.iter();
    *all.find(|spec| spec.method().documentation.name == name).unwrap()
}

/// The cubes of [`dragged_cubes`] with these moduli and densities, the upper first, contact as stiff as they
/// say.
fn free_cubes(scheme: &str, law: &str, [upper, lower]: [[f64; 2]; 2]) -> Scene {
    let mut scene = dragged_cubes("implicit-euler", law);
    if scheme != "implicit-euler" {
        scene.time.integrator = scheme_named(scheme);
        scene.time.solver = Default::default();
    }
    scene.contact.as_mut().unwrap().stiffness = None;
    for body in &mut scene.body {
        let [young, density] = if body.name.as_deref() == Some("upper") { upper } else { lower };
        let material = serde_json::json!({ "neo-hookean": { "young": young, "poisson": 0.3 } });
        body.elastic = Some(serde_json::from_value(material).unwrap());
        body.mass = serde_json::from_value(serde_json::json!({ "density": density })).unwrap();
    }
    scene
}

// Without a `stiffness` contact is as stiff as the softer body, or as much as explicit steps bear, by masses
// and areas.
#[test]
fn moduli_and_masses_that_decide_how_stiff_contact_is_have_derivatives() {
    let law = "friction = 0.4\nthreshold_speed = 0.2";
    let explicit = |scene: Scene, step: f64| {
        let mut scene = scene;
        scene.time.step = Some(step);
        scene
    };
    for (young, what) in [([4e4, 1e5], "softer"), ([1e5, 4e4], "stiffer"), ([6e4, 6e4], "alike")] {
        let of = |upper: f64| free_cubes("implicit-euler", law, [[upper, 900.0], [young[1], 1200.0]]);
        let name = "body.upper.elastic.young";
        compare_number(what, of, (name, young[0], young[0]), (12, 1e-6));
        by_parameters::compare(what, &of(young[0]), &[name], 12);
    }
    // Moduli decide in small steps, masses in large ones.
    for (step, steps) in [(5e-5, 200), (4e-4, 25)] {
        let of = |[young, density]: [f64; 2]| {
            let scene = free_cubes("velocity-verlet", law, [[young, density], [6e4, 1200.0]]);
            explicit(scene, step)
        };
        let of_young = |young| of([young, 900.0]);
        compare_number("explicit", of_young, ("body.upper.elastic.young", 4e4, 4e4), (steps, 1e-6));
        let of_density = |density| of([4e4, density]);
        compare_number("explicit", of_density, ("body.upper.mass.density", 900.0, 900.0), (steps, 1e-6));
        let names = ["body.upper.elastic.young", "body.upper.mass.density", "body.lower.mass.density"];
        by_parameters::compare("explicit", &of([4e4, 900.0]), &names, steps);
    }
    // On a slope it is the block alone; of a material without a modulus masses decide in solved steps, too.
    for (scheme, material, step, steps) in [
        ("velocity-verlet", None, 2e-4, 200),
        ("implicit-euler", Some(serde_json::json!({ "dirichlet": { "stiffness": 1e3 } })), 2e-3, 20),
    ] {
        let of = |density: f64| {
            let mut scene = explicit(slope(scheme, law), step);
            scene.contact.as_mut().unwrap().stiffness = None;
            if let Some(material) = &material {
                scene.body[0].elastic = Some(serde_json::from_value(material.clone()).unwrap());
            }
            scene.body[0].mass = serde_json::from_value(serde_json::json!({ "density": density })).unwrap();
            scene
        };
        compare_number(scheme, of, ("body.block.mass.density", 1000.0, 1000.0), (steps, 1e-6));
    }
}

// Without a `distance` surfaces push from a thousandth of the size of the smallest body on, or from a quarter
// of the shortest edge.
#[test]
fn shapes_at_rest_decide_how_near_surfaces_touch() {
    let law = "friction = 0.4\nthreshold_speed = 0.2";
    let once = "friction = 0.4\nfriction_iterations = 1\nthreshold_speed = 0.2";
    let free = |mut scene: Scene| {
        scene.contact.as_mut().unwrap().distance = None;
        scene
    };
    // The lower of two bodies, so wide that the upper one decides.
    let wider = |mut scene: Scene, [x, y]: [f64; 2]| {
        let grid = serde_json::json!({
            "grid": { "cells": [1, 1, 1], "size": [0.2, 0.2, 0.1], "origin": [x, y, 0.0] }
        });
        scene.body[1].mesh = serde_json::from_value(grid).unwrap();
        scene
    };
    for (scheme, law, steps) in [
        ("implicit-euler", "", 20),
        ("implicit-euler", law, 20),
        ("bdf2", once, 20),
        ("velocity-verlet", law, 200),
    ] {
        let of = |h: f64| {
            let mut scene = free(stretched(slope(scheme, law), h));
            // Explicit steps bear no more so near.
            scene.contact.as_mut().unwrap().stiffness = Some(if steps == 20 { 1e5 } else { 1e4 });
            scene
        };
        compare_shape(&format!("slope, {scheme}, {law}"), of, ("block", 0.02), (steps, 1e-6));
        by_parameters::compare(&format!("{scheme}, {law}"), &of(0.0), &["body.block.rest"], steps);
    }
    for (scheme, law) in [("implicit-euler", law), ("tr-bdf2", once)] {
        let of = |h: f64| wider(free(stretched_cube(dragged_cubes(scheme, law), h)), [-0.05, -0.05]);
        compare_shape(&format!("cubes, {scheme}, {law}"), of, ("upper", 0.01), (12, 1e-6));
        by_parameters::compare(&format!("cubes, {scheme}, {law}"), &of(0.0), &["body.upper.rest"], 12);
    }
    // Edges that are nearly parallel cross each other.
    let crossing = PARALLEL.replace("0.052, 0.101, 0.102", "0.052, 0.0996, 0.1001");
    let edges = |h: f64| {
        let mut scene = free(Scene::from_toml(&crossing).unwrap());
        scene.contact.as_mut().unwrap().threshold_speed = Some(0.1);
        scene.time.solver.get_or_insert_default().tolerance = Some(1e-14);
        // One presses on the other, which stands.
        scene.world.gravity = Some([1.0, 0.5, -100.0].map(OverTime::Constant).to_vec());
        let pin = serde_json::json!([{ "half_space": { "normal": [0, 0, 1], "offset": 0 } }]);
        scene.body[1].pin = serde_json::from_value(pin).unwrap();
        let scene = sized(scene, [1; 3], [0.1 + h, 0.1 + 0.5 * h, 0.1 - 0.7 * h], [0.0; 3]);
        wider(scene, [-0.05, -0.1])
    };
    compare_shape("edges", edges, ("upper", 0.01), (8, 1e-6));
    by_parameters::compare("edges", &edges(0.0), &["body.upper.rest"], 8);
    let walls = |h: f64| {
        let mut scene = stretched(slope("implicit-euler", ""), h);
        (scene.obstacle, scene.contact) = (vec![], None);
        let wall = serde_json::json!({ "normal": [0.05, 1.0], "offset": 0.0 });
        scene.world.walls = serde_json::from_value(serde_json::json!([wall])).unwrap();
        scene
    };
    compare_shape("walls", walls, ("block", 0.02), (20, 1e-6));
}

/// A clip whose prongs are near each other at rest and close, its vertices moved by `h` along a direction
/// from places of which none are alike; keys of contact, and of the body.
fn clip(scheme: &str, h: f64, contact: &str, body: &str) -> Scene {
    let points = [
        [0.0, 0.0],
        [0.05, 0.0],
        [0.058, 0.0],
        [0.1, 0.0],
        [0.0, 0.02],
        [0.05, 0.02],
        [0.058, 0.021],
        [0.1, 0.02],
        [0.0, 0.1],
        [0.0507, 0.097],
        [0.0545, 0.1],
        [0.1, 0.103],
    ];
    let moved: Vec<f64> =
        points.as_flattened().iter().zip(scattered(24, 7.0)).map(|(x, d)| x + (1e-3 + h) * d).collect();
    let text = format!(
        "[world]
         gravity = [1.0, -9.81]
         [contact]
         {contact}
         [[body]]
         name = \"clip\"
         mesh = {{ inline = {{ points = {}, triangles = [
             [0, 1, 5], [0, 5, 4], [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [4, 5, 9], [4, 9, 8],
             [6, 7, 11], [6, 11, 10],
         ] }} }}
         elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}
         mass = {{ density = 1000.0 }}
         pin = [{{ vertices = [0, 1, 2, 3] }}]
         velocity = {{ per_vertex = [
             [0, 0], [0, 0], [0, 0], [0, 0], [0, 0], [0, 0], [0, 0], [0, 0],
             [0.4, 0.1], [0.4, 0.1], [-0.4, 0], [-0.4, 0],
         ] }}
         {body}",
        rows(&moved, 2)
    );
    scene(scheme, 2, [2e-3, 2e-4], &text)
}

// A body that is nearer to itself at rest than surfaces touch does so from nearer on, by its shape.
#[test]
fn shapes_at_rest_of_bodies_near_themselves_have_derivatives() {
    let law = "friction = 0.4\nthreshold_speed = 0.2";
    let once = "friction = 0.4\nfriction_iterations = 1\nthreshold_speed = 0.2";
    let (given, near) = ("distance = 4e-3\nstiffness = 1e5", "distance = 4e-3");
    for (scheme, contact, body, (size, steps)) in [
        ("implicit-euler", format!("{given}\n{law}"), "", (1e-3, 12)),
        ("implicit-euler", format!("{near}\n{law}"), "", (1e-3, 12)),
        // By radii, with the default distance.
        ("implicit-euler", law.into(), "contact = { radius = 2e-3 }", (1e-3, 12)),
        ("tr-bdf2", format!("{given}\n{once}"), "contact = { radius = 2e-3 }", (1e-3, 12)),
        ("velocity-verlet", format!("{near}\n{law}"), "", (1e-3, 120)),
        ("velocity-verlet", format!("{near}\n{law}"), "contact = { radius = 1e-3 }", (1e-3, 120)),
    ] {
        let what = format!("{scheme}, {contact}, {body}");
        let of = |h: f64| clip(scheme, h, &contact, body);
        expect_touching(&what, &of(0.0), (steps, 0));
        compare_shape(&what, of, ("clip", size), (steps, 1e-6));
        by_parameters::compare(&what, &of(0.0), &["body.clip.rest"], steps);
    }
}

/// Ends of a strand that is smaller than the box of [`littered`], and of one that is larger.
const SHORT: &str = "start = [0.02, 0.03, 0.1032], end = [0.07, 0.05, 0.1035]";
const LONG: &str = "start = [-0.05, 0.03, 0.1032], end = [0.15, 0.05, 0.1035]";

/// A box of tetrahedra of this material, its shape changed by `h`, on which a strand with these ends and one
/// of two particles fall that have thicknesses.
fn littered(scheme: &str, h: f64, contact: &str, material: &str, strand: &str) -> Scene {
    let text = format!(
        "[world]
         gravity = [0.5, 0.3, -9.81]
         [contact]
         {contact}
         [[body]]
         name = \"box\"
         mesh = {{ grid = {{ cells = [1, 1, 1], size = [{:?}, {:?}, {:?}], origin = [0, 0, {:?}] }} }}
         elastic = {material}
         mass = {{ density = 1000.0 }}
         pin = [{{ half_space = {{ normal = [0, 0, 1], offset = 0.03 }} }}]
         [[body]]
         name = \"strand\"
         mesh = {{ strand = {{ segments = 2, {strand} }} }}
         springs = {{ stiffness = 1e3 }}
         mass = {{ total = 2e-3 }}
         contact = {{ radius = 2e-3, self = false }}
         velocity = {{ rigid = {{ linear = [0.2, 0.1, -0.3] }} }}
         [[body]]
         name = \"grain\"
         mesh = {{ inline = {{ points = [[0.03, 0.07, 0.103], [0.3, 0.07, 0.103]] }} }}
         mass = {{ per_vertex = [2e-5, 4e-3] }}
         contact = {{ radius = 2e-3 }}
         velocity = {{ rigid = {{ linear = [0.1, 0.1, -0.3] }} }}",
        0.1 + h,
        0.1 + 0.5 * h,
        0.1 - 0.7 * h,
        0.7 * h
    );
    scene(scheme, 3, [2e-3, 1e-4], &text)
}

// Without a `stiffness` contact is as stiff as explicit steps bear, by masses and areas, which go by shapes;
// and so it is in solved steps where no material has a modulus.
#[test]
fn shapes_at_rest_that_decide_how_stiff_contact_is_have_derivatives() {
    let law = "friction = 0.4\nthreshold_speed = 0.2";
    let free = |mut scene: Scene, distance: Option<f64>| {
        let contact = scene.contact.as_mut().unwrap();
        (contact.stiffness, contact.distance) = (None, distance);
        scene
    };
    for distance in [Some(2e-3), None] {
        let of = |h: f64| free(stretched(slope("velocity-verlet", law), h), distance);
        compare_shape(&format!("slope, {distance:?}"), of, ("block", 0.02), (200, 1e-6));
        by_parameters::compare("slope", &of(0.0), &["body.block.rest"], 200);
    }
    let cubes = |h: f64| {
        let cubes = free_cubes("velocity-verlet", law, [[1e5, 900.0], [1e5, 1200.0]]);
        // Faces of different areas: none of the most mobile vertices are alike by chance.
        let mut scene = free(stretched_cube(cubes, 0.003 + h), Some(4e-3));
        scene.time.step = Some(2e-4);
        scene
    };
    expect_touching("cubes", &cubes(0.0), (100, 0));
    compare_shape("cubes", cubes, ("upper", 0.01), (100, 1e-6));
    by_parameters::compare("cubes", &cubes(0.0), &["body.upper.rest", "body.lower.rest"], 100);
    let rubber = "{ neo-hookean = { young = 1e5, poisson = 0.3 } }";
    let shapeless = "{ dirichlet = { stiffness = 2e4 } }";
    // Widths of wires and particles go by the default distance, and that by the smallest body.
    for (scheme, contact, material, strand, steps) in [
        ("velocity-verlet", "distance = 2e-3", rubber, SHORT, 200),
        ("velocity-verlet", "", rubber, SHORT, 200),
        ("velocity-verlet", "", rubber, LONG, 200),
        ("implicit-euler", "", rubber, SHORT, 12),
        ("implicit-euler", "", rubber, LONG, 12),
        ("implicit-euler", "", shapeless, LONG, 12),
        ("implicit-euler", "distance = 2e-3", shapeless, SHORT, 12),
        ("tr-bdf2", "distance = 2e-3", shapeless, SHORT, 12),
    ] {
        // Friction of impacts that are over in one step does not settle in two stages.
        let law = if scheme == "tr-bdf2" { "" } else { law };
        let contact = format!("{contact}\n{law}");
        let what = format!("littered, {scheme}, {contact}, {material}, {strand}");
        let of = |h: f64| littered(scheme, h, &contact, material, strand);
        expect_touching(&what, &of(0.0), (steps, usize::from(!law.is_empty())));
        compare_shape(&what, of, ("box", 0.01), (steps, 1e-6));
        // Of few steps little goes by the mass of what falls.
        let names = &["body.box.rest", "body.grain.mass.per_vertex"][..if steps > 100 { 2 } else { 1 }];
        by_parameters::compare(&what, &of(0.0), names, steps);
    }
    // Of a material without a modulus on a slope, of second order and in quadrilaterals. A stiffer one collapses
    // within these steps, and steps are halved where it does: a run that is not smooth in the shape.
    for (order, cells) in [(1, "triangle"), (2, "triangle"), (1, "quadrilateral")] {
        let of = |h: f64| {
            let distance = (cells != "triangle").then_some(2e-3);
            let mut scene = free(stretched(slope("implicit-euler", law), h), distance);
            let material = serde_json::json!({ "dirichlet": { "stiffness": 200.0 } });
            scene.body[0].elastic = Some(serde_json::from_value(material).unwrap());
            scene.body[0].order = Some(order);
            if cells != "triangle" {
                let grid = serde_json::json!({ "grid": {
                    "cells": [2, 2], "size": [0.1 + h, 0.1 - 0.4 * h], "origin": [-0.3 * h, 0.0015],
                    "element": cells
                } });
                scene.body[0].mesh = serde_json::from_value(grid).unwrap();
            }
            scene
        };
        expect_touching(cells, &of(0.0), (20, 0));
        compare_shape(&format!("slope, {order}, {cells}"), of, ("block", 0.02), (20, 1e-6));
        by_parameters::compare("slope", &of(0.0), &["body.block.rest", "body.block.mass.density"], 20);
    }
}

// Without a `distance` surfaces with a thickness push from a thousandth of the size of the smallest body on.
#[test]
fn shapes_at_rest_decide_how_near_thick_surfaces_touch() {
    let law = "friction = 0.4\nthreshold_speed = 0.2";
    let thick = |mut scene: Scene| {
        scene.contact.as_mut().unwrap().distance = None;
        scene.body[0].contact = Some(BodyContactSpec { radius: Some(1e-3), ..BodyContactSpec::default() });
        scene
    };
    for (scheme, stiffness, steps) in
        [("implicit-euler", Some(1e5), 20), ("velocity-verlet", None, 200), ("bdf2", None, 20)]
    {
        let of = |h: f64| {
            let mut scene = thick(stretched(slope(scheme, law), h));
            scene.contact.as_mut().unwrap().stiffness = stiffness;
            scene
        };
        compare_shape(&format!("slope, {scheme}"), of, ("block", 0.02), (steps, 1e-6));
        by_parameters::compare(scheme, &of(0.0), &["body.block.rest"], steps);
    }
    let of = |h: f64| {
        let mut scene = thick(stretched_cube(dragged_cubes("implicit-euler", law), h));
        let grid = serde_json::json!({
            "grid": { "cells": [1, 1, 1], "size": [0.2, 0.2, 0.1], "origin": [-0.05, -0.05, 0.0] }
        });
        scene.body[1].mesh = serde_json::from_value(grid).unwrap();
        scene
    };
    compare_shape("cubes", of, ("upper", 0.01), (12, 1e-6));
}

// Without a `threshold_speed` it is a thousandth of the size of all bodies at rest in a second.
#[test]
fn shapes_at_rest_decide_the_threshold_speed_of_friction() {
    let slowly = PRESSED.replace("duration = 2.0", "duration = 4.0").replace("step = 1.0", "step = 2.0");
    let slowly =
        slowly.replace("-100*t", "-50*t").replacen("stiffness = 1e5", "stiffness = 1e5\nfriction = 0.3", 1);
    let of = |h: f64| stretched(Scene::from_toml(&slowly).unwrap(), h);
    compare_shape("statics", of, ("block", 0.02), (2, 1e-6));
    by_parameters::compare("statics", &of(0.0), &["body.block.rest"], 2);
    let of = |h: f64| {
        let mut scene = stretched(slope("implicit-euler", "friction = 0.4"), h);
        // Slower than the threshold, which goes by this body, too.
        let far = serde_json::json!({
            "name": "far",
            "mesh": { "inline": { "points": [[60.0, 90.0]] } },
            "mass": { "total": 1.0 },
            "contact": { "collides": false }
        });
        scene.body.push(serde_json::from_value(far).unwrap());
        scene
    };
    compare_shape("beside another", of, ("block", 0.02), (20, 1e-6));
    by_parameters::compare("beside another", &of(0.0), &["body.block.rest"], 20);
}

// Derivatives by numbers of bodies in contact, and by those of contact itself.
#[test]
fn numbers_of_contact_have_derivatives() {
    for scheme in ["implicit-euler", "tr-bdf2"] {
        let with = |change: &dyn Fn(&mut Scene)| {
            let mut scene = dragged_cubes(scheme, "friction = 0.4\nthreshold_speed = 0.02");
            change(&mut scene);
            scene
        };
        let stiffness = |kappa| with(&|scene| scene.contact.as_mut().unwrap().stiffness = Some(kappa));
        compare_number(scheme, stiffness, ("contact.stiffness", 1e5, 1e5), (12, 1e-6));
        let friction = |mu| with(&|scene| scene.contact.as_mut().unwrap().friction = mu);
        compare_number(scheme, friction, ("contact.friction", 0.4, 0.4), (12, 1e-6));
        let young = |young| {
            with(&|scene| {
                let Some(MaterialSpec::NeoHookean(solid)) = &mut scene.body[0].elastic else { panic!() };
                solid.young = young;
            })
        };
        compare_number(scheme, young, ("body.upper.elastic.young", 1e5, 1e5), (12, 1e-6));
        let motion = |f: f64| {
            with(&|scene| {
                let displacement = [0.1, 0.2, -0.1].map(|speed| format!("{f:?}*{speed:?}*t"));
                let motion = serde_json::json!({ "displacement": displacement });
                scene.body[0].pin[0].motion = Some(serde_json::from_value(motion).unwrap());
            })
        };
        compare_number(scheme, motion, ("body.upper.pin.0.motion.factor", 1.0, 1.0), (12, 1e-6));
    }
    // A slope that comes up to the block.
    for (scheme, steps) in [("implicit-euler", 20), ("velocity-verlet", 200)] {
        let of_slope = |f: f64| {
            let mut scene = slope(scheme, "");
            let motion = serde_json::json!({ "velocity": [0.0, 0.2 * f] });
            scene.obstacle[0].motion = Some(serde_json::from_value(motion).unwrap());
            scene
        };
        compare_number(scheme, of_slope, ("obstacle.slope.motion.factor", 1.0, 1.0), (steps, 1e-6));
    }
    // Where one body collides and no stiffness is given, it is as stiff as the body.
    let of_modulus = |young| {
        let mut scene = slope("implicit-euler", "");
        scene.contact.as_mut().unwrap().stiffness = None;
        let Some(MaterialSpec::NeoHookean(solid)) = &mut scene.body[0].elastic else { panic!() };
        solid.young = young;
        scene
    };
    compare_number("as stiff", of_modulus, ("body.block.elastic.young", 1e5, 1e5), (20, 1e-6));
    for (scheme, steps) in [("velocity-verlet", 200), ("implicit-euler", 20)] {
        let of_density = |density: f64| {
            let mut scene = slope(scheme, "");
            scene.body[0].mass = MassSpec::Density(density.into());
            scene
        };
        compare_number(scheme, of_density, ("body.block.mass.density", 1e3, 1e3), (steps, 1e-6));
    }
}

#[test]
fn numbers_of_contact_are_parameters_where_all_pairs_share_them() {
    let has = |law: &str, name: &str| {
        let scene = cubes("implicit-euler", law);
        names(&scene, &assembled(&scene).1).iter().any(|known| known == name)
    };
    assert!(has("friction = 0.4", "contact.friction") && has("friction = 0.4", "contact.stiffness"));
    assert!(!has("", "contact.friction"), "nothing rubs");
    let pair = "friction = 0.4\npairs = [{ between = [\"upper\", \"lower\"], friction = 0.1 }]";
    assert!(!has(pair, "contact.friction") && has(pair, "contact.stiffness"));
}

// Two squares that meet and rub, one the mirror image of the other, and a loss that the mirror leaves alone.
#[test]
fn gradients_of_mirror_images_are_mirror_images() {
    for (scheme, step, steps) in [("implicit-euler", 2e-3, 15), ("velocity-verlet", 2e-4, 150)] {
        let body = |name: &str, side: f64, triangles: &str| {
            let point = |x: f64, y: f64| format!("[{:?}, {y:?}]", side * x);
            let points = [point(1e-3, 0.0), point(0.1, 0.0), point(0.1, 0.1), point(1.2e-3, 0.1)].join(", ");
            format!(
                "[[body]]
                 name = \"{name}\"
                 mesh = {{ inline = {{ points = [{points}], triangles = {triangles} }} }}
                 elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}
                 mass = {{ density = 1000.0 }}
                 velocity = {{ rigid = {{ linear = [{:?}, 0.1], angular = {:?} }} }}\n",
                side * -0.3,
                side * 2.0
            )
        };
        let text = format!(
            "dimension = 2
             [time]
             integrator = \"{scheme}\"
             duration = 0.1
             step = {step:?}
             [contact]
             distance = 2e-3
             stiffness = 1e5
             friction = 0.3
             threshold_speed = 0.1\n{}{}",
            body("right", 1.0, "[[0, 1, 2], [0, 2, 3]]"),
            body("left", -1.0, "[[0, 2, 1], [0, 3, 2]]"),
        );
        let scene = Scene::from_toml(&text).unwrap();
        let mut alone = assembled(&scene).0;
        let touched = (0..steps).filter(|_| {
            alone.step().unwrap();
            touching(&alone) > 0
        });
        assert!(touched.count() > 0, "{scheme}: nothing touches");
        let mut simulation = assembled(&scene).0;
        let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
            if frame.step < steps {
                return 0.0;
            }
            (x_bar[4], x_bar[12], x_bar[7], x_bar[15]) = (1.0, -1.0, 2.0, 2.0);
            frame.x[4] - frame.x[12] + 2.0 * (frame.x[7] + frame.x[15])
        };
        let found = gradient(&mut simulation, steps, &mut loss, &mut [], UNLIMITED).unwrap();
        for rows in [&found.position, &found.velocity] {
            let (right, left) = rows.split_at(8);
            let mirrored: Vec<f64> = left.chunks_exact(2).flat_map(|row| [-row[0], row[1]]).collect();
            compare_numbers(scheme, &mirrored, right, 1e-10);
        }
    }
}

// A block that falls on a slope, slides and comes to rest; the pairs of each state, and how they rub.
#[test]
fn changes_of_contacts_are_counted() {
    let scene = slope("implicit-euler", "friction = 0.6");
    let steps = 60;
    let pairs = |simulation: &Simulation| {
        let state = simulation.state();
        let terms = simulation.system().terms().iter().filter_map(|term| term.touching());
        terms.flat_map(|term| term.pairs(state.x(), state.v())).collect::<Vec<_>>()
    };
    let mut simulation = assembled(&scene).0;
    let mut counts = [0; 4];
    let mut before = pairs(&simulation);
    for _ in 0..steps {
        simulation.step().unwrap();
        let after = pairs(&simulation);
        let of = |pairs: &[TouchingPair], pair: &TouchingPair| {
            pairs.iter().find(|other| other.vertices == pair.vertices).map(|other| other.slides)
        };
        counts[0] += after.iter().filter(|pair| of(&before, pair).is_none()).count() as u64;
        counts[1] += before.iter().filter(|pair| of(&after, pair).is_none()).count() as u64;
        for (i, slides) in [true, false].into_iter().enumerate() {
            let changed = |pair: &&TouchingPair| of(&before, pair) == Some(Some(!slides));
            counts[2 + i] += after.iter().filter(|p| p.slides == Some(slides)).filter(changed).count() as u64;
        }
        assert_eq!(after.len(), touching(&simulation));
        before = after;
    }
    let count = |budget: usize| {
        let mut nothing = |_: &LossFrame<'_>, _: &mut [f64], _: &mut [f64]| 0.0;
        let found = gradient(&mut assembled(&scene).0, steps, &mut nothing, &mut [], budget).unwrap();
        let ContactEvents { come, left, slid, stuck } = found.contact_events;
        [come, left, slid, stuck]
    };
    assert_eq!(count(UNLIMITED), counts);
    assert_eq!(count(0), counts);
    assert!(counts[0] > 0 && counts[1] > 0 && counts[2] + counts[3] > 0, "{counts:?}");
}
