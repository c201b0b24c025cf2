//! Properties of every dissipation function.

use super::*;
use crate::energy::EnergyTerm;
use crate::energy::elastic::{Elastic, points_of};
use crate::energy::measure::{Curvature, HingeAngle, Length, StencilConstants};
use crate::material::Stress;
use crate::material::{Isotropic, Linear, Model, Plane, PlaneIsotropic};

/// Returns the `i`-th number of a sequence without pattern in (-1, 1).
fn number(i: usize) -> f64 {
    2.0 * ((i as f64 + 1.0) * 0.754_877_666_246_692_7).fract() - 1.0
}

fn scattered(count: usize, seed: usize) -> Vec<f64> {
    (0..count).map(|i| number(i + 1000 * seed)).collect()
}

/// Returns reference positions and elements of two triangles or tetrahedra that share a face.
fn two<const D: usize, const N: usize>() -> (Vec<f64>, Vec<[u32; N]>) {
    let mut rest = vec![0.0; D * (N + 1)];
    for i in 0..D {
        rest[D * (i + 1) + i] = 1.0;
    }
    rest[D * N..].fill(0.9);
    let mut elements = vec![[0; N], [0; N]];
    for i in 0..N {
        elements[0][i] = i as u32;
        elements[1][i] = i as u32 + 1;
    }
    // Gives the second element positive volume.
    if crate::element::simplex_rest(&points_of::<D, N>(&rest, &elements[1])).1 < 0.0 {
        elements[1].swap(0, 1);
    }
    (rest, elements)
}

fn terms<const D: usize, const N: usize>() -> (Vec<f64>, Vec<Box<dyn DissipativeTerm>>) {
    let (rest, elements) = two::<D, N>();
    let viscosity = Viscosity { shear: 3.0, second: 2.0 };
    let shape = |element: &[u32; N]| points_of::<D, N>(&rest, element);
    let edges = [[0, 1], [1, 2], [2, 3], [0, 3]];
    let constants = [1.0, 2.0, 3.0, 4.0].map(|stiffness| StencilConstants { stiffness, rest: [0.0; 2] });
    let mass = vec![1.5; N + 1];
    let terms: Vec<Box<dyn DissipativeTerm>> = vec![
        Box::new(StrainRate::<D, N, _>::points("a", viscosity, &elements, &rest, shape)),
        Box::new(MeasuredRate::<Length, D, 2>::new("a", &edges, &constants, &rest)),
        Box::new(MassProportional::new("a", 0.7, &mass, 0..N + 1, D)),
    ];
    let deformed = rest.iter().enumerate().map(|(i, x)| x + 0.2 * number(i)).collect();
    (deformed, terms)
}

/// Returns the same two elements with mid-edge nodes and curved sides.
fn quadratic<const D: usize, const C: usize, const N: usize>() -> (Vec<f64>, Vec<Box<dyn DissipativeTerm>>) {
    let (points, corners) = two::<D, C>();
    let mut mesh = pliant_mesh::Mesh { dimension: D, points, ..pliant_mesh::Mesh::default() };
    for cell in corners {
        match D {
            2 => mesh.triangles.push([cell[0], cell[1], cell[2]]),
            _ => mesh.tetrahedra.push([cell[0], cell[1], cell[2], cell[3]]),
        }
    }
    let mesh = mesh.promoted_to_quadratic().unwrap();
    let rest: Vec<f64> = mesh.points.iter().enumerate().map(|(i, x)| x + 0.03 * number(i + 5)).collect();
    let viscosity = Viscosity { shear: 3.0, second: 2.0 };
    let term = StrainRate::<D, N, _>::points("a", viscosity, &mesh.elements::<N>(), &rest, |element| {
        points_of::<D, N>(&rest, element)
    });
    let deformed = rest.iter().enumerate().map(|(i, x)| x + 0.1 * number(i)).collect();
    (deformed, vec![Box::new(term)])
}

/// Returns one distorted cell.
fn cells<const D: usize, const N: usize>(
    cell: &'static crate::element::Isoparametric<D, N>,
) -> (Vec<f64>, Vec<Box<dyn DissipativeTerm>>) {
    let nodes = cell.nodes.as_flattened().iter().enumerate();
    let rest: Vec<f64> = nodes.map(|(i, x)| 0.5 * x + 0.03 * number(i + 5)).collect();
    let viscosity = Viscosity { shear: 3.0, second: 2.0 };
    let term =
        StrainRate::<D, N, _>::cells("a", viscosity, cell, &[std::array::from_fn(|a| a as u32)], &rest);
    let deformed = rest.iter().enumerate().map(|(i, x)| x + 0.1 * number(i)).collect();
    (deformed, vec![Box::new(term)])
}

