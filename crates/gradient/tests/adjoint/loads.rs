//! Loads and prescribed motion of a beam: derivatives by what the scene gives, against differences.

use pliant::expression::Variable;
use pliant_scene::{OverTime, Scene};
use serde_json::{Value, json};

use crate::by_parameters::compare;
use crate::differences::compare_number;
use crate::solid::{Further, scene};
use crate::support::{case, schemes};

/// The beam of the reference under this load.
fn loaded(scheme: &str, load: Value) -> Scene {
    let mut loaded = scene(&case("beam")["setup"], "neo-hookean", scheme, 20, Further::default());
    loaded.body[0].load = vec![serde_json::from_value(load).unwrap()];
    loaded
}

#[test]
fn values_of_loads_have_derivatives() {
    for scheme in ["velocity-verlet", "implicit-euler", "bdf2"] {
        for key in ["force", "force_per_vertex", "body_force", "traction"] {
            let name = format!("body.beam.load.0.{key}");
            let of_value = |x: f64| loaded(scheme, json!({ key: [x, "-300*cos(20*t)*(1 + X)"] }));
            compare_number(scheme, of_value, (&name, 70.0, 500.0), (20, 1e-7));
        }
        let of_pressure = |p: f64| loaded(scheme, json!({ "pressure": p }));
        compare_number(scheme, of_pressure, ("body.beam.load.0.pressure", 900.0, 900.0), (20, 1e-7));
    }
}

#[test]
fn factors_of_loads_have_derivatives() {
    let factor = ("body.beam.load.0.factor", 1.0, 1.0);
    for scheme in ["velocity-verlet", "tr-bdf2"] {
        let of_force =
            |f: f64| loaded(scheme, json!({ "force": ["0", format!("{f:?}*300*sin(20*t)*(1 + X)")] }));
        compare_number(scheme, of_force, factor, (20, 1e-7));
        let of_pressure = |f: f64| loaded(scheme, json!({ "pressure": format!("{f:?}*900*sin(20*t)") }));
        compare_number(scheme, of_pressure, factor, (20, 1e-7));
    }
}

// By what a formula names: a factor, a rate in time, an exponent in place, in one component or in both.
#[test]
fn numbers_in_formulas_of_loads_have_derivatives() {
    for scheme in ["velocity-verlet", "tr-bdf2", "bdf2"] {
        let force = |a: f64, w: f64, n: f64| {
            let x = format!("A*sin(w*t) where A = {a:?}, w = {w:?}");
            let y = format!("-A*X^n where n = {n:?}, A = {a:?}");
            loaded(scheme, json!({ "traction": [x, y] }))
        };
        let name = |number: &str| format!("body.beam.load.0.parameters.{number}");
        compare_number(scheme, |a| force(a, 20.0, 1.5), (&name("A"), 900.0, 900.0), (20, 1e-7));
        compare_number(scheme, |w| force(900.0, w, 1.5), (&name("w"), 20.0, 20.0), (20, 1e-7));
        compare_number(scheme, |n| force(900.0, 20.0, n), (&name("n"), 1.5, 1.5), (20, 1e-7));
        let pressure =
            |p: f64| loaded(scheme, json!({ "pressure": format!("p*(1 + 20*t) where p = {p:?}") }));
        compare_number(scheme, pressure, (&name("p"), 900.0, 900.0), (20, 1e-7));
    }
}

/// The beam of the reference, its pin and what else it names as given.
fn moved(scheme: &str, pin: Value, change: impl Fn(&mut Scene)) -> Scene {
    let mut moved = scene(&case("beam")["setup"], "neo-hookean", scheme, 20, Further::default());
    moved.body[0].pin[0].motion = Some(serde_json::from_value(pin).unwrap());
    change(&mut moved);
    moved
}

// Held places and velocities are in forces, in damping, and in the loss.
#[test]
fn factors_of_motions_have_derivatives() {
    let factor = ("body.beam.pin.0.motion.factor", 1.0, 1.0);
    for scheme in ["velocity-verlet", "rk4", "sdirk2", "bdf2", "newmark(.3025,.6)", "gauss2"] {
        let of_motion = |f: f64| {
            let motion = json!({
                "velocity": [0.1 * f, 0.2 * f],
                "displacement": ["0", format!("{f:?}*0.05*sin(12*t)*(1 + Y)")],
                "keyframes": { "times": [0.0, 0.3], "displacements": [[0.0, 0.0], [0.01 * f, 0.0]] },
            });
            moved(scheme, motion, |scene| {
                let damping = json!({ "stiffness_proportional": 0.004, "mass_proportional": 0.5 });
                scene.body[0].damping = Some(serde_json::from_value(damping).unwrap());
            })
        };
        compare_number(scheme, of_motion, factor, (20, 1e-7));
    }
    // One coordinate moves, and the others are put back by a wall as it goes.
    let at_wall = |f: f64| {
        let motion = json!({ "displacement": ["0", format!("-{f:?}*0.5*t")] });
        moved("velocity-verlet", motion, |scene| {
            scene.body[0].pin[0].axes = Some(serde_json::from_value(json!(["y"])).unwrap());
            let wall = json!({ "normal": [1.0, 0.4], "offset": 0.02 });
            scene.world.walls = vec![serde_json::from_value(wall).unwrap()];
        })
    };
    compare_number("at a wall", at_wall, factor, (20, 1e-7));
    let of_statics =
        |f: f64| moved("quasi-static", json!({ "displacement": [format!("{f:?}*0.1*t"), "0"] }), |_| {});
    compare_number("statics", of_statics, factor, (2, 1e-7));
}

