//! Facts about the levels and about what the V-cycle is good for.

use rayon::ThreadPoolBuilder;
use serde_json::json;

use pliant::material::Psd;
use pliant::solver::block_matrix::BlockMatrix;
use pliant::solver::conjugate_gradients::Preconditioner;
use pliant::solver::conjugate_gradients::{CgEnd, CgReport, ConjugateGradients};
use pliant::solver::hessian::{Assembler, At, Weights};
use pliant::solver::multigrid::galerkin::Galerkin;
use pliant::solver::multigrid::lattice::{Coarsening, coarsen};
use pliant::solver::multigrid::{HeldCoordinates, Multigrid, TASK_ROWS};
use pliant_mesh::Mesh;
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;

/// The matrix `M + h^2 K` of a scene, and what belongs to it.
struct Problem<const D: usize> {
    matrix: BlockMatrix<D>,
    x: Vec<f64>,
    held: Vec<bool>,
}

impl<const D: usize> Problem<D> {
    /// At the scene's start.
    fn of(scene: &Scene, h: f64) -> Self {
        let mut simulation = scene.assemble(UnstableStep::Accept).unwrap().simulation;
        let x = simulation.state().x().to_vec();
        let system = simulation.system_mut();
        let held = system.inverse_mass().iter().map(|w| *w == 0.0).collect();
        let mut assembler = Assembler::<D>::new(system);
        let at = At { x: &x, v: &x, psd: Psd::Projected, predicted_from: None };
        assembler.assemble(system, at, Weights { inertia: 1.0, stiffness: h * h, damping: 0.0 });
        Problem { matrix: assembler.matrix().clone(), x, held }
    }

    fn preconditioner(&self) -> Multigrid<D> {
        let mut multigrid = Multigrid::new(&self.matrix, &self.x, &self.held).unwrap();
        multigrid.update(&self.matrix).unwrap();
        multigrid
    }

    /// A load that is the same everywhere.
    fn load(&self) -> Vec<f64> {
        self.held
            .iter()
            .enumerate()
            .map(|(i, held)| if *held || i % D != D - 1 { 0.0 } else { 1.0 })
            .collect()
    }

    /// Solves to 1e-6 and sees that the matrix agrees.
    fn solve(&self, multigrid: &mut Multigrid<D>) -> CgReport {
        let b = self.load();
        let (mut x, mut ax) = (vec![0.0; b.len()], vec![0.0; b.len()]);
        let product = |p: &[f64], q: &mut [f64]| self.matrix.multiply(p, q);
        let report = ConjugateGradients::default().solve(product, multigrid, &b, &mut x, 1e-6, 1000);
        assert_eq!(report.end, CgEnd::Converged);
        self.matrix.multiply(&x, &mut ax);
        let square = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
        let residual: Vec<f64> = b.iter().zip(&ax).map(|(b, ax)| b - ax).collect();
        assert!(square(&residual) <= 4e-12 * square(&b), "{}", (square(&residual) / square(&b)).sqrt());
        report
    }

    fn iterations(&self) -> u64 {
        self.solve(&mut self.preconditioner()).iterations
    }
}

/// A body of this mesh, of E = 5e5 Pa and 1000 kg/m^3, held where x is 0.
fn body(dimension: usize, mesh: serde_json::Value, nu: f64) -> serde_json::Value {
    let mut normal = vec![0.0; dimension];
    normal[0] = 1.0;
    json!({
        "mesh": mesh,
        "elastic": { "stable-neo-hookean-log": { "young": 5e5, "poisson": nu } },
        "mass": { "density": 1000.0 },
        "pin": [{ "half_space": { "normal": normal, "offset": 1e-9 } }],
    })
}

fn scene(dimension: usize, bodies: &[serde_json::Value]) -> Scene {
    let scene = json!({
        "dimension": dimension,
        "time": { "integrator": "implicit-euler", "step": 0.01, "duration": 1.0 },
        "body": bodies,
    });
    serde_json::from_value(scene).unwrap()
}

fn grid(cells: &[usize], size: &[f64]) -> serde_json::Value {
    json!({ "grid": { "cells": cells, "size": size } })
}

/// The beam of 4n x n x n cells.
fn beam(n: usize, nu: f64) -> Problem<3> {
    Problem::of(&scene(3, &[body(3, grid(&[4 * n, n, n], &[0.4, 0.1, 0.1]), nu)]), 0.01)
}

/// The tetrahedra of a grid with cubic cells of size 1, as the reader of meshes gives them.
fn cubes(cells: [usize; 3]) -> Mesh {
    let scene = scene(3, &[body(3, grid(&cells, &cells.map(|n| n as f64)), 0.4)]);
    pliant_mesh::build(&scene.body[0].mesh, 3, &scene.directory).unwrap()
}

