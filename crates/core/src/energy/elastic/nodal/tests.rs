//! The terms of nodal integration against plain sums, and what they do outside of the domain.

use super::*;
use crate::algebra::tests::sample::Random;
use crate::element::quadrature_points;
use crate::energy::elastic::cells::tests::{
    by_stencils, check_prediction, derivative, difference, gradient, largest,
};
use crate::energy::elastic::points_of;
use crate::material::Isotropic;

/// Rest positions and elements of a grid whose vertices are off their places.
fn grid<const D: usize, const N: usize>() -> (Vec<f64>, Vec<[u32; N]>) {
    let cells = [4, 3, 2][..D].to_vec();
    let spec = pliant_mesh::spec::MeshSpec::Grid(pliant_mesh::spec::GridSpec {
        cells,
        spacing: Some(0.1),
        ..Default::default()
    });
    let mut mesh = pliant_mesh::build(&spec, D, ".".as_ref()).unwrap();
    let mut random = Random(7);
    mesh.points.iter_mut().for_each(|x| *x += random.uniform(-0.015, 0.015));
    let elements = mesh.elements::<N>();
    // Vertices before and after the body, as in a system with other bodies.
    let elements = elements.into_iter().map(|e| e.map(|v| v + 3)).collect();
    let mut points = vec![0.0; 3 * D];
    points.extend(mesh.points);
    points.extend(vec![0.0; 2 * D]);
    (points, elements)
}

fn deformed<const D: usize>(rest: &[f64], amount: f64) -> Vec<f64> {
    let mut random = Random(3);
    rest.iter().map(|x| 1.1 * x + 0.4 + random.uniform(-amount, amount)).collect()
}

struct Density<'a, const D: usize>(&'a Mat<f64, D>);

impl<const D: usize> MaterialVisitor<D> for Density<'_, D> {
    type Output = f64;
    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> f64 {
        Material::<D>::psi(&material, self.0)
    }
}

/// `sum_a V_a psi_1(F_a) + sum_e V_e psi_2(F_e)`, as it is written.
fn plain_energy<const D: usize, const N: usize>(
    specs: &[MaterialSpec; 2],
    elements: &[[u32; N]],
    rest: &[f64],
    x: &[f64],
) -> f64 {
    let count = rest.len() / D;
    let (mut sums, mut volumes) = (vec![Mat::<f64, D>::zero(); count], vec![0.0; count]);
    let mut energy = 0.0;
    for element in elements {
        for point in quadrature_points(&points_of::<D, N>(rest, element)) {
            let f = point.deformation_gradient(&points_of(x, element));
            energy += point.weight * specs[1].visit::<D, _>(Density(&f));
            for v in element {
                let share = point.weight / (D + 1) as f64;
                volumes[*v as usize] += share;
                sums[*v as usize] += f.scale(share);
            }
        }
    }
    for (sum, volume) in sums.iter().zip(&volumes).filter(|(_, volume)| **volume > 0.0) {
        energy += volume * specs[0].visit::<D, _>(Density(&sum.scale(1.0 / volume)));
    }
    energy
}

fn is_the_plain_sum<const D: usize, const N: usize>() {
    let (rest, elements) = grid::<D, N>();
    let x = deformed::<D>(&rest, 0.01);
    for poisson in [0.3, 0.4999] {
        let spec = MaterialSpec::StableNeoHookean(Isotropic::new(1e5, poisson));
        let specs = spec.split(0.3).unwrap();
        let mut terms =
            nodal_integration::<D, N>("block", &spec, 0.3, Stress::Analytic, &elements, &rest).unwrap();
        let energy: f64 = terms.iter_mut().map(|term| term.energy(&x)).sum();
        let expected = plain_energy::<D, N>(&specs, &elements, &rest, &x);
        assert!((energy / expected - 1.0).abs() < 1e-12, "{D}D: {energy} J, {expected} J");
        // Whole rows and rows in pieces are the same; vertices that are not of the body have none.
        let [_, nodal] = &mut terms;
        assert!(nodal.evaluate(&x));
        let mut whole = vec![0.0; x.len()];
        nodal.add_rows(0, &mut whole);
        let mut pieces = vec![0.0; x.len()];
        for (i, piece) in pieces.chunks_mut(7 * D).enumerate() {
            nodal.add_rows(7 * i, piece);
        }
        assert_eq!(whole, pieces);
        assert!(whole[..3 * D].iter().chain(&whole[x.len() - 2 * D..]).all(|g| *g == 0.0));
        assert!(whole[3 * D..x.len() - 2 * D].iter().all(|g| *g != 0.0));
    }
}

#[test]
fn the_energy_is_the_sum_over_nodes_and_elements() {
    is_the_plain_sum::<2, 3>();
    is_the_plain_sum::<3, 4>();
}

