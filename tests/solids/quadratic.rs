//! Quadratic elements against exact solutions and numbers of independent codes.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};
use pliant::element::MassRule;
use serde_json::{Value, json};

use crate::support::assert_relative;
use crate::support::solid::{Probe, Solid, isotropic, scattered};

/// The nodes of every element: of `order` 2 those in the middle of edges as [`Solid`] numbers them.
pub(super) fn elements<const N: usize>(solid: &Solid) -> Vec<[u32; N]> {
    let mesh = solid.mesh();
    let mesh = if solid.order == 2 { mesh.promoted_to_quadratic().unwrap() } else { mesh };
    mesh.elements::<N>()
}

/// Positions of the nodes of an element.
pub(super) fn nodes<const D: usize, const N: usize>(x: &[f64], element: &[u32; N]) -> [[f64; D]; N] {
    element.map(|v| std::array::from_fn(|c| x[v as usize * D + c]))
}

/// Adds `loads` to the forces on the unknowns `free` and moves them to equilibrium: Newton's method, dense
/// stiffness, until a step is nothing beside all that came before.
fn equilibrium(probe: &mut Probe, start: &[f64], free: &[usize], loads: &[f64]) -> Vec<f64> {
    let mut x = start.to_vec();
    for _ in 0..30 {
        let forces = probe.forces(&x);
        let residual = DVector::from_iterator(free.len(), free.iter().map(|&i| forces[i] + loads[i]));
        let step = probe.stiffness_between(&x, free).cholesky().unwrap().solve(&residual);
        free.iter().zip(step.iter()).for_each(|(&i, s)| x[i] += s);
        let moved = free.iter().fold(0.0f64, |m, &i| m.max((x[i] - start[i]).abs()));
        if step.amax() < 1e-9 * moved {
            return x;
        }
    }
    panic!("no equilibrium");
}

/// Forces of a shear traction [N/m] along `y`, on the edges between nodes at `x`, from `y` to `y + length`:
/// consistent with quadratic edges, 1/6, 2/3, 1/6 of each; linear ones, a half each.
fn shear_on_the_right(rest: &[f64], x: f64, order: u8, traction: f64) -> Vec<f64> {
    let mut side: Vec<usize> = (0..rest.len() / 2).filter(|v| (rest[2 * v] - x).abs() < 1e-9).collect();
    side.sort_by(|a, b| rest[2 * a + 1].total_cmp(&rest[2 * b + 1]));
    let mut loads = vec![0.0; rest.len()];
    let order = usize::from(order);
    for edge in side.windows(order + 1).step_by(order) {
        let length = rest[2 * edge[order] + 1] - rest[2 * edge[0] + 1];
        let shares: &[f64] = if order == 2 { &[1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0] } else { &[0.5, 0.5] };
        for (v, share) in edge.iter().zip(shares) {
            loads[2 * v + 1] += traction * length * share;
        }
    }
    loads
}

/// Displacement of the node at `point` under a total of `force` [N/m] up, spread over the right end; left
/// end clamped.
fn bent(solid: &Solid, end: f64, height: f64, force: f64, point: [f64; 2], steps: u32) -> [f64; 2] {
    let mut probe = solid.probe();
    let rest = probe.rest();
    let loads = shear_on_the_right(&rest, end, solid.order, force / height);
    let total: f64 = loads.iter().sum();
    assert!((total / force - 1.0).abs() < 1e-12, "{total} N of {force} N");
    let free: Vec<usize> = (0..rest.len()).filter(|i| rest[i / 2 * 2] > 1e-9).collect();
    let mut x = rest.clone();
    for step in 1..=steps {
        let part: Vec<f64> = loads.iter().map(|l| l * f64::from(step) / f64::from(steps)).collect();
        x = equilibrium(&mut probe, &x, &free, &part);
    }
    let near = |v: &usize| (rest[2 * v] - point[0]).hypot(rest[2 * v + 1] - point[1]) < 1e-6;
    let v = (0..rest.len() / 2).find(near).unwrap();
    [x[2 * v] - rest[2 * v], x[2 * v + 1] - rest[2 * v + 1]]
}

fn cook(n: usize, order: u8, elastic: Value) -> Solid {
    let mut solid = Solid::grid(&[1, 1], &[1.0, 1.0], elastic).of_order(order);
    solid.mesh = json!({ "cooks_membrane": { "cells": [n, n] } });
    solid
}

// C9: Cook's membrane on a uniform mesh; an independent code has 7.702231495 for 8 x 8 quadratic cells with
// a rule of fourth degree, ours is of second: the last digits differ. Linear elements are far from the
// 7.78138 that both converge to.
#[test]
fn cooks_membrane_bends_as_an_independent_code_has_it() {
    let elastic = isotropic("neo-hookean", 240.565, 0.3);
    let [_, quadratic] = bent(&cook(8, 2, elastic.clone()), 48.0, 16.0, 100.0, [48.0, 60.0], 2);
    assert_relative(quadratic, 7.702_231_495, 1e-5, "quadratic, 8 x 8");
    let [_, linear] = bent(&cook(8, 1, elastic), 48.0, 16.0, 100.0, [48.0, 60.0], 2);
    assert_relative(linear, 5.837_364_486, 1e-8, "linear, 8 x 8");
}

