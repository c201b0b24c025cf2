//! Bending of sheets and strands.

use pliant::simulation::Simulation;
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;
use serde_json::{Value, json};

use crate::support::{advance, assert_relative};

fn simulation(scene: &Value) -> Simulation {
    let scene: Scene = serde_json::from_value(scene.clone()).unwrap();
    scene.assemble(UnstableStep::Refuse).map_err(|p| format!("{p:?}")).unwrap().simulation
}

/// A sheet of `n x n` cells of side `1 / n` in the plane z = 0, of bending stiffness 0.3 N m and springs too
/// soft to matter, every vertex moved by `to`; its elastic energy.
fn energy_of_sheet(n: usize, to: impl Fn(f64, f64) -> [f64; 3]) -> f64 {
    let mut simulation = simulation(&json!({
        "dimension": 3,
        "time": { "integrator": "velocity-verlet", "step": 1e-6, "duration": 1.0 },
        "body": [{
            "mesh": {
                "cloth": { "cells": [n, n], "origin": [0, 0, 0], "u": [1, 0, 0], "v": [0, 1, 0] },
            },
            "springs": { "stiffness": 1e-30 },
            "bending": { "stiffness": 0.3 },
            "mass": { "total": 1.0 },
        }],
    }));
    for x in simulation.state_mut().x_mut().chunks_mut(3) {
        let moved = to(x[0], x[1]);
        x.copy_from_slice(&moved);
    }
    simulation.diagnostics().elastic
}

// The energy of a plate bent to a cylinder is D/2 kappa^2 per area; the hinges in the sheet stand for all of
// it but half a cell at either end.
#[test]
fn a_sheet_rolled_to_a_cylinder_has_the_energy_of_a_plate() {
    let (n, radius) = (12, 0.4f64);
    let rolled = |x: f64| [radius * (x / radius).sin(), radius * (1.0 - (x / radius).cos())];
    let area = (n - 1) as f64 / n as f64;
    let expected = 0.5 * 0.3 / radius.powi(2) * area;
    assert_relative(energy_of_sheet(n, |x, y| [rolled(x)[0], y, rolled(x)[1]]), expected, 1e-12, "about y");
    assert_relative(energy_of_sheet(n, |x, y| [x, rolled(y)[0], rolled(y)[1]]), expected, 1e-12, "about x");
    // Seen from below and from anywhere else.
    assert_relative(energy_of_sheet(n, |x, y| [-rolled(x)[1], y, -rolled(x)[0]]), expected, 1e-12, "turned");
}

// What the reference says of the dependence on the triangles, by hand from the slopes of each: with the
// curvatures H of a shallow surface and cells of side a, the angles are a (H11 + H12), a (H22 + H12) and
// sqrt(2) a H12, the last of weight 2.
#[test]
fn a_grid_is_three_times_as_stiff_along_its_diagonal() {
    let (n, small) = (10usize, 1e-4);
    let inner = (n * (n - 1)) as f64 / (n * n) as f64;
    let energy = |h: [f64; 3]| {
        let height = |x: f64, y: f64| small * 0.5 * (h[0] * x * x + 2.0 * h[1] * x * y + h[2] * y * y);
        energy_of_sheet(n, |x, y| [x, y, height(x, y)]) / (0.5 * 0.3 * small * small)
    };
    for h in [[1.0f64, 0.0, 0.0], [0.5, 0.5, 0.5], [0.5, -0.5, 0.5], [1.0, 0.0, 1.0], [0.2, 0.7, -0.4]] {
        let expected = ((h[0] + h[1]).powi(2) + (h[2] + h[1]).powi(2)) * inner + 4.0 * h[1] * h[1];
        assert_relative(energy(h), expected, 1e-6, &format!("curvatures {h:?}"));
    }
}

