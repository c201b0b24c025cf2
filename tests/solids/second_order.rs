//! Quadrilaterals and hexahedra of second order: counts of rigid modes, exact bending, published problems
//! with the numbers of an independent program for the same elements, orders of convergence.

use nalgebra::{DMatrix, DVector};
use serde_json::json;

use super::manufactured::{body_force, manufactured};
use super::one_point::{assert_parts, block, compliance, units};
use crate::support::assert_relative;
use crate::support::solid::{Kind, Solid, isotropic, scattered};
use pliant::element::{CellVisitor, Isoparametric, MassRule, QuadraturePoint, mass_rule, shape_functions};
use pliant::energy::elastic::points_of;
use pliant_mesh::Mesh;
use pliant_mesh::spec::{BodyMesh, CellOrder};

/// A load by the places at rest.
type LoadOf<'a> = &'a dyn Fn(&[f64]) -> Vec<f64>;

/// Visitor of each point: vertices, point, shape functions and place.
type PointVisitor<'a, const D: usize, const N: usize> =
    &'a mut dyn FnMut(&[u32; N], &QuadraturePoint<D, N>, [f64; N], [f64; D]);

const KINDS: [(usize, Kind); 4] =
    [(2, Kind::Lagrange), (2, Kind::Serendipity), (3, Kind::Lagrange), (3, Kind::Serendipity)];

/// Number of modes of a solid at rest that cost no energy.
fn zero_modes(solid: &Solid) -> usize {
    let mut probe = solid.probe();
    let rest = probe.rest();
    let eigenvalues = probe.stiffness(&rest).symmetric_eigenvalues();
    let largest = eigenvalues.amax();
    eigenvalues.iter().filter(|value| value.abs() < 1e-11 * largest).count()
}

// Reduced integration leaves one mode of a quadrilateral and six of a hexahedron without energy; two
// distorted cells have none of them in common.
#[test]
fn cells_have_rigid_modes_and_no_others_that_spread() {
    for ((d, kind), [one, two]) in KINDS.into_iter().zip([[3, 3], [4, 3], [6, 6], [12, 6]]) {
        let count = |cells: [usize; 3]| {
            let shaken = |x: &[f64]| {
                let at = (x[0] * 7.0 + x[1] * 3.0 + x.get(2).unwrap_or(&0.0) * 11.0) as usize;
                x.iter().enumerate().map(|(c, x)| x + 0.1 * scattered(at + c)).collect()
            };
            zero_modes(&block(kind, &cells[..d], &[cells[0] as f64, 1.0, 1.0][..d], shaken, 0.3, 1.0))
        };
        assert_eq!([count([1, 1, 1]), count([2, 1, 1])], [one, two], "{d}D {kind:?}");
    }
    // A row of boxes keeps some.
    let boxes = |cells: [usize; 3]| {
        let size = cells.map(|count| count as f64);
        zero_modes(&block(Kind::Serendipity, &cells, &size, <[f64]>::to_vec, 0.3, 1.0))
    };
    assert_eq!([boxes([2, 1, 1]), boxes([3, 1, 1]), boxes([2, 2, 1])], [9, 10, 6]);
}

// Displacements of a beam in pure bending are quadratic: exact with any ratio of its lengths.
#[test]
fn a_cell_that_bends_has_the_energy_of_the_solid_at_any_ratio_of_lengths() {
    for (d, kind) in KINDS {
        for length in [1.0, 2.0, 5.0, 10.0, 20.0] {
            for poisson in [0.0, 0.3] {
                let solid =
                    block(kind, &[1; 3][..d], &[length, 1.0, 1.0][..d], <[f64]>::to_vec, poisson, 1.0);
                let mut probe = solid.probe();
                let rest = probe.rest();
                // Curvature k of the axis; in the plane nothing moves out of it.
                let (k, nu) = (1e-6, if d == 2 { poisson / (1.0 - poisson) } else { poisson });
                let bent = rest.chunks_exact(d).flat_map(|x| {
                    let (s, y, z) = (x[0], x[1] - 0.5, x.get(2).map_or(0.0, |z| z - 0.5));
                    let moved = [-k * s * y, 0.5 * k * (s * s + nu * (y * y - z * z)), k * nu * y * z];
                    x.iter().zip(moved).map(|(x, u)| x + u).collect::<Vec<_>>()
                });
                let modulus = if d == 2 { 1.0 / (1.0 - poisson * poisson) } else { 1.0 };
                let expected = 0.5 * modulus * k * k * length / 12.0;
                let found = probe.energy(&bent.collect::<Vec<_>>());
                assert_relative(
                    found,
                    expected,
                    1e-7,
                    &format!("{d}D {kind:?}, length {length}, nu {poisson}"),
                );
            }
        }
    }
}

