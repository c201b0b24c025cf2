//! Step sizes that follow the error.

use std::sync::atomic::AtomicBool;

use pliant::control::StepControl;
use pliant::integrator::Method;
use pliant::integrator::estimate::Tolerances;
use pliant::observer::{Frame, Observer, ObserverError};
use pliant::run::{Outcome, Plan, run};
use pliant::simulation::{Simulation, StepError};
use pliant::solver::{LinearSolver, SolverOptions};

use crate::support::particles::{SOFT_DOUBLE_PENDULUM_X, kepler, soft_double_pendulum, spring_pendulum};
use crate::support::{distance, method, methods};

/// Lets the steps of `simulation` follow the error, `tolerance` relative to the scene's own scales.
fn adaptive(mut simulation: Simulation, tolerance: f64) -> Simulation {
    let tolerances = Tolerances {
        position: tolerance * simulation.length_scale(),
        velocity: tolerance * simulation.speed_scale(),
        relative: tolerance,
    };
    simulation.set_step_control(StepControl { tolerances, first: None, smallest: 0.0, largest: 1.0 });
    simulation
}

/// Goes to `time`, and exactly there.
fn go_to(simulation: &mut Simulation, time: f64) {
    while simulation.state().time < time {
        simulation.step_towards(time).unwrap();
    }
    assert_eq!(simulation.state().time.to_bits(), time.to_bits());
}

/// Schemes whose error a companion estimates.
fn pairs() -> impl Iterator<Item = Method> {
    methods().filter(|method| method.is_adaptive() && !method.has_own_criterion())
}

// A2: Kepler's equation in 40 digits, e = 0.9, where the step has to change by (1 + e)^1.5 / (1 - e)^1.5 =
// 83.
const ECCENTRIC_T_10: [f64; 4] =
    [-1.853_853_709_405_579_2, -0.130_885_404_839_925_55, 0.161_569_452_558_431_34, -0.223_719_276_791_897_1];

/// Error at t = 10 of the orbit of eccentricity 0.9, steps taken and steps taken back.
fn eccentric_orbit(method: Method, tolerance: f64) -> (f64, u64, u64) {
    let mut simulation = adaptive(kepler(method, 0.9, 1.0), tolerance);
    go_to(&mut simulation, 10.0);
    let state = simulation.state();
    let error = distance(&[&state.x()[2..], &state.v()[2..]].concat(), &ECCENTRIC_T_10);
    let work = simulation.work();
    (error, work.steps, work.rejected_steps.unwrap())
}

// A2: the error is in proportion to the tolerance, and the steps grow with the root that the order of the
// estimate promises.
#[test]
fn errors_follow_the_tolerance_on_an_eccentric_orbit() {
    for (name, tolerances) in [("bogacki-shampine3", [1e-5, 1e-7]), ("dormand-prince5", [1e-7, 1e-10])] {
        let method = method(name);
        let [(coarse, few, _), (fine, many, rejected)] = tolerances.map(|t| eccentric_orbit(method, t));
        let ratio = tolerances[0] / tolerances[1];
        let measured = (coarse / fine).log(ratio);
        assert!((0.75..1.25).contains(&measured), "{name}: {coarse:e} to {fine:e}, exponent {measured}");
        let k = f64::from(method.error_exponent().unwrap());
        let growth = (many as f64 / few as f64).log(ratio) * k;
        assert!((0.85..1.15).contains(&growth), "{name}: {few} to {many} steps, exponent {growth} / k");
        assert!(rejected * 20 < many, "{name} takes back {rejected} of {} steps", many + rejected);
    }
    let (error, steps, _) = eccentric_orbit(method("dormand-prince5"), 1e-10);
    // Fixed steps of the size that the perihelion needs would be thirty times as many.
    assert!(error < 1e-6 && steps < 2000, "off by {error:e} after {steps} steps");
}

// E: the estimate is of the order that the controller takes it for.
#[test]
fn estimates_shrink_with_the_documented_power_of_the_step() {
    for method in pairs() {
        let name = method.documentation.name;
        let estimate = |h: f64| {
            // The first step alone, as large as it is told; tolerances so wide that it stands, and absolute.
            let mut simulation = soft_double_pendulum(method, h);
            let tolerances = Tolerances { position: 1e3, velocity: 1e3, relative: 0.0 };
            let control = StepControl { tolerances, first: Some(h), smallest: 0.0, largest: h };
            simulation.set_step_control(control);
            simulation.estimate_of_a_step(h).unwrap()
        };
        let h = if method.documentation.order > 4 { 0.04 } else { 0.01 };
        let measured = (estimate(h) / estimate(0.5 * h)).log2();
        let k = f64::from(method.error_exponent().unwrap());
        assert!((measured - k).abs() < 0.2, "{name}: {measured}, documented {k}");
    }
}

