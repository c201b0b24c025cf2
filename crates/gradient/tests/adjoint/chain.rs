//! A chain of five vertices in 2D, its first held, under gravity.

use pliant::energy::gravity::UniformGravity;
use pliant::energy::spring::Springs;
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;
use pliant_gradient::{
    Gravity, LossFrame, Masses, Parameter, RestLengths, RunGradient, SpringStiffness, TunedSpring, UNLIMITED,
    gradient,
};
use serde_json::Value;

use crate::support::{case, compare, method, numbers, solve_exactly};

const STEPS: u64 = 50;

fn springs(setup: &Value) -> Vec<TunedSpring> {
    let constants = numbers(&setup["k"]).into_iter().zip(numbers(&setup["l"])).enumerate();
    let spring = |(i, (stiffness, rest_length)): (usize, (f64, f64))| TunedSpring {
        ends: [i as u32, i as u32 + 1],
        stiffness,
        rest_length,
    };
    constants.map(spring).collect()
}

fn chain(setup: &Value, scheme: &str) -> Simulation {
    let mass = numbers(&setup["m"]);
    let springs = springs(setup);
    let edges: Vec<[u32; 2]> = springs.iter().map(|spring| spring.ends).collect();
    let (k, l) = (numbers(&setup["k"]), numbers(&setup["l"]));
    let mut system = System::new(2, mass.clone());
    system.add_term(Box::new(UniformGravity::new(&numbers(&setup["g"]), &mass)));
    system.add_term(Box::new(Springs::<2>::new("chain", &edges, &k, &l, 5)));
    system.pin(&[0]);
    let state = State::new(numbers(&setup["x0"]), numbers(&setup["v0"]));
    let mut simulation = Simulation::new(system, state, method(scheme), 0.01);
    solve_exactly(&mut simulation);
    simulation
}

fn parameters(setup: &Value) -> Vec<Box<dyn Parameter>> {
    vec![
        Box::new(SpringStiffness::new(springs(setup))),
        Box::new(RestLengths::new(springs(setup))),
        Box::new(Masses::new((0..5).collect())),
        Box::new(Gravity::new(2)),
    ]
}

/// One of the losses of the reference.
fn loss(name: &str) -> impl FnMut(&LossFrame<'_>, &mut [f64], &mut [f64]) -> f64 {
    move |frame, x_bar, _| match (name, frame.step) {
        ("x_last", STEPS) | ("y_last", STEPS) => {
            let i = if name == "x_last" { 8 } else { 9 };
            x_bar[i] = 1.0;
            frame.x[i]
        }
        ("sum_of_squares_over_frames", step) if step % 10 == 0 => {
            x_bar.iter_mut().zip(frame.x).for_each(|(bar, x)| *bar = 2.0 * x);
            frame.x.iter().map(|x| x * x).sum()
        }
        _ => 0.0,
    }
}

fn derivatives(setup: &Value, scheme: &str, name: &str, budget: usize) -> RunGradient {
    let mut simulation = chain(setup, scheme);
    gradient(&mut simulation, STEPS, &mut loss(name), &mut parameters(setup), budget).unwrap()
}

#[test]
fn every_scheme_has_the_derivatives_of_its_steps() {
    let case = case("chain");
    let setup = &case["setup"];
    let mut compared = 0;
    for (scheme, losses) in case["schemes"].as_object().unwrap() {
        for (name, expected) in losses.as_object().unwrap() {
            let found = derivatives(setup, scheme, name, UNLIMITED);
            let what = format!("{scheme}, {name}");
            compare(&what, &[found.value], &numbers(&expected["value"]), 1e-12);
            let by = &found.parameters;
            let all = [("k", &by[0]), ("l", &by[1]), ("m", &by[2]), ("g", &by[3])];
            for (parameter, found) in
                all.into_iter().chain([("x0", &found.position), ("v0", &found.velocity)])
            {
                let expected = numbers(&expected["gradient"][parameter]);
                compare(&format!("{what} by {parameter}"), found, &expected, 1e-10);
            }
        }
        compared += 1;
    }
    assert_eq!(compared, 23, "schemes");
}

// What explicit schemes recompute from a state that was kept has the same bits.
#[test]
fn checkpoints_change_no_bit_of_explicit_schemes() {
    let setup = &case("chain")["setup"];
    for scheme in ["velocity-verlet", "yoshida4", "rk4"] {
        let of = |budget| derivatives(setup, scheme, "sum_of_squares_over_frames", budget);
        let all = of(UNLIMITED);
        for budget in [0, 2_000, 5_000, 20_000] {
            assert_eq!(of(budget), all, "{scheme} in {budget} bytes");
        }
    }
}

#[test]
fn checkpoints_change_implicit_schemes_by_no_more_than_their_tolerance() {
    let setup = &case("chain")["setup"];
    for scheme in ["implicit-euler", "bdf2", "generalised-alpha(.5)"] {
        let of = |budget| derivatives(setup, scheme, "sum_of_squares_over_frames", budget);
        let (all, few) = (of(UNLIMITED), of(2_000));
        compare(scheme, &few.position, &all.position, 1e-11);
        compare(scheme, &few.parameters[0], &all.parameters[0], 1e-11);
    }
}

#[test]
fn a_simulation_ends_where_its_steps_have_led() {
    let setup = &case("chain")["setup"];
    let mut alone = chain(setup, "velocity-verlet");
    (0..STEPS).for_each(|_| alone.step().unwrap());
    for budget in [0, UNLIMITED] {
        let mut simulation = chain(setup, "velocity-verlet");
        gradient(&mut simulation, STEPS, &mut loss("y_last"), &mut [], budget).unwrap();
        assert_eq!(simulation.positions(), alone.positions());
        assert_eq!(simulation.state().step, STEPS);
    }
}

// Explicit kicks under drag are exact flows, and each scheme has its own way: differences of runs are what
// the derivatives are compared with. At a change of 1e-5 they are good to 1e-10 by the third derivative,
// and to 1e-11 by rounding.
#[test]
fn ether_drag_is_part_of_every_scheme() {
    let setup = &case("chain")["setup"];
    let dragged = |scheme| {
        let mut simulation = chain(setup, scheme);
        simulation.system_mut().set_ether_drag(0.8);
        simulation
    };
    for scheme in ["symplectic-euler", "velocity-verlet", "yoshida4", "rk4", "bdf2", "generalised-alpha(.5)"]
    {
        let found = gradient(&mut dragged(scheme), STEPS, &mut loss("y_last"), &mut [], UNLIMITED).unwrap();
        for (i, by) in [(5, found.position[5]), (14, found.velocity[4])] {
            let moved = |change: f64| {
                let mut simulation = dragged(scheme);
                let state = simulation.state_mut();
                match i {
                    5 => state.x_mut()[5] += change,
                    _ => state.v_mut()[4] += change,
                }
                (0..STEPS).for_each(|_| simulation.step().unwrap());
                simulation.state().x()[9]
            };
            let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert!((difference - by).abs() < 1e-9, "{scheme} {i}: {by}, by differences {difference}");
        }
    }
}
