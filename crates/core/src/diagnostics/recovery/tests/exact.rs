//! Fields that a recovery has to give exactly.

use pliant_mesh::Mesh;
use pliant_mesh::spec::MeshSpec;

use super::super::{NodalStress, Recovery};
use super::problem::{simulated, term};
use crate::algebra::Mat;
use crate::algebra::tests::sample::Random;
use crate::element::CELL_KINDS;
use crate::energy::elastic::{Elastic, Membrane, PullBack, Sheet};
use crate::material::{Isotropic, Linear, Material, Model, NeoHookean, Plane, Stress};

const ALL: [Recovery; 3] = [Recovery::Element, Recovery::Average, Recovery::Patch];

/// Returns dimension and number of nodes of every kind of element.
fn kinds() -> Vec<(usize, usize)> {
    let cells = CELL_KINDS.iter().map(|kind| (kind.dimension, kind.nodes));
    [(2, 3), (2, 6), (3, 4), (3, 10)].into_iter().chain(cells).collect()
}

/// Returns vertices and nodes of the cells of a grid of `cells` cells a direction.
fn grid((dimension, nodes): (usize, usize), cells: usize) -> (Vec<f64>, Vec<u32>) {
    let kind = CELL_KINDS.iter().find(|kind| (kind.dimension, kind.nodes) == (dimension, nodes));
    let mut grid = serde_json::json!({ "cells": vec![cells; dimension], "spacing": 0.5 });
    if kind.is_some() {
        grid["element"] = if dimension == 2 { "quadrilateral" } else { "hexahedron" }.into();
    }
    let spec: MeshSpec = serde_json::from_value(serde_json::json!({ "grid": grid })).unwrap();
    let linear = pliant_mesh::build(&spec, dimension, ".".as_ref()).unwrap();
    let mesh: Mesh = match (kind, nodes) {
        (_, 3 | 4) | (Some(_), 8) if nodes < 8 || dimension == 3 => linear,
        (Some(_), 8 | 20) => linear.promoted_to_serendipity().unwrap(),
        _ => linear.promoted_to_quadratic().unwrap(),
    };
    let cells = match (mesh.block(), nodes) {
        (Some(block), _) => block.vertices.clone(),
        (None, 3) => mesh.elements::<3>().concat(),
        (None, 4) => mesh.elements::<4>().concat(),
        (None, 6) => mesh.elements::<6>().concat(),
        (None, _) => mesh.elements::<10>().concat(),
    };
    assert_eq!(cells.len() % nodes, 0, "{nodes} nodes in {dimension} dimensions");
    (mesh.points, cells)
}

/// Returns the largest distance of the stress from an exact one, over all rows.
fn largest_error(stress: &NodalStress, exact: impl Fn(u32) -> Mat<f64, 3>) -> f64 {
    let rows = stress.vertices.iter().zip(&stress.stress);
    // The root of a sum that is not a number is no number: no maximum hides it.
    rows.map(|(vertex, stress)| (*stress - exact(*vertex)).norm_squared()).sum::<f64>().sqrt()
}

/// Curved and distorted elements in a homogeneous large deformation.
#[test]
fn a_constant_stress_is_exact_at_every_node_of_every_element() {
    let material = NeoHookean::new(&Isotropic { young: 1.0, poisson: 0.3, preset: None });
    let gradient = Mat([[1.2, 0.3, 0.1], [-0.1, 0.9, 0.2], [0.05, -0.2, 1.1]]);
    for (dimension, nodes) in kinds() {
        let (mut rest, cells) = grid((dimension, nodes), 3);
        let mut random = Random(5);
        rest.iter_mut().for_each(|x| *x += random.uniform(-0.02, 0.02));
        let mut f = gradient;
        if dimension == 2 {
            f = Mat([[1.2, 0.3, 0.0], [-0.1, 0.9, 0.0], [0.0, 0.0, 1.0]]);
        }
        let mut x = vec![];
        for point in rest.chunks_exact(dimension) {
            x.extend((0..dimension).map(|i| 0.3 + (0..dimension).map(|j| f[i][j] * point[j]).sum::<f64>()));
        }
        let terms = vec![term((dimension, nodes), material, PullBack::Cofactor, &cells, &rest)];
        let (topology, simulation) = simulated(dimension, terms, &rest, x);
        let exact = Material::<3>::pk1(&material, &f).mul_transpose(&f).scale(1.0 / f.determinant());
        for recovery in ALL {
            let stress = simulation.nodal_stress(&topology, recovery);
            let rows = if recovery == Recovery::Element { cells.len() } else { rest.len() / dimension };
            assert_eq!((stress.vertices.len(), stress.stress.len()), (rows, rows));
            let error = largest_error(&stress, |_| exact);
            assert!(error < 1e-11, "{nodes} nodes in {dimension}D, {recovery:?}: off by {error:e}");
            let estimate = simulation.stress_error(&topology, recovery).unwrap();
            assert_eq!(estimate.elements.len(), cells.len() / nodes);
            assert!(estimate.relative() < 1e-11, "{nodes} nodes: {:e}", estimate.relative());
        }
    }
}

