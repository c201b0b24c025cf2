//! The assembled matrix against products of the exact Hessian, term by term.

use pliant::material::{MaterialSpec, Psd};
use pliant::simulation::Simulation;
use pliant::solver::LinearSolver;
use pliant::solver::hessian::{Assembler, At, Weights};
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;

/// A grid of one material, wavy, its first column held, one coordinate of its last vertex held too.
fn grid(dimension: usize, material: &MaterialSpec, order: usize) -> Simulation {
    let (cells, size) =
        if dimension == 2 { ("[5, 4]", "[1.0, 0.8]") } else { ("[4, 3, 3]", "[1.0, 0.8, 0.7]") };
    wavy(
        dimension,
        serde_json::json!({
            "mesh": { "grid": {
                "cells": serde_json::from_str::<serde_json::Value>(cells).unwrap(),
                "size": serde_json::from_str::<serde_json::Value>(size).unwrap(),
            } },
            "order": order,
            "elastic": material,
            "mass": { "density": 1000.0 },
            "pin": [{ "half_space": { "normal": vec![1.0; dimension], "offset": 0.1 } }],
        }),
    )
}

/// This body, wavy.
fn wavy(dimension: usize, body: serde_json::Value) -> Simulation {
    let scene: Scene = serde_json::from_value(serde_json::json!({
        "dimension": dimension,
        "time": { "integrator": "implicit-euler", "step": 0.01, "duration": 1.0 },
        "body": [body],
    }))
    .unwrap();
    let mut simulation =
        scene.assemble(UnstableStep::Refuse).map_err(|p| format!("{p:?}")).unwrap().simulation;
    for (i, x) in simulation.state_mut().x_mut().iter_mut().enumerate() {
        *x += 0.02 * (7.0 * *x + i as f64).sin();
    }
    simulation
}

/// Largest difference between the two products `A p`, relative to the largest entry.
fn defect<const D: usize>(simulation: &mut Simulation) -> f64 {
    let x = simulation.state().x().to_vec();
    let system = simulation.system_mut();
    let p: Vec<f64> = (0..x.len()).map(|i| (i as f64 * 0.7).sin()).collect();
    let free: Vec<bool> = system.inverse_mass().iter().map(|w| *w > 0.0).collect();
    let p: Vec<f64> = p.iter().zip(&free).map(|(p, free)| if *free { *p } else { 0.0 }).collect();
    let mut assembler = Assembler::<D>::new(system);
    let weights = Weights { inertia: 0.0, stiffness: 2.0, damping: 0.0 };
    assembler.assemble(system, At { x: &x, v: &x, psd: Psd::Exact, predicted_from: None }, weights);
    let (mut assembled, mut exact) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    assembler.matrix().multiply(&p, &mut assembled);
    system.hessian_product(&x, &p, &mut exact);
    let largest = exact.iter().fold(0.0, |m: f64, y| m.max(2.0 * y.abs()));
    let mut error: f64 = 0.0;
    for i in 0..x.len() {
        if free[i] {
            error = error.max((assembled[i] - 2.0 * exact[i]).abs());
        }
    }
    error / largest
}

#[test]
fn the_matrix_of_every_material_is_its_hessian() {
    for material in MaterialSpec::examples() {
        for order in [1, 2] {
            let plane = defect::<2>(&mut grid(2, &material, order));
            assert!(plane < 1e-11, "{} of order {order} in 2D: {plane:e}", material.name());
            let space = defect::<3>(&mut grid(3, &material, order));
            assert!(space < 1e-11, "{} of order {order} in 3D: {space:e}", material.name());
        }
    }
}

