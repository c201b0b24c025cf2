//! Nodal integration: linear elements that are nearly incompressible and do not lock.

use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;
use serde_json::{Value, json};

use super::benchmarks::sheared;
use crate::support::assert_relative;
use crate::support::method;
use crate::support::solid::{Kind, Solid, affine, every_material, isotropic, shaken};

/// The rise of the end of the cantilever of C11, 10 x 1, of `n` times 20 x 2 cells.
fn rise(material: &str, poisson: f64, kind: Kind, n: usize, point: [f64; 2]) -> f64 {
    let solid = Solid::grid(&[20 * n, 2 * n], &[10.0, 1.0], isotropic(material, 1e6, poisson)).of_kind(kind);
    sheared(solid, 10.0, 1.0, 1.0, 1, point)[1]
}

// C11: what a remedy must reach: less than 2 % from the converged rise with 80 x 8 cells.
#[test]
fn nodally_integrated_triangles_do_not_lock() {
    for (poisson, converged) in [(0.3, 3.659_284e-3), (0.49, 3.031_588e-3), (0.4999, 2.989_947e-3)] {
        let nodal = rise("linear", poisson, Kind::Nodal, 4, [10.0, 0.5]);
        assert_relative(nodal, converged, 2e-2, &format!("nu = {poisson}"));
    }
    // And other models as the linear one: the rise is a thousandth of the height.
    for material in ["neo-hookean", "stable-neo-hookean", "corotated", "hencky"] {
        let nodal = rise(material, 0.4999, Kind::Nodal, 4, [10.0, 0.5]);
        assert_relative(nodal, 2.989_947e-3, 2e-2, material);
    }
}

// C9, nearly incompressible: the corner rises by 6.932, by 2.205 with 16 x 16 plain elements. Those that do
// not lock are no further from their limit than plain ones are where nu = 0.3: 5.837 and 7.057 of 7.78138.
#[test]
fn cooks_membrane_does_not_lock() {
    let corner = |n: usize, kind: Kind| {
        let elastic = isotropic("neo-hookean", 240.565, 0.4999);
        let mut solid = Solid::grid(&[1, 1], &[1.0, 1.0], elastic).of_kind(kind);
        solid.mesh = json!({ "cooks_membrane": { "cells": [n, n] } });
        sheared(solid, 48.0, 16.0, 100.0, 4, [48.0, 60.0])[1]
    };
    assert_relative(corner(16, Kind::Order(1)), 2.205, 1e-3, "plain");
    for (n, compressible) in [(8, 5.837_364_486), (16, 7.056_758_432)] {
        let gap = 1.0 - corner(n, Kind::Nodal) / 6.932;
        let usual = 1.0 - compressible / 7.78138;
        assert!(gap > 0.0 && gap < usual, "{n} x {n} cells: {gap}, where nu = 0.3 {usual}");
    }
}

/// How far the middle of the top of a quarter of a block sinks under a load on a quarter of it, as in
/// `incompressible_block.toml`.
fn sunk(kind: Kind, n: usize, poisson: f64) -> f64 {
    let mut solid =
        Solid::grid(&[n, n, n], &[1.0, 1.0, 1.0], isotropic("neo-hookean", 0.24e6, poisson)).of_kind(kind);
    let axes = ["x", "y", "z"];
    let plane = |axis: usize| {
        let mut normal = [0.0; 3];
        normal[axis] = 1.0;
        json!({ "half_space": { "normal": normal, "offset": 0.0 }, "axes": [axes[axis]] })
    };
    let top = json!({ "half_space": { "normal": [0.0, 0.0, -1.0], "offset": -1.0 }, "axes": ["x", "y"] });
    solid.pin = json!([plane(0), plane(1), plane(2), top]);
    solid.load = json!([{
        "box": { "min": [0.0, 0.0, 1.0], "max": [0.5, 0.5, 1.0] }, "traction": [0.0, 0.0, "-40e3 * t"],
    }]);
    let mut simulation = solid.simulation(method("quasi-static"), 1.0);
    let rest = simulation.state().x().to_vec();
    simulation.step().unwrap();
    let top = rest.chunks_exact(3).position(|x| x[0] == 0.0 && x[1] == 0.0 && x[2] == 1.0).unwrap();
    1.0 - simulation.state().x()[3 * top + 2]
}