/// Returns a hinge between two triangles in space, and a joint between two edges.
fn bends() -> (Vec<f64>, Vec<Box<dyn DissipativeTerm>>) {
    let (rest, _) = two::<3, 4>();
    let constants = [StencilConstants { stiffness: 2.0, rest: [0.0; 2] }];
    let terms: Vec<Box<dyn DissipativeTerm>> = vec![
        Box::new(MeasuredRate::<HingeAngle, 3, 4>::new("a", &[[0, 1, 2, 4]], &constants, &rest)),
        Box::new(MeasuredRate::<Curvature, 3, 3>::new("a", &[[0, 1, 2]], &constants, &rest)),
    ];
    let deformed = rest.iter().enumerate().map(|(i, x)| x + 0.2 * number(i)).collect();
    (deformed, terms)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn force(term: &mut dyn DissipativeTerm, x: &[f64], v: &[f64]) -> Vec<f64> {
    let mut g = vec![0.0; x.len()];
    assert!(term.evaluate(x, v));
    term.add_rows(0, &mut g);
    g
}

fn check_derivatives((x, mut terms): (Vec<f64>, Vec<Box<dyn DissipativeTerm>>)) {
    let (v, p, q) = (scattered(x.len(), 1), scattered(x.len(), 2), scattered(x.len(), 3));
    for term in &mut terms {
        let name = term.name();
        let g = force(&mut **term, &x, &v);
        let power = term.power(&x, &v);
        assert!(power > 0.1, "{name} takes away {power} W");
        assert!((dot(&g, &v) / power - 1.0).abs() < 1e-14, "{name}: v . dR/dv is its power");
        // R = power / 2 is quadratic: the central difference is exact up to rounding.
        let moved = |s: f64| -> Vec<f64> { v.iter().zip(&p).map(|(v, p)| v + s * p).collect() };
        let slope = 0.25 * (term.power(&x, &moved(1.0)) - term.power(&x, &moved(-1.0)));
        assert!((dot(&g, &p) - slope).abs() < 1e-13 * power, "{name}: {} and {slope}", dot(&g, &p));
        let product = |term: &mut dyn DissipativeTerm, p: &[f64]| {
            let mut y = vec![0.0; p.len()];
            term.add_damping_product(&x, &v, p, &mut y);
            y
        };
        let (cp, cq) = (product(&mut **term, &p), product(&mut **term, &q));
        assert!((dot(&cp, &q) - dot(&cq, &p)).abs() < 1e-13 * power, "{name} is symmetric");
        let difference: Vec<f64> =
            force(&mut **term, &x, &moved(1.0)).iter().zip(&g).map(|(a, b)| a - b).collect();
        let error = difference.iter().zip(&cp).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-12, "{name}: the product is the difference of forces, but for {error:e}");
        // The derivative of p . dR/dv with respect to positions along q, against differences of fourth
        // order.
        let mut by_positions = vec![0.0; x.len()];
        assert!(term.add_position_product(&x, &v, &p, &mut by_positions), "{name}");
        let mut change = vec![0.0; x.len()];
        assert!(term.add_position_change(&x, &v, &q, &mut change), "{name}");
        let error = (dot(&change, &p) - dot(&by_positions, &q)).abs();
        assert!(error < 1e-13 * power, "{name}: changes with positions are the transpose, but for {error:e}");
        let mut along = |h: f64| {
            let moved: Vec<f64> = x.iter().zip(&q).map(|(x, q)| x + h * q).collect();
            dot(&force(&mut **term, &moved, &v), &p)
        };
        let mut difference = |h: f64| (along(h) - along(-h)) / (2.0 * h);
        let (near, far) = (difference(1e-4), difference(2e-4));
        let error = ((4.0 * near - far) / 3.0 - dot(&by_positions, &q)).abs();
        assert!(error < 1e-9 * power, "{name}: by positions {error:e}");
    }
}

