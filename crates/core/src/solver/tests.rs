//! The assembled matrix against products of the exact Hessian, term by term.

use super::hessian::{Assembler, At, Weights};
use crate::assembly::UnstableStep;
use crate::material::{MaterialSpec, Psd};
use crate::scene::Scene;
use crate::simulation::Simulation;

/// A grid of one material, wavy, its first column held, one coordinate of its last vertex held too.
fn grid(dimension: usize, material: &MaterialSpec, order: usize) -> Simulation {
    let (cells, size) =
        if dimension == 2 { ("[5, 4]", "[1.0, 0.8]") } else { ("[4, 3, 3]", "[1.0, 0.8, 0.7]") };
    let material = serde_json::to_value(material).unwrap();
    let scene: Scene = serde_json::from_value(serde_json::json!({
        "dimension": dimension,
        "time": { "integrator": "implicit-euler", "step": 0.01, "duration": 1.0 },
        "body": [{
            "mesh": { "grid": {
                "cells": serde_json::from_str::<serde_json::Value>(cells).unwrap(),
                "size": serde_json::from_str::<serde_json::Value>(size).unwrap(),
            } },
            "order": order,
            "elastic": material,
            "mass": { "density": 1000.0 },
            "pin": [{ "half_space": { "normal": vec![1.0; dimension], "offset": 0.1 } }],
        }],
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
    assembler.assemble(system, At { x: &x, v: &x, psd: Psd::Exact }, weights);
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
