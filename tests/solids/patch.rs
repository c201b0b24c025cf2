//! Patch tests: where the boundary of any mesh moves affinely, the interior follows exactly.

use nalgebra::DVector;
use pliant_mesh::Mesh;
use serde_json::Value;

use crate::support::largest_difference;
use crate::support::solid::{KINDS, Kind, Probe, Solid, affine, every_material, isotropic, scattered};

/// `I + scale G`, `G` as in C1 of tests/verification.md.
fn gradient(dimension: usize, scale: f64) -> Vec<Vec<f64>> {
    let g = [[0.01, 0.02, -0.01], [-0.015, 0.03, 0.005], [0.02, -0.01, -0.02]];
    (0..dimension)
        .map(|i| (0..dimension).map(|j| f64::from(u8::from(i == j)) + scale * g[i][j]).collect())
        .collect()
}

/// A unit square or cube of `n` cells a side, inner vertices moved by up to 20 % of a cell; the unknowns of
/// the inner vertices.
fn perturbed(dimension: usize, kind: Kind, n: usize, elastic: &Value) -> (Solid, Vec<usize>) {
    let grid = Solid::grid(&vec![n; dimension], &vec![1.0; dimension], elastic.clone());
    let mut mesh = grid.of_kind(kind).mesh();
    for v in 0..mesh.vertex_count() {
        if is_inside(mesh.point(v)) {
            for c in 0..dimension {
                mesh.points[v * dimension + c] += 0.2 / n as f64 * scattered(v * dimension + c);
            }
        }
    }
    let solid = Solid::inline(&mesh, elastic.clone()).of_kind(kind);
    let rest = solid.probe().rest();
    let inner = (0..rest.len()).filter(|i| is_inside(&rest[i / dimension * dimension..][..dimension]));
    (solid, inner.collect())
}

/// True if this point of the unit square or cube is not on its boundary.
fn is_inside(point: &[f64]) -> bool {
    point.iter().all(|x| *x > 1e-9 && *x < 1.0 - 1e-9)
}

/// Moves the unknowns `free` to equilibrium by Newton's method on the dense stiffness.
fn equilibrium(probe: &mut Probe, start: &[f64], free: &[usize]) -> Vec<f64> {
    let mut x = start.to_vec();
    for _ in 0..30 {
        let forces = probe.forces(&x);
        let residual = DVector::from_iterator(free.len(), free.iter().map(|&i| forces[i]));
        let step = probe.stiffness_between(&x, free).lu().solve(&residual).unwrap();
        free.iter().zip(step.iter()).for_each(|(&i, s)| x[i] += s);
        if step.amax() < 1e-13 {
            break;
        }
    }
    x
}

// lecture 13, 18, 19; C1
#[test]
fn the_interior_of_an_affinely_moved_mesh_moves_affinely_in_every_material() {
    for (dimension, kind) in KINDS {
        for (spec, elastic) in every_material() {
            let n = match (dimension, kind) {
                _ if kind.order() == 2 => 2,
                (2, _) => 4,
                _ => 3,
            };
            let (solid, inner) = perturbed(dimension, kind, n, &elastic);
            let mut probe = solid.probe();
            for scale in [1.0, 10.0] {
                let f = gradient(dimension, scale);
                let rows: Vec<&[f64]> = f.iter().map(Vec::as_slice).collect();
                let exact = affine(&probe.rest(), &rows, &vec![0.3; dimension]);
                let mut start = exact.clone();
                inner.iter().for_each(|&i| start[i] += 0.02 * scattered(i));
                let found = equilibrium(&mut probe, &start, &inner);
                let error = largest_difference(&found, &exact);
                assert!(error < 1e-12, "{} in {dimension}D: inner vertices off by {error:e}", spec.name());
                // The reverse: at the affine positions nothing pulls at the inner vertices.
                let forces = probe.forces(&exact);
                let largest = forces.iter().fold(0.0f64, |m, f| m.max(f.abs()));
                let inside = inner.iter().fold(0.0f64, |m, &i| m.max(forces[i].abs()));
                assert!(inside < 1e-12 * largest, "{}: {inside:e} N of {largest:e} N", spec.name());
            }
        }
    }
}

