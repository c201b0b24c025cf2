//! Natural frequencies by dense eigenproblems of the assembled stiffness.

use nalgebra::DMatrix;
use pliant::material::{Lame, MaterialSpec};
use pliant::modes::{MassMatrix, Modes};
use serde_json::{Value, json};
use std::f64::consts::{PI, TAU};

use crate::support::solid::{Solid, at_zero, isotropic};
use crate::support::{assert_relative, method};

/// Eigenvalues and vectors of `M^-1/2 K M^-1/2` over the vertices that are not pinned, and their unknowns.
fn modes(solid: &Solid) -> (Vec<f64>, DMatrix<f64>, Vec<usize>) {
    let mut probe = solid.probe();
    let rest = probe.rest();
    let d = probe.0.system().dimension();
    let free: Vec<usize> = (0..rest.len()).filter(|i| !probe.0.system().is_pinned(i / d)).collect();
    let mut k = probe.stiffness_between(&rest, &free);
    let root = |i: usize| probe.0.system().mass()[free[i] / d].sqrt();
    for i in 0..free.len() {
        for j in 0..free.len() {
            k[(i, j)] /= root(i) * root(j);
        }
    }
    let eigen = k.symmetric_eigen();
    (eigen.eigenvalues.iter().copied().collect(), eigen.eigenvectors, free)
}

/// 10 m x 1 m, nu = 0, ten cells along it, clamped at x = 0; masses of a chain of ten, so that the axial
/// modes are those of the chain.
fn axial_bar(material: &str) -> Solid {
    let mut solid = Solid::grid(&[10, 1], &[10.0, 1.0], isotropic(material, 1e6, 0.0));
    let mut mass: Vec<f64> = vec![500.0; 22];
    mass[20..].fill(250.0);
    solid.mass = json!({ "per_vertex": mass });
    solid.pin = at_zero(2, 0);
    solid
}

// lecture 2; C7: f_j = (2 c / h) sin(k_j h / 2) / (2 pi), k_j = (2 j - 1) pi / (2 L), exactly.
#[test]
fn the_axial_frequencies_of_a_lumped_bar_are_those_of_a_chain() {
    for material in ["linear", "corotated", "stvk", "neo-hookean", "stable-neo-hookean"] {
        let (eigenvalues, vectors, free) = modes(&axial_bar(material));
        let axial: Vec<f64> = (0..eigenvalues.len())
            .filter(|&j| (0..free.len()).all(|i| free[i] % 2 == 0 || vectors[(i, j)].abs() < 1e-8))
            .map(|j| eigenvalues[j].sqrt() / TAU)
            .collect();
        let (c, h) = ((1e6f64 / 1e3).sqrt(), 1.0);
        for j in 1..=10 {
            let k = f64::from(2 * j - 1) * PI / 20.0;
            let expected = 2.0 * c / h * (0.5 * k * h).sin() / TAU;
            if j == 1 {
                assert_relative(expected, 0.789_756_894_082_592_2, 1e-14, "C7");
            }
            let nearest = axial.iter().fold(0.0, |best: f64, f| {
                if (f - expected).abs() < (best - expected).abs() { *f } else { best }
            });
            assert_relative(nearest, expected, 1e-11, &format!("{material}, axial mode {j}"));
        }
    }
}

// lecture 17; C13, D12: every material is the same at small strains; 3D materials with nu = 0.45 too.
#[test]
fn the_largest_frequency_is_that_of_an_independent_code_in_every_material() {
    let beam = |elastic: Value| {
        let mut solid = Solid::grid(&[8, 2], &[4.0, 1.0], elastic);
        solid.pin = at_zero(2, 0);
        solid
    };
    let bar = |elastic: Value| {
        let mut solid = Solid::grid(&[1, 1, 4], &[1.0, 1.0, 4.0], elastic);
        solid.pin = at_zero(3, 2);
        solid
    };
    let materials = crate::support::solid::every_material();
    // Those that have any Poisson's ratio; with the other parameters of their examples.
    let with = |elastic: &Value, name: &str, young: f64, poisson: f64| {
        let mut elastic = elastic.clone();
        if name == "expression" {
            let Lame { lambda, mu } = Lame::new(young, poisson);
            elastic[name]["parameters"] = json!({ "mu": mu, "lambda": lambda });
        } else {
            elastic[name]["young"] = young.into();
            elastic[name]["poisson"] = poisson.into();
        }
        elastic
    };
    let takes_any = |name: &str, elastic: &Value| {
        let spec: MaterialSpec = serde_json::from_value(with(elastic, name, 1e6, 0.3)).unwrap();
        spec.check().is_ok()
    };
    let isotropic_ones: Vec<(&str, Value)> = materials
        .iter()
        .filter(|(spec, elastic)| spec.lame().is_some() && takes_any(spec.name(), elastic))
        .map(|(spec, elastic)| (spec.name(), elastic.clone()))
        .collect();
    assert!(isotropic_ones.len() >= 12);
    for (name, elastic) in isotropic_ones {
        let cases = [
            (beam(with(&elastic, name, 1e6, 0.3)), 212.231_692_628),
            (bar(with(&elastic, name, 1e6, 0.45)), 211.994_694_964),
            (Solid::grid(&[3, 3], &[1.0, 1.0], with(&elastic, name, 1e7, 0.3)), 1_012.153_184_36),
        ];
        for (solid, expected) in cases {
            let (eigenvalues, ..) = modes(&solid);
            let dense = eigenvalues.iter().fold(0.0f64, |m, e| m.max(*e)).sqrt();
            assert_relative(dense, expected, 1e-11, &format!("{name}, dense"));
            let lanczos = solid.probe().0.stability_limit(1.0).unwrap().frequency;
            assert_relative(lanczos, expected, 1e-11, &format!("{name}, Lanczos"));
        }
    }
}

