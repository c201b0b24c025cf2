//! Membranes: sheets of finite elements in space.

use pliant::simulation::Simulation;
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;
use serde_json::{Value, json};

use crate::support::{advance, assert_relative};

fn simulation(scene: &Value) -> Simulation {
    let scene: Scene = serde_json::from_value(scene.clone()).unwrap();
    scene.assemble(UnstableStep::Refuse).map_err(|p| format!("{p:?}")).unwrap().simulation
}

/// A sphere of radius 0.1 m and thickness 1 mm of neo-Hookean rubber, E = 1 MPa, blown up slowly by
/// `pressure` [Pa]: its volume, its area and the mean of the two principal stresses in its skin, by area;
/// and how thick it is.
fn blown_up(cells: usize, poisson: f64, pressure: f64) -> [f64; 4] {
    let mut simulation = simulation(&json!({
        "dimension": 3,
        "time": { "integrator": "symplectic-euler", "step": 5e-5, "duration": 1.0 },
        "body": [{
            "mesh": { "sphere": { "radius": 0.1, "cells": cells } },
            "elastic": { "neo-hookean": { "young": 1e6, "poisson": poisson } },
            "membrane": { "thickness": 1e-3 },
            "damping": { "mass_proportional": 300.0 },
            "mass": { "density": 1000.0 },
            "load": [{ "pressure": -pressure }],
        }],
    }));
    let spec = json!({ "sphere": { "radius": 0.1, "cells": cells } });
    let mesh = pliant_mesh::build(&serde_json::from_value(spec).unwrap(), 3, ".".as_ref()).unwrap();
    advance(&mut simulation, 3000);
    let x = simulation.positions();
    let point = |v: u32| [0, 1, 2].map(|c| x[3 * v as usize + c]);
    let (mut volume, mut area, mut stress, mut thickness) = (0.0, 0.0, 0.0, 0.0);
    for (triangle, state) in mesh.triangles.iter().zip(simulation.element_states()) {
        let [a, b, c] = triangle.map(point);
        let (e, f) = ([0, 1, 2].map(|i| b[i] - a[i]), [0, 1, 2].map(|i| c[i] - a[i]));
        let n = [0, 1, 2].map(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            0.5 * (e[j] * f[k] - e[k] * f[j])
        });
        let own = n.iter().map(|n| n * n).sum::<f64>().sqrt();
        volume += (0..3).map(|i| a[i] * n[i]).sum::<f64>() / 3.0;
        area += own;
        let h = 1e-3 * state.principal_stretches()[2];
        // Free faces: the trace is that of the stress in the skin.
        stress += own * h * 0.5 * state.cauchy_stress().trace();
        thickness += own * h;
    }
    [volume, area, stress / thickness, thickness / area]
}

// The wall of a thin sphere under pressure: sigma = p r / (2 h). For the polyhedron it is an identity with r
// = 3 V / A: blow it up a little by a factor, and the work of the stresses is that of the pressure.
#[test]
fn a_sphere_under_pressure_has_the_stress_of_a_thin_wall() {
    let pressure = 200.0;
    let [volume, area, stress, thickness] = blown_up(4, 0.3, pressure);
    assert_relative(stress, pressure * 3.0 * volume / (2.0 * area * thickness), 1e-4, "of the polyhedron");
    let radius = (3.0 * volume / (4.0 * std::f64::consts::PI)).cbrt();
    assert_relative(stress, pressure * radius / (2.0 * thickness), 0.03, "of the sphere");
    // It is 1 % of E, and the radius grows by (1 - nu) of that.
    let [at_rest, ..] = blown_up(4, 0.3, 1e-6);
    let growth = (volume / at_rest).cbrt() - 1.0;
    assert_relative(growth, 0.7 * stress / 1e6, 0.02, "growth");
}

// A balloon of incompressible rubber: p = 2 mu h / r (1/s - 1/s^7) at the stretch s, and its skin thins as
// 1/s^2 (Treloar 1975, The Physics of Rubber Elasticity, chapter 9). It leaves plane strain and small
// strains far behind.
#[test]
fn a_balloon_follows_the_theory_of_rubber() {
    let (mu, s) = (1e6 / (2.0 * 1.4999), 1.25f64);
    let pressure = 2.0 * mu * 0.01 * (1.0 / s - s.powi(-7));
    let [rest, rest_area, ..] = blown_up(4, 0.4999, 1e-6);
    let [volume, _, _, thickness] = blown_up(4, 0.4999, pressure);
    let found = (volume / rest).cbrt();
    // The polyhedron has the radius 3 V / A for r, a few percent less: it is as strong as a smaller balloon.
    let smaller = 3.0 * rest / rest_area / 0.1;
    assert!((0.93..1.0).contains(&smaller), "{smaller}");
    let of_smaller = |s: f64| 2.0 * mu * 0.01 / smaller * (1.0 / s - s.powi(-7));
    assert_relative(of_smaller(found), pressure, 0.01, &format!("pressure at a stretch of {found}"));
    assert_relative(thickness, 1e-3 / (found * found), 0.01, "thickness");
}

