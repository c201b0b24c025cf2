//! Conformance tests: each registered method behaves as its documentation says.

use std::ops::Range;

use super::splitting::Stage;
use super::{IntegratorSpec, Method, Scheme, amplification};
use crate::energy::{EnergyKind, EnergyTerm, Fault, Stencils, TermProperties, TermViews};
use crate::material::Psd;
use crate::solver::SolverOptions;
use crate::state::State;
use crate::system::System;

/// All methods except statics.
fn methods() -> impl Iterator<Item = Method> {
    IntegratorSpec::ALL.iter().map(|spec| spec.method()).filter(|method| method.documentation.order > 0)
}

#[test]
fn names_in_scenes_are_the_documented_names() {
    for spec in IntegratorSpec::ALL {
        let value = serde_json::to_value(spec).unwrap();
        // A bare word, or a table with the name as its only key.
        let name = value.as_object().map_or(value.as_str(), |table| table.keys().next().map(|k| &k[..]));
        assert_eq!(name, Some(spec.method().documentation.name));
    }
}

/// verification.md A1b; lecture 7.
#[test]
fn the_stability_limit_is_where_the_spectral_radius_leaves_one() {
    for method in methods() {
        let limit = method.documentation.stability_limit;
        let radius = |z: f64| amplification(&method, z, 0.0, 0.0).spectral_radius();
        if limit == 0.0 {
            // The growth of order 15 is rounding at small steps.
            let z = if method.documentation.order < 10 { 1e-2 } else { 4.0 };
            assert!(radius(z) > 1.0 + 1e-12, "{} should grow at any step", method.documentation.name);
            continue;
        }
        if limit == f64::INFINITY {
            for z in [0.01, 0.1, 1.0, 3.0, 10.0, 1e3, 1e6] {
                assert!(radius(z) <= 1.0 + 1e-13, "{} at z = {z}", method.documentation.name);
            }
            continue;
        }
        for z in [0.1 * limit, 0.5 * limit, 0.9 * limit, (1.0 - 1e-9) * limit] {
            assert!(radius(z) <= 1.0 + 1e-14, "{} at z = {z}", method.documentation.name);
        }
        assert!(radius((1.0 + 1e-9) * limit) > 1.0 + 1e-13, "{}", method.documentation.name);
    }
}

/// Consistency: the parts of a step add up to the step.
#[test]
fn coefficients_sum_to_one() {
    for method in methods() {
        let name = method.documentation.name;
        match method.scheme {
            Scheme::Splitting(stages) => {
                let part = |drift: bool| {
                    let parts = stages.iter().map(|stage| match stage {
                        Stage::Drift(c) if drift => *c,
                        Stage::Kick(c) if !drift => *c,
                        _ => 0.0,
                    });
                    parts.sum::<f64>()
                };
                assert!((part(true) - 1.0).abs() < 1e-15 && (part(false) - 1.0).abs() < 1e-15, "{name}");
            }
            Scheme::RungeKutta(tableau) => {
                assert_eq!(tableau.a.len(), tableau.b.len(), "{name}");
                assert!((tableau.b.iter().sum::<f64>() - 1.0).abs() < 1e-15, "{name}");
                for (stage, row) in tableau.a.iter().enumerate() {
                    assert_eq!(row.len(), stage, "{name} is explicit");
                }
            }
            Scheme::Dirk(tableau) | Scheme::Linearised(tableau) => {
                assert_eq!(tableau.a.len(), tableau.b.len(), "{name}");
                assert!((tableau.b.iter().sum::<f64>() - 1.0).abs() < 1e-15, "{name}");
                for (stage, row) in tableau.a.iter().enumerate() {
                    assert_eq!(row.len(), stage + 1, "{name} is diagonally implicit");
                    assert!(row[stage] >= 0.0, "{name}");
                }
            }
            Scheme::Alpha(c) => {
                // The equation of motion is taken at the time that accelerations and forces average to, eq.
                // 15.
                let second_order = (c.gamma - (0.5 - c.alpha_m + c.alpha_f)).abs() < 1e-15;
                assert_eq!(second_order, method.documentation.order == 2, "{name}");
            }
            Scheme::Collocation(tableau) => {
                assert!((tableau.b.iter().sum::<f64>() - 1.0).abs() < 1e-15, "{name}");
                assert!(tableau.a.iter().all(|row| row.len() == tableau.b.len()), "{name}");
            }
            // The nodes are tested in `gauss_radau`.
            Scheme::Bdf2(_) | Scheme::GaussRadau(_) | Scheme::QuasiStatic => {}
        }
    }
}

