//! Membranes against differences of their energy, against plane bodies, and in plane stress.

use super::*;
use crate::algebra::tests::sample::Random;
use crate::energy::elastic::Elastic;
use crate::material::tests::EnergyAlone;
use crate::material::{
    Isotropic, Linear, MaterialSpec, MaterialVisitor, Model, NeoHookean, Plane, PlaneIsotropic,
};

const THICKNESS: f64 = 0.02;

/// Returns reference positions in the plane and triangles of a grid of cells of different sizes.
fn plate() -> (Vec<[f64; 2]>, Vec<[u32; 3]>) {
    let (columns, rows) = (5u32, 4u32);
    let points = (0..=columns).flat_map(|i| (0..=rows).map(move |j| (f64::from(i), f64::from(j))));
    let points =
        points.map(|(i, j)| [0.1 * i + 0.02 * (i * j).sin(), 0.12 * j + 0.015 * (2.0 * i + j).cos()]);
    let vertex = |i: u32, j: u32| i * (rows + 1) + j;
    let cells = (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j)));
    let triangles = cells.flat_map(|(i, j)| {
        let corners = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
        [[corners[0], corners[1], corners[2]], [corners[2], corners[3], corners[0]]]
    });
    (points.collect(), triangles.collect())
}

/// Returns the plate rotated and moved into space; flat.
fn placed(points: &[[f64; 2]], turn: &Mat<f64, 3>) -> Vec<f64> {
    points.iter().flat_map(|&[x, y]| turn.mul_vec(&[x, y, 0.3])).collect()
}

fn turn() -> Mat<f64, 3> {
    Random(5).rotation::<3>()
}

/// Calls `check` with a membrane of every suitable material, in plane stress and plane strain.
fn with_every_material(elements: &[[u32; 3]], rest: &[f64], check: impl Fn(&str, &mut Membrane)) {
    struct Maker<'a>(Sheet, &'a [[u32; 3]], &'a [f64]);
    impl MaterialVisitor<2> for Maker<'_> {
        type Output = Membrane;
        fn visit<M: Material<2> + Material<3> + Clone>(self, material: M) -> Membrane {
            Membrane::new("sheet", material, self.0, self.1, self.2)
        }
    }
    let mut count = 0;
    // A sheet has no direction to compare material directions with.
    let taken = |spec: &&MaterialSpec| spec.about().frame_indifferent && spec.is_isotropic();
    for spec in MaterialSpec::examples().iter().filter(taken) {
        // A material without a rest shape has no thickness.
        let thick = [Plane::Stress, Plane::Strain]
            .into_iter()
            .filter(|plane| *plane == Plane::Strain || spec.about().has_rest_shape);
        for plane in thick {
            for stress in [Stress::Analytic, Stress::Autodiff] {
                let sheet = Sheet { thickness: THICKNESS, plane, lame: spec.lame(), stress };
                let name = format!("{}, plane {plane:?}, {stress:?}", spec.name());
                check(&name, &mut spec.visit::<2, _>(Maker(sheet, elements, rest)));
                count += 1;
            }
        }
    }
    assert!(count >= 4 * 12 + 2, "{count}");
}

/// Returns the blocks of the Hessians of all triangles at `x`.
fn blocks(mut term: Membrane, x: &[f64], psd: Psd) -> Vec<f64> {
    let count = term.stencils().vertices.len() / 3;
    let mut out = vec![0.0; count * 6 * 9];
    term.stencil_hessians(0..count, x, psd, &mut out);
    out
}