#[test]
fn the_matrix_of_muscles_is_their_hessian() {
    let whole = ["quadrilateral", "hexahedron"];
    for (dimension, cells) in [(2, vec![5, 4]), (3, vec![3, 3, 2])] {
        for (order, element) in [(1, None), (2, None), (1, Some(whole[dimension - 2]))] {
            let mut simulation = wavy(
                dimension,
                serde_json::json!({
                    "mesh": { "grid": { "cells": cells, "spacing": 0.25, "element": element } },
                    "order": order,
                    "elastic": { "neo-hookean": { "young": 1e3, "poisson": 0.3 } },
                    "mass": { "density": 1000.0 },
                    "pin": [{ "vertices": [1] }, { "vertices": [2], "axes": ["x"] }],
                    "muscle": [
                        {
                            "fibre": { "direction": vec!["1", "Y", "-X"][..dimension] },
                            "tension": "5e3 * (1 + X) * cos(t)",
                        },
                        { "fibre": { "direction": vec![1.0; dimension] }, "tension": -2e3 },
                    ],
                }),
            );
            let defect =
                if dimension == 2 { defect::<2>(&mut simulation) } else { defect::<3>(&mut simulation) };
            assert!(defect < 1e-11, "order {order}, {element:?} in {dimension}D: {defect:e}");
        }
    }
}

/// A beam of 648 tetrahedra that begins to fall, after two steps with this linear solver.
fn fallen(linear: LinearSolver, nu: f64) -> Simulation {
    fallen_to(serde_json::json!({ "linear": linear, "tolerance": 1e-9 }), nu)
}

/// The same, with these solver options.
fn fallen_to(solver: serde_json::Value, nu: f64) -> Simulation {
    let scene: Scene = serde_json::from_value(serde_json::json!({
        "dimension": 3,
        "time": {
            "integrator": "implicit-euler", "step": 0.01, "duration": 1.0, "solver": solver,
        },
        "world": { "gravity": [0.0, 0.0, -9.81] },
        "body": [{
            "mesh": { "grid": { "cells": [12, 3, 3], "size": [0.4, 0.1, 0.1] } },
            "elastic": { "stable-neo-hookean-log": { "young": 5e5, "poisson": nu } },
            "mass": { "density": 1000.0 },
            "pin": [{ "half_space": { "normal": [1.0, 0.0, 0.0], "offset": 1e-9 } }],
        }],
    }))
    .unwrap();
    let mut simulation = scene.assemble(UnstableStep::Refuse).unwrap().simulation;
    (0..2).for_each(|_| simulation.step().unwrap());
    simulation
}

/// Largest difference of the positions.
fn apart(a: &Simulation, b: &Simulation) -> f64 {
    a.state().x().iter().zip(b.state().x()).fold(0.0, |m, (a, b)| f64::max(m, (a - b).abs()))
}

/// All of them, at work as they should be, against a factorisation.
fn take_the_same_steps(fallen: impl Fn(LinearSolver) -> Simulation) {
    let cholesky = fallen(LinearSolver::Cholesky);
    for linear in [LinearSolver::Cg, LinearSolver::Multigrid, LinearSolver::MatrixFree] {
        let other = fallen(linear);
        let solver = other.work().solver.unwrap();
        assert!(
            solver.cg_iterations > 0 && solver.fallbacks == 0 && solver.factorizations == 0,
            "{linear:?}: {solver:?}"
        );
        // Newton's method ends at corrections of 1e-9 m, in either of two steps.
        let apart = apart(&cholesky, &other);
        assert!(apart < 1e-8, "{linear:?}: {apart:e}");
    }
}

#[test]
fn linear_solvers_take_the_same_steps() {
    let fall = apart(&fallen(LinearSolver::Cholesky, 0.4), &fallen(LinearSolver::Auto, 0.3));
    assert!(fall > 1e-5, "{fall}");
    take_the_same_steps(|linear| fallen(linear, 0.4));
}

// A tolerance that rounding does not let corrections reach: Newton's method ends where they no longer shrink.
#[test]
fn solves_end_at_rounding_where_more_is_asked() {
    for linear in ["cholesky", "multigrid"] {
        let fallen =
            fallen_to(serde_json::json!({ "linear": linear, "tolerance": 1e-30, "iterations": 60 }), 0.4);
        let iterations = fallen.work().solver.unwrap().newton_iterations;
        assert!(iterations < 60, "{linear}: {iterations}");
    }
}

// Volumetric locking: the coarse levels cannot move without a change of volume, and the stiffness against
// that is a million times the other one.
#[test]
fn conjugate_gradients_that_stall_leave_the_solve_to_a_factorisation() {
    let exact = |linear| fallen_to(serde_json::json!({ "linear": linear, "tolerance": 1e-10 }), 0.499_999_9);
    let fallen_back = exact(LinearSolver::Multigrid);
    let solver = fallen_back.work().solver.unwrap();
    assert!(solver.fallbacks > 0 && solver.factorizations > 0, "{solver:?}");
    let apart = apart(&fallen_back, &exact(LinearSolver::Cholesky));
    assert!(apart < 1e-8, "{apart:e}");
}