/// A companion satisfies the order conditions up to its documented order, and no further ones.
/// Uses trees up to four vertices; Hairer, Norsett, Wanner 1993, *Solving Ordinary Differential Equations
/// I*, table II.2.2.
#[test]
fn companions_have_exactly_their_order() {
    let mut count = 0;
    for method in methods() {
        let name = method.documentation.name;
        let (a, b, companion) = match method.scheme {
            Scheme::RungeKutta(tableau) => (tableau.a, tableau.b, tableau.companion),
            Scheme::Dirk(tableau) => (tableau.a, tableau.b, tableau.companion),
            _ => continue,
        };
        let Some(companion) = companion else { continue };
        count += 1;
        let weights: Vec<f64> = b.iter().zip(companion.difference).map(|(b, d)| b - d).collect();
        assert_eq!(weights.len(), companion.difference.len(), "{name}");
        let times = |y: &[f64]| -> Vec<f64> {
            a.iter().map(|row| row.iter().zip(y).map(|(a, y)| a * y).sum()).collect()
        };
        let c = times(&vec![1.0; b.len()]);
        let product = |x: &[f64], y: &[f64]| -> Vec<f64> { x.iter().zip(y).map(|(x, y)| x * y).collect() };
        let (c2, ac) = (product(&c, &c), times(&c));
        let (c3, c_ac, ac2, aac) = (product(&c2, &c), product(&c, &ac), times(&c2), times(&ac));
        let ones = vec![1.0; b.len()];
        let trees: [(u32, &[f64], f64); 8] = [
            (1, &ones, 1.0),
            (2, &c, 1.0 / 2.0),
            (3, &c2, 1.0 / 3.0),
            (3, &ac, 1.0 / 6.0),
            (4, &c3, 1.0 / 4.0),
            (4, &c_ac, 1.0 / 8.0),
            (4, &ac2, 1.0 / 12.0),
            (4, &aac, 1.0 / 24.0),
        ];
        let defect = |order: u32| {
            let of = trees.iter().filter(|(o, ..)| *o == order);
            of.map(|(_, y, right)| (weights.iter().zip(*y).map(|(w, y)| w * y).sum::<f64>() - right).abs())
                .fold(0.0, f64::max)
        };
        for order in 1..=companion.order {
            assert!(defect(order) < 1e-13, "{name}, order {order}: {:e}", defect(order));
        }
        if companion.order < 4 {
            assert!(defect(companion.order + 1) > 1e-4, "{name} has a companion of a higher order");
        }
    }
    assert!(count >= 5);
}

type Matrix2 = nalgebra::Matrix2<f64>;
type Vector2 = nalgebra::Vector2<f64>;

/// The estimate of an implicit pair for a step of `h` of `y' = J y` from `y`: `r = h sum_i d_i J Y_i` with
/// the stages `Y_i`, filtered by the matrix of the last stage, `(I - h a J)^-1 r`; Hosea, Shampine 1996,
/// section 5.
fn filtered_estimate(
    tableau: &super::tableau::Tableau,
    difference: &[f64],
    j: Matrix2,
    y: Vector2,
    h: f64,
) -> Vector2 {
    let (mut slopes, mut r): (Vec<Vector2>, _) = (vec![], Vector2::zeros());
    let resolvent = |a: f64| (Matrix2::identity() - h * a * j).try_inverse().unwrap();
    for (i, row) in tableau.a.iter().enumerate() {
        let known = slopes.iter().zip(*row).fold(y, |sum, (slope, a)| sum + h * a * slope);
        slopes.push(j * resolvent(row[i]) * known);
        r += h * difference[i] * slopes[i];
    }
    let last = tableau.a.last().unwrap();
    resolvent(last[last.len() - 1]) * r
}

