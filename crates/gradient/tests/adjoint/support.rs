//! Reference numbers, schemes by name, comparison.

use pliant::integrator::generalised_alpha::GeneralisedAlphaParameters;
use pliant::integrator::newmark::NewmarkParameters;
use pliant::integrator::{IntegratorSpec, Method};
use pliant::simulation::Simulation;
use pliant::solver::SolverOptions;
use pliant_scene::Scene;
use serde_json::Value;

/// The reference numbers of a case.
pub(crate) fn case(name: &str) -> Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests-data/derivatives.json");
    let all: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    all[name].clone()
}

/// All numbers of a value, in their order.
pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(values) => values.iter().flat_map(numbers).collect(),
        value => vec![value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))],
    }
}

/// The scheme that the reference names so, with its parameters in parentheses.
pub(crate) fn method(name: &str) -> Method {
    let of_alpha = |rho| IntegratorSpec::GeneralisedAlpha(GeneralisedAlphaParameters { rho });
    let of_newmark = |beta, gamma| IntegratorSpec::Newmark(NewmarkParameters { beta, gamma });
    let name = match name {
        "newmark(.3025,.6)" => return of_newmark(0.3025, 0.6).method(),
        "newmark(.25,.5)" => return of_newmark(0.25, 0.5).method(),
        "newmark(.36,.7)" => return of_newmark(0.36, 0.7).method(),
        "generalised-alpha(.25)" => return of_alpha(0.25).method(),
        "generalised-alpha(.5)" => return of_alpha(0.5).method(),
        "generalised-alpha(.8)" => return of_alpha(0.8).method(),
        name => name,
    };
    let all = IntegratorSpec::ALL.iter().map(|spec| spec.method());
    all.into_iter().find(|method| method.documentation.name == name).unwrap_or_else(|| panic!("{name}"))
}

/// Names of all schemes.
pub(crate) fn schemes() -> Vec<&'static str> {
    IntegratorSpec::ALL.iter().map(|spec| spec.method().documentation.name).collect()
}

/// Newton's method to the last bits: derivatives of implicit steps are as exact as their solutions.
pub(crate) fn solve_exactly(simulation: &mut Simulation) {
    simulation.set_solver(SolverOptions { tolerance: Some(1e-15), ..SolverOptions::default() });
}

/// Compares derivatives by one parameter, relative to the largest of them.
pub(crate) fn compare(what: &str, found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let largest = expected.iter().fold(0.0, |largest: f64, e| largest.max(e.abs()));
    for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
        let error = (found - expected).abs();
        assert!(
            error <= tolerance * largest,
            "{what} {i}: {found:e}, expected {expected:e}, error {error:e}"
        );
    }
}

/// A scene of this scheme with these further tables, in steps of one size where they are solved, of the other
/// where they are explicit [s].
pub(crate) fn scene(scheme: &str, dimension: usize, [solved, explicit]: [f64; 2], text: &str) -> Scene {
    let solves = method(scheme).documentation.solves > 0;
    let (step, solver) = if solves { (solved, EXACT) } else { (explicit, "") };
    let text = format!(
        "dimension = {dimension}
         [time]
         integrator = \"{scheme}\"
         duration = 1.0
         step = {step:?}
         {solver}
         {text}"
    );
    Scene::from_toml(&text).unwrap()
}

/// A damped beam that falls, held at one end: this key of its steps, further keys of the world and of the
/// pin.
pub(crate) fn falling_beam(scheme: &str, young: f64, [step, world, pin]: [&str; 3]) -> Scene {
    let solver = if method(scheme).documentation.solves > 0 { EXACT } else { "" };
    let text = format!(
        "dimension = 2
         [time]
         integrator = \"{scheme}\"
         duration = 1.0
         {step}
         {solver}
         [world]
         gravity = [0.7, -9.81]
         {world}
         [[body]]
         name = \"beam\"
         mesh = {{ grid = {{ cells = [3, 1], size = [1.5, 0.5] }} }}
         elastic = {{ neo-hookean = {{ young = {young:?}, poisson = 0.35 }} }}
         mass = {{ density = 1000.0 }}
         velocity = {{ rigid = {{ linear = [0.3, -0.8] }} }}
         damping = {{ mass_proportional = 0.4, stiffness_proportional = 2e-3 }}
         pin = [{{ half_space = {{ normal = [1, 0], offset = 0 }}, {pin} }}]"
    );
    Scene::from_toml(&text).unwrap()
}

/// Tolerance of solves whose derivatives are compared.
const EXACT: &str = "solver = { tolerance = 1e-14 }";

/// Numbers without a pattern.
pub(crate) fn scattered(count: usize, seed: f64) -> Vec<f64> {
    (0..count).map(|i| (12.9898 * (i as f64 + seed)).sin()).collect()
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Compares a derivative with central differences of fourth order of `value`, a function of a change, at the
/// best of several steps from `largest` down; relative to the size of the parts that it is the sum of.
pub(crate) fn compare_with_differences(
    what: &str,
    (found, size): (f64, f64),
    (largest, tolerance): (f64, f64),
    mut value: impl FnMut(f64) -> f64,
) {
    let mut difference = |h: f64| {
        let [near, far] = [h, 2.0 * h].map(|h| value(h) - value(-h));
        (8.0 * near - far) / (12.0 * h)
    };
    assert!(found.abs() > 1e-3 * size, "{what}: nothing to compare");
    let mut least = f64::INFINITY;
    for i in 0..5 {
        least = least.min((difference(largest * 0.1_f64.powi(i)) - found).abs());
        if least <= tolerance * size {
            return;
        }
    }
    panic!("{what}: {found:e} of {size:e} differs by {:e}", least / size);
}