/// Returns the largest relative error of a patch recovery of the stress of a quadratic displacement, at
/// the vertices that `is_wanted` selects by their reference positions.
fn error_of_linear_stress(
    (dimension, nodes): (usize, usize),
    cells: usize,
    is_wanted: impl Fn(&[f64]) -> bool,
) -> f64 {
    // So small that the Cauchy stress is that of linear elasticity, so large that rounding is smaller.
    let scale = 1e-7;
    let material = Linear::new(&Isotropic { young: 1.0, poisson: 0.3, preset: None }.into());
    let (rest, cells) = grid((dimension, nodes), cells);
    let displacement = |p: &[f64]| -> Vec<f64> {
        let next = |c: usize| p[(c + 1) % dimension];
        (0..dimension)
            .map(|c| 0.7 * p[c] * p[c] + (1.1 + c as f64) * p[c] * next(c) - next(c) * next(c))
            .collect()
    };
    let x = rest
        .chunks_exact(dimension)
        .flat_map(|p| p.iter().zip(displacement(p)).map(|(x, u)| x + scale * u).collect::<Vec<f64>>());
    let x = x.collect();
    let terms = vec![term((dimension, nodes), material, PullBack::None, &cells, &rest)];
    let (topology, simulation) = simulated(dimension, terms, &rest, x);
    let mut stress = simulation.nodal_stress(&topology, Recovery::Patch);
    assert_eq!(stress.lowered, 0);
    let position = |vertex: u32| &rest[vertex as usize * dimension..][..dimension];
    let wanted: Vec<bool> = stress.vertices.iter().map(|vertex| is_wanted(position(*vertex))).collect();
    assert!(wanted.contains(&true));
    let mut keep = wanted.iter();
    stress.stress.retain(|_| *keep.next().unwrap());
    let mut keep = wanted.iter();
    stress.vertices.retain(|_| *keep.next().unwrap());
    let exact = |vertex: u32| {
        let p = position(vertex);
        let mut f = Mat::<f64, 3>::identity();
        for k in 0..dimension {
            // Central differences of a quadratic function are exact.
            let moved = |step: f64| {
                let mut p = p.to_vec();
                p[k] += step;
                displacement(&p)
            };
            let (ahead, behind) = (moved(0.5), moved(-0.5));
            (0..dimension).for_each(|i| f[i][k] += scale * (ahead[i] - behind[i]));
        }
        Material::<3>::pk1(&material, &f)
    };
    let size = wanted.len() as f64 * scale;
    largest_error(&stress, exact) / size
}

#[test]
fn elements_of_second_order_recover_a_linear_stress_exactly_at_all_nodes() {
    for (dimension, nodes) in kinds().into_iter().filter(|(_, nodes)| ![3, 4].contains(nodes)) {
        if (dimension, nodes) == (3, 8) {
            continue;
        }
        let error = error_of_linear_stress((dimension, nodes), 3, |_| true);
        assert!(error < 1e-6, "{nodes} nodes in {dimension}D: {error:e}");
    }
}

#[test]
fn elements_of_first_order_recover_a_linear_stress_exactly_from_regular_patches() {
    for kind in [(2, 3), (2, 4), (3, 8)] {
        let inside = error_of_linear_stress(kind, 4, |p| p.iter().all(|x| (0.1..1.9).contains(x)));
        assert!(inside < 1e-6, "{kind:?}: {inside:e}");
    }
}

/// Two materials share a side: its vertices have a stress of each.
#[test]
fn nothing_is_averaged_across_materials() {
    let (rest, cells) = grid((2, 3), 4);
    let (lower, upper): (Vec<&[u32]>, Vec<&[u32]>) =
        cells.chunks_exact(3).partition(|cell| cell.iter().all(|vertex| rest[2 * *vertex as usize] < 1.1));
    let solid = |young| NeoHookean::new(&Isotropic { young, poisson: 0.0, preset: None });
    let of = |young, cells: &[&[u32]]| term((2, 3), solid(young), PullBack::Cofactor, &cells.concat(), &rest);
    let x = rest.chunks_exact(2).flat_map(|p| [1.1 * p[0], p[1]]).collect();
    let (topology, simulation) = simulated(2, vec![of(1.0, &lower), of(3.0, &upper)], &rest, x);
    for recovery in [Recovery::Average, Recovery::Patch] {
        let stress = simulation.nodal_stress(&topology, recovery);
        let middle = rest.chunks_exact(2).position(|p| p == [1.0, 1.0]).unwrap() as u32;
        let found: Vec<f64> = stress.at(middle).map(|stress| stress[0][0]).collect();
        let [soft, stiff] = found[..] else { panic!("{recovery:?}: {found:?}") };
        assert!((stiff / soft - 3.0).abs() < 1e-12, "{recovery:?}: {found:?}");
    }
}