// Unfiltered, the estimate of a fast oscillator that the method damps out grows with the step.
#[test]
fn estimates_of_implicit_pairs_are_filtered_by_the_matrix_of_the_last_stage() {
    let mut count = 0;
    for method in methods() {
        let Scheme::Dirk(tableau) = method.scheme else { continue };
        let Some(companion) = tableau.companion else { continue };
        count += 1;
        for h in [0.1, 1.0, 10.0, 1000.0] {
            let (system, state) = super::oscillator();
            let mut simulation = crate::simulation::Simulation::new(system, state, method, h);
            simulation.set_solver(SolverOptions { tolerance: Some(1e-300), ..SolverOptions::default() });
            let tolerances = super::Tolerances { position: 1.0, velocity: 1.0, relative: 0.0 };
            let control =
                crate::control::StepControl { tolerances, first: Some(h), smallest: 0.0, largest: h };
            simulation.set_step_control(control);
            let found = simulation.estimate_of_a_step(h).unwrap();
            let j = Matrix2::new(0.0, 1.0, -1.0, 0.0);
            let e = filtered_estimate(&tableau, companion.difference, j, Vector2::new(1.0, 0.0), h);
            let expected = (0.5 * e.norm_squared()).sqrt();
            let name = method.documentation.name;
            assert!(
                (found / expected - 1.0).abs() < 1e-9,
                "{name} at h omega = {h}: {found:e}, {expected:e}"
            );
        }
    }
    assert!(count >= 4);
}

/// Symplectic methods preserve area at any step; the others do not. Measured on the hardening oscillator
/// `E = x^2/2 + x^4/4`, as every method without damping preserves area on a linear one.
#[test]
fn exactly_the_schemes_that_say_so_are_symplectic() {
    for method in methods() {
        let after = |x: f64, v: f64, h: f64| {
            let mut system = System::new(1, vec![1.0]);
            system.add_term(Box::<Hardening>::default());
            let mut state = State::new(vec![x], vec![v]);
            let options = SolverOptions { tolerance: Some(1e-13), ..SolverOptions::default() };
            let mut integrator = method.build(1, options);
            // The second step has whatever the first has left behind.
            for _ in 0..2 {
                integrator.step(&mut system, &mut state, h).unwrap();
            }
            [state.x()[0], state.v()[0]]
        };
        // What order 15 does to areas shows at large steps.
        let steps = if method.documentation.order < 10 { [0.3, 0.6] } else { [1.8, 2.2] };
        for h in steps {
            let (x, v, e) = (1.0, 0.3, 1e-4);
            // Fourth-order differences: their error is about 1e-12.
            let slope = |f: &dyn Fn(f64) -> [f64; 2], c: usize| {
                (8.0 * (f(e)[c] - f(-e)[c]) - (f(2.0 * e)[c] - f(-2.0 * e)[c])) / (12.0 * e)
            };
            let (in_x, in_v) = (|d| after(x + d, v, h), |d| after(x, v + d, h));
            let area = slope(&in_x, 0) * slope(&in_v, 1) - slope(&in_x, 1) * slope(&in_v, 0);
            let defect = (area - 1.0).abs();
            if method.documentation.symplectic {
                assert!(defect < 1e-10, "{} at h = {h}: {defect:e}", method.documentation.name);
            } else {
                assert!(defect > 1e-7, "{} at h = {h}: {defect:e}", method.documentation.name);
            }
        }
    }
}

/// `E = x^2/2 + x^4/4`.
#[derive(Default)]
struct Hardening(f64);

impl EnergyTerm for Hardening {
    fn name(&self) -> String {
        "hardening oscillator".into()
    }
    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Elastic)
    }
    fn energy(&mut self, x: &[f64]) -> f64 {
        0.5 * x[0].powi(2) + 0.25 * x[0].powi(4)
    }
    fn evaluate(&mut self, x: &[f64]) -> bool {
        self.0 = x[0] + x[0].powi(3);
        self.0.is_finite()
    }
    fn add_rows(&self, _: usize, g: &mut [f64]) {
        g[0] += self.0;
    }
    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        y[0] += (1.0 + 3.0 * x[0] * x[0]) * p[0];
    }
    fn stencils(&mut self) -> Stencils {
        Stencils { size: 1, vertices: vec![0] }
    }
    fn stencil_hessians(&self, _: Range<usize>, x: &[f64], _: Psd, out: &mut [f64]) {
        out.fill(1.0 + 3.0 * x[0] * x[0]);
    }
    fn fault(&self, _: &[f64]) -> Option<Fault> {
        None
    }
}

impl TermViews for Hardening {}