/// How far the tip of a clamped strand of length 1 and bending stiffness 1 N m^2 sinks, and how far it draws
/// back, at rest under the dead weight `load` = q L^3 / B.
///
/// It is clamped in the middle of its first segment, of which both ends are held: joints stand for the half
/// segments on either side of them.
fn sunk(dimension: usize, segments: usize, load: f64) -> [f64; 2] {
    let length = 1.0 / (segments as f64 - 0.5);
    let (mut start, mut end, mut gravity) =
        (vec![0.0; dimension], vec![0.0; dimension], vec![0.0; dimension]);
    start[0] = -0.5 * length;
    end[0] = 1.0;
    gravity[dimension - 1] = -10.0;
    // Times go with the square root of the mass.
    let slowness = (load / 4.0).sqrt();
    let mut simulation = simulation(&json!({
        "dimension": dimension,
        "time": { "integrator": "velocity-verlet", "step": 5e-5 * slowness, "duration": 1.0 },
        "world": { "gravity": gravity },
        "body": [{
            "mesh": { "strand": { "segments": segments, "start": start, "end": end } },
            // Stretched by its weight by less than 1e-4 of its length.
            "springs": { "stiffness": 1e5 / length },
            "bending": { "stiffness": 1.0, "rest": "flat" },
            "damping": { "mass_proportional": 12.0 / slowness },
            "mass": { "density": load / 10.0 },
            "pin": [{ "vertices": [0, 1] }],
        }],
    }));
    // The slowest motion has omega = 3.5 sqrt(B / (rho L^4)) and is damped critically.
    advance(&mut simulation, 50_000);
    let x = simulation.positions();
    let tip = &x[x.len() - dimension..];
    [-tip[dimension - 1], 1.0 - tip[0]]
}

// C10, distributed dead load: tip of the elastica from elliptic integrals. The error of joints is of second
// order.
#[test]
fn a_strand_under_its_weight_is_an_elastica() {
    for (load, reference) in
        [(4.0, [0.425_159_284_202, 0.109_889_253_315]), (10.0, [0.700_199_715_514, 0.343_646_238_761])]
    {
        let [coarse, fine] = [8, 16].map(|n| sunk(2, n, load));
        for c in 0..2 {
            let errors = [coarse, fine].map(|found| (found[c] / reference[c] - 1.0).abs());
            assert!(errors[1] < 1e-2, "load {load}: {fine:?} instead of {reference:?}");
            let order = (errors[0] / errors[1]).log2();
            assert!((order - 2.0).abs() < 0.4, "load {load}, component {c}: order {order} from {errors:?}");
        }
        let space = sunk(3, 16, load);
        for c in 0..2 {
            assert_relative(space[c], fine[c], 1e-6, "the same in space");
        }
    }
}

/// Elastic energy of two triangles on either side of the diagonal of a unit square, normals along +z, whose
/// wings are raised by the angle `fold` in all; the rest angle is `angle`.
fn energy_of_fold(angle: f64, fold: f64) -> f64 {
    let mut simulation = simulation(&json!({
        "dimension": 3,
        "time": { "integrator": "velocity-verlet", "step": 1e-6, "duration": 1.0 },
        "body": [{
            "mesh": { "inline": {
                "points": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "triangles": [[0, 1, 2], [0, 2, 3]],
            } },
            "springs": { "stiffness": 1e-30 },
            "bending": { "stiffness": 0.3, "rest": { "angle": angle } },
            "mass": { "total": 1.0 },
        }],
    }));
    let (c, s) = ((0.5 * fold).cos(), (0.5 * fold).sin());
    for (vertex, side) in [(1, 0.5), (3, -0.5)] {
        let x = &mut simulation.state_mut().x_mut()[3 * vertex..][..3];
        // The foot of the height is the middle of the diagonal, half a diagonal away.
        x.copy_from_slice(&[0.5 + side * c, 0.5 - side * c, 0.5f64.sqrt() * s]);
    }
    simulation.diagnostics().elastic
}

// E = D/2 |e|^2 / (A_1 + A_2) (theta - theta_0)^2 with |e|^2 = 2 and areas 1/2: a positive rest angle folds a
// sheet to the side of its normals.
#[test]
fn a_sheet_folds_by_a_positive_rest_angle_to_the_side_of_its_normals() {
    for angle in [0.5, -0.5, 2.0] {
        for fold in [0.5, -0.5, 0.0, 1.2] {
            let expected = 0.3 * (fold - angle) * (fold - angle);
            let found = energy_of_fold(angle, fold);
            assert!(
                (found - expected).abs() < 1e-14,
                "{found} J at {fold} rad, rest {angle} rad: {expected}"
            );
        }
    }
}