/// Membranes of energies alone have the Hessians of those with closed-form eigensystems, also in
/// compression, where some eigenvalues are negative.
#[test]
fn hessians_of_an_energy_alone_are_those_in_closed_form() {
    let (points, elements) = plate();
    let rest = placed(&points, &turn());
    let parameters = Isotropic::new(1e6, 0.4);
    for plane in [Plane::Stress, Plane::Strain] {
        let sheet =
            Sheet { thickness: THICKNESS, plane, lame: Some(parameters.lame()), stress: Stress::Analytic };
        for squeezed in [1.0, 0.6] {
            let x: Vec<f64> = bent(&points).iter().map(|x| squeezed * x).collect();
            for psd in [Psd::Exact, Psd::Projected] {
                let material = NeoHookean::new(&parameters);
                let alone = EnergyAlone(material);
                let closed = blocks(Membrane::new("sheet", material, sheet, &elements, &rest), &x, psd);
                let found = blocks(Membrane::new("sheet", alone, sheet, &elements, &rest), &x, psd);
                let largest = closed.iter().fold(0.0, |m: f64, k| m.max(k.abs()));
                let error = closed.iter().zip(&found).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
                assert!(error < 1e-9 * largest, "{plane:?}, {psd:?}: {error:e} of {largest:e} N/m");
            }
        }
    }
}

fn neo_hookean(plane: Plane, elements: &[[u32; 3]], rest: &[f64]) -> Membrane {
    let parameters = Isotropic::new(1e6, 0.4);
    let sheet =
        Sheet { thickness: THICKNESS, plane, lame: Some(parameters.lame()), stress: Stress::Analytic };
    Membrane::new("sheet", NeoHookean::new(&parameters), sheet, elements, rest)
}