/// Consistent nodal loads of a traction that is `traction(y, z)` on the end of a body: by the shape functions
/// of its faces.
fn end_load(solid: &Solid, rest: &[f64], end: f64, traction: &dyn Fn(&[f64]) -> Vec<f64>) -> DVector<f64> {
    struct Ends<'a> {
        mesh: &'a Mesh,
        rest: &'a [f64],
        end: f64,
        traction: &'a dyn Fn(&[f64]) -> Vec<f64>,
    }
    impl CellVisitor for Ends<'_> {
        type Output = DVector<f64>;
        fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> DVector<f64> {
            let mut load = DVector::zeros(self.rest.len());
            let line = [(-(0.6f64.sqrt()), 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.6f64.sqrt(), 5.0 / 9.0)];
            for vertices in self.mesh.block().unwrap().of::<N>() {
                let nodes: [[f64; D]; N] = points_of(self.rest, vertices);
                for (y, wy) in line {
                    for (z, wz) in if D == 3 { line.to_vec() } else { vec![(0.0, 1.0)] } {
                        let xi: [f64; D] = std::array::from_fn(|k| [1.0, y, z][k]);
                        let (shape, j) = ((cell.shape)(&xi), cell.jacobian(&nodes, &xi));
                        let at: Vec<f64> =
                            (0..D).map(|c| (0..N).map(|a| shape[a] * nodes[a][c]).sum()).collect();
                        if (at[0] - self.end).abs() > 1e-9 {
                            continue;
                        }
                        // The end is flat, its normal along x: the cofactor of dX/dxi there.
                        let area = j.cofactor()[0][0];
                        let traction = (self.traction)(&at);
                        for (v, n) in vertices.iter().zip(shape) {
                            (0..D)
                                .for_each(|c| load[*v as usize * D + c] += wy * wz * area * n * traction[c]);
                        }
                    }
                }
            }
            load
        }
    }
    let mesh = &solid.whole_mesh();
    mesh.block().unwrap().kind.visit(Ends { mesh, rest, end, traction })
}

