//! A mass on a spring whose other end is moved: prescribed positions are right at every stage, and holds let
//! go.

use pliant::constraint::{Hold, Motion, Rotation};
use pliant::energy::spring::Springs;
use pliant::integrator::IntegratorSpec;
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;

use crate::support::{advance, distance, solve_to_rounding};

const MASS: f64 = 2.0;
const STIFFNESS: f64 = 18.0;
/// Of the mass on its spring, `sqrt(k/m)` [rad/s], and of the moving end.
const OMEGA: f64 = 3.0;
const DRIVE: f64 = 2.0;

/// Every scheme but static equilibrium.
fn dynamic() -> impl Iterator<Item = IntegratorSpec> {
    IntegratorSpec::ALL.iter().copied().filter(|spec| spec.method().documentation.order > 0)
}

/// A spring of rest length zero from the origin, held as said, to a mass at rest at (1, 0).
fn on_a_spring(spec: IntegratorSpec, h: f64, hold: impl Fn(Hold, &[f64]) -> Hold) -> Simulation {
    let mut system = System::new(2, vec![1.0, MASS]);
    system.add_term(Box::new(Springs::<2>::new("spring", &[[0, 1]], &[STIFFNESS], &[0.0], 2)));
    let start = vec![0.0, 0.0, 1.0, 0.0];
    system.hold(hold(Hold::new("end", vec![0]), &start));
    let mut simulation = Simulation::new(system, State::new(start, vec![0.0; 4]), spec.method(), h);
    solve_to_rounding(&mut simulation);
    simulation
}

/// The end goes along `0.5 sin(2 t)` in x, and in y on a circle of radius 0.2 about (-0.2, 0) seen from the
/// side.
fn driven(spec: IntegratorSpec, h: f64) -> Simulation {
    on_a_spring(spec, h, |hold, start| {
        let (sin, cos) = (|t: f64| 0.5 * (DRIVE * t).sin(), |t: f64| 0.5 * DRIVE * (DRIVE * t).cos());
        let rotation = Rotation::new([-0.2, 0.0, 0.0], [0.0, 0.0, 1.0], |t| (DRIVE * t, DRIVE));
        let path = move |t: f64| ([sin(t), 0.0, 0.0], [cos(t), 0.0, 0.0]);
        hold.moving(Motion::new().turning(rotation).along(path), start, start, 2)
    })
}

/// `x'' = -omega^2 (x - a cos(Omega t) - b sin(Omega t) - c)`, `x(0) = x0`, `x'(0) = 0`: position and
/// velocity at `t`.
fn exact(x0: f64, [a, b, c]: [f64; 3], t: f64) -> [f64; 2] {
    let gain = OMEGA * OMEGA / (OMEGA * OMEGA - DRIVE * DRIVE);
    let (free_cos, free_sin) = (x0 - c - gain * a, -gain * b * DRIVE / OMEGA);
    let (sd, cd, so, co) = ((DRIVE * t).sin(), (DRIVE * t).cos(), (OMEGA * t).sin(), (OMEGA * t).cos());
    [
        c + gain * (a * cd + b * sd) + free_cos * co + free_sin * so,
        gain * DRIVE * (b * cd - a * sd) + OMEGA * (free_sin * co - free_cos * so),
    ]
}

/// Errors of position and velocity of the mass at t = 1, and of the energy there is less the work of the
/// moving end.
fn errors(spec: IntegratorSpec, steps: usize) -> [f64; 3] {
    let mut simulation = driven(spec, 1.0 / steps as f64);
    let before = simulation.diagnostics().total;
    advance(&mut simulation, steps);
    let diagnostics = simulation.diagnostics();
    let work = diagnostics.balance.unwrap().motion.unwrap();
    // As much as the mass had to begin with.
    assert!(work.abs() > 1.0, "{work}");
    let (x, y) = (exact(1.0, [0.2, 0.5, -0.2], 1.0), exact(0.0, [0.0, 0.2, 0.0], 1.0));
    let state = simulation.state();
    // The end is where it has to be, to rounding.
    let end = [0.5 * DRIVE.sin() - 0.2 + 0.2 * DRIVE.cos(), 0.2 * DRIVE.sin()];
    let speed = [DRIVE * (0.5 * DRIVE.cos() - 0.2 * DRIVE.sin()), 0.2 * DRIVE * DRIVE.cos()];
    assert!(distance(&state.x()[..2], &end) < 1e-14, "{:?} {end:?}", state.x());
    assert!(distance(&state.v()[..2], &speed) < 1e-14, "{:?} {speed:?}", state.v());
    [
        distance(&state.x()[2..], &[x[0], y[0]]),
        distance(&state.v()[2..], &[x[1], y[1]]),
        (diagnostics.total - work - before).abs(),
    ]
}

// A8: the stages of a step see the moving end where it is at their times, and its work is known as well as
// the state.
#[test]
fn every_scheme_keeps_its_order_with_a_moving_end() {
    // Order 15 is not to be seen in double precision.
    for spec in dynamic().filter(|spec| spec.method().documentation.order < 10) {
        let documentation = spec.method().documentation;
        let (name, order) = (documentation.name, f64::from(documentation.order));
        let steps = if order < 2.5 {
            400
        } else if order < 4.5 || documentation.solves == 0 {
            80
        } else {
            40
        };
        let (coarse, fine) = (errors(spec, steps), errors(spec, 2 * steps));
        let quantities = ["position", "velocity", "balance of energy"];
        for (quantity, (coarse, fine)) in quantities.iter().zip(coarse.iter().zip(fine)) {
            // Work is integrated to fourth order.
            let order = if *quantity == "balance of energy" { order.min(4.0) } else { order };
            let measured = (coarse / fine).log2();
            // A NaN does not agree.
            let agrees = (measured - order).abs() < 0.15;
            assert!(agrees, "{name}: {quantity} has order {measured:.3}, documented {order} ({fine:e})");
        }
    }
}

