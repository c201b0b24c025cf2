//! Free bodies in flight: momenta over many steps.

use crate::support::solid::{KINDS, Kind, Solid, isotropic};
use crate::support::{advance, assert_relative, method, methods, solve_to_rounding};
use pliant::integrator::Method;
use pliant::simulation::Simulation;
use serde_json::json;

/// The unit square of 3 x 3 cells about the origin, spinning at 10 rad/s.
fn spinning_square(method: Method, h: f64) -> Simulation {
    let mut solid = Solid::grid(&[3, 3], &[1.0, 1.0], isotropic("stable-neo-hookean", 1e7, 0.3));
    solid.mesh = json!({ "grid": { "cells": [3, 3], "size": [1.0, 1.0], "origin": [-0.5, -0.5] } });
    let mut simulation = solid.simulation(method, h);
    let x = simulation.state().x().to_vec();
    for (v, x) in simulation.state_mut().v_mut().chunks_exact_mut(2).zip(x.chunks_exact(2)) {
        v.copy_from_slice(&[-10.0 * x[1], 10.0 * x[0]]);
    }
    simulation
}

// lecture 5; D12: changes of angular momentum and energy after one second at h = 1/2000, computed by an
// independent implementation.
#[test]
fn a_spinning_square_changes_angular_momentum_and_energy_as_an_independent_code_finds() {
    let rows = [
        ("symplectic-euler", 0.0, 3.40856e-5),
        ("velocity-verlet", 0.0, -4.73786e-6),
        ("yoshida4", 0.0, 4.60466e-8),
        ("rk4", -2.57796e-9, -1.92430e-6),
    ];
    for (name, expected_l, expected_e) in rows {
        let mut simulation = spinning_square(method(name), 1.0 / 2000.0);
        let start = simulation.diagnostics();
        assert_relative(start.angular_momentum[2], 2_037.037_037_037, 1e-12, "angular momentum at the start");
        assert_relative(start.kinetic, 10_185.185_185_185, 1e-12, "energy at the start");
        assert_relative(
            simulation.stability_limit(1.0).unwrap().frequency,
            1_012.153_184_36,
            1e-11,
            "frequency",
        );
        advance(&mut simulation, 2000);
        let end = simulation.diagnostics();
        let l = end.angular_momentum[2] / start.angular_momentum[2] - 1.0;
        if expected_l == 0.0 {
            assert!(l.abs() < 1e-12, "{name} changes L by {l:e}");
        } else {
            assert_relative(l, expected_l, 1e-2, &format!("{name}: change of L"));
        }
        assert_relative(end.total / start.total - 1.0, expected_e, 1e-3, &format!("{name}: change of E"));
        let p = end.linear_momentum[0].hypot(end.linear_momentum[1]);
        assert!(p < 1e-11, "{name} gives it a momentum of {p:e} kg m/s");
    }
}

// lecture 5; C3
#[test]
fn a_tumbling_body_keeps_its_momenta_over_ten_thousand_steps() {
    for (dimension, kind) in KINDS {
        let cells = &if kind.order() != 2 { [3, 2, 2] } else { [2, 1, 1] }[..dimension];
        let size = &[1.5, 1.0, 1.0][..dimension];
        let solid = Solid::grid(cells, size, isotropic("neo-hookean", 1e5, 0.3)).of_kind(kind);
        for method in methods().filter(|m| m.documentation.stability_limit > 0.0) {
            let name = method.documentation.name;
            // What a scheme does to momenta does not depend on the element; that its forces balance does.
            if kind != Kind::Order(1) && !["velocity-verlet", "implicit-midpoint"].contains(&name) {
                continue;
            }
            let mut simulation = solid.simulation(method, 2e-4);
            solve_to_rounding(&mut simulation);
            let x = simulation.state().x().to_vec();
            for (v, x) in
                simulation.state_mut().v_mut().chunks_exact_mut(dimension).zip(x.chunks_exact(dimension))
            {
                // Translation, spin and stretch at once.
                v[0] = 0.7 - 3.0 * x[1] + x[0];
                v[1] = -0.4 + 3.0 * x[0];
                if dimension == 3 {
                    v[1] -= 2.0 * x[2];
                    v[2] = 0.2 + 2.0 * x[1];
                }
            }
            let start = simulation.diagnostics();
            let norm = |a: [f64; 3]| a.iter().map(|a| a * a).sum::<f64>().sqrt();
            let change = |a: [f64; 3], b: [f64; 3]| norm([a[0] - b[0], a[1] - b[1], a[2] - b[2]]) / norm(b);
            // An implicit step costs a hundred explicit ones.
            advance(&mut simulation, if method.documentation.solves > 0 { 300 } else { 10_000 });
            let end = simulation.diagnostics();
            assert!(end.elastic > 1e-3 * end.kinetic, "{name}: the body does deform");
            let p = change(end.linear_momentum, start.linear_momentum);
            assert!(p < 1e-12, "{name} in {dimension}D changes the momentum by {p:e}");
            let l = change(end.angular_momentum, start.angular_momentum);
            // What Runge-Kutta loses is measured above.
            if method.documentation.symplectic {
                assert!(l < 1e-10, "{name} in {dimension}D changes the angular momentum by {l:e}");
            }
        }
    }
}