/// Result of `pliant modes`.
fn found(solid: &Solid, count: usize) -> Modes {
    solid.simulation(method("implicit-euler"), 1.0).modes(count).unwrap()
}

// C6, C8: the frequencies of an independent code with consistent mass: a cantilever of 40 x 4 quadratic
// cells, NAFEMS FV32 in plane stress.
#[test]
fn modes_of_quadratic_elements_have_the_frequencies_of_consistent_mass() {
    let mut solid = Solid::grid(&[40, 4], &[10.0, 1.0], isotropic("linear", 1e6, 0.3)).of_order(2);
    solid.pin = at_zero(2, 0);
    let modes = found(&solid, 1);
    assert_eq!(modes.mass_matrix, MassMatrix::Consistent);
    assert_relative(modes.modes[0].frequency, 0.053_256_1, 2e-6, "cantilever 40 x 4");
    let elastic = json!({ "linear": { "young": 200e9, "poisson": 0.3, "plane": "stress" } });
    let mut solid = Solid::grid(&[1, 1], &[1.0, 1.0], elastic).of_order(2);
    (solid.mesh, solid.mass) =
        (json!({ "tapered_beam": { "cells": [16, 8] } }), json!({ "density": 8000.0 }));
    solid.pin = at_zero(2, 0);
    let expected = [44.624_00, 130.0406, 162.6994, 246.0979, 380.0498, 391.4457];
    for (mode, expected) in found(&solid, 6).modes.iter().zip(expected) {
        assert_relative(mode.frequency, expected, 1e-5, "FV32 16 x 8");
    }
}

/// A bar that is held at its foot and can only be stretched: omega = pi/2 sqrt(E/rho) / L.
fn stretched(dimension: usize, cells: usize, mass: Value) -> Modes {
    let (mut count, mut size) = (vec![1; dimension], vec![0.1; dimension]);
    (count[0], size[0]) = (cells, 1.0);
    let mut solid = Solid::grid(&count, &size, isotropic("linear", 1e6, 0.0)).of_order(2);
    let across: Vec<&str> = ["y", "z"][..dimension - 1].to_vec();
    let mut normal = vec![0.0; dimension];
    normal[0] = 1.0;
    solid.pin = json!([
        { "half_space": { "normal": normal, "offset": 0.0 }, "axes": ["x"] },
        { "half_space": { "normal": normal.iter().map(|n| -n).collect::<Vec<f64>>(), "offset": 1.0 }, "axes": across },
    ]);
    solid.mass = mass;
    found(&solid, 1)
}

// Of fourth order in the size of the elements, 2 (p = 2), and an upper bound, as Galerkin's method has it;
// lumped masses are of second.
#[test]
fn frequencies_of_quadratic_elements_converge_with_the_fourth_order_from_above() {
    let exact = 0.5 * PI * (1e6f64 / 1e3).sqrt();
    for dimension in [2, 3] {
        let error = |cells: usize| {
            stretched(dimension, cells, json!({ "density": 1000.0 })).modes[0].omega / exact - 1.0
        };
        let (coarse, fine) = (error(4), error(8));
        let order = (coarse / fine).log2();
        assert!(fine > 0.0 && order > 3.8, "{dimension}D: {coarse:e} {fine:e}, order {order}");
    }
    // Masses that a scene gives vertex by vertex are those that it has.
    let given = stretched(2, 2, json!({ "per_vertex": 1.0 }));
    assert_eq!(given.mass_matrix, MassMatrix::Lumped);
}

// D12 with consistent masses: rigid motion is found to be rigid, and has all of the mass.
#[test]
fn free_quadratic_bodies_have_the_modes_of_rigid_motion() {
    for (dimension, rigid) in [(2, 3), (3, 6)] {
        let mut solid =
            Solid::grid(&vec![2; dimension], &vec![0.6; dimension], isotropic("corotated", 1e7, 0.3))
                .of_order(2);
        solid.pin = json!([]);
        let modes = found(&solid, rigid + 2);
        assert_eq!(modes.mass_matrix, MassMatrix::Consistent);
        for (j, mode) in modes.modes.iter().enumerate() {
            assert_eq!(mode.omega == 0.0, j < rigid, "{dimension}D, mode {j}: {}", mode.omega);
        }
        let mass = 1000.0 * 0.6f64.powi(dimension as i32);
        for axis in 0..dimension {
            assert_relative(modes.free_mass[axis], mass, 1e-12, "mass");
            let share: f64 = modes.modes[..rigid].iter().map(|mode| mode.effective_mass[axis]).sum();
            assert!((share - 1.0).abs() < 1e-8, "{dimension}D, axis {axis}: {share}");
        }
    }
}
