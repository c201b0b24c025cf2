//! Quadratic elements with curved sides, against sums over their quadrature points.

use super::*;
use crate::algebra::tests::sample::Random;
use crate::element::{QuadraturePoint, least_jacobian, quadrature_points, simplex_rest};
use crate::energy::EnergyTerm;
use crate::material::{
    DispersedFibres, HolzapfelGasserOgden, Isotropic, Model, NeoHookean, Parameters, Psd, material_axes,
};

/// Returns a grid of curved elements, with mid-edge nodes off their edges: reference positions, flat, and
/// the elements.
fn curved<const D: usize, const N: usize>(cells: [usize; D]) -> (Vec<f64>, Vec<[u32; N]>) {
    let grid =
        pliant_mesh::spec::GridSpec { cells: cells.to_vec(), spacing: Some(0.1), ..Default::default() };
    let spec = pliant_mesh::spec::MeshSpec::Grid(grid);
    let linear = pliant_mesh::build(&spec, D, ".".as_ref()).unwrap();
    let mut mesh = linear.promoted_to_quadratic().unwrap();
    let mut random = Random(21);
    for x in &mut mesh.points[linear.points.len()..] {
        *x += random.uniform(-0.006, 0.006);
    }
    let elements = mesh.elements::<N>();
    assert!(
        elements.iter().all(|e| (0.3..0.99).contains(&least_jacobian(&points_of::<D, N>(&mesh.points, e))))
    );
    (mesh.points, elements)
}

fn material() -> NeoHookean {
    NeoHookean::new(&Isotropic::example())
}

/// Returns a smooth deformation with `det F > 0` everywhere.
fn deformed<const D: usize>(rest: &[f64]) -> Vec<f64> {
    let mut x = vec![];
    for row in rest.chunks_exact(D) {
        let mut y = [0.0; D];
        for c in 0..D {
            y[c] = 1.2 * row[c] + 0.3 * row[(c + 1) % D] + 0.8 * row[c] * row[(c + 1) % D] + 0.4;
        }
        x.extend(y);
    }
    x
}

/// Returns energy, gradient and Hessian product, element by element from [`quadrature_points`].
fn plainly<const D: usize, const N: usize>(
    rest: &[f64],
    elements: &[[u32; N]],
    x: &[f64],
    p: &[f64],
) -> (f64, Vec<f64>, Vec<f64>) {
    let (mut energy, mut gradient, mut product) = (0.0, vec![0.0; x.len()], vec![0.0; x.len()]);
    for element in elements {
        for point in quadrature_points(&points_of::<D, N>(rest, element)) {
            let QuadraturePoint { weight, gradients } = point;
            let f = point.deformation_gradient(&points_of(x, element));
            let df = point.deformation_gradient(&points_of(p, element));
            energy += weight * Material::<D>::psi(&material(), &f);
            let stress = Material::<D>::pk1(&material(), &f);
            let change = Material::<D>::hessian(&material(), &f, Psd::Exact).apply(&df);
            for (v, b) in element.iter().zip(&gradients) {
                for c in 0..D {
                    gradient[*v as usize * D + c] += weight * stress.mul_vec(b)[c];
                    product[*v as usize * D + c] += weight * change.mul_vec(b)[c];
                }
            }
        }
    }
    (energy, gradient, product)
}

fn agrees_with_the_plain_sum<const D: usize, const N: usize>(cells: [usize; D]) {
    let (rest, elements) = curved::<D, N>(cells);
    let x = deformed::<D>(&rest);
    let mut random = Random(4);
    let p: Vec<f64> = x.iter().map(|_| random.uniform(-1.0, 1.0)).collect();
    let (energy, gradient, product) = plainly::<D, N>(&rest, &elements, &x, &p);
    for stress in [Stress::Analytic, Stress::Autodiff] {
        let mut term = Elastic::<D, N>::quadratic("block", material(), stress, &elements, &rest);
        assert!((term.energy(&x) / energy - 1.0).abs() < 1e-13);
        let (mut g, mut k) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        assert!(term.evaluate(&x));
        term.add_rows(0, &mut g);
        term.add_hessian_product(&x, &p, &mut k);
        let mut with_work = vec![0.0; x.len()];
        let work = term.add_transposed_product(&x, &p, &mut with_work).unwrap();
        assert_eq!(with_work, k, "{D}D, {stress:?}");
        let parts: Vec<f64> = gradient.iter().zip(&p).map(|(g, p)| g * p).collect();
        let size: f64 = parts.iter().map(|part| part.abs()).sum();
        let error = (work - parts.iter().sum::<f64>()).abs();
        assert!(error < 1e-13 * size, "{D}D, {stress:?}: the work {work:e} is off by {error:e}");
        for (found, expected) in [(&g, &gradient), (&k, &product)] {
            let scale = expected.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
            let error = found.iter().zip(expected).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
            assert!(error < 1e-12 * scale, "{D}D, {stress:?}: off by {error:e} of {scale:e}");
        }
    }
}

