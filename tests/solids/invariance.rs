//! Effect of rigid motion on every material on every mesh, and whether forces and stiffness belong to the
//! energy.

use serde_json::Value;

use crate::support::largest_difference;
use crate::support::solid::{KINDS, Kind, Probe, Solid, affine, every_material, shaken};

/// Kinds of second order have fewer cells, for as many vertices. A row of boxes of `hex20` has motions
/// without energy.
fn grid(dimension: usize, kind: Kind, elastic: &Value) -> Solid {
    let cells = match kind {
        Kind::Serendipity => [2, 2, 1],
        _ if kind.order() == 2 => [2, 1, 1],
        _ => [3, 2, 2],
    };
    Solid::grid(&cells[..dimension], &[1.5, 1.0, 1.0][..dimension], elastic.clone()).of_kind(kind)
}

/// A small grid of this material and positions that deform it.
fn deformed(dimension: usize, kind: Kind, elastic: &Value) -> (Probe, Vec<f64>) {
    let probe = grid(dimension, kind, elastic).probe();
    let x = shaken(&probe.rest(), 0.04);
    (probe, x)
}

fn rotation(dimension: usize) -> Vec<Vec<f64>> {
    let (s, c) = 0.7f64.sin_cos();
    let (t, d) = 1.9f64.sin_cos();
    if dimension == 2 {
        return vec![vec![c, -s], vec![s, c]];
    }
    // About z by 0.7, then about x by 1.9.
    vec![vec![c, -s, 0.0], vec![d * s, d * c, -t], vec![t * s, t * c, d]]
}

fn rows(matrix: &[Vec<f64>]) -> Vec<&[f64]> {
    matrix.iter().map(Vec::as_slice).collect()
}

fn largest(a: &[f64]) -> f64 {
    a.iter().fold(0.0, |m, a| m.max(a.abs()))
}

// lecture 14; C2
#[test]
fn rotating_a_deformed_body_rotates_its_forces_and_keeps_its_energy_exactly_where_the_model_says_so() {
    for (dimension, kind) in KINDS {
        for (spec, elastic) in every_material() {
            let (mut probe, x) = deformed(dimension, kind, &elastic);
            let q = rotation(dimension);
            let moved = affine(&x, &rows(&q), &vec![0.4; dimension]);
            let (before, after) = (probe.energy(&x), probe.energy(&moved));
            let turned = affine(&probe.forces(&x), &rows(&q), &vec![0.0; dimension]);
            let forces = probe.forces(&moved);
            let defect = largest_difference(&turned, &forces) / largest(&turned);
            let name = spec.name();
            if spec.about().frame_indifferent {
                assert!((after - before).abs() <= 1e-12 * before.abs(), "{name}: {before} J to {after} J");
                assert!(defect < 1e-12, "{name}: forces off by {defect:e}");
            } else {
                let changed = (after - before).abs() > 1e-3 * before.abs() || defect > 1e-3;
                // `dirichlet` is rotation invariant but has no rest shape; everything else here must show it.
                assert!(changed, "{name} says that it is not invariant, but it is");
            }
        }
    }
}

// lecture 14; C2
#[test]
fn internal_forces_have_no_sum_and_invariant_models_no_torque() {
    for (dimension, kind) in KINDS {
        for (spec, elastic) in every_material() {
            let (mut probe, x) = deformed(dimension, kind, &elastic);
            let forces = probe.forces(&x);
            let scale = largest(&forces);
            for c in 0..dimension {
                let sum: f64 = forces.iter().skip(c).step_by(dimension).sum();
                assert!(sum.abs() < 1e-12 * scale, "{}: sum of forces {sum:e}", spec.name());
            }
            if !spec.about().frame_indifferent {
                continue;
            }
            for (a, b) in [(0, 1), (1, 2), (2, 0)].into_iter().filter(|(a, b)| a.max(b) < &dimension) {
                let pairs = x.chunks_exact(dimension).zip(forces.chunks_exact(dimension));
                let torque: f64 = pairs.map(|(x, f)| x[a] * f[b] - x[b] * f[a]).sum();
                assert!(torque.abs() < 1e-12 * scale, "{}: torque {torque:e}", spec.name());
            }
        }
    }
}

