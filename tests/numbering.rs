//! A mesh whose neighbours have far-apart numbers is renumbered inside a simulation; its users do not notice.

use std::sync::atomic::AtomicBool;

use pliant::observer::{Frame, Observer, ObserverError};
use pliant::run::{Plan, run};
use pliant::simulation::StepError;
use pliant_mesh::Mesh;
use serde_json::json;

use crate::support::method;
use crate::support::solid::{Solid, at_zero, isotropic, scattered};

/// Cells a side: just enough vertices for an order to matter.
const SIDE: usize = 96;

/// A sheet held at its left edge under gravity, and the same with vertex `v` called `new(v)`.
fn sheets() -> (Solid, Solid, impl Fn(usize) -> usize) {
    let complete = |mut solid: Solid| {
        solid.pin = at_zero(2, 0);
        solid.gravity = Some(vec![0.0, -9.81]);
        solid
    };
    let elastic = isotropic("stable-neo-hookean", 1e6, 0.3);
    let grid = Solid::grid(&[SIDE, SIDE], &[1.0, 1.0], elastic.clone());
    let mesh = grid.mesh();
    let n = mesh.vertex_count();
    // 97^2 vertices; 41 has no factor in common with it.
    let new = move |v: usize| v * 41 % n;
    let mut shuffled = Mesh { dimension: 2, points: vec![0.0; 2 * n], ..Mesh::default() };
    for v in 0..n {
        shuffled.points[2 * new(v)..][..2].copy_from_slice(mesh.point(v));
    }
    for e in 0..mesh.triangles.len() {
        let triangle = mesh.triangles[e * 1009 % mesh.triangles.len()];
        shuffled.triangles.push(triangle.map(|v| new(v as usize) as u32));
    }
    (complete(grid), complete(Solid::inline(&shuffled, elastic)), new)
}

fn renamed(rows: &[f64], new: impl Fn(usize) -> usize) -> Vec<f64> {
    let mut out = vec![0.0; rows.len()];
    for (v, row) in rows.chunks_exact(2).enumerate() {
        out[2 * new(v)..][..2].copy_from_slice(row);
    }
    out
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold(0.0, |m, (a, b)| m.max((a - b).abs()))
}

/// Keeps what it is shown.
#[derive(Default)]
struct Keeper(Vec<(Vec<f64>, Vec<f64>)>);

impl Observer for Keeper {
    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        self.0.push((frame.x.to_vec(), frame.v.to_vec()));
        Ok(())
    }
}

// lecture 18
#[test]
fn a_shuffled_mesh_moves_like_the_ordered_one() {
    let (ordered, shuffled, new) = sheets();
    let h = 1e-5;
    let mut runs = [&ordered, &shuffled].map(|solid| {
        let mut simulation = solid.simulation(method("velocity-verlet"), h);
        let mut keeper = Keeper::default();
        let plan = Plan { duration: 20.0 * h, rate: 0.1 / h };
        run(&mut simulation, &plan, &mut [&mut keeper], &AtomicBool::new(false));
        (simulation, keeper.0)
    });
    assert!(runs[0].0.numbering().is_identity());
    assert!(!runs[1].0.numbering().is_identity());
    assert_eq!(runs[0].1.len(), 3);
    for ((x, v), (x_shuffled, v_shuffled)) in runs[0].1.iter().zip(&runs[1].1) {
        assert!(largest_difference(x_shuffled, &renamed(x, &new)) < 1e-14);
        assert!(largest_difference(v_shuffled, &renamed(v, &new)) < 1e-11);
    }
    // It fell: 1e-8 m and 2e-3 m/s are far above those bounds.
    let fallen = runs[0].1[2].1.iter().fold(0.0f64, |m, v| m.max(-v));
    assert!((fallen / (9.81 * 20.0 * h) - 1.0).abs() < 1e-3, "{fallen}");
    // The pure map takes and gives the order of the scene, too.
    let (simulation, frames) = &mut runs[1];
    let (mut x, mut v) = frames[0].clone();
    for _ in 0..20 {
        simulation.advance(&mut x, &mut v).unwrap();
    }
    assert_eq!((&x, &v), (&frames[2].0, &frames[2].1));
}

// A step that fails names the vertex of the scene.
#[test]
fn a_failed_step_names_the_vertex_of_the_scene() {
    let (_, shuffled, _) = sheets();
    let mut simulation = shuffled.simulation(method("symplectic-euler"), 1e-5);
    let (x, mut v) = (simulation.positions().into_owned(), simulation.velocities().into_owned());
    v[2 * 1234] = f64::INFINITY;
    assert_ne!(simulation.numbering().internal(1234), 1234);
    let error = simulation.advance(&mut x.clone(), &mut v).unwrap_err();
    let StepError::NotFinite { vertex, .. } = error else { panic!("{error}") };
    assert_eq!(vertex, Some(1234));
}

// Promise 1, with as many vertices as it takes for the pass over them to be shared out.
#[test]
fn a_large_sheet_gives_the_same_bits_on_any_number_of_threads() {
    let (_, shuffled, _) = sheets();
    let bits = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut simulation = shuffled.simulation(method("velocity-verlet"), 1e-5);
            for (k, v) in simulation.state_mut().v_mut().iter_mut().enumerate() {
                *v += scattered(k);
            }
            for _ in 0..5 {
                simulation.step().unwrap();
            }
            let state = simulation.state();
            state.x().iter().chain(state.v()).map(|x| x.to_bits()).collect::<Vec<u64>>()
        })
    };
    let one = bits(1);
    for threads in [2, 3, 8] {
        assert!(bits(threads) == one, "{threads} threads give other bits than one");
    }
}

// Small bodies keep their numbers, whatever these are.
#[test]
fn a_small_mesh_is_left_alone() {
    let mut solid = Solid::grid(&[4, 4], &[1.0, 1.0], isotropic("corotated", 1e5, 0.3));
    solid.mesh =
        json!({ "inline": { "points": [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], "triangles": [[0, 1, 2]] } });
    assert!(solid.simulation(method("symplectic-euler"), 1e-5).numbering().is_identity());
}
