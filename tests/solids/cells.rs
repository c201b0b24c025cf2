//! Quadrilaterals and hexahedra do not lock, neither where they are nearly incompressible nor in bending,
//! converge as their shape functions do, and keep energy.

use pliant::element::{HEXAHEDRON, Isoparametric, QUADRILATERAL};
use pliant_mesh::Mesh;
use pliant_scene::Scene;
use pliant_scene::assembly::UnstableStep;
use serde_json::{Value, json};

use super::benchmarks::sheared;
use super::locking::hung;
use super::manufactured::{body_force, manufactured};
use crate::support::solid::{Kind, Solid, isotropic};
use crate::support::{advance, assert_relative, method};

/// The rise of the end of the cantilever of C11, 10 x 1, of `cells`, as a part of its converged one.
fn rise(cells: [usize; 2], poisson: f64) -> f64 {
    let converged = match poisson {
        0.3 => 3.659_284e-3,
        0.49 => 3.031_588e-3,
        _ => 2.989_947e-3,
    };
    let solid = Solid::grid(&cells, &[10.0, 1.0], isotropic("linear", 1e6, poisson)).of_kind(Kind::Whole);
    sheared(solid, 10.0, 1.0, 1.0, 1, [10.0, 0.5])[1] / converged
}

// C11: two rows bend as one does. The clamp holds the contraction of the end, over a length of half the
// thickness, which cells twice and four times as long resolve the less the less they change their volume.
#[test]
fn a_bent_beam_of_two_quadrilaterals_through_its_thickness_does_not_lock() {
    for (poisson, within) in
        [(0.3, [0.01, 0.02, 0.01]), (0.49, [0.03, 0.06, 0.02]), (0.4999, [0.03, 0.07, 0.02])]
    {
        for (cells, within) in [[20, 2], [10, 2], [40, 4]].into_iter().zip(within) {
            let part = rise(cells, poisson);
            assert!((part - 1.0).abs() < within, "nu = {poisson}, {cells:?}: {part}");
        }
    }
}

// The deflection of the end of a beam of 10 x 1 x 1 under its weight, as a part of that of 20 x 2 x 2
// cells of quadratic tetrahedra. Plain trilinear cells two times longer than thick have 0.77 of it.
#[test]
fn a_bent_beam_of_two_hexahedra_through_its_thickness_does_not_lock() {
    for (poisson, quadratic, cells, within) in [
        (0.3, -1.497e-2, [10, 2, 2], 0.03),
        (0.4999, -1.408e-2, [10, 2, 2], 0.04),
        (0.4999, -1.408e-2, [20, 4, 4], 0.03),
    ] {
        let solid = Solid::grid(&cells, &[10.0, 1.0, 1.0], isotropic("neo-hookean", 1e6, poisson));
        let part = hung(solid.of_kind(Kind::Whole), &[10.0, 1.0, 1.0]) / quadratic;
        assert!((part - 1.0).abs() < within, "nu = {poisson}, {cells:?}: {part}");
    }
}

/// Cook's membrane of `n` x `n` quadrilaterals.
fn cook(n: usize, elastic: Value) -> Solid {
    let mut solid = Solid::grid(&[1, 1], &[1.0, 1.0], elastic);
    solid.mesh = json!({ "cooks_membrane": { "cells": [n, n], "element": "quadrilateral" } });
    solid
}

// C9: the corner rises by 6.932 at nu = 0.4999 and by 7.78138 at 0.3, where plain triangles, twice as
// many, have 5.837 and 7.057.
#[test]
fn cooks_membrane_of_quadrilaterals_does_not_lock() {
    for (poisson, converged) in [(0.3, 7.78138), (0.4999, 6.932)] {
        let gap = |n: usize| {
            let elastic = isotropic("neo-hookean", 240.565, poisson);
            1.0 - sheared(cook(n, elastic), 48.0, 16.0, 100.0, 4, [48.0, 60.0])[1] / converged
        };
        let (coarse, fine) = (gap(8), gap(16));
        assert!(coarse.abs() < 0.05 && fine.abs() < 0.02, "nu = {poisson}: {coarse} {fine}");
    }
}