/// Times of frames, bit by bit.
struct Times(Vec<u64>);

impl Observer for Times {
    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        self.0.push(frame.time.to_bits());
        Ok(())
    }
}

// E: all schemes must land on the common times exactly; steps there are not tiny ones.
#[test]
fn frames_are_hit_to_the_last_bit_without_tiny_steps() {
    for method in pairs() {
        let name = method.documentation.name;
        let plan = Plan { duration: 1.05, rate: 30.0 };
        let mut times = Times(vec![]);
        let mut simulation = adaptive(soft_double_pendulum(method, 1.0), 1e-6);
        let summary = run(&mut simulation, &plan, &mut [&mut times], &AtomicBool::new(false));
        assert!(matches!(summary.outcome, Outcome::Done), "{name}");
        let mut expected: Vec<u64> = (0..32).map(|i| (f64::from(i) / 30.0).to_bits()).collect();
        expected.push(1.05f64.to_bits());
        assert_eq!(times.0, expected, "{name}");

        let mut simulation = adaptive(soft_double_pendulum(method, 1.0), 1e-6);
        for frame in 1..=30 {
            let (target, mut smallest, mut largest) = (f64::from(frame) / 30.0, f64::INFINITY, 0.0f64);
            while simulation.state().time < target {
                let before = simulation.state().time;
                simulation.step_towards(target).unwrap();
                let h = simulation.state().time - before;
                (smallest, largest) = (smallest.min(h), largest.max(h));
            }
            assert!(frame < 4 || smallest > 0.2 * largest, "{name}: steps from {smallest:e} to {largest:e}");
        }
    }
}

// A6, k = 1e6, t = 1: the fast mode is 1000 rad/s, and explicit steps are held at the limit of stability by
// the error alone.
#[test]
fn explicit_pairs_follow_the_stiff_pendulum_and_take_steps_back() {
    let expected =
        [-0.853_380_064_222_92, -0.521_294_613_602_41, -0.340_405_909_139_74, 0.549_469_082_835_49];
    for (name, tolerance, bar) in [("bogacki-shampine3", 8e-8, 1e-3), ("dormand-prince5", 1e-6, 1e-3)] {
        let mut simulation = adaptive(spring_pendulum(method(name), 1e6, 1.0), tolerance);
        go_to(&mut simulation, 1.0);
        let state = simulation.state();
        let error = distance(&[&state.x()[2..], &state.v()[2..]].concat(), &expected);
        assert!(error < bar, "{name} is off by {error:e}");
        let work = simulation.work();
        let rejected = work.rejected_steps.unwrap();
        assert!(rejected > 0, "{name} took no step back");
        assert!(rejected < work.steps / 4, "{name}: {rejected} taken back of {}", work.steps);
        let per_step = u64::from(method(name).documentation.force_evaluations);
        // Those at the start, and one more where the first of a step is not the last of the one before.
        let most = per_step * (work.steps + rejected) + 2 * rejected + 5;
        assert!(work.force_evaluations <= most, "{name}: {} evaluations", work.force_evaluations);
    }
}

// A6: the first step is found, neither far too small nor taken back.
#[test]
fn the_first_step_is_of_the_size_that_the_tolerance_asks_for() {
    for method in pairs() {
        let name = method.documentation.name;
        let mut simulation = adaptive(soft_double_pendulum(method, 1.0), 1e-6);
        let first = simulation.step_size();
        simulation.step().unwrap();
        assert_eq!(simulation.work().rejected_steps, Some(0), "{name} takes its first step back");
        for _ in 0..20 {
            simulation.step().unwrap();
        }
        let ratio = simulation.step_size() / first;
        assert!((0.1..100.0).contains(&ratio), "{name}: from {first:e} to {:e}", simulation.step_size());
    }
}

// Promise 2: a step size that falls below the smallest is an error with step, time and sizes; the state is
// the last good one.
#[test]
fn a_step_that_would_have_to_be_too_small_is_reported() {
    let mut simulation = spring_pendulum(method("dormand-prince5"), 1e6, 1.0);
    let tolerances = Tolerances { position: 1e-10, velocity: 1e-8, relative: 0.0 };
    let control = StepControl { tolerances, first: Some(0.01), smallest: 1e-3, largest: 1.0 };
    simulation.set_step_control(control);
    let before = simulation.state().x().to_vec();
    let error = simulation.step().unwrap_err();
    let StepError::StepTooSmall { step, time, smallest, error: Some(estimate), .. } = error else {
        panic!("{error}")
    };
    assert_eq!((step, time, smallest), (1, 0.0, 1e-3));
    assert!(estimate > 1.0);
    assert_eq!(simulation.state().x(), before);
    assert_eq!(simulation.state().time, 0.0);
    let said = error.to_string();
    assert!(said.contains("step 1 ") && said.contains("allowed is 1 ms"), "{said}");
}

