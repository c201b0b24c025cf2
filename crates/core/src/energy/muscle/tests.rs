//! Muscles against closed forms and differences.

use super::*;
use crate::element::{HEXAHEDRON, Isoparametric, QUADRILATERAL};
use crate::energy::elastic::points_of;
use pliant_mesh::Mesh;
use pliant_mesh::spec::{GridSpec, MeshSpec, WholeCell};

/// A number in (-1, 1) that looks random.
fn scattered(i: usize) -> f64 {
    2.0 * ((i as f64 + 1.0) * 0.754_877_666_246_692_7).fract() - 1.0
}

/// A unit vector that differs from place to place.
fn turned<const D: usize>(place: [f64; 3]) -> [f64; D] {
    let mut direction = [0.6, 0.8 * place[0].cos(), 0.8 * place[0].sin()];
    if D == 2 {
        direction = [place[1].cos(), place[1].sin(), 0.0];
    }
    let mut own = [0.0; D];
    own.copy_from_slice(&direction[..D]);
    own
}

/// Tension that differs from place to place and changes with time.
fn wave() -> TensionField {
    let field = |x: [f64; 3], t: f64| (3.0 + x[0]) * (1.0 + 0.5 * x[1]) * (1.0 + t);
    TensionField { field: Box::new(field), changes: true, varies: true, until: 2.0 }
}

fn steady(tension: f64) -> TensionField {
    TensionField { field: Box::new(move |_, _| tension), changes: false, varies: false, until: 1.0 }
}

/// A muscle and its rest positions.
struct Case {
    term: Box<dyn EnergyTerm>,
    rest: Vec<f64>,
    dimension: usize,
}

fn grid(dimension: usize, element: Option<WholeCell>) -> Mesh {
    let cells = [3, 2, 2][..dimension].to_vec();
    let grid = GridSpec { cells, spacing: Some(0.5), element, ..GridSpec::default() };
    pliant_mesh::build(&MeshSpec::Grid(grid), dimension, ".".as_ref()).unwrap()
}

fn simplices<const D: usize, const N: usize>(quadratic: bool, tension: TensionField) -> Case {
    let mut mesh = grid(D, None);
    if quadratic {
        mesh = mesh.promoted_to_quadratic().unwrap();
    }
    let (cells, rest) = (mesh.elements::<N>(), mesh.points);
    let fibres = |element: usize| simplex_fibres::<D, N>(&points_of(&rest, &cells[element]), turned);
    let term = ActiveTension::<D, N>::new("muscle 0".into(), &cells, &rest, fibres, tension);
    Case { term: Box::new(term), rest, dimension: D }
}

fn cells<const D: usize, const N: usize>(
    cell: &Isoparametric<D, N>,
    element: WholeCell,
    tension: TensionField,
) -> Case {
    let mesh = grid(D, Some(element));
    let (cells, rest) = (mesh.block().unwrap().of::<N>(), &mesh.points);
    let fibres = |element: usize| cell_fibres(cell, &points_of(rest, &cells[element]), turned);
    let term = ActiveTension::<D, N>::new("muscle 0".into(), cells, rest, fibres, tension);
    Case { term: Box::new(term), rest: rest.clone(), dimension: D }
}

fn all(tension: impl Fn() -> TensionField) -> Vec<Case> {
    vec![
        simplices::<2, 3>(false, tension()),
        simplices::<2, 6>(true, tension()),
        simplices::<3, 4>(false, tension()),
        simplices::<3, 10>(true, tension()),
        cells(&QUADRILATERAL, WholeCell::Quadrilateral, tension()),
        cells(&HEXAHEDRON, WholeCell::Hexahedron, tension()),
    ]
}

impl Case {
    fn moved(&self) -> Vec<f64> {
        self.rest.iter().enumerate().map(|(i, x)| 1.1 * x + 0.1 * scattered(i)).collect()
    }

    fn direction(&self) -> Vec<f64> {
        (0..self.rest.len()).map(|i| scattered(i + 77)).collect()
    }