// lecture 18: energy and boundary forces of the affine patch are those of one point of material.
#[test]
fn a_linear_patch_has_the_energy_and_the_forces_of_its_strain() {
    let (young, poisson) = (1e6, 0.3);
    let (mu, lambda) =
        (young / (2.0 * (1.0 + poisson)), young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)));
    let (solid, _) = perturbed(2, Kind::Order(1), 4, &isotropic("linear", young, poisson));
    let mut probe = solid.probe();
    let rest = probe.rest();
    let x = affine(&rest, &[&[1.01, 0.02], &[-0.015, 1.03]], &[0.0, 0.0]);
    let (e11, e22, e12) = (0.01, 0.03, 0.0025);
    let trace: f64 = e11 + e22;
    let psi = mu * (e11 * e11 + e22 * e22 + 2.0 * e12 * e12) + 0.5 * lambda * trace * trace;
    let energy = probe.energy(&x);
    assert!((energy / psi - 1.0).abs() < 1e-12, "{energy} J instead of {psi} J");
    // The right side pulls with P e_x = sigma e_x; the material pulls back.
    let forces = probe.forces(&x);
    let pull = |c: usize| -> f64 {
        let right = rest.chunks_exact(2).zip(forces.chunks_exact(2)).filter(|(x, _)| x[0] > 1.0 - 1e-9);
        right.map(|(_, f)| f[c]).sum()
    };
    // What the corners carry of the upper and the lower side cancels.
    let (s11, s12) = (2.0 * mu * e11 + lambda * trace, 2.0 * mu * e12);
    assert!((pull(0) + s11).abs() < 1e-12 * s11, "{} N instead of {} N", pull(0), -s11);
    assert!((pull(1) + s12).abs() < 1e-12 * s11, "{} N instead of {} N", pull(1), -s12);
}

/// A square whose lower side has a vertex `epsilon` above it, and one in the middle: triangle 0 is the
/// sliver.
fn with_sliver(epsilon: f64, elastic: Value) -> Solid {
    let mesh = Mesh {
        dimension: 2,
        points: vec![0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.5, epsilon, 0.5, 0.5],
        triangles: vec![[0, 1, 4], [4, 1, 5], [1, 2, 5], [2, 3, 5], [3, 0, 5], [0, 4, 5]],
        ..Mesh::default()
    };
    Solid::inline(&mesh, elastic)
}

// lecture 18; D7
#[test]
fn slivers_pass_the_patch_test() {
    for epsilon in [1e-3, 1e-6, 1e-9] {
        let solid = with_sliver(epsilon, isotropic("linear", 1e7, 0.3));
        let mut probe = solid.probe();
        let exact = affine(&probe.rest(), &[&[1.01, 0.02], &[-0.015, 1.03]], &[0.0, 0.0]);
        let inner: Vec<usize> = (8..12).collect();
        let mut start = exact.clone();
        inner.iter().for_each(|&i| start[i] += 0.1 * epsilon * scattered(i));
        let found = equilibrium(&mut probe, &start, &inner);
        let error = largest_difference(&found, &exact);
        assert!(error < 1e-14, "epsilon = {epsilon:e}: vertices off by {error:e}");
        // A vertex in the wrong place would spoil det F of the sliver first.
        probe.0.state_mut().x_mut().copy_from_slice(&found);
        let min_j = probe.0.diagnostics().min_j.unwrap();
        let expected = 1.01 * 1.03 + 0.015 * 0.02;
        let error = (min_j - expected).abs();
        assert!(error < 10.0 * 2e-17 / epsilon, "epsilon = {epsilon:e}: det F off by {error:e}");
    }
}

// C1: the patch test can fail.
#[test]
fn a_mesh_with_a_hole_in_its_connectivity_fails_the_patch_test() {
    let (solid, inner) = perturbed(2, Kind::Order(1), 4, &isotropic("stvk", 1e6, 0.3));
    let mut mesh = solid.mesh();
    mesh.triangles.remove(9);
    let mut probe = Solid::inline(&mesh, solid.elastic).probe();
    let exact = affine(&probe.rest(), &[&[1.1, 0.2], &[-0.15, 1.3]], &[0.0, 0.0]);
    let found = equilibrium(&mut probe, &exact, &inner);
    assert!(largest_difference(&found, &exact) > 1e-3);
}