// C11: a cantilever 10 x 1 under a unit shear at its end, nearly incompressible.
#[test]
fn quadratic_triangles_do_not_lock() {
    let rows = [(0.3, 3.659_284e-3, None), (0.4999, 2.989_947e-3, Some(2.866e-3))];
    for (poisson, converged, expected) in rows {
        let tip = |order: u8| {
            let solid =
                Solid::grid(&[20, 2], &[10.0, 1.0], isotropic("linear", 1e6, poisson)).of_order(order);
            bent(&solid, 10.0, 1.0, 1.0, [10.0, 0.5], 1)[1]
        };
        let (linear, quadratic) = (tip(1), tip(2));
        assert!((quadratic / converged - 1.0).abs() < 0.05, "nu = {poisson}: {quadratic:e}");
        if let Some(expected) = expected {
            assert_relative(quadratic, expected, 2e-4, "quadratic, 20 x 2");
            // Locked; the last digits depend on how the diagonals run, 0.0399e-3 with those of C11.
            assert_relative(linear, 0.0399e-3, 2e-2, "linear, 20 x 2");
        }
    }
}

/// The lowest `count` frequencies [Hz] of a solid of consistent mass that is clamped at `x = 0`, ascending.
fn frequencies(solid: &Solid, density: f64, count: usize) -> Vec<f64> {
    let mut probe = solid.probe();
    let rest = probe.rest();
    let free: Vec<usize> = (0..rest.len()).filter(|i| rest[i / 2 * 2] > 1e-9).collect();
    let stiffness = probe.stiffness_between(&rest, &free);
    let mass = MassRule::<2, 6>::new();
    let place: std::collections::BTreeMap<usize, usize> =
        free.iter().enumerate().map(|(place, &unknown)| (unknown, place)).collect();
    let mut m = DMatrix::<f64>::zeros(free.len(), free.len());
    for element in elements::<6>(solid) {
        let consistent = mass.consistent(&nodes::<2, 6>(&rest, &element));
        for (a, v) in element.iter().enumerate() {
            for (b, w) in element.iter().enumerate() {
                for c in 0..2 {
                    let at = |v: u32| place.get(&(v as usize * 2 + c));
                    if let (Some(&i), Some(&j)) = (at(*v), at(*w)) {
                        m[(i, j)] += density * consistent[a][b];
                    }
                }
            }
        }
    }
    // Subspace iteration with K^-1 M; Bathe 2014, Finite Element Procedures, section 11.6.
    let factor = stiffness.cholesky().unwrap();
    let mut space = DMatrix::from_fn(free.len(), 2 * count + 8, |i, j| scattered(i * 31 + j * 17));
    let mut squares = vec![];
    for _ in 0..25 {
        let mass_times = &m * &space;
        let mut solved = factor.solve(&mass_times);
        // High modes come out small: of length one the Gram matrix stays positive.
        let mut mass_times = mass_times;
        for (mut column, mut times) in solved.column_iter_mut().zip(mass_times.column_iter_mut()) {
            let length = column.norm();
            column /= length;
            times /= length;
        }
        // K and M on the subspace of `solved`.
        let small_stiffness = solved.transpose() * mass_times;
        let small_mass = solved.transpose() * (&m * &solved);
        let lower = small_mass.cholesky().unwrap().l();
        let half = lower.solve_lower_triangular(&small_stiffness).unwrap();
        let whole = lower.solve_lower_triangular(&half.transpose()).unwrap();
        let pairs = (0.5 * (&whole + whole.transpose())).symmetric_eigen();
        let vectors = lower.transpose().solve_upper_triangular(&pairs.eigenvectors).unwrap();
        space = solved * vectors;
        squares = pairs.eigenvalues.iter().copied().collect();
        squares.sort_by(f64::total_cmp);
    }
    squares[..count].iter().map(|s| s.sqrt() / (2.0 * PI)).collect()
}

// C6: the first frequency of the cantilever with 40 x 4 quadratic cells; converged 0.05321494 Hz.
// C8: NAFEMS FV32 in plane stress, 16 x 8 quadratic cells.
#[test]
fn frequencies_with_consistent_mass_are_those_of_an_independent_code() {
    let solid = Solid::grid(&[40, 4], &[10.0, 1.0], isotropic("linear", 1e6, 0.3)).of_order(2);
    let f = frequencies(&solid, 1000.0, 1);
    assert_relative(f[0], 0.053_256_1, 2e-6, "cantilever 40 x 4");
    let elastic = json!({ "linear": { "young": 200e9, "poisson": 0.3, "plane": "stress" } });
    let mut solid = Solid::grid(&[1, 1], &[1.0, 1.0], elastic).of_order(2);
    solid.mesh = json!({ "tapered_beam": { "cells": [16, 8] } });
    let f = frequencies(&solid, 8000.0, 6);
    let expected = [44.624_00, 130.0406, 162.6994, 246.0979, 380.0498, 391.4457];
    for (f, expected) in f.iter().zip(expected) {
        assert_relative(*f, expected, 1e-5, "FV32 16 x 8");
    }
}
