//! C7: waves along a bar of 10 m without Poisson's effect, fixed at one end: `E = 1e6`, density 1000.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};
use pliant::element::MassRule;
use serde_json::json;

use crate::support::solid::{ELEMENTS, Solid, at_zero, isotropic};
use crate::support::{assert_relative, method};

const LENGTH: f64 = 10.0;
/// Speed of the waves [m/s].
fn speed() -> f64 {
    (1e6f64 / 1e3).sqrt()
}

/// A bar of `n` cubic cells, of which nothing moves across.
fn bar(dimension: usize, order: u8, n: usize) -> Solid {
    let side = LENGTH / n as f64;
    let (mut cells, mut size) = (vec![1; dimension], vec![side; dimension]);
    (cells[0], size[0]) = (n, LENGTH);
    let mut solid = Solid::grid(&cells, &size, isotropic("linear", 1e6, 0.0)).of_order(order);
    let everywhere =
        json!({ "normal": at_zero(dimension, 0)[0]["half_space"]["normal"], "offset": 2.0 * LENGTH });
    let across = &["y", "z"][..dimension - 1];
    solid.pin = json!([
        { "half_space": { "normal": everywhere["normal"], "offset": 0.0 }, "axes": ["x"] },
        { "half_space": everywhere, "axes": across },
    ]);
    solid
}

/// The lowest frequency [Hz] of `solid` with consistent masses, by inverse iteration.
fn consistent_frequency<const D: usize, const N: usize>(solid: &Solid) -> f64 {
    let mut probe = solid.probe();
    let rest = probe.rest();
    let place: Vec<Option<usize>> = {
        let mut count = 0;
        (0..rest.len() / D).map(|v| (rest[v * D] > 1e-9).then(|| (count, count += 1).0)).collect()
    };
    let free: Vec<usize> = (0..place.len()).filter(|v| place[*v].is_some()).map(|v| v * D).collect();
    let stiffness = probe.stiffness_between(&rest, &free);
    let mut mass = DMatrix::<f64>::zeros(free.len(), free.len());
    let mesh = solid.mesh();
    let mesh = if solid.order == 2 { mesh.promoted_to_quadratic().unwrap() } else { mesh };
    let rule = MassRule::<D, N>::new();
    for element in mesh.elements::<N>() {
        let nodes = element.map(|v| std::array::from_fn(|c| rest[v as usize * D + c]));
        for (row, v) in rule.consistent(&nodes).iter().zip(element) {
            for (entry, w) in row.iter().zip(element) {
                if let (Some(i), Some(j)) = (place[v as usize], place[w as usize]) {
                    mass[(i, j)] += 1000.0 * entry;
                }
            }
        }
    }
    let factor = stiffness.clone().cholesky().unwrap();
    let mut u = DVector::<f64>::repeat(free.len(), 1.0);
    for _ in 0..30 {
        u = factor.solve(&(&mass * u)).normalize();
    }
    (u.dot(&(&stiffness * &u)) / u.dot(&(&mass * &u))).sqrt() / TAU
}

/// The frequency [Hz] of the mode `j` of a line of `n` elements of this order with consistent masses.
/// Linear: the formula of C7. Quadratic: the matrices `E/3h [7 1 -8; 1 7 -8; -8 -8 16]` and `rho h/30 [4 -1
/// 2; -1 4 2; 2 2 16]`, the node in the middle eliminated, give `a + b cos kh = 0` in `(omega h / c)^2`.
fn line_frequency(order: u8, n: usize, j: usize) -> f64 {
    let (c, h) = (speed(), LENGTH / n as f64);
    let kh = (2 * j - 1) as f64 * PI / (2.0 * LENGTH) * h;
    if order == 1 {
        return (6.0 * (c / h).powi(2) * (1.0 - kh.cos()) / (2.0 + kh.cos())).sqrt() / TAU;
    }
    let defect = |square: f64| {
        let (middle, coupling) = (16.0 / 3.0 - 8.0 * square / 15.0, -8.0 / 3.0 - square / 15.0);
        let eliminated = coupling * coupling / middle;
        (7.0 / 3.0 - 2.0 * square / 15.0 - eliminated) + (1.0 / 3.0 + square / 30.0 - eliminated) * kh.cos()
    };
    let (mut low, mut high) = (0.9 * kh * kh, 1.1 * kh * kh);
    assert!(defect(low) > 0.0 && defect(high) < 0.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if defect(middle) > 0.0 { low = middle } else { high = middle }
    }
    low.sqrt() * c / h / TAU
}

// C7: f_1 = c / 4L. The elements contain those of a line, and the continuum contains them: their frequency
// is between the two, by the principle of Rayleigh and Ritz. For quadratic ones these are `(kh)^4 / 1440`,
// 4e-7, apart.
#[test]
fn the_first_axial_frequency_is_between_that_of_the_continuum_and_that_of_a_line_of_elements() {
    let exact = speed() / (4.0 * LENGTH);
    assert_relative(exact, 0.790_569_415_042_094_8, 1e-14, "C7");
    assert_relative(line_frequency(1, 10, 1), 0.791_382_435_390_347_9, 1e-14, "C7");
    for (dimension, order) in ELEMENTS {
        for n in [10, 20] {
            let solid = bar(dimension, order, n);
            let found = match (dimension, order) {
                (2, 1) => consistent_frequency::<2, 3>(&solid),
                (2, _) => consistent_frequency::<2, 6>(&solid),
                (_, 1) => consistent_frequency::<3, 4>(&solid),
                _ => consistent_frequency::<3, 10>(&solid),
            };
            let line = line_frequency(order, n, 1);
            let gap = if order == 2 { 5e-7 } else { 2e-3 };
            assert!(line / exact - 1.0 < gap, "{line} and {exact} tell nothing");
            let what = format!("{dimension}D, order {order}, {n} cells: {found} Hz");
            assert!(found > exact * (1.0 - 1e-11), "{what} is below the continuum's {exact} Hz");
            assert!(found < line * (1.0 + 1e-11), "{what} is above the {line} Hz of a line of elements");
        }
    }
}