/// Errors of displacements and their gradients, L2, of the manufactured solution with `n` cells a side.
fn errors<const D: usize, const N: usize>(cell: &Isoparametric<D, N>, material: &str, n: usize) -> [f64; 2] {
    let mut solid = Solid::grid(&[n; D], &[1.0; D], isotropic(material, 1.0, 0.3)).of_kind(Kind::Whole);
    let side = |axis: usize, sign: f64| {
        let mut normal = vec![0.0; D];
        normal[axis] = sign;
        json!({ "half_space": { "normal": normal, "offset": 0.5 * (sign - 1.0) } })
    };
    solid.pin = (0..D).flat_map(|axis| [side(axis, 1.0), side(axis, -1.0)]).collect();
    let mesh = solid.mesh();
    let mut loads = vec![0.0; mesh.points.len()];
    integrate(cell, &mesh, &mesh.points, |weight, x, _, _, shape, vertices| {
        let b = body_force(x, material);
        for (v, shape) in vertices.iter().zip(shape) {
            (0..D).for_each(|c| loads[*v as usize * D + c] += weight * shape * b[c]);
        }
    });
    let simulation = super::manufactured::loaded::<D>(&solid, loads);
    let x = super::manufactured::equilibrium::<D>(simulation);
    let (mut value, mut gradient) = (0.0, 0.0);
    integrate(cell, &mesh, &x, |weight, at, u, g, _, _| {
        let (exact, slope) = manufactured(at);
        for i in 0..D {
            value += weight * (u[i] - exact[i]).powi(2);
            gradient += (0..D).map(|j| weight * (g[i][j] - slope[i][j]).powi(2)).sum::<f64>();
        }
    });
    [f64::sqrt(value), f64::sqrt(gradient)]
}

