//! Bending problems whose answers are known, by the quasi-static scheme.

use pliant::diagnostics::recovery::Recovery;
use pliant::solver::SolverOptions;
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;
use serde_json::json;

use crate::support::solid::{Solid, at_zero, isotropic};
use crate::support::{assert_relative, method};

/// Displacement of the vertex at `point` when a dead shear traction of `force` [N/m] in all, spread over the
/// right end at `end`, has come on in `steps`; the left end is clamped.
pub(super) fn sheared(
    mut solid: Solid,
    end: f64,
    height: f64,
    force: f64,
    steps: u32,
    point: [f64; 2],
) -> [f64; 2] {
    solid.pin = at_zero(2, 0);
    let traction = format!("{} * t", force / height);
    solid.load =
        json!([{ "half_space": { "normal": [-1.0, 0.0], "offset": -end }, "traction": [0.0, traction] }]);
    let mut simulation = solid.simulation(method("quasi-static"), 1.0 / f64::from(steps));
    simulation.set_solver(SolverOptions { tolerance: Some(1e-10 * end), ..SolverOptions::default() });
    let rest = simulation.state().x().to_vec();
    (0..steps).for_each(|_| simulation.step().unwrap());
    let near = |x: &[f64]| (x[0] - point[0]).hypot(x[1] - point[1]) < 1e-6;
    let v = rest.chunks_exact(2).position(near).unwrap();
    let x = simulation.state().x();
    [x[2 * v] - rest[2 * v], x[2 * v + 1] - rest[2 * v + 1]]
}

fn cook(n: usize, order: u8, elastic: serde_json::Value) -> Solid {
    let mut solid = Solid::grid(&[1, 1], &[1.0, 1.0], elastic).of_order(order);
    solid.mesh = json!({ "cooks_membrane": { "cells": [n, n] } });
    solid
}

// C9: uniform meshes of an independent code, the corner (48, 60); the middle (48, 52) of the linear rows.
#[test]
fn cooks_membrane_converges_as_an_independent_code_has_it() {
    let corner = |n: usize, order: u8, poisson: f64| {
        let elastic = isotropic("neo-hookean", 240.565, poisson);
        sheared(cook(n, order, elastic), 48.0, 16.0, 100.0, 2, [48.0, 60.0])[1]
    };
    for (n, expected) in [(8, 5.837_364_486), (16, 7.056_758_432), (32, 7.545_159_568)] {
        assert_relative(corner(n, 1, 0.3), expected, 1e-8, &format!("linear, {n} cells"));
    }
    // Ours is a rule of second degree, theirs of fourth.
    for (n, expected) in [(8, 7.702_231_495), (16, 7.752_389_532)] {
        assert_relative(corner(n, 2, 0.3), expected, 1e-5, &format!("quadratic, {n} cells"));
    }
    let plane = |plane: &str, order: u8, n: usize| {
        let elastic = json!({ "linear": { "young": 1.0, "poisson": 1.0 / 3.0, "plane": plane } });
        sheared(cook(n, order, elastic), 48.0, 16.0, 1.0, 1, [48.0, 52.0])
    };
    assert_relative(plane("stress", 1, 32)[1], 23.275_121_9, 1e-8, "plane stress, linear");
    assert_relative(plane("stress", 2, 32)[1], 23.952_197_76, 1e-8, "plane stress, quadratic");
    // From below, as slowly as the singular corners let it: cells half as large leave 0.6 of the error or
    // less.
    let gap = |n: usize| 1.0 - plane("strain", 2, n)[1] / 21.524_574;
    let (coarse, fine) = (gap(16), gap(32));
    assert!(fine > 0.0 && fine < 2e-3 && fine < 0.6 * coarse, "plane strain: {coarse:e}, {fine:e}");
}

// C9, nu = 0.4999: the corner (48, 60) on uniform meshes of an independent code. Linear triangles lock at a
// third of the answer.
#[test]
fn cooks_membrane_that_hardly_changes_its_volume_is_as_an_independent_code_has_it() {
    let corner = |n: usize, order: u8| {
        let elastic = isotropic("neo-hookean", 240.565, 0.4999);
        sheared(cook(n, order, elastic), 48.0, 16.0, 100.0, 10, [48.0, 60.0])[1]
    };
    // Four digits are given.
    for (n, expected) in [(8, 2.168), (16, 2.205)] {
        assert_relative(corner(n, 1), expected, 2.5e-4, &format!("linear, {n} cells"));
    }
    // Ours is a rule of second degree for quadratic triangles, theirs of fourth, which locks more; the limit
    // is 6.932 +- 0.004.
    let [coarse, fine] = [(8, 6.217_1), (16, 6.658_9)].map(|(n, theirs)| {
        let ours = corner(n, 2);
        assert!(theirs < ours && ours < 6.936, "quadratic, {n} cells: {ours}, theirs {theirs}");
        6.932 - ours
    });
    assert!(fine < 0.6 * coarse && fine < 0.04 * 6.932, "{coarse:e} {fine:e}");
}

