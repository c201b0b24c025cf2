//! Surfaces that touch: gradients against central differences of the program's own runs.

use pliant::energy::TouchingPair;
use pliant::integrator::IntegratorSpec;
use pliant::material::MaterialSpec;
use pliant::simulation::Simulation;
use pliant_gradient::{ContactEvents, LossFrame, ParameterSelection, UNLIMITED, gradient, names};
use pliant_scene::{ContactSpec, MassSpec, OverTime, Scene};

use crate::by_parameters;
use crate::differences::{compare_number, compare_shape, compare_starts};
use crate::solid::assembled;
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

// Defaults of contact have no derivatives: what decides them says which of them to give.
#[test]
fn numbers_that_decide_defaults_of_contact_are_refused() {
    let all = |scene: &Scene| names(scene, &assembled(scene).1);
    let has = |scene: &Scene, key: &str| all(scene).contains(&format!("body.block.{key}"));
    let keys = ["elastic.young", "elastic.poisson", "mass.density", "rest"];
    for (scheme, by_density) in [("implicit-euler", true), ("velocity-verlet", false)] {
        let mut scene = slope(scheme, "friction = 0.4\nthreshold_speed = 0.2");
        let refuses = |what: &str, key: &str, change: &dyn Fn(&mut ContactSpec)| {
            let mut free = scene.clone();
            change(free.contact.as_mut().unwrap());
            assert!(!has(&free, key), "{scheme}: {key} without {what}");
            let (simulation, topology) = assembled(&free);
            let name = format!("body.block.{key}");
            let select = ParameterSelection::new(&free, &topology, simulation.numbering(), &[&name]);
            let error = select.err().unwrap().to_string();
            assert!(error.contains(&format!("give `{what}` in [contact]")), "{error}");
        };
        refuses("stiffness", "elastic.young", &|contact| contact.stiffness = None);
        refuses("distance", "rest", &|contact| contact.distance = None);
        refuses("threshold_speed", "rest", &|contact| contact.threshold_speed = None);
        if !by_density {
            refuses("stiffness", "mass.density", &|contact| contact.stiffness = None);
        }
        assert_eq!(keys.map(|key| has(&scene, key)), [true; 4], "{scheme}");
        scene.contact.as_mut().unwrap().stiffness = None;
        assert_eq!(has(&scene, "mass.density"), by_density, "{scheme}");
        assert!(has(&scene, "elastic.poisson"), "{scheme}");
    }
    let mut free = slope("velocity-verlet", "");
    let material = serde_json::json!({ "mooney-rivlin": { "c10": 2e4, "c01": 1e4, "poisson": 0.4 } });
    free.body[0].elastic = Some(serde_json::from_value(material).unwrap());
    assert!(has(&free, "elastic.c10"));
    free.contact.as_mut().unwrap().stiffness = None;
    assert!(!has(&free, "elastic.c10"));
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
    assert!(error.to_string().contains("friction with a given `threshold_speed`"), "{error}");
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

/// Ends of a strand.
const SHORT: &str = "start = [0.02, 0.03, 0.1032], end = [0.07, 0.05, 0.1035]";

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

// Wires and particles are as wide as contact reaches.
#[test]
fn shapes_at_rest_have_derivatives_where_wires_and_particles_touch() {
    let rubber = "{ neo-hookean = { young = 1e5, poisson = 0.3 } }";
    for (scheme, law, stiffness, strand, steps) in [
        ("velocity-verlet", "friction = 0.4\nthreshold_speed = 0.2", 1e4, SHORT, 200),
        ("implicit-euler", "friction = 0.4\nthreshold_speed = 0.2", 2e3, SHORT, 12),
        // Friction of impacts that are over in one step does not settle in two stages.
        ("tr-bdf2", "", 2e3, SHORT, 12),
    ] {
        let contact = format!("distance = 2e-3\nstiffness = {stiffness:?}\n{law}");
        let of = |h: f64| littered(scheme, h, &contact, rubber, strand);
        expect_touching(scheme, &of(0.0), (steps, usize::from(!law.is_empty())));
        compare_shape(scheme, of, ("box", 0.01), (steps, 1e-6));
        by_parameters::compare(scheme, &of(0.0), &["body.box.rest"], steps);
    }
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