// MacNeal, Harder 1985, six cells: forces in the plane and out of it, and a torque.
#[test]
fn a_slender_cantilever_of_six_cells_bends_and_twists_as_another_program_has_it() {
    let (width, height) = (0.2, 0.1);
    let polar = width * height * (width * width + height * height) / 12.0;
    for (kind, expected) in [
        (Kind::Lagrange, [[0.983, 0.982, 0.869], [0.973, 0.973, 0.869], [0.973, 0.972, 0.870]]),
        (Kind::Serendipity, [[0.988, 0.978, 0.876], [0.999, 0.967, 0.878], [0.969, 0.970, 0.883]]),
    ] {
        let slants: [fn(usize) -> f64; 3] =
            [|_| 0.0, |_| 1.0, |column| if column % 2 == 1 { 1.0 } else { -1.0 }];
        for (slant, expected) in slants.into_iter().zip(expected) {
            let place = move |x: &[f64]| {
                let column = x[0].round() as usize;
                let inner = f64::from(u8::from(column > 0 && column < 6));
                vec![x[0] + inner * slant(column) * (x[1] - 0.1), x[1], x[2]]
            };
            let solid = block(kind, &[6, 1, 1], &[6.0, width, height], place, 0.3, 1e7);
            let rest = solid.probe().rest();
            let area = width * height;
            let loads: [LoadOf<'_>; 3] =
                [&|_| vec![0.0, 1.0 / area, 0.0], &|_| vec![0.0, 0.0, 1.0 / area], &|x| {
                    vec![0.0, -(x[2] - 0.05) / polar, (x[1] - 0.1) / polar]
                }];
            let allowed = units(&rest, 3, |x, _| x[0] > 1e-9);
            let reference = [1.075_959_09e-1, 4.297_432_84e-1, 3.335_523_71e-2];
            let parts = loads.iter().zip(reference).map(|(traction, fine)| {
                compliance(&solid, &allowed, &end_load(&solid, &rest, 6.0, traction)).0 / fine
            });
            assert_parts(&format!("{kind:?}"), &parts.collect::<Vec<_>>(), &expected);
        }
    }
}

// Cook 1974 in plane strain, the middle of the free side, with 2, 4 and 8 cells a side.
#[test]
fn cooks_membrane_of_few_quadrilaterals_rises_as_another_program_has_it() {
    for (kind, poisson, fine, expected) in [
        (Kind::Lagrange, 0.3, 21.944_815_67, [0.966, 0.993, 0.997]),
        (Kind::Lagrange, 0.4999, 18.508_999_21, [0.689, 0.881, 0.957]),
        (Kind::Serendipity, 0.3, 21.944_815_67, [0.959, 0.987, 0.995]),
        (Kind::Serendipity, 0.4999, 18.508_999_21, [0.800, 0.925, 0.968]),
    ] {
        let rise = |n: usize| {
            let mut solid =
                Solid::grid(&[1, 1], &[1.0, 1.0], isotropic("linear", 1.0, poisson)).of_kind(kind);
            solid.mesh = json!({ "cooks_membrane": { "cells": [n, n], "element": "quadrilateral" } });
            let rest = solid.probe().rest();
            let load = end_load(&solid, &rest, 48.0, &|_| vec![0.0, 1.0 / 16.0]);
            let (_, moved) = compliance(&solid, &units(&rest, 2, |x, _| x[0] > 1e-9), &load);
            let tip = rest.chunks_exact(2).position(|x| (x[0] - 48.0).hypot(x[1] - 52.0) < 1e-9).unwrap();
            moved[2 * tip + 1] / fine
        };
        assert_parts(&format!("{kind:?}, nu = {poisson}"), &[2, 4, 8].map(rise), &expected);
    }
}

// MacNeal, Harder 1985: ten degrees of a thick cylinder with pressure inside, five cells, straight sides.
#[test]
fn a_thick_cylinder_of_five_cells_locks_in_full_integration_alone_and_there_mildly() {
    let radii = [3.0, 3.5, 4.2, 5.2, 6.75, 9.0];
    let angle = 10f64.to_radians();
    for (kind, expected) in [(Kind::Lagrange, [1.0, 0.999, 0.986, 0.879]), (Kind::Serendipity, [1.0; 4])] {
        for (poisson, expected) in [0.3, 0.49, 0.499, 0.4999].into_iter().zip(expected) {
            // Nodes are on arcs, those in the middle of edges too: the map of a grid of half the size.
            let place = |x: &[f64]| {
                let (radius, turn) = (radii[x[0].round() as usize], angle * x[1]);
                vec![radius * turn.cos(), radius * turn.sin()]
            };
            let solid = block(kind, &[5, 1], &[5.0, 1.0], place, poisson, 1000.0);
            let rest = solid.probe().rest();
            let nodes = rest.len() / 2;
            // Both sides slide along their radius, and so does all else by symmetry.
            let allowed = DMatrix::from_fn(rest.len(), nodes, |row, node| {
                let x = &rest[2 * node..][..2];
                if row / 2 == node { x[row % 2] / x[0].hypot(x[1]) } else { 0.0 }
            });
            let mut load = DVector::zeros(rest.len());
            let chord = 6.0 * (0.5 * angle).sin();
            let out = [(0.5 * angle).cos(), (0.5 * angle).sin()];
            let inside = |share: f64, at: [f64; 2], load: &mut DVector<f64>| {
                let node = (0..nodes).find(|a| (rest[2 * a] - at[0]).hypot(rest[2 * a + 1] - at[1]) < 1e-9);
                let node = node.unwrap();
                (0..2).for_each(|c| load[2 * node + c] += share * chord * out[c]);
                node
            };
            let ends = [[3.0, 0.0], [3.0 * angle.cos(), 3.0 * angle.sin()]];
            let middle = [0, 1].map(|c| 0.5 * (ends[0][c] + ends[1][c]));
            let first = inside(1.0 / 6.0, ends[0], &mut load);
            inside(1.0 / 6.0, ends[1], &mut load);
            inside(2.0 / 3.0, middle, &mut load);
            let (_, moved) = compliance(&solid, &allowed, &load);
            let exact = (1.0 + poisson) * 9.0 / (1000.0 * 72.0) * (27.0 + (1.0 - 2.0 * poisson) * 3.0);
            let found = moved[2 * first].hypot(moved[2 * first + 1]) / exact;
            assert!((found - expected).abs() < 0.01, "{kind:?} nu = {poisson}: {found}, expected {expected}");
        }
    }
}

// Shares of the mass of a square and a cube: products of 1/6, 2/3, 1/6 where all nodes are there.
#[test]
fn lumped_masses_are_positive_and_those_of_simpsons_rule_where_all_nodes_are_there() {
    struct Lumped;
    impl CellVisitor for Lumped {
        type Output = Vec<f64>;
        fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) -> Vec<f64> {
            let mass = MassRule::<D, N>::new();
            let curved = std::array::from_fn(|a| {
                std::array::from_fn(|c| cell.nodes[a][c] + 0.05 * scattered(D * a + c))
            });
            let (consistent, lumped) = (mass.consistent(&curved), mass.lumped(&curved));
            let sum: f64 = consistent.as_flattened().iter().sum();
            assert!(lumped.iter().all(|m| *m > 0.0));
            assert_relative(lumped.iter().sum(), sum, 1e-14, "sum of lumped masses");
            mass.lumped(cell.nodes).to_vec()
        }
    }
    for (d, kind) in KINDS {
        let solid = block(kind, &[1; 3][..d], &[1.0; 3][..d], <[f64]>::to_vec, 0.3, 1.0);
        let cell = solid.whole_mesh().block().unwrap().kind;
        let lumped = cell.visit(Lumped);
        let total = f64::from(1 << d);
        assert_relative(lumped.iter().sum(), total, 1e-14, cell.name);
        if kind == Kind::Lagrange {
            let middle = (2.0f64 / 3.0).powi(d as i32) * total;
            assert_relative(lumped[cell.nodes - 1], middle, 1e-13, cell.name);
            assert_relative(lumped[0], total / 6.0f64.powi(d as i32), 1e-13, cell.name);
        }
    }
}

