//! Builders and small measurements that the tests share.

pub(crate) mod fields;
pub(crate) mod oscillator;
pub(crate) mod particles;
pub(crate) mod penalty;
pub(crate) mod reference;
pub(crate) mod solid;

use std::sync::atomic::AtomicBool;

use pliant::integrator::{IntegratorSpec, Method};
use pliant::observer::{Frame, Observer, ObserverError, Quantities};
use pliant::run::{Plan, Summary, run};
use pliant::simulation::Simulation;
use pliant::solver::SolverOptions;

/// Every scheme of the registry that moves things; statics has no order and no inertia.
pub(crate) fn methods() -> impl Iterator<Item = Method> {
    IntegratorSpec::ALL.iter().map(|spec| spec.method()).filter(|method| method.documentation.order > 0)
}

/// Schemes whose order shows in double precision: of order 15, a step that is large enough to have an error
/// is too large to converge.
pub(crate) fn methods_of_measurable_order() -> impl Iterator<Item = Method> {
    methods().filter(|method| method.documentation.order < 10)
}

/// The scheme of this name.
pub(crate) fn method(name: &str) -> Method {
    let mut all = IntegratorSpec::ALL.iter().map(|spec| spec.method());
    all.find(|m| m.documentation.name == name).unwrap_or_else(|| panic!("no scheme is called {name}"))
}

/// Solves the equations of implicit schemes to rounding, so that what is measured is the scheme; explicit
/// ones do not care.
pub(crate) fn solve_to_rounding(simulation: &mut Simulation) {
    simulation.set_solver(SolverOptions { tolerance: Some(1e-15), ..SolverOptions::default() });
}

/// Takes `steps` steps, none of which may fail.
pub(crate) fn advance(simulation: &mut Simulation, steps: usize) {
    for _ in 0..steps {
        simulation.step().unwrap();
    }
}

/// Runs for `duration` with a look at the energy every `1 / rate`.
pub(crate) fn run_watched(simulation: &mut Simulation, duration: f64, rate: f64) -> Summary {
    struct Watch;
    impl Observer for Watch {
        fn quantities(&self) -> Quantities {
            Quantities::DIAGNOSTICS
        }
        fn frame(&mut self, _: &Frame<'_>) -> Result<(), ObserverError> {
            Ok(())
        }
    }
    run(simulation, &Plan { duration, rate }, &mut [&mut Watch], &AtomicBool::new(false))
}

/// Euclidean norm of the difference.
pub(crate) fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

/// Largest absolute component of the difference.
pub(crate) fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Fails unless `measured` is within `tolerance * |expected|` of `expected`.
#[track_caller]
pub(crate) fn assert_relative(measured: f64, expected: f64, tolerance: f64, what: &str) {
    let error = (measured - expected).abs() / expected.abs();
    assert!(error <= tolerance, "{what}: {measured:e} instead of {expected:e}, off by {error:.2e}");
}

/// Mass-weighted root mean square of the difference of two flat arrays, over the vertices that are not
/// pinned.
pub(crate) fn weighted_rms(simulation: &Simulation, a: &[f64], b: &[f64]) -> f64 {
    let system = simulation.system();
    let d = system.dimension();
    let (mut sum, mut total) = (0.0, 0.0);
    for i in (0..a.len()).filter(|i| !system.is_pinned(i / d)) {
        sum += system.mass()[i / d] * (a[i] - b[i]).powi(2);
        total += system.mass()[i / d];
    }
    (sum / total).sqrt()
}

/// Displacements between two states.
pub(crate) fn displacements(x: &[f64], rest: &[f64]) -> Vec<f64> {
    x.iter().zip(rest).map(|(x, rest)| x - rest).collect()
}
