//! Steps that are not solved, taken in parts.

use pliant::energy::gravity::UniformGravity;
use pliant::energy::spring::Springs;
use pliant::energy::{Driven, EnergyKind, EnergyTerm, Fault, TermProperties, TermViews};
use pliant::integrator::Method;
use pliant::simulation::{Retried, RetriedSteps, Simulation, StepError};
use pliant::solver::SolverOptions;
use pliant::state::State;
use pliant::system::System;

use crate::support::particles::{SOFT_DOUBLE_PENDULUM_V, SOFT_DOUBLE_PENDULUM_X};
use crate::support::{advance, distance, method, methods};

/// No force at all, but where it refuses to be evaluated: so often in each window `(i width, (i + 1) width]`
/// of time as `budget` says.
struct Refusing {
    width: f64,
    budget: fn(usize) -> u32,
    spent: Vec<u32>,
    time: f64,
    refuses: bool,
}

impl EnergyTerm for Refusing {
    fn name(&self) -> String {
        "what refuses".into()
    }

    fn properties(&self) -> TermProperties {
        TermProperties { changes_with_time: true, ..TermProperties::of(EnergyKind::Load) }
    }

    fn energy(&mut self, _: &[f64]) -> f64 {
        0.0
    }

    fn evaluate(&mut self, _: &[f64]) -> bool {
        let window = ((self.time / self.width - 1e-6).ceil().max(1.0) - 1.0) as usize;
        self.spent.resize(self.spent.len().max(window + 1), 0);
        self.refuses = self.time > 0.0 && self.spent[window] < (self.budget)(window);
        self.spent[window] += u32::from(self.refuses);
        !self.refuses
    }

    fn add_rows(&self, _: usize, g: &mut [f64]) {
        if self.refuses {
            g.fill(f64::NAN);
        }
    }

    fn add_hessian_product(&mut self, _: &[f64], _: &[f64], _: &mut [f64]) {}

    fn fault(&self, _: &[f64]) -> Option<Fault> {
        self.refuses.then(|| Fault::Load { load: "what refuses".into(), time: self.time })
    }
}

impl TermViews for Refusing {
    fn driven(&mut self) -> Option<&mut dyn Driven> {
        Some(self)
    }
}

impl Driven for Refusing {
    fn set_time(&mut self, time: f64) {
        self.time = time;
    }
}

/// The soft double pendulum in steps of `h`, which may be halved `retries` times, with what refuses.
fn pendulum(method: Method, h: f64, retries: u32, width: f64, budget: fn(usize) -> u32) -> Simulation {
    let mass = vec![1.0, 1.0, 2.0];
    let mut system = System::new(2, mass.clone());
    let springs = Springs::<2>::new("pendulum", &[[0, 1], [1, 2]], &[10.0, 10.0], &[1.0, 0.8], 3);
    system.add_term(Box::new(springs));
    system.add_term(Box::new(UniformGravity::new(&[0.0, -9.81], &mass)));
    system.add_term(Box::new(Refusing { width, budget, spent: vec![], time: 0.0, refuses: false }));
    system.pin(&[0]);
    let state = State::new(vec![0.0, 0.0, 1.1, -0.2, 1.7, 0.4], vec![0.0, 0.0, 0.0, 0.5, -1.0, 0.0]);
    let mut simulation = Simulation::new(system, state, method, h);
    simulation.set_solver(SolverOptions { tolerance: Some(1e-15), retries, ..SolverOptions::default() });
    simulation
}

fn implicit() -> impl Iterator<Item = Method> {
    methods().filter(|method| method.documentation.solves > 0)
}

fn apart(a: &Simulation, b: &Simulation) -> f64 {
    distance(a.state().x(), b.state().x()) + distance(a.state().v(), b.state().v())
}

