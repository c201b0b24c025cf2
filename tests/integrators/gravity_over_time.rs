//! A particle in gravity that changes with time, against its exact integral: forces are evaluated at the
//! right stage times.

use pliant::diagnostics::Diagnostics;
use pliant::energy::Fault;
use pliant::integrator::Method;
use pliant::simulation::{Simulation, StepError};
use pliant_scene::assembly::UnstableStep;
use pliant_scene::{Problem, Scene};

use crate::support::{advance, distance, methods, methods_of_measurable_order};

/// One particle of 2 kg at rest at the origin.
fn particle(method: &str, gravity: &str, step: f64) -> Result<Simulation, Vec<Problem>> {
    let text = format!(
        "dimension = 2\n[time]\nintegrator = '{method}'\nstep = {step:?}\nduration = 2.0\n[world]\ngravity \
         = {gravity}\n\
         [[body]]\nmesh = {{ inline = {{ points = [[0, 0]] }} }}\nmass = {{ total = 2.0 }}\n"
    );
    Ok(Scene::from_toml(&text).unwrap().assemble(UnstableStep::Accept)?.simulation)
}

/// Errors of position and velocity at t = 1 under `g = (cos 3t, -9.81 (1 - exp(-t/0.4)))`.
fn errors(method: Method, steps: usize) -> [f64; 2] {
    let name = method.documentation.name;
    let mut simulation =
        particle(name, "['cos(3*t)', '-9.81 * (1 - exp(-t/0.4))']", 1.0 / steps as f64).unwrap();
    advance(&mut simulation, steps);
    let (tau, t) = (0.4_f64, 1.0_f64);
    let decay = (-t / tau).exp();
    let v = [(3.0 * t).sin() / 3.0, -9.81 * (t + tau * (decay - 1.0))];
    let x = [(1.0 - (3.0 * t).cos()) / 9.0, -9.81 * (0.5 * t * t - tau * t - tau * tau * (decay - 1.0))];
    [distance(&simulation.positions(), &x), distance(&simulation.velocities(), &v)]
}

#[test]
fn every_scheme_has_its_order_under_gravity_that_changes_with_time() {
    for method in methods_of_measurable_order() {
        let name = method.documentation.name;
        // Of a force that depends on time alone a scheme is a quadrature, and Crouzeix' one that of Gauss.
        let order = if name == "crouzeix3" { 4.0 } else { f64::from(method.documentation.order) };
        let steps = if order < 2.5 {
            400
        } else if order < 4.5 {
            40
        } else if method.documentation.solves > 0 {
            8
        } else {
            32
        };
        let (coarse, fine) = (errors(method, steps), errors(method, 2 * steps));
        for (quantity, (coarse, fine)) in ["position", "velocity"].iter().zip(coarse.iter().zip(fine)) {
            let measured = (coarse / fine).log2();
            // A NaN does not agree.
            let agrees = (measured - order).abs() < 0.1;
            assert!(agrees, "{name}: {quantity} has order {measured:.3}, documented {order} ({fine:e})");
        }
    }
}

#[test]
fn a_formula_that_does_not_change_gives_the_bits_of_the_number() {
    for method in methods() {
        let run = |gravity: &str| {
            let mut simulation = particle(method.documentation.name, gravity, 0.01).unwrap();
            advance(&mut simulation, 100);
            let energy = simulation.diagnostics().total;
            (simulation.positions().to_vec(), simulation.velocities().to_vec(), energy)
        };
        assert_eq!(run("[0.5, '-9.81 m/s^2']"), run("['0.5 + 0 * t', '-9.81']"));
        assert_eq!(run("[0.5, -9.81]"), run("['0.5 + 0 * t', '-9.81 * cos(0 * t)']"));
    }
}

#[test]
fn plain_numbers_leave_time_out() {
    for (gravity, changes) in
        [("[0, -9.81]", false), ("['1 cm/s^2', '-9.81']", false), ("[0, 0]", false), ("[0, 't']", true)]
    {
        let simulation = particle("rk4", gravity, 0.1).unwrap();
        assert_eq!(simulation.system().changes_with_time(), changes, "{gravity}");
    }
}

/// The potential is that of the time of the state, also after a step whose stages were at other times.
#[test]
fn energies_are_measured_at_the_time_of_the_state() {
    for method in methods() {
        let mut simulation = particle(method.documentation.name, "['3 * t', 0]", 0.25).unwrap();
        for step in 1..=4 {
            simulation.step().unwrap();
            let before = simulation.positions().to_vec();
            let gravitational = simulation.diagnostics().gravitational;
            let expected = -2.0 * 3.0 * (0.25 * f64::from(step)) * before[0];
            assert!(
                (gravitational - expected).abs() <= 1e-14 * expected.abs(),
                "{}",
                method.documentation.name
            );
            // Of any other time too, on request.
            let velocities = simulation.velocities().to_vec();
            let later = Diagnostics::measure(simulation.system_mut(), 7.0, &before, &velocities);
            let expected = -2.0 * 3.0 * 7.0 * before[0];
            assert!((later.gravitational - expected).abs() <= 1e-14 * expected.abs());
        }
        // To measure changes nothing: the next step begins with the force at hand.
        let mut unmeasured = particle(method.documentation.name, "['3 * t', 0]", 0.25).unwrap();
        advance(&mut unmeasured, 4);
        assert_eq!(unmeasured.positions(), simulation.positions());
        assert_eq!(unmeasured.work(), simulation.work());
    }
}

#[test]
fn gravity_without_a_value_ends_the_run() {
    for method in methods() {
        let mut simulation = particle(method.documentation.name, "[0, '1 / (t - 0.5)']", 0.125).unwrap();
        let error = (0..4).find_map(|_| simulation.step().err()).expect("the gravity at 0.5 s is infinite");
        let StepError::NotFinite { fault, .. } = &error else { panic!("{error}") };
        assert_eq!(fault.as_deref(), Some(&Fault::Gravity { time: 0.5 }), "{}", method.documentation.name);
        assert!(error.to_string().contains("gravity is not finite at t = 0.5 s"), "{error}");
        assert!(simulation.positions().iter().all(|x| x.is_finite()));
    }
}