/// As `inline` mesh, points moved; without the tets that are `unwanted` for their centre.
fn inline(
    mesh: &Mesh,
    mut place: impl FnMut([f64; 3]) -> [f64; 3],
    unwanted: impl Fn([f64; 3]) -> bool,
) -> serde_json::Value {
    let points = mesh.points.as_chunks::<3>().0;
    let centre = |tet: &[u32; 4]| {
        std::array::from_fn(|k| tet.iter().map(|v| points[*v as usize][k]).sum::<f64>() / 4.0)
    };
    let tets: Vec<[u32; 4]> = mesh.tetrahedra.iter().filter(|tet| !unwanted(centre(tet))).copied().collect();
    let mut number = vec![u32::MAX; points.len()];
    let mut kept = vec![];
    for v in tets.iter().flatten() {
        if number[*v as usize] == u32::MAX {
            number[*v as usize] = kept.len() as u32;
            kept.push(place(points[*v as usize]).to_vec());
        }
    }
    let tets: Vec<_> = tets.iter().map(|tet| tet.map(|v| number[v as usize])).collect();
    json!({ "inline": { "points": kept, "tetrahedra": tets } })
}

/// Numbers in [-1, 1], always the same.
struct Random(u32);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0 >> 8) / f64::from(1 << 23) - 1.0
    }

    fn vector(&mut self, length: usize) -> Vec<f64> {
        (0..length).map(|_| self.next()).collect()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A plate with one side held and another that may only slide along itself: coordinates held in part.
fn sliding_plate(cells: [usize; 2]) -> Problem<2> {
    let mut plate = body(2, grid(&cells, &[0.4, 0.4]), 0.3);
    plate["pin"] = json!([
        { "half_space": { "normal": [1.0, 0.0], "offset": 1e-9 } },
        { "half_space": { "normal": [0.0, 1.0], "offset": 1e-9 }, "axes": ["y"] },
    ]);
    Problem::of(&scene(2, &[plate]), 0.01)
}

#[test]
fn interpolation_reproduces_affine_fields() {
    let mesh = cubes([7, 4, 3]);
    let mut random = Random(5);
    let shaken = inline(&mesh, |x| x.map(|x| x + 0.2 * random.next()), |_| false);
    let problem = Problem::<3>::of(&scene(3, &[body(3, shaken, 0.4)]), 0.01);
    let x = problem.x.as_chunks::<3>().0;
    for spacing in [0.7, 2.0, 3.1, 50.0] {
        let Coarsening { prolongation, positions } = coarsen(&problem.matrix, x, spacing);
        let field = |x: &[f64; 3]| 2.0 - x[0] + 0.5 * x[1] + 3.0 * x[2];
        let mut rows = 0;
        for (i, x) in x.iter().enumerate() {
            let entries: Vec<_> = prolongation.row(i).collect();
            if entries.is_empty() {
                assert!(problem.held[3 * i], "{x:?} takes no part");
                continue;
            }
            let value: f64 = entries.iter().map(|(c, w)| w * field(&positions[*c])).sum();
            assert!((entries.iter().map(|(_, w)| w).sum::<f64>() - 1.0).abs() < 1e-14);
            // A weight below 1e-5 may have been left out.
            assert!((value - field(x)).abs() < 3e-5 * spacing * 4.0, "{value} for {} at {x:?}", field(x));
            rows += 1;
        }
        assert!(rows > 100);
    }
}

#[test]
fn the_coarse_matrix_is_the_product() {
    let problem = sliding_plate([9, 8]);
    let Problem { matrix, x, held } = &problem;
    let (points, rows) = (x.as_chunks::<2>().0, matrix.rows());
    let Coarsening { prolongation, .. } = coarsen(matrix, points, 0.11);
    let (mut galerkin, mut coarse) = Galerkin::new(matrix, &prolongation);
    let mask = HeldCoordinates::new::<2>(held).mask().to_vec();
    assert!(mask.contains(&2) && mask.contains(&3));
    galerkin.compute(matrix, &prolongation, &mask, &mut coarse);
    // The same with dense matrices; held coordinates are not interpolated.
    let (n, m) = (2 * rows, 2 * prolongation.columns());
    let mut p = vec![vec![0.0; m]; n];
    for i in 0..rows {
        for (c, w) in prolongation.row(i) {
            (0..2).filter(|k| !held[2 * i + k]).for_each(|k| p[2 * i + k][2 * c + k] = w);
        }
    }
    let column = |c: usize| (0..n).map(|i| p[i][c]).collect::<Vec<f64>>();
    let largest = coarse.value.as_flattened().as_flattened().iter().fold(0.0, |m: f64, a| m.max(a.abs()));
    let mut ap = vec![0.0; n];
    for c in 0..m {
        matrix.multiply(&column(c), &mut ap);
        let mut stored = vec![0.0; m];
        let mut unit = vec![0.0; m];
        unit[c] = 1.0;
        coarse.multiply(&unit, &mut stored);
        for (r, stored) in stored.iter().enumerate() {
            let exact = dot(&column(r), &ap);
            assert!((stored - exact).abs() < 1e-13 * largest, "({r}, {c}): {stored}, not {exact}");
        }
    }
}

#[test]
fn the_cycle_is_symmetric_and_positive_definite() {
    fn check<const D: usize>(problem: &Problem<D>) {
        let mut multigrid = problem.preconditioner();
        assert!(multigrid.rows().len() > 1);
        let n = problem.x.len();
        let mut random = Random(7);
        for _ in 0..5 {
            let (r, s) = (random.vector(n), random.vector(n));
            let (mut mr, mut ms) = (vec![0.0; n], vec![0.0; n]);
            multigrid.apply(&r, &mut mr);
            multigrid.apply(&s, &mut ms);
            let norm = (dot(&r, &mr) * dot(&s, &ms)).sqrt();
            assert!(dot(&r, &mr) > 0.0 && dot(&s, &ms) > 0.0);
            // Single precision: 2^-24 a rounding, errors of both signs in each of the sums.
            let defect = (dot(&mr, &s) - dot(&r, &ms)).abs() / norm;
            assert!(defect < 1e-5, "{defect:e}");
        }
    }
    check(&beam(4, 0.4));
    check(&sliding_plate([16, 16]));
}

#[test]
fn iterations_do_not_grow_with_the_mesh() {
    let [few, many] = [3, 6].map(|n| beam(n, 0.4).iterations());
    assert!(many <= 12 && (many as f64) < 1.3 * few as f64 + 1.0, "{few}, then {many}");
}

#[test]
fn iterations_do_not_grow_with_the_mesh_of_a_plate() {
    let [few, many] = [16, 48].map(|n| sliding_plate([n, n]).iterations());
    assert!(many <= 12 && (many as f64) < 1.3 * few as f64 + 1.0, "{few}, then {many}");
}

// 29 iterations in the prototype of this method, for 11 cells across.
#[test]
fn near_incompressibility_costs_iterations_but_converges() {
    let iterations = beam(5, 0.49).iterations();
    assert!(iterations <= 35, "{iterations}");
}

/// Two prongs from 8 to 20 of the length, one cell apart, 5 cells high and deep in all.
fn fork() -> Problem<3> {
    let prongs = |c: [f64; 3]| c[0] > 8.0 && c[2] > 2.0 && c[2] < 3.0;
    let mesh = inline(&cubes([20, 5, 5]), |x| x.map(|x| 0.02 * x), prongs);
    Problem::of(&scene(3, &[body(3, mesh, 0.4)]), 0.01)
}

#[test]
fn prongs_one_cell_apart_do_not_move_as_one() {
    let iterations = fork().iterations();
    assert!(iterations <= 20, "{iterations}");
}

#[test]
fn a_lattice_node_belongs_to_one_connected_piece() {
    let problem = fork();
    let x = problem.x.as_chunks::<3>().0;
    let Coarsening { prolongation, .. } = coarsen(&problem.matrix, x, 0.06);
    let tip = |i: &u32| x[*i as usize][0] > 0.25;
    let mut at_the_tip = 0;
    for c in 0..prolongation.columns() {
        let support: Vec<u32> = prolongation.support(c).iter().copied().filter(tip).collect();
        let above = support.iter().filter(|i| x[**i as usize][2] > 0.05).count();
        // Behind the joint the whole support is in a prong.
        if prolongation.support(c).iter().all(&tip) {
            assert!(above == 0 || above == support.len(), "node {c}: {above} of {}", support.len());
            at_the_tip += 1;
        }
    }
    assert!(at_the_tip > 10);
}

#[test]
fn shaken_and_squeezed_meshes_take_few_iterations_more() {
    let mut random = Random(11);
    let mesh = cubes([20, 5, 5]);
    let shaken = inline(&mesh, |x| x.map(|c| 0.02 * (c + 0.2 * random.next())), |_| false);
    // Pins: what is near x = 0.
    let mut shaken = body(3, shaken, 0.4);
    shaken["pin"][0]["half_space"]["offset"] = json!(0.005);
    let shaken = Problem::<3>::of(&scene(3, &[shaken]), 0.01).iterations();
    assert!(shaken <= 20, "{shaken} shaken");
    let slivers = inline(&mesh, |x| [0.02 * x[0], 0.02 * x[1], 0.002 * x[2]], |_| false);
    let slivers = Problem::<3>::of(&scene(3, &[body(3, slivers, 0.4)]), 0.01).iterations();
    assert!(slivers <= 60, "{slivers} squeezed");
    let layer = Problem::<3>::of(&scene(3, &[body(3, grid(&[30, 30, 1], &[0.3, 0.3, 0.01]), 0.4)]), 0.01);
    let layer = layer.iterations();
    assert!(layer <= 40, "{layer} in one layer");
}

#[test]
fn the_bunny_takes_few_iterations() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/bunny.toml");
    let scene = Scene::from_path(path).unwrap();
    let bunny = Problem::<3>::of(&scene, 0.01);
    let iterations = bunny.iterations();
    assert!(iterations <= 40, "{iterations}");
}

