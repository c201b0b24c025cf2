//! Order of convergence of every scheme, from its documentation; a new scheme is measured by existing.

use pliant::integrator::splitting::Stage::{Drift, Kick};
use pliant::integrator::tableau::Tableau;
use pliant::integrator::{Method, Scheme};

use crate::support::particles::{SOFT_DOUBLE_PENDULUM_V, SOFT_DOUBLE_PENDULUM_X, soft_double_pendulum};
use crate::support::{advance, distance, method, methods, methods_of_measurable_order};

/// Errors of positions, velocities and energy on the soft double pendulum at t = 1.
fn errors(method: Method, steps: usize) -> [f64; 3] {
    let mut simulation = soft_double_pendulum(method, 1.0 / steps as f64);
    let start = simulation.diagnostics().total;
    advance(&mut simulation, steps);
    let energy = (simulation.diagnostics().total - start).abs();
    let state = simulation.state();
    [
        distance(&state.x()[2..], &SOFT_DOUBLE_PENDULUM_X),
        distance(&state.v()[2..], &SOFT_DOUBLE_PENDULUM_V),
        energy,
    ]
}

/// Whether positions, velocities and energy converge with the documented order, and what was measured.
fn has_its_documented_order(method: Method) -> Result<(), String> {
    let order = f64::from(method.documentation.order);
    // Fine enough to be in the asymptotic range, coarse enough to be far from rounding.
    let steps = match order {
        o if o < 1.5 => 4000,
        // Five solves a step, each exact to rounding, with weights of up to 8 that nearly cancel.
        o if o > 3.5 && method.documentation.solves > 1 => 150,
        // The most accurate: rounding is near.
        o if o > 4.5 || o > 3.5 && method.documentation.solves > 0 => 50,
        _ => 400,
    };
    let (coarse, fine) = (errors(method, steps), errors(method, 2 * steps));
    for (quantity, (coarse, fine)) in ["position", "velocity", "energy"].iter().zip(coarse.iter().zip(fine)) {
        let measured = (coarse / fine).log2();
        // A NaN does not agree.
        let agrees = (measured - order).abs() < 0.15;
        if !agrees {
            let name = method.documentation.name;
            return Err(format!("{name}: {quantity} has order {measured:.3}, documented {order} ({fine:e})"));
        }
    }
    Ok(())
}

// lecture 4 to 7; A8
#[test]
fn every_scheme_converges_with_its_documented_order() {
    for method in methods_of_measurable_order() {
        has_its_documented_order(method).unwrap();
    }
}

/// A scheme of this documentation with other coefficients.
fn forged(name: &str, scheme: Scheme) -> Method {
    Method { scheme, ..method(name) }
}

// A8: the check above can fail.
#[test]
fn schemes_with_wrong_coefficients_are_exposed() {
    const UNBALANCED: &[pliant::integrator::splitting::Stage] = &[Kick(0.4), Drift(1.0), Kick(0.6)];
    const JUMP: [f64; 2] = [1.3512, 1.0 - 2.0 * 1.3512];
    const BLUNT_JUMP: &[pliant::integrator::splitting::Stage] = &[
        Kick(0.5 * JUMP[0]),
        Drift(JUMP[0]),
        Kick(0.5 * (JUMP[0] + JUMP[1])),
        Drift(JUMP[1] + 1e-3),
        Kick(0.5 * (JUMP[0] + JUMP[1])),
        Drift(JUMP[0] - 1e-3),
        Kick(0.5 * JUMP[0]),
    ];
    let slipped = Tableau {
        a: &[&[], &[0.5], &[0.0, 0.5], &[0.0, 0.0, 1.0]],
        b: &[1.0 / 6.0, 1.0 / 3.0, 1.0 / 6.0, 1.0 / 3.0],
        companion: None,
    };
    let three_eighths_of_rk4 = Tableau {
        a: &[&[], &[0.5], &[0.01, 0.49], &[0.0, 0.0, 1.0]],
        b: &[1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0],
        companion: None,
    };
    let forgeries = [
        forged("velocity-verlet", Scheme::Splitting(UNBALANCED)),
        forged("yoshida4", Scheme::Splitting(BLUNT_JUMP)),
        forged("rk4", Scheme::RungeKutta(slipped)),
        forged("rk4", Scheme::RungeKutta(three_eighths_of_rk4)),
        // A first-order scheme that claims more, and a second-order one that claims less.
        forged("velocity-verlet", method("symplectic-euler").scheme),
        forged("forward-euler", method("rk2-midpoint").scheme),
    ];
    for method in forgeries {
        let verdict = has_its_documented_order(method);
        assert!(verdict.is_err(), "{:?} passes for {}", method.scheme, method.documentation.name);
    }
}

// lecture 4 to 6; the work that the documentation promises is the work done.
#[test]
fn every_scheme_evaluates_the_force_as_often_as_documented() {
    // How often a scheme that iterates does depends on the iterations.
    for method in methods().filter(|m| m.documentation.force_evaluations > 0) {
        let mut simulation = soft_double_pendulum(method, 1e-3);
        advance(&mut simulation, 1);
        let first = simulation.work().force_evaluations;
        advance(&mut simulation, 100);
        let per_step = (simulation.work().force_evaluations - first) as f64 / 100.0;
        assert_eq!(
            per_step,
            f64::from(method.documentation.force_evaluations),
            "{}",
            method.documentation.name
        );
    }
}