// C11 in 3D, where docs/verification.md has no figure: quadratic elements on the same cells are the measure.
#[test]
fn nodally_integrated_tetrahedra_do_not_lock() {
    let quadratic = sunk(Kind::Order(2), 4, 0.4999);
    let locked = sunk(Kind::Order(1), 4, 0.4999);
    let nodal = sunk(Kind::Nodal, 4, 0.4999);
    assert!(locked < 0.01 * quadratic, "plain: {locked} of {quadratic}");
    assert_relative(nodal, quadratic, 0.05, "4 x 4 x 4 cells");
}

// C1: an affine motion has the energy density, and every element the stress, of one point of all of the
// material.
#[test]
fn an_affine_motion_has_the_energy_and_the_stress_of_the_whole_material() {
    for dimension in [2, 3] {
        for (spec, elastic) in every_material().into_iter().filter(|(spec, _)| spec.split(0.2).is_some()) {
            let cells = &[3, 3, 2][..dimension];
            let size = &[1.0, 0.9, 0.7][..dimension];
            let plain = Solid::grid(cells, size, elastic);
            let mut nodal = plain.clone().of_kind(Kind::Nodal).probe();
            let mut plain = plain.probe();
            let f = [[1.1, 0.2, -0.1], [-0.15, 1.3, 0.05], [0.2, -0.1, 0.8]];
            let rows: Vec<&[f64]> = f.iter().map(|row| &row[..dimension]).collect();
            let x = affine(&plain.rest(), &rows[..dimension], &vec![0.3; dimension]);
            let (expected, found) = (plain.energy(&x), nodal.energy(&x));
            assert_relative(found, expected, 1e-12, &format!("{} in {dimension}D", spec.name()));
            let states = [&plain, &nodal].map(|probe| probe.0.element_states());
            assert_eq!(states[0].len(), states[1].len());
            for (plain, nodal) in states[0].iter().zip(&states[1]) {
                let (p, q) = (plain.first_piola, nodal.first_piola);
                let error = (p - q).norm_squared().sqrt() / p.norm_squared().sqrt();
                assert!(error < 1e-11, "{} in {dimension}D: stress off by {error:e}", spec.name());
                let change = (plain.deformation_gradient - nodal.deformation_gradient).norm_squared();
                assert!(change < 1e-28, "{change:e}");
            }
        }
    }
}

// Everywhere but in affine motions the energy is less: psi at a mean is not the mean of psi.
#[test]
fn a_motion_that_is_not_affine_costs_less_than_with_plain_elements() {
    for dimension in [2, 3] {
        let plain = Solid::grid(
            &[3, 3, 2][..dimension],
            &[1.0, 1.0, 0.7][..dimension],
            isotropic("linear", 1e6, 0.49),
        );
        let mut nodal = plain.clone().of_kind(Kind::Nodal).probe();
        let mut plain = plain.probe();
        let x = shaken(&plain.rest(), 0.01);
        let (plain, nodal) = (plain.energy(&x), nodal.energy(&x));
        assert!(nodal < 0.7 * plain && nodal > 0.0, "{dimension}D: {nodal} J, {plain} J");
    }
}

/// The problems with this body of a scene.
fn refused(dimension: usize, body: Value) -> String {
    let mut all = json!({
        "mesh": { "grid": { "cells": vec![2; dimension], "spacing": 0.1 } },
        "elastic": { "neo-hookean": { "young": 1e5, "poisson": 0.49 } },
        "nodal_integration": {},
        "mass": { "density": 1000.0 },
    });
    for (key, value) in body.as_object().unwrap() {
        all[key] = value.clone();
    }
    let scene: Scene = serde_json::from_value(json!({
        "dimension": dimension,
        "time": { "integrator": "implicit-euler", "step": 1e-3, "duration": 0.01 },
        "body": [all],
    }))
    .unwrap();
    match scene.assemble(UnstableStep::Refuse) {
        Ok(_) => String::new(),
        Err(problems) => problems.iter().map(|p| p.message.clone()).collect::<Vec<_>>().join("; "),
    }
}

#[test]
fn what_is_left_of_a_scene_works_with_nodal_integration() {
    for dimension in [2, 3] {
        assert_eq!(
            refused(dimension, json!({ "damping": { "strain_rate": { "shear": 1.0, "second": 1.0 } } })),
            ""
        );
        assert_eq!(refused(dimension, json!({ "springs": { "stiffness": 1.0 }, "stress": "autodiff" })), "");
    }
    let plane = json!({ "linear": { "young": 1e5, "poisson": 0.49, "plane": "stress" } });
    assert_eq!(refused(2, json!({ "elastic": plane })), "");
}
