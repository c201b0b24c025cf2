//! Where implicit steps are solved to if the scene does not say.

use std::path::Path;

use pliant::simulation::Simulation;
use pliant::solver::SolverOptions;
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;

use crate::support::{advance, method, weighted_rms};

/// The twisting bar of the study by this scheme, at its end: after 1 s in `steps`.
fn end_of_bar(scheme: &str, steps: usize, tolerance: impl Fn(&Simulation) -> Option<f64>) -> Simulation {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/study/twisted_bar.toml");
    let mut scene = Scene::from_toml(&std::fs::read_to_string(path).unwrap()).unwrap();
    scene.time.step = Some(1.0 / steps as f64);
    let mut simulation = scene.assemble(UnstableStep::Accept).ok().unwrap().simulation;
    simulation.set_method(method(scheme));
    let tolerance = tolerance(&simulation);
    simulation.set_solver(SolverOptions { tolerance, ..SolverOptions::default() });
    advance(&mut simulation, steps);
    simulation
}

/// The error of the scheme is that of equations solved to rounding within a hundredth, and no step takes more
/// iterations than at 1e-9 of the size of the scene, which is the least that the default asks for.
#[test]
fn solves_leave_a_small_part_of_the_error_of_the_scheme() {
    let reference = end_of_bar("sdirk4", 800, |bar| Some(1e-13 * bar.length_scale()));
    let iterations = |bar: &Simulation| bar.work().solver.unwrap().newton_iterations;
    for scheme in ["implicit-euler", "implicit-midpoint", "bdf2", "sdirk4"] {
        for steps in [50, 100, 200] {
            let accurate = end_of_bar(scheme, steps, |bar| Some(1e-13 * bar.length_scale()));
            let fixed = end_of_bar(scheme, steps, |bar| Some(1e-9 * bar.length_scale()));
            let default = end_of_bar(scheme, steps, |_| None);
            let distance = |a: &Simulation, b: &Simulation| weighted_rms(a, a.state().x(), b.state().x());
            let (error, left) = (distance(&accurate, &reference), distance(&default, &accurate));
            assert!(left <= 1e-2 * error, "{scheme}, {steps} steps: {left:e} of {error:e}");
            let (fewer, more) = (iterations(&default), iterations(&fixed));
            assert!(fewer <= more, "{scheme}, {steps} steps: {fewer} iterations for {more}");
            if scheme == "implicit-euler" && steps <= 100 {
                assert!(10 * fewer <= 9 * more, "{steps} steps: {fewer} iterations for {more}");
            }
        }
    }
}

/// A level cloth of stiff springs that falls into folds, ten steps of a sixtieth of a second. The matrix of
/// the last step leads far off at first: where its direction would have to be shortened, by four halvings in
/// a step, it is made anew. (By shortened steps: 19 halvings, 29 factorisations, 76 iterations.)
#[test]
fn a_cloth_that_folds_takes_whole_steps() {
    let mut scene: Scene = serde_json::from_value(serde_json::json!({
        "dimension": 3,
        "time": { "integrator": "implicit-euler", "step": 1.0 / 60.0, "duration": 1.0 },
        "world": { "gravity": [0.0, 0.0, -9.81] },
        "body": [{
            "mesh": { "cloth": {
                "cells": [8, 8], "origin": [-0.5, 0.0, 1.0], "u": [1.0, 0.0, 0.0], "v": [0.0, 1.0, 0.0],
            } },
            "springs": { "stiffness": 5e3 },
            "mass": { "total": 0.3 },
            "pin": [{ "vertices": [0, 72] }],
        }],
    }))
    .unwrap();
    let cloth = |scene: &Scene, tolerance: Option<f64>| {
        let mut cloth = scene.assemble(UnstableStep::Accept).ok().unwrap().simulation;
        cloth.set_solver(SolverOptions { tolerance, ..SolverOptions::default() });
        advance(&mut cloth, scene.time.step.map_or(0, |h| (1.0 / (6.0 * h)).round() as usize));
        cloth
    };
    let default = cloth(&scene, None);
    let work = default.work().solver.unwrap();
    assert!(work.halvings <= 2, "{work:?}");
    assert!(work.factorizations <= 25 && work.newton_iterations <= 60, "{work:?}");
    // What solves leave is no more than a hundredth of the error of the scheme, as half the step shows it.
    let accurate = cloth(&scene, Some(1e-12));
    scene.time.step = Some(1.0 / 120.0);
    let fine = cloth(&scene, Some(1e-12));
    let distance = |a: &Simulation, b: &Simulation| weighted_rms(a, a.state().x(), b.state().x());
    let (left, error) = (distance(&default, &accurate), distance(&accurate, &fine));
    assert!(left <= 1e-2 * error, "{left:e} of {error:e}");
}
