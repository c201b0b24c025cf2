//! A7, Prothero and Robinson: a smooth solution on top of something very stiff. The order of a scheme there
//! is not its classical one.

use pliant::dissipation::MassProportional;
use pliant::energy::load::{DeadLoad, Sample};
use pliant::energy::spring::Springs;
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;

use crate::support::{assert_relative, method, solve_to_rounding};

/// One mass of 1 kg (vertex 1), on which a force that changes with time acts along x.
fn pushed(force: impl Fn(f64) -> f64 + Send + Sync + 'static) -> System {
    let mut system = System::new(2, vec![1.0; 2]);
    let sample = Sample { point: [0.0; 3], shares: vec![(0, 1.0)] };
    let field = move |_: [f64; 3], t: f64| [force(t), 0.0, 0.0];
    let load = DeadLoad::new("push".into(), 2, vec![1], &[0.0; 4], vec![sample], Box::new(field), true);
    system.add_term(Box::new(load));
    system.pin(&[0]);
    system
}

/// The largest of `error(t, x, v)` over the steps of 10 s.
fn largest(system: System, start: [f64; 2], name: &str, h: f64, error: impl Fn(f64, f64, f64) -> f64) -> f64 {
    let state = State::new(vec![0.0, 0.0, start[0], 0.0], vec![0.0, 0.0, start[1], 0.0]);
    let mut simulation = Simulation::new(system, state, method(name), h);
    solve_to_rounding(&mut simulation);
    let mut worst = 0.0f64;
    for _ in 0..(10.0 / h).round() as usize {
        simulation.step().unwrap();
        let state = simulation.state();
        worst = worst.max(error(state.time, state.x()[2], state.v()[2]));
    }
    worst
}

/// `v' = lambda (v - cos t) - sin t`, `v(0) = 1`: of the velocities of a mass under drag.
fn first_order(name: &str, lambda: f64, h: f64) -> f64 {
    let mut system = pushed(move |t| -lambda * t.cos() - t.sin());
    system.add_dissipation(Box::new(MassProportional::new("mass", -lambda, &[1.0], 1..2, 2)));
    largest(system, [0.0, 1.0], name, h, |t, _, v| (v - t.cos()).abs())
}

fn order(errors: [f64; 2]) -> f64 {
    (errors[0] / errors[1]).log2()
}

// A7 (a), lambda = -1e6: error at h = 0.1 and the order down to h = 0.025. lambda = -1: the classical orders.
#[test]
fn the_orders_of_a_stiff_first_order_problem_are_the_stage_orders() {
    let rows = [
        ("implicit-euler", 5.00e-8, 1.0, 1.0),
        ("implicit-midpoint", 2.499e-3, 2.0, 2.0),
        ("trapezoid", 8.34e-10, 2.0, 2.0),
        ("sdirk2", 3.54e-8, 1.0, 2.0),
        ("tr-bdf2", 6.90e-10, 2.0, 2.0),
        ("sdirk3", 2.09e-8, 1.0, 3.0),
        ("crouzeix3", 1.44e-3, 2.0, 3.0),
        ("sdirk4", 4.17e-8, 1.0, 4.0),
        ("gauss2", 5.54e-4, 2.0, 4.0),
        ("radau-iia2", 1.11e-9, 2.0, 3.0),
        ("radau-iia3", 1.25e-11, 3.0, 5.0),
        ("bdf2", 3.33e-9, 2.0, 2.0),
    ];
    for (name, expected, stiff, smooth) in rows {
        let stiff_errors = [0.1, 0.05, 0.025].map(|h| first_order(name, -1e6, h));
        assert_relative(stiff_errors[0], expected, 5e-3, name);
        let observed = order([stiff_errors[1], stiff_errors[2]]);
        assert!((observed - stiff).abs() < 0.15, "{name}, lambda = -1e6: order {observed:.3}");
        let observed = order([0.1, 0.05].map(|h| first_order(name, -1.0, h)));
        assert!((observed - smooth).abs() < 0.15, "{name}, lambda = -1: order {observed:.3}");
    }
}

/// `x'' = -cos t - k (x - cos t)`, `k = 1e6`: a mass on a stiff spring whose other end follows.
fn second_order(name: &str, h: f64) -> [f64; 2] {
    let run =
        |velocity: bool| {
            let k = 1e6;
            let mut system = pushed(move |t| (k - 1.0) * t.cos());
            system.add_term(Box::new(Springs::<2>::new("spring", &[[0, 1]], &[k], &[0.0], 2)));
            largest(system, [1.0, 0.0], name, h, move |t, x, v| {
                if velocity { (v + t.sin()).abs() } else { (x - t.cos()).abs() }
            })
        };
    [run(false), run(true)]
}

// A7 (b): largest error of positions at h = 0.05, two digits, and the order from h = 0.025 to 0.0125.
#[test]
fn the_orders_of_a_stiff_spring_whose_end_moves_are_not_the_classical_ones() {
    let rows = [
        ("trapezoid", 8.3e-10, Some(2.0)),
        ("bdf2", 2.17e-9, Some(2.0)),
        ("tr-bdf2", 1.6e-8, Some(1.6)),
        ("sdirk2", 4.0e-6, Some(0.5)),
        ("sdirk3", 2.0e-6, Some(0.3)),
        ("sdirk4", 6.9e-6, None),
        ("implicit-midpoint", 6.2e-4, Some(2.0)),
        ("generalised-alpha", 5.5e-4, Some(2.0)),
        ("radau-iia3", 2.8e-10, None),
    ];
    for (name, expected, observed) in rows {
        let [first, middle, last] = [0.05, 0.025, 0.0125].map(|h| second_order(name, h));
        assert_relative(first[0], expected, 0.02, name);
        if let Some(expected) = observed {
            let observed = order([middle[0], last[0]]);
            assert!((observed - expected).abs() < 0.3, "{name}: order {observed:.3}");
        }
        match name {
            // No convergence.
            "sdirk4" => assert_relative(last[0], 1.1e-5, 0.05, name),
            // Ringing velocities.
            "implicit-midpoint" => assert_relative(first[1], 3.1e-1, 0.02, name),
            "generalised-alpha" => {
                let observed = order([middle[1], last[1]]);
                assert!((observed - 1.4).abs() < 0.3, "{name}: velocities have order {observed:.3}");
            }
            _ => {}
        }
    }
}
