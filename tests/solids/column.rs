//! A column of 1 m x 1 m x 6 m, clamped at its foot and set spinning at 105 rad/s at its head.

use std::f64::consts::PI;

use crate::support::solid::{Solid, at_zero, isotropic};
use crate::support::{assert_relative, method};
use serde_json::json;

// lecture 13, 18; C12: 4 x 4 x 24 cells, neo-Hookean, velocity Verlet in steps of 25 microseconds; an independent code
// with the same scheme and step gives the numbers below.
#[test]
fn the_twisting_column_follows_an_independent_code() {
    let mut solid = Solid::grid(&[4, 4, 24], &[1.0, 1.0, 6.0], isotropic("neo-hookean", 17e6, 0.45));
    solid.mesh =
        json!({ "grid": { "cells": [4, 4, 24], "size": [1.0, 1.0, 6.0], "origin": [-0.5, -0.5, 0.0] } });
    solid.mass = json!({ "density": 1100.0 });
    solid.pin = at_zero(3, 2);
    let mut simulation = solid.simulation(method("velocity-verlet"), 2.5e-5);
    let x = simulation.state().x().to_vec();
    for (v, x) in simulation.state_mut().v_mut().chunks_exact_mut(3).zip(x.chunks_exact(3)) {
        let w = 105.0 * (PI * x[2] / 12.0).sin();
        v.copy_from_slice(&[-w * x[1], w * x[0], 0.0]);
    }
    let start = simulation.diagnostics();
    assert_relative(start.kinetic, 3_410_859.38, 3e-9, "kinetic energy at the start");
    let corner = x.len() - 3;
    let mut angles = vec![];
    let (mut turned, mut last) = (0.0, PI / 4.0);
    let mut peak = (0.0, 0.0);
    for step in 1..=4000 {
        simulation.step().unwrap();
        // The axis of the column stays on the z axis by symmetry to the digits compared here, but is measured.
        let x = simulation.state().x();
        let centre = ((2 * 5 + 2) * 25 + 24) * 3;
        let angle = (x[corner + 1] - x[centre + 1]).atan2(x[corner] - x[centre]);
        turned += (angle - last + PI).rem_euclid(2.0 * PI) - PI;
        last = angle;
        if turned > peak.0 {
            peak = (turned, simulation.state().time);
        }
        if step % 2000 == 0 {
            angles.push([x[corner], x[corner + 1], x[corner + 2]]);
        }
        if step % 200 == 0 {
            let now = simulation.diagnostics();
            assert!((now.total / start.total - 1.0).abs() < 1e-2, "energy at step {step}: {} J", now.total);
            assert!(now.min_j.unwrap() > 0.5, "det F at step {step}");
        }
    }
    assert_relative(peak.0, 5.324_959_37, 1e-6, "largest twist [rad]");
    assert!((peak.1 - 0.081_775).abs() < 1e-9, "largest twist at {} s", peak.1);
    let expected =
        [[0.213_775_334, -0.647_475_938, 5.921_955_37], [0.576_777_88, -0.346_485_724, 6.096_242_01]];
    for (corner, expected) in angles.iter().zip(expected) {
        let error = crate::support::largest_difference(corner, &expected);
        assert!(error < 1e-6, "corner off by {error:e} m");
    }
    let end = simulation.diagnostics();
    assert_relative(end.kinetic, 587_091.0, 1e-5, "kinetic energy at the end");
    assert_relative(end.elastic, 2_823_767.6, 1e-6, "elastic energy at the end");
}