#[test]
fn parts_of_other_stiffness_converge() {
    let stiff = |young: f64| {
        let mut beam = body(3, grid(&[12, 4, 4], &[0.4, 0.1, 0.1]), 0.4);
        beam["elastic"]["stable-neo-hookean-log"]["young"] = json!(young);
        beam
    };
    // Two bodies on one another, not connected, one of them free and a thousand times as stiff.
    let mut free = stiff(5e8);
    free["pin"] = json!([]);
    free["name"] = json!("free");
    let iterations = Problem::<3>::of(&scene(3, &[stiff(5e5), free]), 0.01).iterations();
    assert!(iterations <= 25, "{iterations}");
}

#[test]
fn a_free_body_in_small_steps_is_no_worse() {
    let mut free = body(3, grid(&[16, 4, 4], &[0.4, 0.1, 0.1]), 0.4);
    free["pin"] = json!([]);
    for h in [1e-1, 1e-3, 1e-5] {
        let iterations = Problem::<3>::of(&scene(3, &[free.clone()]), h).iterations();
        assert!(iterations <= 15, "{iterations} with h = {h}");
    }
}

#[test]
fn cloth_and_many_small_bodies_converge() {
    let cloth = json!({
        "mesh": {
            "cloth": { "cells": [40, 40], "origin": [0, 0, 1], "u": [0.4, 0, 0], "v": [0, 0.4, 0] },
        },
        "springs": { "stiffness": 100.0 },
        "mass": { "total": 0.1 },
    });
    let iterations = Problem::<3>::of(&scene(3, &[cloth]), 0.01).iterations();
    assert!(iterations <= 30, "{iterations} for a cloth");
    let crowd: Vec<_> = (0..30)
        .map(|i| {
            let mut cube = body(3, grid(&[2, 2, 2], &[0.1, 0.1, 0.1]), 0.4);
            cube["pin"] = json!([]);
            cube["name"] = json!(format!("cube{i}"));
            cube["transform"] =
                json!({ "translate": [0.3 * f64::from(i % 6), 0.37 * f64::from(i / 6), 0.0] });
            cube
        })
        .collect();
    let iterations = Problem::<3>::of(&scene(3, &crowd), 0.01).iterations();
    assert!(iterations <= 15, "{iterations} for a crowd");
}

#[test]
fn bits_do_not_depend_on_threads() {
    let run = |threads: usize| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let problem = beam(8, 0.4);
            let mut multigrid = problem.preconditioner();
            let (r, mut z) = (Random(3).vector(problem.x.len()), vec![0.0; problem.x.len()]);
            multigrid.apply(&r, &mut z);
            (z, multigrid.coarse(0).clone())
        })
    };
    let one = run(1);
    assert!(one.0.len() / 3 > 2 * TASK_ROWS, "too few rows for two threads");
    assert!(one == run(3));
}

#[test]
fn what_is_computed_anew_is_what_a_fresh_one_computes() {
    let [soft, hard] = [0.3, 0.45].map(|nu| beam(4, nu));
    let (mut renewed, mut fresh) = (soft.preconditioner(), hard.preconditioner());
    renewed.update(&hard.matrix).unwrap();
    let r = Random(3).vector(hard.x.len());
    let [mut a, mut b] = [vec![0.0; r.len()], vec![0.0; r.len()]];
    renewed.apply(&r, &mut a);
    fresh.apply(&r, &mut b);
    assert_eq!(a, b);
    soft.preconditioner().apply(&r, &mut b);
    assert_ne!(a, b);
}