#[test]
fn forces_are_derivatives_of_the_dissipation_and_products_of_forces() {
    check_derivatives(terms::<2, 3>());
    check_derivatives(terms::<3, 4>());
    check_derivatives(quadratic::<2, 3, 6>());
    check_derivatives(quadratic::<3, 4, 10>());
    check_derivatives(cells(&crate::element::QUADRILATERAL));
    check_derivatives(cells(&crate::element::HEXAHEDRON));
    check_derivatives(bends());
}

fn rigid_velocity<const D: usize>(x: &[f64]) -> Vec<f64> {
    let turn = |x: &[f64]| match D {
        2 => vec![3.0 - 2.0 * x[1], 1.0 + 2.0 * x[0]],
        _ => vec![1.0 - 2.0 * x[1] + x[2], 2.0 * x[0] - 3.0 * x[2], 0.5 - x[0] + 3.0 * x[1]],
    };
    x.chunks_exact(D).flat_map(turn).collect()
}

/// `rounding` is the residual of forces that cancel [N].
fn check_rigid<const D: usize>((x, mut terms): (Vec<f64>, Vec<Box<dyn DissipativeTerm>>), rounding: f64) {
    let v = rigid_velocity::<D>(&x);
    for term in &mut terms {
        let largest = force(&mut **term, &x, &v).iter().fold(0.0f64, |m, g| m.max(g.abs()));
        let name = term.name();
        if name.starts_with("mass-proportional") {
            assert!(largest > 1.0, "{name} does slow rigid motion");
        } else {
            assert!(largest < rounding, "{name} resists a rigid motion with {largest:e} N");
        }
        // No net force and no net moment, whatever the velocities.
        let g = force(&mut **term, &x, &scattered(x.len(), 4));
        if !name.starts_with("mass-proportional") {
            let work = dot(&g, &v);
            assert!(work.abs() < rounding, "{name} does {work:e} W on a rigid motion");
        }
    }
}

// README, promise 6.
#[test]
fn a_rigid_motion_of_a_deformed_body_is_not_damped() {
    check_rigid::<2>(terms::<2, 3>(), 1e-14);
    check_rigid::<3>(terms::<3, 4>(), 1e-14);
    // Gradients of the shape functions are up to four times as steep.
    check_rigid::<2>(quadratic::<2, 3, 6>(), 4e-14);
    check_rigid::<3>(quadratic::<3, 4, 10>(), 4e-14);
    check_rigid::<2>(cells(&crate::element::QUADRILATERAL), 4e-14);
    check_rigid::<3>(cells(&crate::element::HEXAHEDRON), 4e-14);
}

/// Checks `C = beta K` in the reference configuration, with `K` of linear elasticity.
fn check_rayleigh<const D: usize, const N: usize>(plane: Option<Plane>) {
    let (rest, elements) = two::<D, N>();
    let (young, poisson, beta) = (50.0, 0.3, 0.02);
    let parameters = PlaneIsotropic { solid: Isotropic::new(young, poisson), plane };
    let (mu, lambda) = (young / 2.6, young * poisson / (1.3 * 0.4));
    let in_plane = 2.0 * lambda * mu / (lambda + 2.0 * mu);
    let second = beta * if plane == Some(Plane::Stress) { in_plane } else { lambda };
    let shape = |element: &[u32; N]| points_of::<D, N>(&rest, element);
    let viscosity = Viscosity { shear: beta * mu, second };
    let mut damping = StrainRate::<D, N, _>::points("a", viscosity, &elements, &rest, shape);
    let mut elastic =
        Elastic::<D, N>::linear("a", Linear::new(&parameters), Stress::Analytic, &elements, &rest);
    let p = scattered(rest.len(), 5);
    let (mut c, mut k) = (vec![0.0; p.len()], vec![0.0; p.len()]);
    damping.add_damping_product(&rest, &p, &p, &mut c);
    elastic.add_hessian_product(&rest, &p, &mut k);
    for (c, k) in c.iter().zip(&k) {
        assert!((c - beta * k).abs() < 1e-13 * beta * young, "{c} and {}", beta * k);
    }
}

#[test]
fn at_rest_stiffness_proportional_viscosities_are_rayleigh_damping() {
    check_rayleigh::<2, 3>(None);
    check_rayleigh::<2, 3>(Some(Plane::Stress));
    check_rayleigh::<3, 4>(None);
}