/// Errors of displacements and their gradients, L2, of the manufactured solution with `n` cells a side.
struct Errors<'a> {
    solid: &'a Solid,
    mesh: &'a Mesh,
}

impl CellVisitor for Errors<'_> {
    type Output = [f64; 2];

    fn visit<const D: usize, const N: usize>(self, _: &'static Isoparametric<D, N>) -> [f64; 2] {
        let (rest, cells) = (&self.mesh.points, self.mesh.block().unwrap().of::<N>());
        let rule = mass_rule::<D, N>();
        let mut loads = vec![0.0; rest.len()];
        let each = |visit: PointVisitor<'_, D, N>| {
            for vertices in cells {
                let nodes = points_of::<D, N>(rest, vertices);
                for (at, weight) in &rule {
                    let shape = shape_functions::<D, N>(at);
                    let place = std::array::from_fn(|c| (0..N).map(|a| shape[a] * nodes[a][c]).sum());
                    visit(vertices, &QuadraturePoint::new(&nodes, at, *weight), shape, place);
                }
            }
        };
        each(&mut |vertices, point, shape, place| {
            let force = body_force(place, "linear");
            for (v, n) in vertices.iter().zip(shape) {
                (0..D).for_each(|c| loads[*v as usize * D + c] += point.weight * n * force[c]);
            }
        });
        let x = super::manufactured::equilibrium::<D>(super::manufactured::loaded::<D>(self.solid, loads));
        let (mut value, mut gradient) = (0.0, 0.0);
        each(&mut |vertices, point, shape, place| {
            let (now, nodes) = (points_of::<D, N>(&x, vertices), points_of::<D, N>(rest, vertices));
            let (exact, slope) = manufactured(place);
            let f = point.deformation_gradient(&now);
            for i in 0..D {
                let u: f64 = (0..N).map(|a| shape[a] * (now[a][i] - nodes[a][i])).sum();
                value += point.weight * (u - exact[i]).powi(2);
                for j in 0..D {
                    let g = f[i][j] - f64::from(u8::from(i == j));
                    gradient += point.weight * (g - slope[i][j]).powi(2);
                }
            }
        });
        [f64::sqrt(value), f64::sqrt(gradient)]
    }
}

