//! Steps so long that the equations of their stages have solutions which are those of no motion.

use pliant::energy::spring::Springs;
use pliant::integrator::Method;
use pliant::simulation::{Simulation, StepError};
use pliant::solver::{SolveFailure, SolverOptions};
use pliant::state::State;
use pliant::system::System;

use crate::support::method;

/// Mass of 1 kg on a spring of 100 rad/s and 1 m, pressed to 0.8 m, that turns at 3 rad/s about the other
/// end: 200 J and what it moves with.
fn pressed_spring(method: Method, h: f64, retries: u32) -> Simulation {
    let mut system = System::new(2, vec![1.0; 2]);
    system.add_term(Box::new(Springs::<2>::new("spring", &[[0, 1]], &[1e4], &[1.0], 2)));
    system.pin(&[0]);
    let state = State::new(vec![0.0, 0.0, 0.8, 0.0], vec![0.0, 0.0, 0.0, 2.4]);
    let mut simulation = Simulation::new(system, state, method, h);
    simulation.set_solver(SolverOptions { retries, ..SolverOptions::default() });
    simulation
}

/// Largest factor by which the energy of the spring grows or shrinks in one of 100 steps; why they ended.
fn run(mut simulation: Simulation) -> (f64, Option<StepError>) {
    let (mut before, mut largest) = (simulation.diagnostics().total, 1.0f64);
    for _ in 0..100 {
        if let Err(error) = simulation.step() {
            return (largest, Some(error));
        }
        let now = simulation.diagnostics().total;
        largest = largest.max(now / before);
        before = now;
    }
    (largest, None)
}

/// In steps of 8 and 16 rad, the stages of Gauss's method have a solution with 60 times the energy, to which
/// Newton's method went without a word. A method that is stable at any step has no such motion.
#[test]
fn collocation_takes_no_solution_that_makes_energy() {
    for name in ["gauss2", "radau-iia2", "radau-iia3"] {
        for h in [0.08, 0.16] {
            let (factor, end) = run(pressed_spring(method(name), h, 0));
            assert!(factor < 2.0, "{name}, {h} s: {factor} times the energy in a step; {end:?}");
            let unsolved = |error: &StepError| {
                matches!(
                    error,
                    StepError::Unsolved { verdict: SolveFailure::Spurious | SolveFailure::Stalled, .. }
                )
            };
            assert!(end.as_ref().is_none_or(unsolved), "{name}, {h} s: {end:?}");
            // Parts of the step have the solution.
            let (factor, end) = run(pressed_spring(method(name), h, 6));
            assert!(factor < 2.0 && end.is_none(), "{name}, {h} s, in parts: {factor} times; {end:?}");
        }
    }
}

/// The same spring at rest, and one that barely moves: nothing is refused for rounding.
#[test]
fn what_rests_is_not_taken_for_a_wrong_solution() {
    for name in ["gauss2", "radau-iia2", "radau-iia3"] {
        for speed in [0.0, 1e-14, 1e-9, 1e-3] {
            let mut simulation = pressed_spring(method(name), 0.16, 0);
            let state = simulation.state_mut();
            state.x_mut()[2] = 1.0;
            state.v_mut()[3] = speed;
            let (_, end) = run(simulation);
            assert!(end.is_none(), "{name}, {speed} m/s: {end:?}");
        }
    }
}