fn gradient(term: &mut dyn EnergyTerm, x: &[f64]) -> Vec<f64> {
    let mut g = vec![0.0; x.len()];
    assert!(term.evaluate(x), "{:?}", term.fault(x));
    term.add_rows(0, &mut g);
    g
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Returns a curved and strained shape.
fn bent(points: &[[f64; 2]]) -> Vec<f64> {
    let at = |&[x, y]: &[f64; 2]| {
        [1.15 * x + 0.1 * y, 0.95 * y - 0.2 * x * y, 0.4 * x * x - 0.3 * x * y + 0.2 * (5.0 * y).sin()]
    };
    points.iter().flat_map(at).collect()
}

#[test]
fn forces_and_hessian_products_are_derivatives_for_every_material() {
    let (points, elements) = plate();
    let rest = placed(&points, &turn());
    let x = bent(&points);
    let mut random = Random(3);
    let mut direction = || x.iter().map(|_| random.uniform(-1.0, 1.0)).collect::<Vec<f64>>();
    let (p, q) = (direction(), direction());
    let moved = |h: f64| -> Vec<f64> { x.iter().zip(&p).map(|(x, p)| x + h * p).collect() };
    // Fourth-order differences; edges are 0.1 long, so that lengths change by a thousandth.
    let h = 1e-4;
    with_every_material(&elements, &rest, |name, term| {
        let g = gradient(term, &x);
        let scale = dot(&g, &g).sqrt();
        let slope = {
            let mut e = |s: f64| term.energy(&moved(s));
            (8.0 * (e(h) - e(-h)) - (e(2.0 * h) - e(-2.0 * h))) / (12.0 * h)
        };
        assert!((slope - dot(&g, &p)).abs() < 1e-8 * scale, "{name}: {slope} and {}", dot(&g, &p));
        let (mut kp, mut kq) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        term.add_hessian_product(&x, &p, &mut kp);
        term.add_hessian_product(&x, &q, &mut kq);
        let size = dot(&kp, &kp).sqrt();
        assert!((dot(&kp, &q) - dot(&kq, &p)).abs() < 1e-12 * size, "{name}: the Hessian is symmetric");
        let at = [h, -h, 2.0 * h, -2.0 * h].map(|s| gradient(term, &moved(s)));
        for i in 0..x.len() {
            let slope = (8.0 * (at[0][i] - at[1][i]) - (at[2][i] - at[3][i])) / (12.0 * h);
            assert!((slope - kp[i]).abs() < 1e-7 * size, "{name}: row {i}: {slope} and {}", kp[i]);
        }
        // Translations and rotations do no work.
        for c in 0..3 {
            let (a, b) = ((c + 1) % 3, (c + 2) % 3);
            let force: f64 = g.chunks(3).map(|g| g[c]).sum();
            let moment: f64 = g.chunks(3).zip(x.chunks(3)).map(|(g, x)| x[a] * g[b] - x[b] * g[a]).sum();
            assert!(force.abs() + moment.abs() < 1e-12 * scale, "{name}: {force:e} {moment:e}");
        }
    });
}

#[test]
fn a_sheet_at_rest_anywhere_has_no_force() {
    let (points, elements) = plate();
    let rest = placed(&points, &turn());
    let elsewhere = placed(&points, &Random(8).rotation::<3>());
    with_every_material(&elements, &rest, |name, term| {
        if name.starts_with("dirichlet") {
            return;
        }
        // Moduli of 1e6 Pa or so on edges of 0.1 m times 0.02 m, in units of rounding.
        let scale = 1e6 * 0.1 * THICKNESS;
        for x in [&rest, &elsewhere] {
            let g = gradient(term, x);
            let largest = g.iter().fold(0.0, |m: f64, g| m.max(g.abs()));
            assert!(largest < 1e-12 * scale, "{name}: {largest:e} N of {scale} N");
        }
    });
}

// The same sheet in its plane is a body in 2D of the same thickness.
#[test]
fn in_its_plane_a_membrane_is_a_body_in_two_dimensions() {
    let (points, elements) = plate();
    let turn = turn();
    let rest = placed(&points, &turn);
    let parameters = Isotropic::new(1e6, 0.4);
    let mut sheet = neo_hookean(Plane::Strain, &elements, &rest);
    let flat_rest: Vec<f64> = points.iter().flatten().copied().collect();
    let mut body = Elastic::<2, 3>::linear(
        "body",
        NeoHookean::new(&parameters),
        Stress::Analytic,
        &elements,
        &flat_rest,
    );
    let stretched: Vec<[f64; 2]> =
        points.iter().map(|&[x, y]| [1.3 * x + 0.2 * y + 0.3 * x * y, 0.8 * y - 0.1 * x]).collect();
    let flat: Vec<f64> = stretched.iter().flatten().copied().collect();
    let in_space = placed(&stretched, &turn);
    let (expected, found) = (THICKNESS * body.energy(&flat), sheet.energy(&in_space));
    assert!((found / expected - 1.0).abs() < 1e-13, "{found} instead of {expected}");
    let (expected, found) = (gradient(&mut body, &flat), gradient(&mut sheet, &in_space));
    let scale = found.iter().fold(0.0, |m: f64, g| m.max(g.abs()));
    for (expected, found) in expected.chunks(2).zip(found.chunks(3)) {
        let there = turn.mul_vec(&[THICKNESS * expected[0], THICKNESS * expected[1], 0.0]);
        for c in 0..3 {
            assert!((there[c] - found[c]).abs() < 1e-12 * scale, "{there:?} and {found:?}");
        }
    }
    // And so are the strains and stresses, in the axes of space.
    for (sheet, body) in sheet.element_states(&in_space).iter().zip(body.element_states(&flat)) {
        let turned = turn.mul(&body.deformation_gradient).mul_transpose(&turn);
        let difference = sheet.deformation_gradient - turned;
        assert!(difference.norm_squared().sqrt() < 1e-13, "{difference:?}");
        let turned = turn.mul(&body.first_piola).mul_transpose(&turn);
        let difference = (sheet.first_piola - turned).norm_squared().sqrt();
        assert!(difference < 1e-12 * turned.norm_squared().sqrt());
    }
}

// C1: an affine motion, into space, strains all triangles alike.
#[test]
fn an_affine_motion_has_one_strain_and_free_faces() {
    let (points, elements) = plate();
    let rest = placed(&points, &turn());
    let f = Mat([[1.2, 0.1, 0.0], [-0.1, 0.9, 0.2], [0.3, 0.2, 1.1]]);
    let x: Vec<f64> = rest.as_chunks::<3>().0.iter().flat_map(|row| f.mul_vec(row)).collect();
    with_every_material(&elements, &rest, |name, term| {
        let states = term.element_states(&x);
        let area = term.deformation(&x).unwrap().min_j;
        let first = states[0];
        for state in &states {
            let change = state.deformation_gradient - first.deformation_gradient;
            assert!(change.norm_squared().sqrt() < 1e-12, "{name}: {change:?}");
            let change = (state.first_piola - first.first_piola).norm_squared().sqrt();
            assert!(change < 1e-11 * first.first_piola.norm_squared().sqrt(), "{name}: {change:e}");
        }
        // Tangents of the sheet go where the motion takes them.
        let along = turn().mul_vec(&[0.6, 0.8, 0.0]);
        let (there, expected) = (first.deformation_gradient.mul_vec(&along), f.mul_vec(&along));
        assert!((0..3).all(|c| (there[c] - expected[c]).abs() < 1e-12), "{name}: {there:?}");
        let across = first.j() / area;
        let normal = first.deformation_gradient.mul_vec(&turn().mul_vec(&[0.0, 0.0, 1.0]));
        let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
        assert!((length - across).abs() < 1e-12, "{name}: {length} {across}");
        let cauchy = first.cauchy_stress();
        let traction = cauchy.mul_vec(&normal).map(|t| t / length);
        let pressed = traction.iter().map(|t| t * t).sum::<f64>().sqrt();
        let scale = cauchy.norm_squared().sqrt();
        if name.contains("Strain") {
            assert!((across - 1.0).abs() < 1e-14, "{name}");
        } else {
            assert!(pressed < 1e-12 * scale, "{name}: {pressed:e} Pa of {scale:e} Pa on its faces");
        }
    });
}

// A bar pulled one way, its sides free: P = E strain and -nu across, at small strains, in every material
// that has E and nu.
#[test]
fn plane_stress_reduces_to_that_of_linear_elasticity() {
    let (points, elements) = plate();
    let rest = placed(&points, &Mat::identity());
    let small = 1e-6;
    let at = |&[x, y]: &[f64; 2]| [x * (1.0 + small) + 0.3 * small * y, y * (1.0 - 0.6 * small)];
    let stretched: Vec<[f64; 2]> = points.iter().map(at).collect();
    let flat: Vec<f64> = stretched.iter().flatten().copied().collect();
    let flat_rest: Vec<f64> = points.iter().flatten().copied().collect();
    let checked = std::cell::Cell::new(0);
    with_every_material(&elements, &rest, |name, term| {
        let example = MaterialSpec::examples();
        let spec = example.iter().find(|spec| name.starts_with(&format!("{},", spec.name()))).unwrap();
        let Some(Lame { lambda, mu }) = spec.lame() else { return };
        checked.set(checked.get() + 1);
        let poisson = 0.5 * lambda / (lambda + mu);
        let isotropic = Isotropic::new(2.0 * mu * (1.0 + poisson), poisson);
        let plane = if name.contains("plane Stress") { Plane::Stress } else { Plane::Strain };
        let linear = Linear::new(&PlaneIsotropic { solid: isotropic, plane: Some(plane) });
        let mut body = Elastic::<2, 3>::linear("body", linear, Stress::Analytic, &elements, &flat_rest);
        let (expected, found) =
            (gradient(&mut body, &flat), gradient(term, &placed(&stretched, &Mat::identity())));
        let scale = expected.iter().fold(0.0, |m: f64, g| m.max(g.abs()));
        for (expected, found) in expected.chunks(2).zip(found.chunks(3)) {
            for c in 0..2 {
                let error = (THICKNESS * expected[c] - found[c]).abs() / (THICKNESS * scale);
                assert!(error < 1e-4, "{name}: off by {error:e}");
            }
        }
    });
    assert!(checked.get() >= 4 * 11, "{checked:?}");
}

// Rubber at nu = 0.5 (nearly), twice as long one way: the classical P = mu (s - 1/s^2) of uniaxial tension
// needs both free sides.
#[test]
fn a_sheet_gets_thinner_as_it_is_stretched() {
    let rest = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let parameters = Isotropic::new(3e6, 0.499_99);
    let lame = parameters.lame();
    let sheet = Sheet { thickness: 1.0, plane: Plane::Stress, lame: Some(lame), stress: Stress::Analytic };
    let term = Membrane::new("sheet", NeoHookean::new(&parameters), sheet, &[[0, 1, 2]], &rest);
    for s in [0.5, 0.9, 1.0, 1.5, 3.0f64] {
        let x = [0.0, 0.0, 0.0, s, 0.0, 0.0, 0.0, 1.0 / s.sqrt(), 0.0];
        let state = term.element_states(&x)[0];
        let expected = lame.mu * (s - 1.0 / (s * s));
        let found = state.first_piola[0][0];
        // Compressible by one part in 10^4 or so of the strain.
        assert!((found - expected).abs() < 2e-4 * lame.mu * (s + 1.0 / (s * s)), "{s}: {found} {expected}");
        assert!(state.first_piola[1][1].abs() < 1e-3 * lame.mu, "{s}: {:?}", state.first_piola);
        assert!((state.deformation_gradient[2][2] - 1.0 / s.sqrt()).abs() < 1e-3, "{s}");
    }
}

#[test]
fn a_triangle_without_area_is_named() {
    let (points, elements) = plate();
    let rest = placed(&points, &turn());
    for plane in [Plane::Stress, Plane::Strain] {
        let mut term = neo_hookean(plane, &elements, &rest);
        assert_eq!(term.fault(&rest), None);
        let mut x = rest.clone();
        let [a, b, _] = elements[7].map(|v| 3 * v as usize);
        let first: Vec<f64> = x[a..a + 3].to_vec();
        x[b..b + 3].copy_from_slice(&first);
        assert!(!term.evaluate(&x));
        match term.fault(&x) {
            Some(Fault::Element { element, .. }) => {
                assert!(
                    elements[element].contains(&elements[7][0])
                        && elements[element].contains(&elements[7][1])
                );
            }
            other => panic!("{other:?}"),
        }
    }
}

/// In plane stress some materials get thinner to nothing at a stretch that is not large, and are named just
/// before; those that the message names as better bear twenty times their length.
#[test]
fn sheets_stretched_beyond_their_material_are_told_with_their_stretch() {
    let (points, elements) = plate();
    let turn = turn();
    let rest = placed(&points, &turn);
    let stretched = |s: f64| {
        let points: Vec<[f64; 2]> = points.iter().map(|&[x, y]| [s * x, y]).collect();
        placed(&points, &turn)
    };
    let named = std::cell::Cell::new(0);
    with_every_material(&elements, &rest, |name, term| {
        assert_eq!((term.fault(&rest), term.near_fault(&rest)), (None, None), "{name}");
        let frees_faces = name.contains("Stress");
        // Uniaxial strain `(s^2 - 1) / 2 = (1 - nu) / (2 nu)`, and `s - 1 = (1 - nu) / nu`.
        let ends = match name.split(',').next().unwrap() {
            "stvk" if frees_faces => true,
            "corotated" if frees_faces => true,
            "neo-hookean" | "stable-neo-hookean" => false,
            _ => return,
        };
        named.set(named.get() + 1);
        let at_end = term.fault(&stretched(20.0));
        if !ends {
            assert_eq!((at_end, term.near_fault(&stretched(20.0))), (None, None), "{name}");
            return;
        }
        let stretch = |fault: Option<Fault>| match fault {
            Some(Fault::Sheet { stretch, .. }) => stretch,
            other => panic!("{name}: {other:?}"),
        };
        let largest = stretch(at_end);
        assert!((largest - 20.0).abs() < 1e-9, "{name}: {largest}");
        // From where it is no more than near its end, to where it is beyond.
        let nearest =
            (100..2000).map(|i| 0.01 * f64::from(i)).find(|s| term.near_fault(&stretched(*s)).is_some());
        let x = stretched(nearest.unwrap());
        assert!(term.fault(&x).is_none() && term.evaluate(&x), "{name} at {nearest:?}");
        stretch(term.near_fault(&x));
    });
    // Two ways to stresses, in plane strain too where a sheet bears both.
    assert_eq!(named.get(), 2 * 2 + 2 * 4);
}