// C5
#[test]
fn errors_fall_at_order_three_and_those_of_gradients_at_order_two() {
    for (d, kind) in KINDS {
        let error = |n: usize| {
            let mut solid =
                Solid::grid(&[n; 3][..d], &[1.0; 3][..d], isotropic("linear", 1.0, 0.3)).of_kind(kind);
            let side = |axis: usize, sign: f64| {
                let mut normal = vec![0.0; d];
                normal[axis] = sign;
                json!({ "half_space": { "normal": normal, "offset": 0.5 * (sign - 1.0) } })
            };
            solid.pin = (0..d).flat_map(|axis| [side(axis, 1.0), side(axis, -1.0)]).collect();
            let mesh = solid.whole_mesh();
            mesh.block().unwrap().kind.visit(Errors { solid: &solid, mesh: &mesh })
        };
        let (coarse, fine) = if d == 2 { (4, 8) } else { (2, 4) };
        let [coarse, fine] = [error(coarse), error(fine)];
        let orders = [0, 1].map(|i| (coarse[i] / fine[i]).log2());
        // Coarse ones in space are not yet at their order.
        let least = if d == 2 { [2.8, 1.85] } else { [2.5, 1.7] };
        assert!(orders[0] > least[0] && orders[1] > least[1] && orders[0] < 3.6, "{d}D {kind:?}: {orders:?}");
    }
}

/// A body of these keys in statics: its positions at rest and in equilibrium.
fn still(dimension: usize, body: serde_json::Value) -> [Vec<f64>; 2] {
    let scene: pliant_scene::Scene = serde_json::from_value(json!({
        "dimension": dimension,
        "time": { "integrator": "quasi-static", "step": 1.0, "duration": 1.0 },
        "body": [body],
    }))
    .unwrap();
    let assembly = scene.assemble(pliant_scene::assembly::UnstableStep::Accept);
    let mut simulation = assembly.map_err(|problems| format!("{problems:?}")).unwrap().simulation;
    let rest = simulation.state().x().to_vec();
    simulation.step().unwrap();
    [rest, simulation.state().x().to_vec()]
}

// What faces of 3, 8 and 9 nodes make of a traction and of a pressure balances a uniform stress.
#[test]
fn tractions_and_pressures_stretch_a_distorted_bar_uniformly() {
    for (d, kind) in KINDS {
        let place = |x: &[f64]| {
            let inner = x[0] > 0.5 && x[0] < 1.5;
            let slant = if inner { 0.3 * (x[1] - 0.4) + 0.2 * x.get(2).unwrap_or(&0.0) } else { 0.0 };
            let mut at = x.to_vec();
            at[0] += slant;
            at
        };
        let solid = block(kind, &[2, 1, 1][..d], &[2.0, 1.0, 1.0][..d], place, 0.25, 1.0);
        let rollers: Vec<_> = (0..d)
            .map(|axis| {
                let (mut normal, name) = (vec![0.0; d], ["x", "y", "z"][axis]);
                normal[axis] = 1.0;
                json!({ "half_space": { "normal": normal, "offset": 0.0 }, "axes": [name] })
            })
            .collect();
        let mut normal = vec![0.0; d];
        normal[0] = -1.0;
        let end = json!({ "half_space": { "normal": normal, "offset": -2.0 } });
        let mut traction = vec![0.0; d];
        traction[0] = 1e-3;
        for load in [json!({ "traction": traction }), json!({ "pressure": -1e-3 })] {
            let mut load = load;
            load["half_space"] = end["half_space"].clone();
            let body = json!({
                "mesh": solid.mesh, "order": 2, "serendipity": solid.serendipity,
                "elastic": solid.elastic, "mass": { "density": 1.0 }, "pin": rollers, "load": [load],
            });
            let [rest, found] = still(d, body);
            let stretch = 1e-3 * if d == 2 { 1.0 - 0.25 * 0.25 } else { 1.0 };
            let across = -1e-3 * 0.25 * if d == 2 { 1.25 } else { 1.0 };
            // A pressure on the deformed face is another one at second order.
            let within = if load.get("pressure").is_some() { 3e-6 } else { 1e-12 };
            for (i, (x, at)) in rest.iter().zip(&found).enumerate() {
                let expected = x * if i % d == 0 { stretch } else { across };
                assert!((at - x - expected).abs() < within, "{d}D {kind:?} {load}: {at} from {x}");
            }
        }
    }
}