// C7: the first frequency tends to c / 4L as found by `pliant modes`: with the second order of lumped masses
// in linear elements, with the fourth of consistent ones in quadratic elements.
#[test]
fn the_first_axial_frequency_converges_with_the_order_of_the_masses() {
    let exact = speed() / (4.0 * LENGTH);
    for (dimension, order) in ELEMENTS {
        let error = |n: usize| {
            let mut simulation = bar(dimension, order, n).simulation(method("velocity-verlet"), 1.0);
            (simulation.modes(1).unwrap().modes[0].frequency / exact - 1.0).abs()
        };
        let [coarse, fine] = [error(5), error(10)];
        let measured = (coarse / fine).log2();
        let expected = 2.0 * order as f64;
        assert!((measured - expected).abs() < 0.15, "{dimension}D, order {order}: order {measured:.3}");
        assert!(fine < 1e-2, "{dimension}D, order {order}: off by {fine:e}");
    }
}

/// Displacement of the end [m] under a force of 1000 N/m^2 on it from `t = 0` on, over time: `(t, u)`.
fn pulled(mut solid: Solid, h: f64, duration: f64) -> Vec<(f64, f64)> {
    let d = solid.dimension;
    let (mut normal, mut traction) = (vec![0.0; d], vec![0.0; d]);
    (normal[0], traction[0]) = (-1.0, 1000.0);
    solid.load = json!([{ "half_space": { "normal": normal, "offset": -LENGTH }, "traction": traction }]);
    let mut simulation = solid.simulation(method("velocity-verlet"), h);
    let tip = simulation.state().x().len() - d;
    let tip = if solid.order == 1 {
        tip
    } else {
        // Nodes in the middle of edges come last.
        let x = simulation.state().x();
        (0..x.len() / d).position(|v| x[v * d] > LENGTH - 1e-9).unwrap() * d
    };
    let steps = (duration / h).round() as usize;
    (1..=steps)
        .map(|step| {
            simulation.step().unwrap();
            (step as f64 * h, simulation.state().x()[tip] - LENGTH)
        })
        .collect()
}

/// d'Alembert: `F t c / (E A)` until the wave is back from the fixed end, then back at the same rate, and so
/// on.
fn dalembert(t: f64) -> f64 {
    let phase = (t * speed() / LENGTH).rem_euclid(4.0);
    1000.0 / 1e6 * LENGTH * if phase < 2.0 { phase } else { 4.0 - phase }
}

// C7: linear elements along a line with the masses of a chain, in steps in which a wave crosses one element,
// `sin(omega h/2) = sin(k h/2)`, are exact.
#[test]
fn linear_elements_carry_a_wave_exactly_where_it_crosses_one_in_a_step() {
    for dimension in [2, 3] {
        let mut solid = bar(dimension, 1, 10);
        // Wide enough that what varies across is stable at the limit too.
        let width = 40.0;
        let (mut cells, mut size) = (vec![1; dimension], vec![width; dimension]);
        (cells[0], size[0]) = (10, LENGTH);
        solid.mesh = json!({ "grid": { "cells": cells, "size": size } });
        // Each row of a chain weighs as much as stiffness of the cells hangs on it.
        let shares: &[f64] =
            if dimension == 2 { &[0.5, 0.5] } else { &[1.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0, 1.0 / 3.0] };
        let rest = solid.probe().rest();
        let whole = 1000.0 * width.powi(dimension as i32 - 1);
        let mass: Vec<f64> = rest
            .chunks_exact(dimension)
            .map(|x| {
                let row = x[1..].iter().fold(0, |row, x| 2 * row + usize::from(*x > 0.5 * width));
                whole * shares[row] * if x[0] > LENGTH - 1e-9 { 0.5 } else { 1.0 }
            })
            .collect();
        solid.mass = json!({ "per_vertex": mass });
        for (t, u) in pulled(solid, 1.0 / speed(), 4.0 * LENGTH / speed()) {
            let exact = dalembert(t);
            assert!((u - exact).abs() < 1e-11, "{dimension}D, t = {t}: {u} m instead of {exact} m");
        }
    }
}

// C7: in quadratic elements the end follows d'Alembert's saw to within the stretch of one element.
#[test]
fn the_end_of_a_bar_of_quadratic_elements_follows_dalembert() {
    for dimension in [2, 3] {
        for n in [10, 20] {
            let side = LENGTH / n as f64;
            let path = pulled(bar(dimension, 2, n), 0.05 * side / speed(), 3.0 * LENGTH / speed());
            let error = path.into_iter().map(|(t, u)| (u - dalembert(t)).abs()).fold(0.0, f64::max);
            let stretch = 1000.0 / 1e6 * side;
            assert!(error < stretch, "{dimension}D, {n} cells: off by {error:e} m");
        }
    }
}
