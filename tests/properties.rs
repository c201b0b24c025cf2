//! Properties that hold for any mesh, any material that claims them, any deformation.

use pliant_mesh::Mesh;
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::support::solid::{Solid, affine, every_material};
use crate::support::{advance, largest_difference, methods, solve_to_rounding};

/// A grid of a few cells with moved vertices, and how to deform it.
#[derive(Clone, Debug)]
struct Sample {
    mesh: Mesh,
    elastic: Value,
    frame_indifferent: bool,
    /// Deformed positions.
    x: Vec<f64>,
    angle: f64,
    axis: [f64; 3],
    shift: [f64; 3],
    seed: u64,
}

fn samples() -> impl Strategy<Value = Sample> {
    let materials = every_material().len();
    let shape = (2usize..=3, 1usize..=3, 1usize..=3, 1usize..=2, 0..materials);
    let shifts = prop::collection::vec(-1.0f64..1.0, 2 * 3 * 4 * 4 * 3);
    let motion = (-3.0f64..3.0, prop::array::uniform3(-1.0f64..1.0), prop::array::uniform3(-2.0f64..2.0));
    (shape, shifts, motion, any::<u64>()).prop_map(|((d, nx, ny, nz, material), shifts, motion, seed)| {
        let (spec, elastic) = every_material().swap_remove(material);
        let size: Vec<f64> = [nx, ny, nz][..d].iter().map(|n| *n as f64).collect();
        let mut mesh = Solid::grid(&[nx, ny, nz][..d], &size, elastic.clone()).mesh();
        let n = mesh.points.len();
        // Cells of 1 m: neither change turns an element inside out.
        mesh.points.iter_mut().zip(&shifts).for_each(|(x, s)| *x += 0.08 * s);
        let x = mesh
            .points
            .iter()
            .zip(shifts[n..].iter().chain(&shifts))
            .map(|(x, s)| 1.1 * x + 0.08 * s)
            .collect();
        let (angle, axis, shift) = motion;
        Sample {
            mesh,
            elastic,
            frame_indifferent: spec.about().frame_indifferent,
            x,
            angle,
            axis,
            shift,
            seed,
        }
    })
}

impl Sample {
    fn solid(&self) -> Solid {
        Solid::inline(&self.mesh, self.elastic.clone())
    }

    /// A rotation about z in 2D, about the axis in 3D (Rodrigues).
    fn rotation(&self) -> Vec<Vec<f64>> {
        let (s, c) = self.angle.sin_cos();
        if self.mesh.dimension == 2 {
            return vec![vec![c, -s], vec![s, c]];
        }
        let a = [self.axis[0], self.axis[1], self.axis[2] + 1.5];
        let length = a.iter().map(|a| a * a).sum::<f64>().sqrt();
        let [x, y, z] = a.map(|a| a / length);
        let t = 1.0 - c;
        vec![
            vec![c + t * x * x, t * x * y - s * z, t * x * z + s * y],
            vec![t * x * y + s * z, c + t * y * y, t * y * z - s * x],
            vec![t * x * z - s * y, t * y * z + s * x, c + t * z * z],
        ]
    }
}

/// A permutation of `0..n` from a seed.
fn permutation(n: usize, seed: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n).collect();
    let mut state = seed | 1;
    for i in (1..n).rev() {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        order.swap(i, (state >> 33) as usize % (i + 1));
    }
    order
}

