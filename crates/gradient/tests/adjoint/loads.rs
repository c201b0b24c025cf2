//! Loads of a beam: derivatives by what the scene gives, against differences.

use pliant_scene::Scene;
use serde_json::{Value, json};

use crate::differences::compare_number;
use crate::solid::{Further, scene};
use crate::support::case;

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