/// A crumpled, spinning sheet; with damping if asked for.
fn spinning(damping: bool) -> Simulation {
    let mut scene = json!({
        "dimension": 3,
        "time": { "integrator": "velocity-verlet", "step": 1e-5, "duration": 1.0 },
        "body": [{
            "mesh": {
                "cloth": { "cells": [6, 5], "origin": [0, 0, 0], "u": [0.3, 0, 0], "v": [0, 0.25, 0] },
            },
            "elastic": { "stable-neo-hookean": { "young": 1e6, "poisson": 0.4 } },
            "membrane": { "thickness": 2e-3 },
            "bending": { "stiffness": 1e-3 },
            "mass": { "density": 1000.0 },
            "position": { "affine": { "matrix": [[1.1, 0.1, 0.0], [0.0, 0.95, 0.0], [0.2, -0.1, 1.0]] } },
            "velocity": { "rigid": { "linear": [1.0, -2.0, 0.5], "angular": [3.0, 4.0, 20.0] } },
        }],
    });
    if damping {
        scene["body"][0]["damping"] =
            json!({ "strain_rate": { "shear": 200.0, "second": 100.0 }, "stiffness_proportional": 1e-5 });
    }
    simulation(&scene)
}

#[test]
fn a_sheet_keeps_energy_and_momenta_and_damping_takes_energy_alone() {
    for damping in [false, true] {
        let mut simulation = spinning(damping);
        let start = simulation.diagnostics();
        advance(&mut simulation, 4000);
        let end = simulation.diagnostics();
        for c in 0..3 {
            let size = |m: [f64; 3]| m.iter().map(|m| m * m).sum::<f64>().sqrt();
            let error = (end.linear_momentum[c] - start.linear_momentum[c]).abs();
            assert!(error < 1e-12 * size(start.linear_momentum), "momentum {c}: {error:e}");
            let error = (end.angular_momentum[c] - start.angular_momentum[c]).abs();
            assert!(error < 1e-12 * size(start.angular_momentum), "spin {c}: {error:e}");
        }
        let lost = (start.total - end.total) / start.elastic;
        if damping {
            assert!((0.2..1.2).contains(&lost), "{lost} of {}", start.elastic);
        } else {
            assert!(lost.abs() < 2e-3, "{lost} of {}", start.elastic);
        }
    }
}

/// Mass of a square of 1 m by `elastic`, `membrane` and `mass`, or the mistake in them.
fn mass_of(mass: &Value) -> Result<f64, String> {
    let scene: Scene = serde_json::from_value(json!({
        "dimension": 3,
        "time": { "integrator": "velocity-verlet", "step": 1e-6, "duration": 1.0 },
        "body": [{
            "mesh": {
                "cloth": { "cells": [2, 2], "origin": [0, 0, 0], "u": [1, 0, 0], "v": [0, 1, 0] },
            },
            "elastic": { "stvk": { "young": 1e6, "poisson": 0.4 } },
            "membrane": { "thickness": "3 mm" },
            "mass": mass,
        }],
    }))
    .map_err(|e| e.to_string())?;
    let assembly = scene.assemble(UnstableStep::Refuse).map_err(|p| p[0].message.clone())?;
    Ok(assembly.report.mass)
}

#[test]
fn a_density_is_by_volume_unless_its_unit_says_otherwise() {
    for (mass, expected) in [
        (json!({ "density": 1000.0 }), 3.0),
        (json!({ "density": "1 g/cm^3" }), 3.0),
        (json!({ "density": "0.2 kg/m^2" }), 0.2),
        (json!({ "preset": "rubber" }), 0.003 * 930.0),
        (json!({ "total": 0.7 }), 0.7),
    ] {
        let found = mass_of(&mass).unwrap();
        assert!((found / expected - 1.0).abs() < 0.02, "{mass}: {found} kg");
    }
    let message = mass_of(&json!({ "density": "1 kg/m" })).unwrap_err();
    assert!(message.contains("this body is made of a membrane"), "{message}");
}