    fn gradient(&mut self, x: &[f64]) -> Vec<f64> {
        let mut g = vec![0.0; x.len()];
        assert!(self.term.evaluate(x));
        self.term.add_rows(0, &mut g);
        g
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn along(x: &[f64], p: &[f64], t: f64) -> Vec<f64> {
    x.iter().zip(p).map(|(x, p)| x + t * p).collect()
}

fn assert_near(found: f64, expected: f64, tolerance: f64, of: &str) {
    assert!((found - expected).abs() <= tolerance * expected.abs().max(1.0), "{of}: {found} and {expected}");
}

#[test]
fn force_and_power_are_those_of_the_energy_in_every_kind_of_element() {
    for mut case in all(wave) {
        case.term.driven().unwrap().set_time(0.7);
        let (x, p, n) = (case.moved(), case.direction(), case.rest.len());
        // Quadratic in the positions: central differences are exact but for rounding.
        let [less, more] = [-0.5, 0.5].map(|t| case.term.energy(&along(&x, &p, t)));
        let g = case.gradient(&x);
        assert_near(dot(&g, &p), more - less, 1e-12, &format!("{n} numbers"));
        assert_near(case.term.driven().unwrap().power(&x, &p), less - more, 1e-12, "power");
        let mut product = vec![0.0; n];
        case.term.add_hessian_product(&x, &p, &mut product);
        let curvature = more + less - 2.0 * case.term.energy(&x);
        assert_near(0.25 * dot(&product, &p), curvature, 1e-11, "curvature");
        assert!(curvature > 1.0);
    }
}

#[test]
fn hessians_of_elements_are_those_of_products_and_projected_without_what_pushes() {
    for pushes in [false, true] {
        let sign = if pushes { -1.0 } else { 1.0 };
        for mut case in all(|| steady(2.0 * sign)) {
            let (d, p) = (case.dimension, case.direction());
            let stencils = case.term.stencils();
            let (size, pairs) = (stencils.size, stencils.size * (stencils.size + 1) / 2);
            let count = stencils.vertices.len() / size;
            for psd in [Psd::Exact, Psd::Projected] {
                let mut blocks = vec![f64::NAN; count * pairs * d * d];
                case.term.stencil_hessians(0..count, &case.rest, psd, &mut blocks);
                let mut product = vec![0.0; p.len()];
                let mut blocks = blocks.chunks_exact(d * d);
                for vertices in stencils.vertices.chunks_exact(size) {
                    for a in 0..size {
                        for b in a..size {
                            let block = blocks.next().unwrap();
                            let (i, j) = (vertices[a] as usize * d, vertices[b] as usize * d);
                            for (r, c) in (0..d).flat_map(|r| (0..d).map(move |c| (r, c))) {
                                product[i + r] += block[r * d + c] * p[j + c];
                                if a != b {
                                    product[j + c] += block[r * d + c] * p[i + r];
                                }
                            }
                        }
                    }
                }
                let mut expected = vec![0.0; p.len()];
                if psd == Psd::Exact || !pushes {
                    case.term.add_hessian_product(&case.rest, &p, &mut expected);
                }
                let off = product.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(off < 1e-13, "{off}, {size} nodes, {psd:?}");
            }
        }
    }
}

/// In the deformation `F` everywhere the energy is `T V/2 (|F a|^2 - 1)`, wherever the body is.
#[test]
fn a_uniform_stretch_has_the_energy_of_its_fibres() {
    let fibre = [0.6, 0.8];
    let mesh = grid(2, None);
    let (cells, rest) = (mesh.elements::<3>(), &mesh.points);
    let fibres = |element: usize| simplex_fibres::<2, 3>(&points_of(rest, &cells[element]), |_| fibre);
    let mut term = ActiveTension::<2, 3>::new("muscle 0".into(), &cells, rest, fibres, steady(5.0));
    let f = [[1.3, 0.2], [-0.4, 0.9]];
    let moved = |x: &[f64]| f.map(|row| row[0] * x[0] + row[1] * x[1] + 1e3);
    let x: Vec<f64> = rest.chunks_exact(2).flat_map(moved).collect();
    let image = f.map(|row| row[0] * fibre[0] + row[1] * fibre[1]);
    let volume = 1.5 * 1.0;
    let expected = 5.0 * volume / 2.0 * (image[0] * image[0] + image[1] * image[1] - 1.0);
    // Positions of 1e3 are rounded to 1e-13.
    assert_near(term.energy(&x), expected, 1e-11, "energy");
    assert_near(term.energy(rest), 0.0, 1e-14, "at rest");
}

/// The largest eigenvalue of `M^-1 K` at the end of a run is at most what was said at its beginning.
#[test]
fn what_a_muscle_may_add_bounds_what_it_adds() {
    for mut case in all(wave) {
        let (n, d) = (case.rest.len(), case.dimension);
        let inverse_mass: Vec<f64> = (0..n / d).flat_map(|i| vec![1.5 + scattered(i); d]).collect();
        let driven = case.term.driven().unwrap();
        driven.set_time(0.5);
        let [now, zero] = [0.5, -1.0].map(|time| {
            driven.set_time(time);
            driven.stiffening(&inverse_mass)
        });
        assert!(now > 0.0 && now < zero);
        // By the power method at the end of the run, from where there is no tension.
        driven.set_time(2.0);
        let mut p = case.direction();
        let mut largest = 0.0;
        for _ in 0..200 {
            let mut product = vec![0.0; n];
            case.term.add_hessian_product(&case.rest, &p, &mut product);
            product.iter_mut().zip(&inverse_mass).for_each(|(y, w)| *y *= w);
            largest = dot(&product, &product).sqrt() / dot(&p, &p).sqrt();
            p = along(&vec![0.0; n], &product, 1.0 / largest);
        }
        assert!(largest > 0.05 * zero && largest <= zero, "{largest} of {zero}");
    }
}

#[test]
fn a_tension_that_is_no_number_is_told_with_its_time() {
    let field = |_: [f64; 3], t: f64| 1.0 / (t - 1.0);
    let tension = TensionField { field: Box::new(field), changes: true, varies: false, until: 2.0 };
    let mut case = simplices::<2, 3>(false, tension);
    let x = case.moved();
    assert!(case.term.evaluate(&x));
    case.term.driven().unwrap().set_time(1.0);
    assert!(!case.term.evaluate(&x));
    let fault = case.term.fault(&x).map(|fault| fault.to_string());
    let expected = "the tension of muscle 0 is not finite at t = 1 s";
    assert_eq!(fault.as_deref(), Some(expected));
}