// lecture 2, 15; C2 and B4 (v): without the derivative of R a rotation would cost 2 mu.
#[test]
fn at_rest_exactly_the_rigid_motions_are_free() {
    for (dimension, kind) in KINDS {
        for (spec, elastic) in every_material() {
            if !spec.about().has_rest_shape {
                continue;
            }
            let (mut probe, _) = deformed(dimension, kind, &elastic);
            let rest = probe.rest();
            let eigenvalues = probe.stiffness(&rest).symmetric_eigenvalues();
            let top = eigenvalues.max();
            let free = eigenvalues.iter().filter(|e| e.abs() < 1e-10 * top).count();
            // Models made of Lame parameters, and all whose energy minds no rotation, resist strain only;
            // |F - I|^2 resists rotation too.
            let of_strain = spec.lame().is_some() || spec.about().frame_indifferent;
            let expected = if of_strain { dimension * (dimension + 1) / 2 } else { dimension };
            assert_eq!(free, expected, "{} in {dimension}D", spec.name());
            assert!(eigenvalues.min() > -1e-10 * top, "{} is not stable at rest", spec.name());
        }
    }
}

// lecture 20; C2 and C4
#[test]
fn stiffness_is_symmetric_and_the_derivative_of_the_force() {
    for (dimension, kind) in KINDS {
        for (spec, elastic) in every_material() {
            let (mut probe, x) = deformed(dimension, kind, &elastic);
            let k = probe.stiffness(&x);
            let asymmetry = (&k - k.transpose()).amax() / k.amax();
            assert!(asymmetry < 1e-14, "{} in {dimension}D: asymmetry {asymmetry:e}", spec.name());
            let h = 1e-6;
            let mut worst = 0.0f64;
            for j in 0..x.len() {
                let (mut plus, mut minus) = (x.clone(), x.clone());
                plus[j] += h;
                minus[j] -= h;
                let (plus, minus) = (probe.forces(&plus), probe.forces(&minus));
                for i in 0..x.len() {
                    worst = worst.max((k[(i, j)] + (plus[i] - minus[i]) / (2.0 * h)).abs());
                }
            }
            assert!(worst < 1e-6 * k.amax(), "{} in {dimension}D: {:e}", spec.name(), worst / k.amax());
        }
    }
}

// lecture 1
#[test]
fn forces_are_minus_the_derivative_of_the_energy() {
    for (dimension, kind) in KINDS {
        for (spec, elastic) in every_material() {
            let (mut probe, x) = deformed(dimension, kind, &elastic);
            let forces = probe.forces(&x);
            let h = 1e-5;
            for j in 0..x.len() {
                let (mut plus, mut minus) = (x.clone(), x.clone());
                plus[j] += h;
                minus[j] -= h;
                let slope = (probe.energy(&plus) - probe.energy(&minus)) / (2.0 * h);
                let error = (forces[j] + slope).abs() / largest(&forces);
                assert!(error < 1e-7, "{} in {dimension}D: off by {error:e}", spec.name());
            }
        }
    }
}

// lecture 20
#[test]
fn automatic_differentiation_gives_the_same_forces() {
    for (dimension, kind) in KINDS {
        for (spec, elastic) in every_material() {
            let mut solid = grid(dimension, kind, &elastic);
            let mut analytic = solid.probe();
            solid.stress = "autodiff";
            let mut automatic = solid.probe();
            let x = shaken(&analytic.rest(), 0.04);
            let (analytic, automatic) = (analytic.forces(&x), automatic.forces(&x));
            let error = largest_difference(&automatic, &analytic) / largest(&analytic);
            assert!(error < 1e-12, "{} in {dimension}D: {error:e}", spec.name());
        }
    }
}