/// `sigma_yy` [MPa] at the inner end of the long axis of NAFEMS LE1, `n` and `3 n / 2` quadratic cells
/// across and along.
fn le1(n: usize) -> f64 {
    let scene: Scene = serde_json::from_value(json!({
        "dimension": 2,
        "time": { "integrator": "quasi-static", "step": 1.0, "duration": 1.0 },
        "body": [{
            "mesh": { "elliptic_membrane": { "cells": [n, 3 * n / 2] } },
            "elastic": { "linear": { "young": 210e9, "poisson": 0.3, "plane": "stress" } },
            "order": 2,
            "mass": { "density": 8000.0 },
            "pin": [{ "group": "bottom", "axes": ["y"] }, { "group": "left", "axes": ["x"] }],
            "load": [{ "group": "outer", "pressure": -1e7 }],
        }],
    }))
    .unwrap();
    let mut assembly = scene.assemble(UnstableStep::Accept).map_err(|p| format!("{p:?}")).unwrap();
    assembly.simulation.step().unwrap();
    let rest = assembly.topology.rest_positions.chunks_exact(2);
    let inner = rest.map(|x| [x[0] - 2.0, x[1]]).position(|[x, y]| x.abs() < 1e-9 && y.abs() < 1e-9);
    let stress = assembly.simulation.nodal_stress(&assembly.topology, Recovery::Patch);
    stress.at(inner.unwrap() as u32).next().unwrap()[1][1] * 1e-6
}

// C8: 92.6576 MPa, recovered at the vertex. An independent program has errors of 0.8, 0.3 and 0.06 % on 16,
// 32 and 64 square cells.
#[test]
fn the_stress_of_le1_is_that_of_an_independent_code() {
    for n in [16, 32] {
        let error = le1(n) / 92.6576 - 1.0;
        assert!(error.abs() < 2e-3, "{n} cells: {error:e}");
    }
}

// C10: a thick elastica, neo-Hookean, nu = 0, L/H = 20, as a code with elements of fourth order has it: a =
// F L^2 / (E I).
#[test]
fn a_cantilever_of_quadratic_triangles_follows_the_elastica() {
    for (a, w, u) in
        [(1.0, 0.302_233_2, 0.056_499_8), (2.0, 0.494_460_4, 0.160_883_6), (4.0, 0.671_724_4, 0.329_534_4)]
    {
        let (young, height) = (1e6, 0.05);
        let solid = Solid::grid(&[40, 2], &[1.0, height], isotropic("neo-hookean", young, 0.0)).of_order(2);
        let force = a * young * height.powi(3) / 12.0;
        let [x, y] = sheared(solid, 1.0, height, force, 4, [1.0, 0.5 * height]);
        assert_relative(y, w, 5e-3, &format!("rise at a = {a}"));
        assert_relative(-x, u, 5e-3, &format!("shortening at a = {a}"));
    }
}

// C11: a cantilever 10 x 1 under a unit shear; three digits of an independent code.
#[test]
fn linear_triangles_lock_and_quadratic_ones_do_not() {
    let tip = |poisson: f64, order: u8, n: usize| {
        let solid =
            Solid::grid(&[20 * n, 2 * n], &[10.0, 1.0], isotropic("linear", 1e6, poisson)).of_order(order);
        sheared(solid, 10.0, 1.0, 1.0, 1, [10.0, 1.0])[1]
    };
    let locked = [
        (0.3, [1.898e-3, 2.961e-3, 3.452e-3]),
        (0.49, [0.315e-3, 0.892e-3, 1.856e-3]),
        (0.4999, [0.0399e-3, 0.0494e-3, 0.0864e-3]),
    ];
    for (poisson, expected) in locked {
        for (n, expected) in [1, 2, 4].into_iter().zip(expected) {
            assert_relative(tip(poisson, 1, n), expected, 2e-3, &format!("linear, nu = {poisson}, {n}"));
        }
    }
    for (n, expected) in [(1, 2.866e-3), (2, 2.950e-3), (4, 2.976e-3)] {
        assert_relative(tip(0.4999, 2, n), expected, 5e-4, &format!("quadratic, {n}"));
    }
}