fn largest(a: &[f64]) -> f64 {
    a.iter().fold(0.0, |m, a| m.max(a.abs()))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    // lecture 14; C2
    #[test]
    fn energy_and_forces_do_not_depend_on_the_observer(sample in samples()) {
        prop_assume!(sample.frame_indifferent);
        let d = sample.mesh.dimension;
        let mut probe = sample.solid().probe();
        let q = sample.rotation();
        let rows: Vec<&[f64]> = q.iter().map(Vec::as_slice).collect();
        let moved = affine(&sample.x, &rows, &sample.shift[..d]);
        let (before, after) = (probe.energy(&sample.x), probe.energy(&moved));
        prop_assert!((before - after).abs() <= 1e-12 * before.abs(), "{before} J, {after} J");
        let turned = affine(&probe.forces(&sample.x), &rows, &vec![0.0; d]);
        let error = largest_difference(&probe.forces(&moved), &turned);
        prop_assert!(error < 1e-12 * largest(&turned), "forces off by {error:e} of {:e}", largest(&turned));
    }

    // lecture 14; C2
    #[test]
    fn internal_forces_have_neither_sum_nor_torque(sample in samples()) {
        let d = sample.mesh.dimension;
        let forces = sample.solid().probe().forces(&sample.x);
        let scale = largest(&forces) * largest(&sample.x).max(1.0);
        for c in 0..d {
            let sum: f64 = forces.iter().skip(c).step_by(d).sum();
            prop_assert!(sum.abs() < 1e-12 * scale, "sum {sum:e} of {scale:e}");
        }
        if sample.frame_indifferent {
            for (a, b) in [(0, 1), (1, 2), (2, 0)].into_iter().filter(|(a, b)| *a.max(b) < d) {
                let pairs = sample.x.chunks_exact(d).zip(forces.chunks_exact(d));
                let torque: f64 = pairs.map(|(x, f)| x[a] * f[b] - x[b] * f[a]).sum();
                prop_assert!(torque.abs() < 1e-12 * scale, "torque {torque:e} of {scale:e}");
            }
        }
    }

    // lecture 18
    #[test]
    fn the_numbering_of_vertices_and_elements_changes_nothing_but_rounding(sample in samples()) {
        let d = sample.mesh.dimension;
        let n = sample.mesh.vertex_count();
        // Old vertex `v` becomes `new[v]`.
        let new = permutation(n, sample.seed);
        let scattered_rows = |a: &[f64]| {
            let mut b = vec![0.0; a.len()];
            for (v, row) in a.chunks_exact(d).enumerate() {
                b[new[v] * d..new[v] * d + d].copy_from_slice(row);
            }
            b
        };
        let mut mesh = Mesh { dimension: d, points: scattered_rows(&sample.mesh.points), ..Mesh::default() };
        let rename = |v: u32| new[v as usize] as u32;
        for e in permutation(sample.mesh.triangles.len() * usize::from(d == 2), sample.seed ^ 77) {
            mesh.triangles.push(sample.mesh.triangles[e].map(rename));
        }
        for e in permutation(sample.mesh.tetrahedra.len(), sample.seed ^ 99) {
            mesh.tetrahedra.push(sample.mesh.tetrahedra[e].map(rename));
        }
        let (mut old, shuffled) = (sample.solid().probe(), Solid::inline(&mesh, sample.elastic.clone()));
        let mut shuffled = shuffled.probe();
        let (a, b) = (old.energy(&sample.x), shuffled.energy(&scattered_rows(&sample.x)));
        prop_assert!((a - b).abs() <= 1e-12 * a.abs(), "{a} J, {b} J");
        let expected = scattered_rows(&old.forces(&sample.x));
        let error = largest_difference(&shuffled.forces(&scattered_rows(&sample.x)), &expected);
        prop_assert!(error < 1e-12 * largest(&expected), "forces off by {error:e}");
        let mass = shuffled.0.system().mass();
        for (v, m) in old.0.system().mass().iter().enumerate() {
            prop_assert!((mass[new[v]] - m).abs() <= 1e-14 * m);
        }
    }

    // lecture 5; C3
    #[test]
    fn every_scheme_keeps_the_momentum_of_a_free_body(sample in samples()) {
        let d = sample.mesh.dimension;
        let mut solid = sample.solid();
        solid.mass = json!({ "density": 1e3 });
        // Models that are not invariant push, but a sum they have not.
        for method in methods() {
            let limit = solid.simulation(method, 1.0).stability_limit(1.0).unwrap().frequency;
            let mut simulation = solid.simulation(method, 0.1 / limit);
            solve_to_rounding(&mut simulation);
            let w = sample.angle;
            for (v, x) in simulation.state_mut().v_mut().chunks_exact_mut(d).zip(sample.x.chunks_exact(d)) {
                v.copy_from_slice(&sample.shift[..d]);
                v[0] -= w * x[1];
                v[1] += w * x[0];
            }
            simulation.state_mut().x_mut().copy_from_slice(&sample.x);
            let start = simulation.diagnostics();
            let mass: f64 = simulation.system().mass().iter().sum();
            advance(&mut simulation, 20);
            let end = simulation.diagnostics();
            let speed = simulation.state().v().iter().fold(1e-3f64, |m, v| m.max(v.abs()));
            for c in 0..d {
                let change = (end.linear_momentum[c] - start.linear_momentum[c]).abs() / (mass * speed);
                prop_assert!(change < 1e-13, "{} changes it by {change:e}", method.documentation.name);
            }
        }
    }
}