#[test]
fn forces_and_products_of_curved_elements_are_sums_over_their_quadrature_points() {
    agrees_with_the_plain_sum::<2, 6>([5, 3]);
    agrees_with_the_plain_sum::<3, 10>([3, 2, 2]);
}

/// `F` of an affine motion is equal at all points of all elements, curved or not; C1.
fn affine_motion<const D: usize, const N: usize>(cells: [usize; D]) {
    let (rest, elements) = curved::<D, N>(cells);
    let g = [[0.1, 0.2, -0.1], [-0.15, 0.3, 0.05], [0.2, -0.1, -0.2]];
    let f: [[f64; D]; D] =
        std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j)) + g[i][j]));
    let f = Mat(f);
    let x: Vec<f64> =
        rest.as_chunks::<D>().0.iter().flat_map(|row| f.mul_vec(row).map(|y| y + 0.3)).collect();
    let mut term = Elastic::<D, N>::quadratic("block", material(), Stress::Analytic, &elements, &rest);
    for (element, vertices, pack, lane) in term.elements() {
        for [dx, inverse] in term.points(&x, &vertices, pack, lane) {
            let error = (dx.mul(&inverse) - f).norm_squared().sqrt();
            assert!(error < 4e-14, "element {element}: F off by {error:e}");
        }
    }
    for state in term.element_states(&x) {
        assert!((state.j() - f.determinant()).abs() < 1e-13);
    }
    // The energy is the energy density times the volume between the curved sides.
    let volume: f64 = elements.iter().map(|e| crate::element::volume(&points_of::<D, N>(&rest, e))).sum();
    let density = Material::<D>::psi(&material(), &f);
    let error = (term.energy(&x) / (volume * density) - 1.0).abs();
    // det J has degree D: in 3D the rule, exact to degree 2, is off by its cubic part.
    assert!(error < if D == 2 { 1e-13 } else { 1e-3 }, "{D}D: energy off by {error:e}");
    let extremes = term.deformation(&x).unwrap();
    assert!((extremes.min_j - f.determinant()).abs() < 1e-13 && extremes.inverted == 0);
}

#[test]
fn affine_motions_strain_curved_elements_uniformly() {
    affine_motion::<2, 6>([5, 3]);
    affine_motion::<3, 10>([3, 2, 2]);
}

/// A mid-edge node is drawn through its element: `det F < 0` at quadrature points, but not at the
/// corners.
#[test]
fn an_element_that_is_inverted_at_one_quadrature_point_is_counted_and_named() {
    let (rest, elements) = curved::<2, 6>([5, 3]);
    let mut term = Elastic::<2, 6>::quadratic("block", material(), Stress::Analytic, &elements, &rest);
    assert_eq!(term.fault(&rest), None);
    let mut x = rest.clone();
    // The last mid-edge node of the last element is on the boundary: it belongs to that element alone.
    let own = |v: &u32| elements.iter().filter(|e| e.contains(v)).count() == 1;
    let (element, vertex) = (elements.iter().enumerate())
        .find_map(|(i, e)| e[3..].iter().find(|v| own(v)).map(|v| (i, *v as usize)))
        .unwrap();
    let centre: [f64; 2] = std::array::from_fn(|c| {
        elements[element][..3].iter().map(|v| rest[2 * *v as usize + c]).sum::<f64>() / 3.0
    });
    for c in 0..2 {
        x[2 * vertex + c] += 2.5 * (centre[c] - x[2 * vertex + c]);
    }
    let extremes = term.deformation(&x).unwrap();
    assert!(extremes.min_j < 0.0 && extremes.inverted == 1, "{extremes:?}");
    assert!(!term.evaluate(&x) || term.energy(&x).is_infinite());
    match term.fault(&x) {
        Some(Fault::Element { element: found, j, .. }) => assert!(found == element && j < 0.0),
        other => panic!("{other:?}"),
    }
}