/// Let go at a time on a step or within one, the end flies on as it moved; the step is the nearest.
#[test]
fn a_hold_lets_go_at_the_step_nearest_to_its_end() {
    for (until, steps) in [(0.5, 5), (0.54, 5), (0.56, 6), (0.0, 0)] {
        let mut simulation = on_a_spring(IntegratorSpec::VelocityVerlet, 0.1, |hold, start| {
            let path = |t: f64| ([0.0, 0.25 * t, 0.0], [0.0, 0.25, 0.0]);
            hold.until(until).moving(Motion::new().along(path), start, start, 2)
        });
        for step in 1..=8 {
            let held = simulation.system().structure();
            let before = simulation.state().clone();
            simulation.step().unwrap();
            let moved = simulation.state().x()[1];
            if step <= steps {
                assert_eq!(simulation.system().structure(), held);
                assert!((moved - 0.25 * simulation.state().time).abs() < 1e-15, "{until}: {moved} at {step}");
            } else {
                // One step of velocity Verlet from there, mass 1.
                let [x0, y0, x1, y1] = before.x().try_into().unwrap();
                let expected = [
                    x0 + 0.1 * before.v()[0] + 0.005 * STIFFNESS * (x1 - x0),
                    y0 + 0.1 * before.v()[1] + 0.005 * STIFFNESS * (y1 - y0),
                ];
                assert!(distance(&simulation.state().x()[..2], &expected) < 1e-14, "{until} at {step}");
                assert_eq!(simulation.system().structure() != held, step == steps + 1);
            }
        }
    }
}

/// One coordinate held, the other free: a bead on a wire.
#[test]
fn single_coordinates_are_held() {
    for spec in dynamic() {
        let mut simulation = on_a_spring(spec, 0.01, |hold, _| hold.along([true, false, true]));
        simulation.state_mut().x_mut()[3] = 0.5;
        advance(&mut simulation, 20);
        let x = simulation.state().x();
        assert!(x[0] == 0.0 && x[1] > 0.05, "{}: {x:?}", spec.method().documentation.name);
    }
}

/// Vertices that are let go later count for the largest step: free, the end of 1 kg oscillates faster than
/// the mass of 2 kg alone.
#[test]
fn the_stability_limit_is_that_after_the_release() {
    let limit = |until: f64| {
        let mut simulation = on_a_spring(IntegratorSpec::VelocityVerlet, 0.01, |hold, _| hold.until(until));
        simulation.stability_limit(1.0).unwrap().frequency
    };
    assert!((limit(f64::INFINITY) - OMEGA).abs() < 1e-6);
    assert!((limit(0.3) - (STIFFNESS * 1.5_f64).sqrt()).abs() < 1e-6);
}

/// A motion without a value is a step that cannot be taken.
#[test]
fn a_motion_that_is_not_finite_ends_the_run_at_its_vertex() {
    for spec in dynamic() {
        let mut simulation = on_a_spring(spec, 0.1, |hold, start| {
            let path = |t: f64| ([(0.45 - t).sqrt(), 0.0, 0.0], [0.0; 3]);
            hold.moving(Motion::new().along(path), start, start, 2)
        });
        let error = (0..9).find_map(|_| simulation.step().err()).unwrap();
        let text = error.to_string();
        assert!(
            text.contains("step 5") && text.contains("the motion of pin `end` has no finite value"),
            "{text}"
        );
        assert!(simulation.state().x().iter().all(|x| x.is_finite()));
    }
}

/// The end of the spring jumps by 0.3 m: at once, so that what it gives is the energy of the spring after
/// less that before, the mass being where it was, `k/2 ((x - 0.3)^2 - x^2)` with `x = cos(3 t)`. Within a
/// step or at its end, the error is of the order of the step.
#[test]
fn the_energy_of_a_jump_is_counted_and_the_jump_is_named() {
    const JUMP: f64 = 0.3;
    for spec in [IntegratorSpec::VelocityVerlet, IntegratorSpec::Rk4, IntegratorSpec::ImplicitMidpoint] {
        let name = spec.method().documentation.name;
        for at in [0.5, 0.4937] {
            let errors = |steps: usize| {
                let mut simulation = on_a_spring(spec, 1.0 / steps as f64, |hold, start| {
                    let path = move |t: f64| ([if t < at { 0.0 } else { JUMP }, 0.0, 0.0], [0.0; 3]);
                    hold.moving(Motion::new().along(path), start, start, 2)
                });
                let before = simulation.diagnostics().total;
                advance(&mut simulation, steps);
                let jumps = simulation.motion_jumps().unwrap();
                assert_eq!((jumps.pin.as_str(), jumps.count, jumps.size), ("end", 1, JUMP), "{name}");
                assert!((jumps.time - at).abs() < 1e-12, "{name}: {jumps:?}");
                let end = simulation.diagnostics();
                let work = end.balance.unwrap().motion.unwrap();
                let x = (OMEGA * at).cos();
                let exact = 0.5 * STIFFNESS * ((x - JUMP).powi(2) - x * x);
                assert!(exact.abs() > 0.3, "{exact}");
                [(work - exact).abs(), (end.total - work - before).abs()]
            };
            let (coarse, fine) = (errors(400), errors(3200));
            for (coarse, fine) in coarse.into_iter().zip(fine) {
                // The mass moves by 3 m/s, the force of the end changes by 5.4 N: in a step of h less than 17
                // W h.
                assert!(coarse < 17.0 / 400.0 && fine < 17.0 / 3200.0, "{name}: {coarse:e} J, {fine:e} J");
            }
        }
    }
}