#[test]
fn tangents_by_numbers_of_motions_are_the_transpose_of_gradients() {
    let motion = json!({
        "velocity": [0.1, 0.2],
        "displacement": [
            "A*smoothstep(0, T, t) where A = 0.1, T = 0.33",
            "A*t*(1 + Y)^n where n = 1.5, A = 0.1",
        ],
    });
    let damping = json!({ "stiffness_proportional": 0.004, "mass_proportional": 0.5 });
    let names = ["factor", "parameters.A", "parameters.T", "parameters.n"];
    let names = names.map(|key| format!("body.beam.pin.0.motion.{key}"));
    let names: Vec<&str> = names.iter().map(|name| &name[..]).collect();
    for scheme in schemes() {
        let scene = moved(scheme, motion.clone(), |scene| {
            if scheme != "quasi-static" && scheme != "linearised-implicit-euler" {
                scene.body[0].damping = Some(serde_json::from_value(damping.clone()).unwrap());
            }
        });
        let steps = if scheme == "quasi-static" { 2 } else { 12 };
        compare(scheme, &scene, &names, steps);
    }
    // One coordinate moves, and the others are put back by a wall as it goes.
    let motion = json!({ "displacement": ["0", "-A*t where A = 0.5"] });
    let at_wall = moved("velocity-verlet", motion, |scene| {
        scene.body[0].pin[0].axes = Some(serde_json::from_value(json!(["y"])).unwrap());
        let wall = json!({ "normal": [1.0, 0.4], "offset": 0.02 });
        scene.world.walls = vec![serde_json::from_value(wall).unwrap()];
    });
    compare("at a wall", &at_wall, &names[..2], 20);
}

// By a number of one component or of both, of time, of place; in statics, and of gravity.
#[test]
fn numbers_in_formulas_of_motions_and_of_gravity_have_derivatives() {
    let name = |number: &str| format!("body.beam.pin.0.motion.parameters.{number}");
    for scheme in ["velocity-verlet", "rk4", "sdirk2", "bdf2", "newmark(.3025,.6)", "gauss2"] {
        let of_motion = |a: f64, end: f64, n: f64| {
            let x = format!("A*smoothstep(0, T, t) where A = {a:?}, T = {end:?}");
            let y = format!("A*t*(1 + Y)^n where n = {n:?}, A = {a:?}");
            moved(scheme, json!({ "velocity": [0.1, 0.0], "displacement": [x, y] }), |scene| {
                let damping = json!({ "stiffness_proportional": 0.004 });
                scene.body[0].damping = Some(serde_json::from_value(damping).unwrap());
            })
        };
        compare_number(scheme, |a| of_motion(a, 0.33, 1.5), (&name("A"), 0.1, 0.1), (20, 1e-7));
        compare_number(scheme, |end| of_motion(0.1, end, 1.5), (&name("T"), 0.33, 0.1), (20, 1e-7));
        compare_number(scheme, |n| of_motion(0.1, 0.33, n), (&name("n"), 1.5, 1.5), (20, 1e-7));
        let of_gravity = |a: f64, w: f64| {
            let mut weighed = scene(&case("beam")["setup"], "neo-hookean", scheme, 20, Further::default());
            let [x, y] = [format!("A*sin(w*t) where A = {a:?}, w = {w:?}"), format!("-A where A = {a:?}")];
            weighed.world.gravity = Some([x, y].map(|text| over_time(&text)).to_vec());
            weighed
        };
        let name = |number: &str| format!("world.gravity.parameters.{number}");
        compare_number(scheme, |a| of_gravity(a, 30.0), (&name("A"), 9.81, 9.81), (20, 1e-7));
        compare_number(scheme, |w| of_gravity(9.81, w), (&name("w"), 30.0, 30.0), (20, 1e-7));
    }
    let of_statics = |a: f64, g: f64| {
        moved("quasi-static", json!({ "displacement": [format!("A*t where A = {a:?}"), "0"] }), |scene| {
            let weight = over_time(&format!("-A*(1 + t) where A = {g:?}"));
            scene.world.gravity = Some(vec![OverTime::Constant(0.0), weight]);
        })
    };
    compare_number("statics", |a| of_statics(a, 9.81), (&name("A"), 0.1, 0.1), (2, 1e-7));
    let weight = ("world.gravity.parameters.A", 9.81, 9.81);
    compare_number("statics", |g| of_statics(0.1, g), weight, (2, 1e-7));
}

/// A formula of time.
fn over_time(text: &str) -> OverTime {
    OverTime::parse(&[], Variable::TIME, text).unwrap()
}
