//! Plane stress: a sheet that is free to change its thickness.

use serde_json::{Value, json};

use crate::support::assert_relative;
use crate::support::solid::{Solid, at_zero};

fn linear(young: f64, poisson: f64, plane: &str) -> Value {
    json!({ "linear": { "young": young, "poisson": poisson, "plane": plane } })
}

/// Displacements of the free unknowns under forces, by conjugate gradients on the assembled stiffness.
fn displacements(solid: &Solid, force: &[f64]) -> Vec<f64> {
    let mut probe = solid.probe();
    let rest = probe.rest();
    let d = probe.0.system().dimension();
    let pinned: Vec<bool> = (0..rest.len()).map(|i| probe.0.system().is_pinned(i / d)).collect();
    let masked =
        |v: &[f64]| v.iter().zip(&pinned).map(|(v, p)| if *p { 0.0 } else { *v }).collect::<Vec<_>>();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut u = vec![0.0; rest.len()];
    let mut residual = masked(force);
    let (mut direction, mut product) = (residual.clone(), vec![0.0; rest.len()]);
    let (mut norm, start) = (dot(&residual, &residual), dot(&residual, &residual));
    while norm > 1e-26 * start {
        probe.0.system_mut().hessian_product(&rest, &direction, &mut product);
        product = masked(&product);
        let step = norm / dot(&direction, &product);
        for i in 0..u.len() {
            u[i] += step * direction[i];
            residual[i] -= step * product[i];
        }
        let next = dot(&residual, &residual);
        for i in 0..u.len() {
            direction[i] = residual[i] + next / norm * direction[i];
        }
        norm = next;
    }
    u
}

/// The force at each vertex of the edge at `x` under a uniform load of resultant `total`.
fn on_the_edge(rest: &[f64], x: f64, total: [f64; 2]) -> Vec<f64> {
    let mut edge: Vec<usize> = (0..rest.len() / 2).filter(|&v| (rest[2 * v] - x).abs() < 1e-9).collect();
    edge.sort_by(|&a, &b| rest[2 * a + 1].total_cmp(&rest[2 * b + 1]));
    let length = rest[2 * edge[edge.len() - 1] + 1] - rest[2 * edge[0] + 1];
    let mut force = vec![0.0; rest.len()];
    for pair in edge.windows(2) {
        let share = 0.5 * (rest[2 * pair[1] + 1] - rest[2 * pair[0] + 1]) / length;
        for &v in pair {
            force[2 * v] += share * total[0];
            force[2 * v + 1] += share * total[1];
        }
    }
    force
}

/// A sheet drawn at its ends: the stress is E times the strain, the width and the thickness shrink by
/// nu times it. In plane strain it is stiffer by 1 / (1 - nu^2).
#[test]
fn a_drawn_sheet_has_the_modulus_of_the_material() {
    let (young, poisson, load) = (2e6, 0.3, 50.0);
    for (plane, modulus, ratio) in
        [("stress", young, poisson), ("strain", young / (1.0 - poisson * poisson), poisson / (1.0 - poisson))]
    {
        // Held at its middle alone; the pulls on both sides do not turn it.
        let mut solid = Solid::grid(&[4, 2], &[2.0, 1.0], linear(young, poisson, plane));
        solid.mesh = json!({ "grid": { "cells": [4, 2], "size": [2.0, 1.0], "origin": [-1.0, -0.5] } });
        solid.pin = json!([{ "box": { "min": [-0.1, -0.1], "max": [0.1, 0.1] } }]);
        let rest = solid.probe().rest();
        let mut force = on_the_edge(&rest, 1.0, [load, 0.0]);
        for (f, g) in force.iter_mut().zip(on_the_edge(&rest, -1.0, [load, 0.0])) {
            *f -= g;
        }
        let u = displacements(&solid, &force);
        // The thickness of the sheet is 1 m, so is its width.
        let strain = load / modulus;
        let scale = 2.0 * strain;
        for v in 0..rest.len() / 2 {
            let (x, y) = (rest[2 * v], rest[2 * v + 1]);
            assert!((u[2 * v] - strain * x).abs() < 1e-10 * scale, "{plane}: {u:?}");
            assert!((u[2 * v + 1] + ratio * strain * y).abs() < 1e-10 * scale, "{plane}: {u:?}");
        }
        let mut probe = solid.probe();
        for (x, u) in probe.0.state_mut().x_mut().iter_mut().zip(&u) {
            *x += u;
        }
        for state in probe.0.element_states() {
            let (f, p) = (&state.deformation_gradient, &state.first_piola);
            assert_relative(p[0][0], load, 1e-9, plane);
            let thinner = if plane == "stress" { poisson * strain } else { 0.0 };
            assert!((f[2][2] - 1.0 + thinner).abs() < 1e-14, "{plane}: {f:?}");
            let across = if plane == "stress" { 0.0 } else { poisson * load };
            assert!((p[2][2] - across).abs() < 1e-9 * load, "{plane}: {p:?}");
        }
    }
}

// C9: Cook's membrane in plane stress, E = 1, nu = 1/3, F = 1, 32 x 32 cells of linear triangles; an
// independent code.
#[test]
fn cooks_membrane_bends_as_an_independent_code_has_it() {
    let mut solid = Solid::grid(&[1, 1], &[1.0, 1.0], linear(1.0, 1.0 / 3.0, "stress"));
    solid.mesh = json!({ "cooks_membrane": { "cells": [32, 32] } });
    solid.pin = at_zero(2, 0);
    let rest = solid.probe().rest();
    let u = displacements(&solid, &on_the_edge(&rest, 48.0, [0.0, 1.0]));
    let middle = rest.chunks(2).position(|p| (p[0] - 48.0).abs() + (p[1] - 52.0).abs() < 1e-9).unwrap();
    assert_relative(u[2 * middle + 1], 23.275_121_9, 1e-8, "the middle of the loaded edge");
}