// Pressure follows the surface, and the matrix knows how: a factor serves a whole step of a balloon that is
// blown up. Without that corrections shrink slowly, and nearly each of them takes a matrix of its own.
#[test]
fn balloons_are_blown_up_with_one_matrix_a_step() {
    let scene: Scene = serde_json::from_value(serde_json::json!({
        "dimension": 3,
        "time": { "integrator": "implicit-euler", "step": 0.02, "duration": 1.0 },
        "body": [{
            "mesh": { "sphere": { "radius": 0.1, "cells": 3 } },
            "elastic": { "neo-hookean": { "young": 1e6, "poisson": 0.49 } },
            "membrane": { "thickness": 1e-3 },
            "mass": { "density": 1000.0 },
            "load": [{ "pressure": "-3700 * smoothstep(0, 0.2, t)" }],
        }],
    }))
    .unwrap();
    let mut simulation = scene.assemble(UnstableStep::Refuse).unwrap().simulation;
    let steps = 10;
    (0..steps).for_each(|_| simulation.step().unwrap());
    let grown = simulation.length_scale();
    let solver = simulation.work().solver.unwrap();
    assert!(grown > 1.1 * 0.2 * 3.0_f64.sqrt(), "{grown}");
    assert!(solver.newton_iterations <= 8 * steps && solver.factorizations <= steps, "{solver:?}");
}

/// Springs, hinges, joints, membranes, attachments, and what damps them, where everything has moved a little.
#[test]
fn the_matrix_of_every_other_term_is_its_hessian_and_its_damping() {
    for name in
        ["hair", "bending_cloth", "awning", "pavilion", "damped_jelly", "quadratic_beams_2d", "balloon"]
    {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/");
        let scene = Scene::from_path(format!("{path}{name}.toml")).unwrap();
        let mut simulation =
            scene.assemble(UnstableStep::Accept).map_err(|p| format!("{p:?}")).unwrap().simulation;
        let size = simulation.length_scale();
        for (i, x) in simulation.state_mut().x_mut().iter_mut().enumerate() {
            *x += 1e-3 * size * (i as f64 * 1.3).sin();
        }
        let (hessian, damping) = match scene.dimension {
            2 => (defect::<2>(&mut simulation), damping_defect::<2>(&mut simulation)),
            _ => (defect::<3>(&mut simulation), damping_defect::<3>(&mut simulation)),
        };
        assert!(hessian < 1e-11, "{name}: Hessian off by {hessian:e}");
        assert!(damping < 1e-11, "{name}: damping off by {damping:e}");
    }
}

/// The same for the damping matrix; zero where nothing dissipates.
fn damping_defect<const D: usize>(simulation: &mut Simulation) -> f64 {
    let x = simulation.state().x().to_vec();
    let v: Vec<f64> = (0..x.len()).map(|i| (i as f64 * 0.3).cos()).collect();
    let system = simulation.system_mut();
    let free: Vec<bool> = system.inverse_mass().iter().map(|w| *w > 0.0).collect();
    let p: Vec<f64> = (0..x.len()).map(|i| if free[i] { (i as f64 * 0.7).sin() } else { 0.0 }).collect();
    let mut assembler = Assembler::<D>::new(system);
    let weights = Weights { inertia: 0.0, stiffness: 0.0, damping: 2.0 };
    assembler.assemble(system, At { x: &x, v: &v, psd: Psd::Exact, predicted_from: None }, weights);
    let (mut assembled, mut exact) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    assembler.matrix().multiply(&p, &mut assembled);
    system.damping_product(&x, &v, &p, &mut exact);
    let largest = exact.iter().fold(0.0, |m: f64, y| m.max(2.0 * y.abs()));
    let error = (0..x.len()).filter(|i| free[*i]).map(|i| (assembled[i] - 2.0 * exact[i]).abs());
    let error = error.fold(0.0, f64::max);
    if largest == 0.0 { error } else { error / largest }
}