/// One cell, one strip without a vertex inside, and a cell in three dimensions.
#[test]
fn patches_without_a_corner_inside_take_a_lower_degree_and_say_so() {
    let material = NeoHookean::new(&Isotropic { young: 1.0, poisson: 0.3, preset: None });
    for (kind, cells, lowered) in
        [((2, 4), 1, 4), ((2, 3), 1, 4), ((3, 8), 1, 8), ((2, 9), 1, 4), ((2, 6), 1, 4)]
    {
        let (rest, cells) = grid(kind, cells);
        let x = rest.iter().map(|x| 1.1 * x).collect();
        let terms = vec![term(kind, material, PullBack::Cofactor, &cells, &rest)];
        let (topology, simulation) = simulated(kind.0, terms, &rest, x);
        let stress = simulation.nodal_stress(&topology, Recovery::Patch);
        assert_eq!(stress.lowered, lowered, "{kind:?}");
        let first = stress.stress[0];
        assert!(first.norm_squared() > 1e-4 && largest_error(&stress, |_| first) < 1e-13, "{kind:?}");
    }
}

/// A sheet turned in space, in plane stress.
#[test]
fn membranes_have_the_stress_of_their_plane() {
    let (plane, cells) = grid((2, 3), 4);
    let turn = |p: [f64; 2]| [0.6 * p[0] + 0.3, 0.8 * p[0], p[1]];
    let rest: Vec<f64> = plane.as_chunks::<2>().0.iter().flat_map(|p| turn(*p)).collect();
    let x: Vec<f64> = plane.as_chunks::<2>().0.iter().flat_map(|p| turn([1.2 * p[0], p[1]])).collect();
    let material = NeoHookean::new(&Isotropic { young: 1.0, poisson: 0.0, preset: None });
    let sheet = Sheet { thickness: 0.1, plane: Plane::Stress, lame: None, stress: Stress::Analytic };
    let term = Membrane::new("b", material, sheet, cells.as_chunks().0, &rest);
    let (topology, simulation) = simulated(3, vec![Box::new(term)], &rest, x);
    for recovery in ALL {
        let stress = simulation.nodal_stress(&topology, recovery);
        assert!(stress.lowered == 0 && simulation.stress_error(&topology, recovery).is_none());
        let first = stress.principal()[0];
        let [tension, ..] = first.values;
        assert!(tension > 0.1 && (first.directions[0][1].abs() - 0.8).abs() < 1e-12, "{first:?}");
        let exact = Mat([[0.36, 0.48, 0.0], [0.48, 0.64, 0.0], [0.0, 0.0, 0.0]]).scale(tension);
        assert!(largest_error(&stress, |_| exact) < 1e-12, "{recovery:?}");
    }
}

#[test]
fn principal_stresses_descend_along_their_directions() {
    let stress = NodalStress {
        vertices: vec![4],
        stress: vec![Mat([[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 7.0]])],
        lowered: 0,
    };
    let principal = stress.principal()[0];
    let half = 0.5f64.sqrt();
    for (found, expected) in principal.values.iter().zip([7.0, 3.0, 1.0]) {
        assert!((found - expected).abs() < 1e-14, "{principal:?}");
    }
    for (direction, expected) in principal.directions.0.iter().zip([[0.0, 0.0, 1.0], [half, half, 0.0]]) {
        let along: f64 = direction.iter().zip(expected).map(|(a, b)| a * b).sum();
        assert!((along.abs() - 1.0).abs() < 1e-14, "{principal:?}");
    }
    // sqrt(((7 - 3)^2 + (3 - 1)^2 + (1 - 7)^2) / 2)
    assert!((stress.von_mises()[0] - 28f64.sqrt()).abs() < 1e-14);
    assert_eq!((stress.at(4).count(), stress.at(5).count()), (1, 0));
}

/// Fibres and factors of elements change the tangent that an estimate divides by.
#[test]
fn estimates_scale_with_the_factors_of_elements() {
    let (rest, cells) = grid((2, 6), 3);
    let material = NeoHookean::new(&Isotropic { young: 1.0, poisson: 0.3, preset: None });
    let elements = cells.as_chunks::<6>().0;
    let x: Vec<f64> = rest.chunks_exact(2).flat_map(|p| [p[0] + 0.05 * p[0].powi(3), p[1]]).collect();
    let estimate = |factor: f64| {
        let term = Elastic::<2, 6>::quadratic("b", material, Stress::Analytic, elements, &rest);
        let term = term.with_factors(&vec![factor; elements.len()]);
        let (topology, simulation) = simulated(2, vec![Box::new(term)], &rest, x.clone());
        simulation.stress_error(&topology, Recovery::Patch).unwrap()
    };
    let (once, four) = (estimate(1.0), estimate(4.0));
    assert!(once.relative() > 1e-4 && (four.total / once.total - 2.0).abs() < 1e-12);
    assert!((four.norm / once.norm - 2.0).abs() < 1e-12);
}