// Lame: a ring of two cells with pressure inside; its curved sides have nodes on circles.
#[test]
fn a_ring_of_curved_cells_widens_as_lame_has_it() {
    for serendipity in [false, true] {
        let (a, b, pressure, poisson): (f64, f64, f64, f64) = (1.0, 2.0, 1e-4, 0.3);
        let ring =
            json!({ "inner_radius": a, "outer_radius": b, "cells": [2, 12], "element": "quadrilateral" });
        let on = |min: [f64; 2], max: [f64; 2], axis: &str| {
            let place = json!({ "min": min, "max": max });
            json!({ "box": place, "axes": [axis] })
        };
        let body = json!({
            "mesh": { "annulus": ring }, "order": 2, "serendipity": serendipity,
            "elastic": isotropic("linear", 1.0, poisson), "mass": { "density": 1.0 },
            "pin": [on([-3.0, -1e-9], [3.0, 1e-9], "y"), on([-1e-9, -3.0], [1e-9, 3.0], "x")],
            "load": [{ "group": "inner", "pressure": pressure }],
        });
        let [rest, found] = still(2, body);
        let factor = (1.0 + poisson) * pressure * a * a / (b * b - a * a);
        for (x, at) in rest.chunks_exact(2).zip(found.chunks_exact(2)) {
            let r = x[0].hypot(x[1]);
            // Every node at a radius of the mesh, those in the middle of sides too.
            let exact = factor * ((1.0 - 2.0 * poisson) * r + b * b / r);
            let found = at[0].hypot(at[1]) - r;
            assert_relative(found, exact, 6e-3, &format!("serendipity {serendipity}, r = {r}"));
        }
        assert!(rest.chunks_exact(2).filter(|x| (x[0].hypot(x[1]) - a).abs() < 1e-14).count() == 24);
    }
}