// A8: whole steps, halves and quarters take turns, and every scheme keeps its order.
#[test]
fn schemes_keep_their_order_where_steps_are_taken_in_parts() {
    for method in implicit() {
        let documentation = method.documentation;
        let errors = |steps: u32| {
            let h = 1.0 / f64::from(steps);
            // Whole; in halves; the first half in quarters; whole.
            let mut simulation = pendulum(method, h, 2, h, |window| [0, 1, 2, 0][window % 4]);
            advance(&mut simulation, steps as usize);
            let (quarter, work) = (u64::from(steps / 4), simulation.work());
            let expected = RetriedSteps { steps: 2 * quarter, parts: 5 * quarter, halvings: 2 };
            assert_eq!(work.retried, Some(expected), "{}", documentation.name);
            assert_eq!(work.steps, u64::from(steps));
            assert_eq!(simulation.state().time, f64::from(steps) * h);
            let state = simulation.state();
            [
                distance(&state.x()[2..], &SOFT_DOUBLE_PENDULUM_X),
                distance(&state.v()[2..], &SOFT_DOUBLE_PENDULUM_V),
            ]
        };
        let steps = match documentation.order {
            1 => 4000,
            2 => 400,
            3 => 100,
            _ => 48,
        };
        let (coarse, fine) = (errors(steps), errors(2 * steps));
        for (coarse, fine) in coarse.into_iter().zip(fine) {
            let measured = (coarse / fine).log2();
            let agrees = (measured - f64::from(documentation.order)).abs() < 0.2;
            assert!(agrees, "{}: order {measured:.3}, {fine:e}", documentation.name);
        }
    }
}

// A step in halves is two steps of half the size: those of several steps remember the halves.
#[test]
fn halves_are_steps_of_half_the_size() {
    for method in implicit() {
        let h = 0.05;
        let mut in_halves = pendulum(method, h, 1, h, |_| 1);
        let mut small = pendulum(method, 0.5 * h, 0, h, |_| 0);
        advance(&mut in_halves, 20);
        advance(&mut small, 40);
        let name = method.documentation.name;
        assert_eq!(
            in_halves.work().retried,
            Some(RetriedSteps { steps: 20, parts: 40, halvings: 1 }),
            "{name}"
        );
        assert_eq!(in_halves.state().time, small.state().time, "{name}");
        assert!(apart(&in_halves, &small) < 1e-12, "{name}: {:e}", apart(&in_halves, &small));
        let mut whole = pendulum(method, h, 1, h, |_| 0);
        advance(&mut whole, 20);
        assert!(apart(&in_halves, &whole) > 1e-9, "{name}");
    }
}

// The state, its memory and the time are taken back to the last bit, and what is tried again later goes on
// as if nothing had happened.
#[test]
fn a_step_that_fails_in_all_parts_is_taken_back() {
    for name in ["implicit-euler", "bdf2", "newmark", "generalised-alpha", "tr-bdf2", "radau-iia3"] {
        let h = 0.01;
        // In the second half of step 11 whole, half and quarter all fail, after the first half was taken.
        let budget = |window| if window == 21 { 3 } else { 0 };
        let mut simulation = pendulum(method(name), h, 2, 0.5 * h, budget);
        let mut plain = pendulum(method(name), h, 2, h, |_| 0);
        advance(&mut simulation, 10);
        advance(&mut plain, 10);
        let before = simulation.snapshot();
        let error = simulation.step().unwrap_err();
        assert_eq!(simulation.snapshot(), before, "{name}");
        let StepError::NotFinite { step: 11, retried: Some(retried), is_implicit: true, .. } = &error else {
            panic!("{name}: {error}")
        };
        let Retried { halvings, step_size, time } = **retried;
        assert_eq!((halvings, step_size), (2, 0.25 * h), "{name}");
        assert!((time - 0.105).abs() < 1e-15, "{name}: {time}");
        let said = error.to_string();
        assert!(said.contains("subdivided down to 1/4, 2.5 ms, the last part at t = 0.105 s"), "{said}");
        assert!(said.contains("more `retries`") && said.contains("1.25 ms"), "{said}");
        assert_eq!(simulation.work().retried, Some(RetriedSteps::default()), "{name}");
        advance(&mut simulation, 10);
        advance(&mut plain, 10);
        assert!(apart(&simulation, &plain) < 1e-13, "{name}: {:e}", apart(&simulation, &plain));
    }
}

/// Without retries the message names them.
#[test]
fn a_step_that_could_be_retried_says_so() {
    let mut simulation = pendulum(method("bdf2"), 0.01, 0, 0.01, |window| u32::from(window == 1));
    advance(&mut simulation, 1);
    let said = simulation.step().unwrap_err().to_string();
    assert!(said.contains("step 2 ") && said.contains("`retries` in [time] solver"), "{said}");
    assert_eq!(simulation.work().retried, None);
    let mut explicit = pendulum(method("rk4"), 0.01, 5, 0.01, |window| u32::from(window == 1));
    advance(&mut explicit, 1);
    let said = explicit.step().unwrap_err().to_string();
    assert!(!said.contains("retries") && !said.contains("subdivide"), "{said}");
}