/// Steps of models that need `J > 0` end before any element or any mean collapses.
#[test]
fn steps_end_where_the_energy_is_finite() {
    let (rest, elements) = grid::<3, 4>();
    let spec = MaterialSpec::NeoHookean(Isotropic::new(1e5, 0.49));
    let mut terms =
        nodal_integration::<3, 4>("block", &spec, 0.2, Stress::Analytic, &elements, &rest).unwrap();
    // Everything is turned inside out: at half of the way all volumes are zero.
    let dx: Vec<f64> =
        rest.iter().enumerate().map(|(i, x)| if i % 3 == 0 { -2.0 * x } else { 0.0 }).collect();
    for term in &mut terms {
        let step = term.limit().map_or(1.0, |limit| limit.max_step(&rest, &dx));
        assert!((step - 0.9 * 0.5).abs() < 1e-9, "{}: {step}", term.name());
        let at = |t: f64| -> Vec<f64> { rest.iter().zip(&dx).map(|(x, dx)| x + t * dx).collect() };
        assert!(term.energy(&at(step)).is_finite() && term.energy(&at(1.0)).is_infinite());
        assert_eq!(term.fault(&at(step)), None);
        match term.fault(&at(1.0)) {
            Some(Fault::Node { vertex, j, .. }) => assert!(vertex == 3 && (j + 1.0).abs() < 1e-9),
            Some(Fault::Element { element, j, .. }) => {
                assert!(element < elements.len() && (j + 1.0).abs() < 1e-9)
            }
            other => panic!("{other:?}"),
        }
    }
}

/// Models that can be inverted have finite forces and no negative energy wherever the whole model has none.
#[test]
fn collapsed_and_inverted_states_have_finite_forces_and_no_less_energy_than_rest() {
    let (rest, elements) = grid::<3, 4>();
    for name in
        ["corotated", "fixed-corotated", "stable-neo-hookean-log", "stable-neo-hookean", "stvk", "arap"]
    {
        let spec = MaterialSpec::examples().into_iter().find(|spec| spec.name() == name).unwrap();
        let mut terms =
            nodal_integration::<3, 4>("block", &spec, 0.2, Stress::Analytic, &elements, &rest).unwrap();
        let states = [[0.0; 3], [1.0, 1.0, 0.0], [-1.0, 1.0, 1.0], [-1.0, -1.0, -1.0], [1.0, 0.0, 0.0]];
        for scale in states {
            let x: Vec<f64> = rest.iter().enumerate().map(|(i, x)| scale[i % 3] * x).collect();
            for term in &mut terms {
                assert!(term.evaluate(&x) && term.fault(&x).is_none(), "{name} at {scale:?}");
                let energy = term.energy(&x);
                assert!(energy.is_finite() && energy > -1e-9, "{name} at {scale:?}: {energy} J");
            }
        }
    }
}

/// The Hessian of either term, as a product and by stencils, is the derivative of its gradient.
fn hessians_are_derivatives<const D: usize, const N: usize>() {
    let (rest, elements) = grid::<D, N>();
    let x = deformed::<D>(&rest, 0.01);
    let mut random = Random(11);
    let p: Vec<f64> = x.iter().map(|_| random.uniform(-0.1, 0.1)).collect();
    let moved = |t: f64| -> Vec<f64> { x.iter().zip(&p).map(|(x, p)| x + t * p).collect() };
    let spec = MaterialSpec::StableNeoHookean(Isotropic::new(1e5, 0.3));
    let terms = nodal_integration::<D, N>("block", &spec, 0.3, Stress::Analytic, &elements, &rest).unwrap();
    for term in terms {
        let term = std::cell::RefCell::new(term);
        let expected = derivative(|t| gradient(&mut **term.borrow_mut(), &moved(t)), 1e-3);
        let mut term = term.into_inner();
        let mut product = vec![0.0; x.len()];
        term.add_hessian_product(&x, &p, &mut product);
        let error = difference(&product, &expected) / largest(&expected);
        assert!(error < 1e-8, "{}, {D}D: product off by {error:e}", term.name());
        let (by_stencils, _) = by_stencils(&mut *term, &x, &p, Psd::Exact, D);
        let error = difference(&product, &by_stencils) / largest(&expected);
        assert!(error < 1e-12, "{}, {D}D: stencils off by {error:e}", term.name());
    }
}

#[test]
fn hessians_of_nodes_and_elements_are_derivatives_of_their_forces() {
    hessians_are_derivatives::<2, 3>();
    hessians_are_derivatives::<3, 4>();
}

fn prediction<const D: usize, const N: usize>() {
    let (rest, elements) = grid::<D, N>();
    let spec = MaterialSpec::NeoHookean(Isotropic::new(1e5, 0.4999));
    let [_, mut nodal] =
        nodal_integration::<D, N>("block", &spec, 0.1, Stress::Analytic, &elements, &rest).unwrap();
    check_prediction(&mut *nodal, &rest, D);
}

#[test]
fn predicted_hessians_of_nodes_are_positive_after_a_turn_and_exact_where_they_begin() {
    prediction::<2, 3>();
    prediction::<3, 4>();
}