// Rows that a step reads in place equal those that it would otherwise add.
#[test]
fn rows_as_they_lie_are_the_sums_of_their_block() {
    for (cells, all) in [([5, 3], true), ([60, 40], false)] {
        let (rest, elements) = curved::<2, 6>(cells);
        let mut term = Elastic::<2, 6>::quadratic("block", material(), Stress::Analytic, &elements, &rest);
        assert!(term.evaluate(&deformed::<2>(&rest)));
        let (vertices, mut found, mut missed) = (rest.len() / 2, 0, 0);
        for first in (0..vertices).step_by(128) {
            let count = (vertices - first).min(128);
            let mut sums = vec![0.0; 2 * count];
            term.add_rows(first, &mut sums);
            assert!(sums.iter().any(|sum| *sum != 0.0));
            match term.rows(first, count) {
                Some(rows) => {
                    assert_eq!(rows, sums, "from vertex {first} of {vertices} on");
                    found += 1;
                }
                None => missed += 1,
            }
        }
        assert_eq!((found > 0, missed == 0), (all, all), "{found} blocks of one patch, {missed} others");
    }
    let (rest, elements) = curved::<3, 10>([1, 1, 1]);
    let mut term = Elastic::<3, 10>::quadratic("block", material(), Stress::Analytic, &elements, &rest);
    assert!(term.evaluate(&deformed::<3>(&rest)));
    assert!(term.rows(0, rest.len() / 3).is_none(), "in space rows have four numbers");
}

/// Returns the least `det(dx/dxi)` of linear elements.
fn least_volume<const D: usize, const N: usize>(elements: &[[u32; N]], x: &[f64]) -> f64 {
    let volume = |element: &[u32; N]| simplex_rest(&points_of::<D, N>(x, element)).1;
    elements.iter().map(volume).fold(f64::INFINITY, f64::min)
}

/// A truncated step ends at nine tenths of the displacement to the first element without volume; a step
/// that is not truncated passes none. Motions of a hundredth of a cell to several, of all vertices and of
/// one.
fn collapse<const D: usize, const N: usize>(cells: [usize; D]) {
    let grid =
        pliant_mesh::spec::GridSpec { cells: cells.to_vec(), spacing: Some(0.1), ..Default::default() };
    let spec = pliant_mesh::spec::MeshSpec::Grid(grid);
    let mesh = pliant_mesh::build(&spec, D, ".".as_ref()).unwrap();
    let (elements, rest) = (mesh.elements::<N>(), &mesh.points);
    let term = Elastic::<D, N>::linear("block", material(), Stress::Analytic, &elements, rest);
    let (mut random, mut cut) = (Random(8), 0);
    for round in 0..60 {
        let size = 0.1 * 0.01 * 1.12_f64.powi(round);
        let mut dx: Vec<f64> = rest.iter().map(|_| size * random.uniform(-1.0, 1.0)).collect();
        if round % 3 == 0 {
            let only = round as usize * 7 % (rest.len() / D);
            (0..dx.len()).filter(|i| i / D != only).for_each(|i| dx[i] = 0.0);
        }
        let at = |part: f64| rest.iter().zip(&dx).map(|(x, dx)| x + part * dx).collect::<Vec<_>>();
        let step = StepLimit::max_step(&term, rest, &dx);
        let end = if step < 1.0 { step / collapse::MARGIN * (1.0 - 1e-9) } else { 1.0 };
        for sample in 0..=200 {
            let part = end * f64::from(sample) / 200.0;
            assert!(least_volume::<D, N>(&elements, &at(part)) > 0.0, "{round}: {part} of {step}");
        }
        if step < 1.0 {
            cut += 1;
            let beyond = least_volume::<D, N>(&elements, &at(step / collapse::MARGIN * (1.0 + 1e-6)));
            assert!(beyond <= 0.0, "{round}: {step} left {beyond:e}");
        }
    }
    assert!((15..45).contains(&cut), "{cut} of 60 were cut");
}