// Small deflections: w = q L^4 / (8 B).
#[test]
fn a_strand_under_a_small_weight_is_a_beam() {
    assert_relative(sunk(2, 16, 0.1)[0], 0.1 / 8.0, 1e-2, "deflection");
}

// Nothing else holds it: a ring of given angles closes.
#[test]
fn a_strand_with_rest_angles_curls_up() {
    let n = 12;
    let angle = std::f64::consts::TAU / f64::from(n);
    let mut simulation = simulation(&json!({
        "dimension": 2,
        "time": { "integrator": "velocity-verlet", "step": 1e-3, "duration": 1.0 },
        "body": [{
            "mesh": { "strand": { "segments": n, "start": [0.0, 0.0], "end": [1.0, 0.0] } },
            "springs": { "stiffness": 1e3 },
            "bending": { "stiffness": 0.1, "rest": { "angle": "30 deg" } },
            "damping": { "mass_proportional": 2.0, "stiffness_proportional": "10 ms" },
            "mass": { "total": 1.0 },
        }],
    }));
    advance(&mut simulation, 20_000);
    let x = simulation.positions().to_vec();
    let last = x.len() - 2;
    let gap = (x[0] - x[last]).hypot(x[1] - x[last + 1]);
    assert!(gap < 1e-3, "its ends are {gap} m apart");
    assert!(simulation.diagnostics().elastic < 1e-9);
    // Counter-clockwise, by turns of the angle asked for.
    let turn = |i: usize| {
        let edge = |j: usize| (x[2 * j + 2] - x[2 * j], x[2 * j + 3] - x[2 * j + 1]);
        let ((ex, ey), (fx, fy)) = (edge(i - 1), edge(i));
        (ex * fy - ey * fx).atan2(ex * fx + ey * fy)
    };
    for i in 1..n as usize {
        assert!((turn(i) - angle).abs() < 1e-3, "joint {i} turns by {}", turn(i));
    }
}

// A strand of 25 vertices, hardly extensible, clamped at one end and bent by a dead load at the other: in
// space, it is the same whatever the direction of the load across it.
#[test]
fn a_strand_in_space_bends_alike_under_loads_of_every_direction() {
    let bent = |angle: f64| {
        let load = |along: f64| format!("{} * t", 0.0074 * along);
        let mut simulation = simulation(&json!({
            "dimension": 3,
            "time": {
                "integrator": "quasi-static", "step": 0.05, "duration": 1.0, "solver": { "tolerance": 1e-9 },
            },
            "body": [{
                "mesh": { "strand": { "segments": 24, "start": [0.0, 0.0, 0.0], "end": [1.0, 0.0, 0.0] } },
                "springs": { "stiffness": 1e5 },
                "bending": { "stiffness": 0.002 },
                "mass": { "per_vertex": 0.001 },
                "pin": [{ "vertices": [0, 1] }],
                "load": [{ "vertices": [24], "force": ["0", load(angle.cos()), load(angle.sin())] }],
            }],
        }));
        advance(&mut simulation, 20);
        let end = simulation.positions()[72..].to_vec();
        let iterations = simulation.work().solver.unwrap().newton_iterations;
        ([end[0], angle.cos() * end[1] + angle.sin() * end[2]], iterations)
    };
    let (along_y, fewest) = bent(0.0);
    // By 3.7 times B / L^2 the end is far from where it was.
    assert!(along_y[1] > 0.5, "{along_y:?}");
    for angle in [0.927_295_218_001_612_2, 0.3, 2.0] {
        let (end, iterations) = bent(angle);
        for (a, b) in end.iter().zip(along_y) {
            assert!((a - b).abs() < 1e-8, "{angle}: {end:?} for {along_y:?}");
        }
        assert!(iterations <= fewest + fewest / 4, "{angle}: {iterations} iterations for {fewest}");
    }
}