/// The stiff pendulum to t = 10: its angle less that of the inextensible one, and all steps, those taken
/// back too.
fn over_the_fast_mode(name: &str, linear: LinearSolver, tolerance: f64) -> (f64, u64) {
    let mut simulation = spring_pendulum(method(name), 1e6, 1.0);
    simulation.set_solver(SolverOptions { tolerance: Some(1e-15), linear, ..SolverOptions::default() });
    let mut simulation = adaptive(simulation, tolerance);
    go_to(&mut simulation, 10.0);
    let x = simulation.state().x();
    let work = simulation.work();
    (x[2].atan2(-x[3]) + 0.651_863_046_741_975_93, work.steps + work.rejected_steps.unwrap())
}

// A6, k = 1e6: the fast mode of 1000 rad/s is at rest on the slow motion, and L-stable pairs step over it
// where the estimate is filtered, by a factor or by conjugate gradients.
#[test]
fn the_filtered_estimate_steps_over_the_fast_mode() {
    let [by_factor, by_iterations] = [LinearSolver::Cholesky, LinearSolver::Cg].map(|linear| {
        let (angle, steps) = over_the_fast_mode("tr-bdf2", linear, 1e-4);
        assert!(angle.abs() < 2e-2, "{linear:?}: off by {angle:e} rad");
        // Ten seconds in steps of a millisecond would be 10,000.
        assert!(steps < 3000, "{linear:?}: {steps} steps");
        steps as f64
    });
    // The estimate that is not filtered takes a fifth more.
    assert!((by_iterations / by_factor - 1.0).abs() < 0.05, "{by_iterations} {by_factor}");
}

// A1: both have the stability function (1 + (1 - 2 gamma) w)/(1 - gamma w)^2, and so the same error on a
// linear problem, to the last bit of theory. A companion of order 1 made the estimate of SDIRK2 1 / (h omega)
// times as large.
#[test]
fn sdirk2_estimates_the_error_that_it_makes() {
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let steps = |name: &str| {
            let mut simulation = adaptive(soft_double_pendulum(method(name), 1.0), tolerance);
            go_to(&mut simulation, 1.0);
            let error = distance(&simulation.state().x()[2..], &SOFT_DOUBLE_PENDULUM_X);
            (simulation.work().steps, error)
        };
        let ((sdirk, error), (bdf, other)) = (steps("sdirk2"), steps("tr-bdf2"));
        assert!(sdirk < 2 * bdf, "{tolerance:e}: {sdirk} steps, where tr-bdf2 takes {bdf}");
        assert!(error < 5.0 * other, "{tolerance:e}: off by {error:e}, tr-bdf2 by {other:e}");
    }
}

// A6: SDIRK2 is of stage order 1: in steps of 10 ms it is off by 0.17 rad. Its estimate sees that, and takes
// smaller ones, far fewer than the fast mode would take.
#[test]
fn the_estimate_of_sdirk2_sees_its_order_reduction() {
    let (angle, steps) = over_the_fast_mode("sdirk2", LinearSolver::Auto, 5e-5);
    assert!(
        angle.abs() < 0.02 && (2000..10_000).contains(&steps),
        "off by {angle:e} rad after {steps} steps"
    );
}

// E: the tolerance of Newton's method is tied to the error of a step: loose steps are solved loosely, and
// what is left adds next to nothing to the error.
#[test]
fn solves_are_as_accurate_as_steps_need() {
    for (name, tolerance, cheaper) in
        [("tr-bdf2", 1e-3, true), ("sdirk3", 1e-3, true), ("tr-bdf2", 1e-8, false), ("sdirk4", 1e-11, false)]
    {
        let [tied, to_rounding] = [None, Some(1e-15)].map(|newton| {
            let mut simulation = soft_double_pendulum(method(name), 1.0);
            simulation.set_solver(SolverOptions { tolerance: newton, ..SolverOptions::default() });
            let mut simulation = adaptive(simulation, tolerance);
            go_to(&mut simulation, 1.0);
            simulation
        });
        let x = |simulation: &Simulation| simulation.state().x()[2..].to_vec();
        let error = distance(&x(&to_rounding), &SOFT_DOUBLE_PENDULUM_X);
        let added = distance(&x(&tied), &x(&to_rounding));
        let iterations = |simulation: &Simulation| {
            simulation.work().solver.unwrap().newton_iterations as f64 / simulation.work().steps as f64
        };
        let (few, many) = (iterations(&tied), iterations(&to_rounding));
        assert!(added < 0.2 * error, "{name} at {tolerance:e}: {added:e} beside {error:e}");
        assert!(
            !cheaper || few < 0.75 * many,
            "{name} at {tolerance:e}: {few} iterations a step, {many} to rounding"
        );
    }
}
