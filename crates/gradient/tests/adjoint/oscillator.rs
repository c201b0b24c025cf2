//! A mass on a spring: `m x'' = -k x`, built as a spring without rest length from a held vertex.

use pliant::energy::spring::Springs;
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;
use pliant_gradient::{
    GradientError, LossFrame, Masses, Parameter, RunGradient, SpringStiffness, TunedSpring, UNLIMITED,
    gradient, tangent,
};

use crate::support::{case, compare, method, numbers, solve_exactly};

const K: f64 = 3.7;
const M: f64 = 1.3;
const STEPS: u64 = 40;

fn oscillator(scheme: &str) -> Simulation {
    let mut system = System::new(2, vec![1.0, M]);
    system.add_term(Box::new(Springs::<2>::new("spring", &[[0, 1]], &[K], &[0.0], 2)));
    system.pin(&[0]);
    let state = State::new(vec![0.0, 0.0, 0.8, 0.0], vec![0.0, 0.0, -0.45, 0.0]);
    let mut simulation = Simulation::new(system, state, method(scheme), 0.05);
    solve_exactly(&mut simulation);
    simulation
}

fn parameters() -> Vec<Box<dyn Parameter>> {
    let spring = TunedSpring { ends: [0, 1], stiffness: K, rest_length: 0.0 };
    vec![Box::new(SpringStiffness::new(vec![spring])), Box::new(Masses::new(vec![1]))]
}

/// One of the losses of the reference.
fn loss(name: &str) -> impl FnMut(&LossFrame<'_>, &mut [f64], &mut [f64]) -> f64 {
    move |frame, x_bar, v_bar| {
        let (x, v) = (frame.x[2], frame.v[2]);
        match (name, frame.step) {
            ("sum_x2", _) => {
                x_bar[2] = 2.0 * x;
                x * x
            }
            ("x", STEPS) => {
                x_bar[2] = 1.0;
                x
            }
            ("v", STEPS) => {
                v_bar[2] = 1.0;
                v
            }
            ("energy", STEPS) => {
                (x_bar[2], v_bar[2]) = (K * x, M * v);
                0.5 * (K * x * x + M * v * v)
            }
            _ => 0.0,
        }
    }
}

/// Derivatives by k, m, x0, v0.
fn row(found: &RunGradient) -> [f64; 4] {
    [found.parameters[0][0], found.parameters[1][0], found.position[2], found.velocity[2]]
}

// The step is linear: one Newton iteration, and 1e-12 of the largest derivative.
#[test]
fn every_scheme_has_the_derivatives_of_its_steps() {
    let case = case("oscillator");
    let mut compared = 0;
    for (scheme, losses) in case["schemes"].as_object().unwrap() {
        for (name, expected) in losses.as_object().unwrap() {
            let expected = numbers(expected);
            let mut simulation = oscillator(scheme);
            let mut loss = loss(name);
            let found = gradient(&mut simulation, STEPS, &mut loss, &mut parameters(), UNLIMITED).unwrap();
            let mut by = row(&found);
            if name == "energy" {
                let (x, v) = (simulation.state().x()[2], simulation.state().v()[2]);
                by[0] += 0.5 * x * x;
                by[1] += 0.5 * v * v;
            }
            let what = format!("{scheme}, {name}");
            compare(&what, &[found.value], &expected[..1], 1e-12);
            compare(&what, &by, &expected[1..], 1e-12);
            compared += 1;
        }
    }
    assert_eq!(compared, 26 * 4, "schemes, and losses");
}

// x is homogeneous of degree 0 in (k, m) and linear in the start.
#[test]
fn position_is_homogeneous_in_constants_and_linear_in_the_start() {
    for scheme in ["velocity-verlet", "rk4", "sdirk4", "bdf2", "generalised-alpha(.5)"] {
        let mut simulation = oscillator(scheme);
        let found = gradient(&mut simulation, STEPS, &mut loss("x"), &mut parameters(), UNLIMITED).unwrap();
        let [k, m, x0, v0] = row(&found);
        assert!((K * k + M * m).abs() < 1e-13, "{scheme}: {}", K * k + M * m);
        assert!((0.8 * x0 - 0.45 * v0 - found.value).abs() < 1e-13, "{scheme}");
    }
}

#[test]
fn derivatives_by_what_nothing_depends_on_are_zero() {
    let mut simulation = oscillator("velocity-verlet");
    let mut at_start = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
        x_bar[2] = f64::from(u8::from(frame.step == 0));
        x_bar[2] * frame.x[2]
    };
    let found = gradient(&mut simulation, STEPS, &mut at_start, &mut parameters(), UNLIMITED).unwrap();
    assert_eq!(row(&found), [0.0, 0.0, 1.0, 0.0]);
    assert_eq!(found.growth, 0.0);
}

#[test]
fn a_loss_that_is_not_finite_names_its_step() {
    let mut bad =
        |frame: &LossFrame<'_>, _: &mut [f64], _: &mut [f64]| if frame.step == 7 { f64::NAN } else { 0.0 };
    let error = gradient(&mut oscillator("rk4"), STEPS, &mut bad, &mut [], UNLIMITED).unwrap_err();
    assert_eq!(error.to_string(), "the loss is not finite at step 7 (t = 0.35 s): it is NaN");
    let mut bad = |_: &LossFrame<'_>, _: &mut [f64], v_bar: &mut [f64]| {
        v_bar[3] = f64::INFINITY;
        1.0
    };
    let error = gradient(&mut oscillator("rk4"), STEPS, &mut bad, &mut [], UNLIMITED).unwrap_err();
    let expected = "the loss is not finite at step 40 (t = 2 s): its derivative by the velocity of \
                    vertex 1 is inf";
    assert_eq!(error.to_string(), expected);
}

// Forward Euler makes an oscillator grow: by the factor sqrt(1 + h^2 k/m) a step, and derivatives likewise.
#[test]
fn a_gradient_that_overflows_says_how_fast_it_grows() {
    let mut huge = |frame: &LossFrame<'_>, x_bar: &mut [f64], _: &mut [f64]| {
        x_bar[2] = if frame.step == STEPS { 1.7e308 } else { 0.0 };
        0.0
    };
    let error = gradient(&mut oscillator("forward-euler"), STEPS, &mut huge, &mut [], UNLIMITED).unwrap_err();
    let GradientError::Overflow { step, growth, .. } = error else { panic!("{error}") };
    assert!(step < STEPS && growth > 0.0, "{error}");
}

#[test]
fn a_tangent_that_overflows_says_how_fast_it_grows() {
    let mut simulation = oscillator("forward-euler");
    let huge = [0.0, 0.0, 1e306, 0.0];
    let error = tangent(&mut simulation, 2000, (&huge, &[0.0; 4]), &mut |_, _| {}).unwrap_err();
    let GradientError::TangentOverflow { step, time, growth } = error else { panic!("{error}") };
    let rate = (1.0 + 0.05 * 0.05 * K / M).ln() / 2.0 / 0.05;
    // Of a circle that grows one coordinate is looked at: a part of a turn in more than ten.
    assert!((growth / rate - 1.0).abs() < 0.1, "{error}, expected {rate}");
    assert!(step > 1000 && (time - 0.05 * step as f64).abs() < 1e-9, "{error}");
    assert!(error.to_string().contains(&format!("exp({growth:.4} t) from the start")), "{error}");
}