// The order of Gmsh by the pictures of its manual, of Abaqus and VTK by theirs: nodes by what they are
// between.
#[test]
fn files_of_gmsh_vtk_and_abaqus_keep_the_nodes_of_second_order() {
    const CUBE: [[f64; 3]; 8] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 1.0, 1.0],
        [0.0, 1.0, 1.0],
    ];
    let around = [[0, 1], [1, 2], [2, 3], [3, 0]].map(|e| e.to_vec());
    let edges = |list: &[[usize; 2]]| list.iter().map(|e| e.to_vec()).collect::<Vec<_>>();
    let vtk_edges = edges(&[
        [0, 1],
        [1, 2],
        [2, 3],
        [3, 0],
        [4, 5],
        [5, 6],
        [6, 7],
        [7, 4],
        [0, 4],
        [1, 5],
        [2, 6],
        [3, 7],
    ]);
    let gmsh_edges = edges(&[
        [0, 1],
        [0, 3],
        [0, 4],
        [1, 2],
        [1, 5],
        [2, 3],
        [2, 6],
        [3, 7],
        [4, 5],
        [4, 7],
        [5, 6],
        [6, 7],
    ]);
    let faces = |list: [[usize; 4]; 6]| list.map(|f| f.to_vec()).to_vec();
    let vtk_faces =
        faces([[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 1, 2, 3], [4, 5, 6, 7]]);
    let gmsh_faces =
        faces([[0, 3, 2, 1], [0, 1, 5, 4], [0, 4, 7, 3], [1, 2, 6, 5], [2, 3, 7, 6], [4, 5, 6, 7]]);
    let whole = |n: usize| vec![(0..n).collect::<Vec<usize>>()];
    let gmsh = |kind: u8| {
        move |nodes: &[Vec<f64>]| {
            let points: String = nodes
                .iter()
                .enumerate()
                .map(|(i, x)| format!("{} {} {} {}\n", i + 1, x[0], x[1], x[2]))
                .collect();
            let list: String = (1..=nodes.len()).map(|i| format!(" {i}")).collect();
            let n = nodes.len();
            format!(
                "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{n}\n{points}$EndNodes\n\
                 $Elements\n1\n1 {kind} 2 0 \
             1{list}\n$EndElements\n"
            )
        }
    };
    let vtk = |kind: u8| {
        move |nodes: &[Vec<f64>]| {
            let points: String = nodes.iter().map(|x| format!("{} {} {}\n", x[0], x[1], x[2])).collect();
            let list: String = (0..nodes.len()).map(|i| format!(" {i}")).collect();
            let n = nodes.len();
            format!(
                "# vtk DataFile Version 4.2\n\nASCII\nDATASET UNSTRUCTURED_GRID\n\
                 POINTS {n} double\n{points}CELLS 1 {}\n\
             {n}{list}\nCELL_TYPES 1\n{kind}\n",
                n + 1
            )
        }
    };
    let abaqus = |kind: &'static str| {
        move |nodes: &[Vec<f64>]| {
            let points: String = nodes
                .iter()
                .enumerate()
                .map(|(i, x)| format!("{}, {}, {}, {}\n", i + 1, x[0], x[1], x[2]))
                .collect();
            let list: Vec<String> = (1..=nodes.len()).map(|i| i.to_string()).collect();
            format!("*NODE\n{points}*ELEMENT, TYPE={kind}\n1, {}\n", list.join(", "))
        }
    };
    type Write<'a> = Box<dyn Fn(&[Vec<f64>]) -> String + 'a>;
    /// Name of the cells, dimension, cells, name of the file, and its writer.
    type Case<'a> = (&'a str, usize, Vec<Vec<usize>>, &'a str, Write<'a>);
    let cases: Vec<Case<'_>> = vec![
        ("quad8", 4, around.to_vec(), "msh", Box::new(gmsh(16))),
        ("quad9", 4, [around.to_vec(), whole(4)].concat(), "msh", Box::new(gmsh(10))),
        ("hex20", 8, gmsh_edges.clone(), "msh", Box::new(gmsh(17))),
        ("hex27", 8, [gmsh_edges, gmsh_faces, whole(8)].concat(), "msh", Box::new(gmsh(12))),
        ("quad8", 4, around.to_vec(), "vtk", Box::new(vtk(23))),
        ("quad9", 4, [around.to_vec(), whole(4)].concat(), "vtk", Box::new(vtk(28))),
        ("hex20", 8, vtk_edges.clone(), "vtk", Box::new(vtk(25))),
        ("hex27", 8, [vtk_edges.clone(), vtk_faces, whole(8)].concat(), "vtk", Box::new(vtk(29))),
        ("quad8", 4, around.to_vec(), "inp", Box::new(abaqus("CPS8R"))),
        ("hex20", 8, vtk_edges, "inp", Box::new(abaqus("C3D20R"))),
    ];
    let directory = tempfile::tempdir().unwrap();
    for (name, corners, middles, ending, write) in cases {
        let corner = |a: usize| CUBE[a].to_vec();
        let middle = |of: &Vec<usize>| {
            (0..3).map(|c| of.iter().map(|a| CUBE[*a][c]).sum::<f64>() / of.len() as f64).collect()
        };
        let nodes: Vec<Vec<f64>> = (0..corners).map(corner).chain(middles.iter().map(middle)).collect();
        let path = directory.path().join(format!("{name}.{ending}"));
        std::fs::write(&path, write(&nodes)).unwrap();
        let d = if corners == 4 { 2 } else { 3 };
        let shape = serde_json::from_value(json!({ "file": { "path": path } })).unwrap();
        let built = |order: CellOrder| {
            let body = BodyMesh { shape: &shape, order, refine: 0, transform: None, repeat: None };
            pliant_mesh::build_body(&body, d, directory.path())
        };
        let mesh = built(CellOrder::Quadratic).unwrap_or_else(|error| panic!("{name} {ending}: {error}"));
        let block = mesh.block().unwrap();
        assert_eq!((block.kind.name, block.len(), mesh.vertex_count()), (name, 1, nodes.len()), "{ending}");
        struct InOrder<'a>(&'a Mesh);
        impl CellVisitor for InOrder<'_> {
            type Output = ();
            fn visit<const D: usize, const N: usize>(self, cell: &'static Isoparametric<D, N>) {
                let vertices = self.0.block().unwrap().of::<N>()[0];
                for (v, xi) in vertices.iter().zip(cell.nodes) {
                    let at = self.0.point(*v as usize);
                    assert!((0..D).all(|c| (2.0 * at[c] - 1.0 - xi[c]).abs() < 1e-14), "{at:?} {xi:?}");
                }
            }
        }
        block.kind.visit(InOrder(&mesh));
        let refused = built(CellOrder::Linear).unwrap_err().to_string();
        assert!(refused.contains("order"), "{name} {ending}: {refused}");
        let shape =
            serde_json::from_value(json!({ "file": { "path": path, "drop_mid_nodes": true } })).unwrap();
        let body =
            BodyMesh { shape: &shape, order: CellOrder::Linear, refine: 0, transform: None, repeat: None };
        let mesh = pliant_mesh::build_body(&body, d, directory.path()).unwrap();
        assert_eq!((mesh.block().unwrap().kind.nodes, mesh.vertex_count()), (corners, corners));
    }
}