#[test]
fn steps_end_before_the_first_element_without_volume() {
    collapse::<2, 3>([5, 3]);
    collapse::<3, 4>([3, 2, 2]);
}

/// Fibres along material axes, which elements rotate, equal the same fibres given in space: energies,
/// forces, products and states.
fn turned_axes_turn_fibres<const D: usize, const N: usize>(cells: [usize; D]) {
    let (rest, elements) = curved::<D, N>(cells);
    let axes = match D {
        2 => material_axes(&[-0.6, 0.7, 0.0], None),
        _ => material_axes(&[-0.6, 0.7, 0.4], Some(&[0.2, 0.5, 1.0])),
    };
    let families = [[0.8, 0.6, 0.0], [0.8, -0.6, 0.0]];
    let of = |families: [[f64; 3]; 2]| {
        let fibres = families.map(|fibre| fibre.to_vec()).to_vec();
        let material = HolzapfelGasserOgden::new(&DispersedFibres { fibres, ..DispersedFibres::example() });
        Elastic::<D, N>::quadratic("body", material, Stress::Analytic, &elements, &rest)
    };
    let mut turned = of(families).with_axes(&vec![axes; elements.len()]);
    let mut plain = of(families.map(|fibre| axes.mul_vec(&fibre)));
    let (x, p) = (deformed::<D>(&rest), rest.iter().map(|x| (50.0 * x).sin()).collect::<Vec<_>>());
    let rows = |term: &mut Elastic<D, N>| {
        let (mut gradient, mut product) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        term.add_gradient(&x, &mut gradient);
        term.add_hessian_product(&x, &p, &mut product);
        let mut states = vec![];
        term.each_state(&x, &mut |_, state: ElementState| {
            states.extend(state.deformation_gradient.0.as_flattened().iter().copied());
            states.extend(state.first_piola.0.as_flattened().iter().map(|p| 1e-6 * p));
        });
        let within = term.state_at(&x, 1, &[0.5, 0.2, 0.2, 0.1]).unwrap();
        states.extend(within.first_piola.0.as_flattened().iter().map(|p| 1e-6 * p));
        [vec![term.energy(&x)], gradient, product, states]
    };
    for (found, expected) in rows(&mut turned).iter().zip(rows(&mut plain)) {
        let largest = expected.iter().fold(0.0, |largest: f64, e| largest.max(e.abs()));
        let off = found.iter().zip(&expected).fold(0.0, |off: f64, (a, b)| off.max((a - b).abs()));
        assert!(largest > 0.0 && off < 1e-12 * largest, "{off:e} of {largest:e}");
    }
}

#[test]
fn fibres_turn_with_the_axes_of_the_material() {
    turned_axes_turn_fibres::<2, 6>([3, 2]);
    turned_axes_turn_fibres::<3, 10>([2, 1, 1]);
}

/// The fused kernel is bit-identical to kinematics and law, one after the other.
fn fused<const D: usize, const N: usize>(cells: [usize; D]) {
    let grid =
        pliant_mesh::spec::GridSpec { cells: cells.to_vec(), spacing: Some(0.1), ..Default::default() };
    let mesh = pliant_mesh::build(&pliant_mesh::spec::MeshSpec::Grid(grid), D, ".".as_ref()).unwrap();
    let mut term =
        Elastic::<D, N>::linear("block", material(), Stress::Analytic, &mesh.elements::<N>(), &mesh.points);
    let x = deformed::<D>(&mesh.points);
    let mut forces = [(); 2].map(|()| vec![0.0; x.len()]);
    for forces in &mut forces {
        assert!(term.evaluate(&x));
        term.add_rows(0, forces);
        term.fused = None;
    }
    assert!(forces[0].iter().any(|force| force.abs() > 1.0));
    assert_eq!(forces[0], forces[1]);
}

#[test]
fn fused_forces_are_those_of_kinematics_and_law() {
    fused::<2, 3>([7, 5]);
    fused::<3, 4>([4, 3, 3]);
}