/// Sums over 4^D Gauss points in every cell: `visit(weight, X, u, grad u, N, vertices)`.
fn integrate<const D: usize, const N: usize>(
    cell: &Isoparametric<D, N>,
    mesh: &Mesh,
    x: &[f64],
    mut visit: impl FnMut(f64, [f64; D], [f64; D], [[f64; D]; D], &[f64; N], &[u32; N]),
) {
    let line = [
        (0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
        (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    ];
    let line: Vec<(f64, f64)> = line.into_iter().flat_map(|(x, w)| [(x, w), (-x, w)]).collect();
    let nodes = |x: &[f64], vertices: &[u32; N]| -> [[f64; D]; N] {
        vertices.map(|v| std::array::from_fn(|c| x[v as usize * D + c]))
    };
    for vertices in mesh.block().unwrap().of::<N>() {
        let (rest, now) = (nodes(&mesh.points, vertices), nodes(x, vertices));
        for point in 0..line.len().pow(D as u32) {
            let at: [(f64, f64); D] =
                std::array::from_fn(|k| line[point / line.len().pow(k as u32) % line.len()]);
            let (xi, weight) = (at.map(|(x, _)| x), at.iter().map(|(_, w)| w).product::<f64>());
            let shape = (cell.shape)(&xi);
            let j = cell.jacobian(&rest, &xi);
            let f = cell.jacobian(&now, &xi).mul(&j.inverse());
            let sum = |nodes: &[[f64; D]; N]| -> [f64; D] {
                std::array::from_fn(|c| shape.iter().zip(nodes).map(|(n, x)| n * x[c]).sum())
            };
            let (place, moved) = (sum(&rest), sum(&now));
            let u = std::array::from_fn(|c| moved[c] - place[c]);
            let g = std::array::from_fn(|i| std::array::from_fn(|k| f[i][k] - f64::from(u8::from(i == k))));
            visit(weight * j.determinant(), place, u, g, &shape, vertices);
        }
    }
}

fn converges<const D: usize, const N: usize>(cell: &Isoparametric<D, N>, material: &str, n: usize) {
    let (coarse, fine) = (errors(cell, material, n), errors(cell, material, 2 * n));
    for (norm, order) in [2.0, 1.0].into_iter().enumerate() {
        let measured = (coarse[norm] / fine[norm]).log2();
        assert!((measured - order).abs() < 0.15, "{material}, {D}D: order {measured:.3} instead of {order}");
    }
}

// C5
#[test]
fn displacements_of_cells_converge_with_the_second_order_and_strains_with_the_first() {
    converges(&QUADRILATERAL, "linear", 8);
    converges(&QUADRILATERAL, "neo-hookean", 8);
    converges(&HEXAHEDRON, "linear", 4);
}

/// A free body that was stretched keeps its energy: its forces are the gradient of it.
#[test]
fn a_vibrating_body_of_cells_keeps_its_energy() {
    for (dimension, poisson) in [(2, 0.3), (3, 0.499)] {
        let solid = Solid::grid(
            &[3, 2, 2][..dimension],
            &[1.5, 1.0, 1.0][..dimension],
            isotropic("neo-hookean", 1e5, poisson),
        );
        let energies = |h: f64, steps: usize| {
            let mut simulation = solid.clone().of_kind(Kind::Whole).simulation(method("velocity-verlet"), h);
            simulation.state_mut().x_mut().iter_mut().for_each(|x| *x *= 1.05);
            let start = simulation.diagnostics().total;
            advance(&mut simulation, steps);
            (simulation.diagnostics().total / start - 1.0).abs()
        };
        // The error of the scheme is of the second order in the step, and there is no other.
        let (coarse, fine) = (energies(2e-5, 2000), energies(1e-5, 4000));
        assert!(coarse < 1e-2 && fine < 0.35 * coarse, "{dimension}D: {coarse:e} {fine:e}");
    }
}

#[test]
fn shares_of_gravity_and_loads_on_sides_add_up() {
    for dimension in [2, 3] {
        let mut solid = Solid::grid(
            &[3, 2, 2][..dimension],
            &[1.5, 1.0, 1.0][..dimension],
            isotropic("linear", 1e5, 0.3),
        )
        .of_kind(Kind::Whole);
        let mut traction = vec![0.0; dimension];
        traction[1] = 7.0;
        let mut normal = vec![0.0; dimension];
        normal[0] = -1.0;
        solid.load = json!([{ "half_space": { "normal": normal, "offset": -1.5 }, "traction": traction }]);
        let mut probe = solid.probe();
        let rest = probe.rest();
        let forces = probe.forces(&rest);
        let sum: f64 = forces.iter().skip(1).step_by(dimension).sum();
        assert_relative(sum, 7.0, 1e-13, "the area of the side is 1");
        let mass: f64 = probe.0.system().mass().iter().sum();
        assert_relative(mass, 1500.0, 1e-13, "the volume is 1.5");
    }
}

/// What is wrong with a body of this mesh and these keys.
fn refused(dimension: usize, mesh: &Value, keys: &Value) -> String {
    let mut body =
        json!({ "mesh": mesh, "mass": { "density": 1.0 }, "elastic": isotropic("linear", 1.0, 0.3) });
    body.as_object_mut().unwrap().extend(keys.as_object().unwrap().clone());
    let time = json!({ "integrator": "rk4", "step": 1e-3, "duration": 1.0 });
    let scene = json!({ "dimension": dimension, "time": time, "body": [body] });
    // As text: places and bounds are checked where text is read.
    let read = Scene::from_toml(&toml::to_string(&scene).unwrap());
    match read {
        Err(error) => error.to_string(),
        Ok(scene) => format!("{:?}", scene.assemble(UnstableStep::Accept).err().expect("refused")),
    }
}

#[test]
fn what_cells_cannot_be_is_refused_with_the_reason() {
    let whole = |element: &str, cells: &[usize]| -> Value {
        json!({ "grid": { "cells": cells, "spacing": 1.0, "element": element } })
    };
    let quadrilaterals = |cells: Value| {
        let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.7, 0.2], [2.0, 0.0], [2.0, 1.0]];
        json!({ "inline": { "points": points, "quadrilaterals": cells } })
    };
    let hexahedra = whole("hexahedron", &[1, 1, 1]);
    let triangles = json!({ "grid": { "cells": [1, 1], "spacing": 1.0 } });
    for (dimension, mesh, keys, message) in [
        (2, whole("hexahedron", &[1, 1]), json!({}), "is for 3D, and `dimension` is 2"),
        (3, whole("quadrilateral", &[1, 1, 1]), json!({}), "is for 2D, and `dimension` is 3"),
        (3, hexahedra.clone(), json!({ "serendipity": true }), "add `order = 2`"),
        (2, triangles, json!({ "order": 2, "serendipity": true }), "is for quadrilaterals and hexahedra"),
        (2, quadrilaterals(json!([[0, 1, 2, 4]])), json!({}), "quadrilateral 0 is folded"),
        (2, quadrilaterals(json!([[0, 3, 2, 1]])), json!({}), "quadrilateral 0 is inverted"),
        (2, quadrilaterals(json!([[0, 1, 2, 3], [1, 5, 6, 2], [2, 3, 0, 1]])), json!({}), "quadrilateral 2"),
    ] {
        let found = refused(dimension, &mesh, &keys);
        assert!(found.contains(message), "{found}");
    }
}
