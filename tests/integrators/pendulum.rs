//! The spring pendulum: soft, stiff, and on both sides of the stability limit of explicit schemes.

use pliant::integrator::generalised_alpha::GeneralisedAlphaParameters;
use pliant::run::Outcome;

use crate::support::particles::spring_pendulum;
use crate::support::{advance, assert_relative, distance, method, run_watched};

// lecture 9; A6: Taylor series to two tolerances, 13 digits.
#[test]
fn fourth_order_schemes_follow_the_spring_pendulum_to_t_10() {
    let rows = [
        (1e2, [0.539_910_361_879_78, -1.135_311_322_803, -2.197_602_984_866_8, -1.011_214_845_485_9]),
        (1e4, [-0.628_320_523_232_65, -0.779_699_729_578_09, 1.787_286_665_954, -1.508_266_087_798_1]),
    ];
    for (stiffness, expected) in rows {
        for name in ["rk4", "yoshida4"] {
            // One hundredth of the fast period's radian.
            let steps = (10.0 * f64::sqrt(stiffness) * 100.0).max(2e4) as usize;
            let mut simulation = spring_pendulum(method(name), stiffness, 10.0 / steps as f64);
            advance(&mut simulation, steps);
            let state = simulation.state();
            let error = distance(&[&state.x()[2..], &state.v()[2..]].concat(), &expected);
            assert!(error < 1e-8, "{name} at k = {stiffness:e} is off by {error:e}");
        }
    }
}

// lecture 9; A6
#[test]
fn velocity_verlet_follows_the_stiff_pendulum_to_t_1() {
    let expected =
        [-0.853_380_064_222_92, -0.521_294_613_602_41, -0.340_405_909_139_74, 0.549_469_082_835_49];
    let mut simulation = spring_pendulum(method("velocity-verlet"), 1e6, 2e-6);
    advance(&mut simulation, 500_000);
    let state = simulation.state();
    let error = distance(&[&state.x()[2..], &state.v()[2..]].concat(), &expected);
    assert!(error < 1e-6, "off by {error:e}");
}

// lecture 7; A6: at k = 1e6 the limits 2 / omega and 2 sqrt 2 / omega are 2e-3 and 2.83e-3. Positions by an
// independent implementation of each scheme, which blows up at the second step size.
#[test]
fn explicit_schemes_hold_the_stiff_pendulum_below_their_limit_and_report_above() {
    let rows = [
        ("symplectic-euler", 0.0019, [-0.60559588, -0.79579366], 0.0021),
        ("velocity-verlet", 0.0019, [-0.6074021, -0.79441777], 0.0021),
        ("rk4", 0.0028, [-0.60919713, -0.7930316], 0.003),
    ];
    for (name, below, expected, above) in rows {
        let mut simulation = spring_pendulum(method(name), 1e6, below);
        let summary = run_watched(&mut simulation, (10.0 / below).round() * below, 60.0);
        assert!(matches!(summary.outcome, Outcome::Done), "{name} at {below}: {:?}", summary.outcome);
        let error = distance(&simulation.state().x()[2..], &expected);
        assert!(error < 1e-6, "{name} is off by {error:e}");

        let mut simulation = spring_pendulum(method(name), 1e6, above);
        let limit = simulation.stability_limit(10.0).unwrap().step;
        assert!(below < limit && limit < above, "{name}: the limit {limit:e} is between the two");
        let summary = run_watched(&mut simulation, 10.0, 60.0);
        let Outcome::Failed(error) = summary.outcome else {
            panic!("{name} at {above} must not end with {:?}", summary.outcome)
        };
        assert!(error.to_string().contains("above the stability limit"), "{error}");
        assert!(simulation.state().x().iter().all(|x| x.is_finite()), "the state is the last good one");
    }
}

/// State of the stiff pendulum, k = 1e6, after 10 s: its angle less that of the inextensible one, and the
/// energy gained [J].
fn after_ten_seconds(name: &str, steps: usize) -> (f64, f64) {
    let mut simulation = spring_pendulum(method(name), 1e6, 10.0 / steps as f64);
    let start = simulation.diagnostics().total;
    advance(&mut simulation, steps);
    let x = simulation.state().x();
    (x[2].atan2(-x[3]) + 0.651_863_046_741_975_93, simulation.diagnostics().total - start)
}

// A6: h = 0.01 is ten times what the stiff spring would need, an independent implementation of each scheme;
// two digits are known.
#[test]
fn implicit_schemes_swing_the_stiff_pendulum_as_an_independent_code_finds() {
    let rows = [
        ("implicit-euler", 0.83, -3.55),
        ("bdf2", -1.5e-2, -1.3e-2),
        ("tr-bdf2", -2.5e-3, -7.0e-4),
        ("implicit-midpoint", -4.4e-3, 2.9e-3),
        ("trapezoid", -4.7e-3, -7.1e-4),
        ("generalised-alpha", -4.6e-3, 2.7e-3),
        ("sdirk2", 0.173, -0.62),
        ("sdirk3", 0.208, -0.74),
        ("crouzeix3", -5.8e-4, -8.9e-4),
        ("sdirk4", -0.62, 2.62),
        ("radau-iia2", -1.7e-4, -3.6e-4),
        ("radau-iia3", -2.69e-4, -1.2e-5),
    ];
    for (name, angle, energy) in rows {
        let (measured_angle, measured_energy) = after_ten_seconds(name, 1000);
        assert_relative(measured_angle, angle, 0.05, &format!("{name}: angle"));
        assert_relative(measured_energy, energy, 0.05, &format!("{name}: energy"));
    }
}

// A6: Gauss is exact to the digits given; its energy is that of a scheme without damping, -9e-7 J.
#[test]
fn gauss_swings_the_stiff_pendulum_as_an_independent_code_finds() {
    let (angle, energy) = after_ten_seconds("gauss2", 1000);
    assert_relative(angle, -2.69e-4, 0.01, "angle");
    assert!((energy + 9e-7).abs() < 5e-7, "{energy:e} J");
}

// A6: h = 1/32, h omega = 31, every step solved: the energy gained after 10 s. Stage order decides, not
// L-stability: SDIRK4 gains.
#[test]
fn at_h_omega_of_31_stage_order_decides_what_becomes_of_energy() {
    let alpha = |rho: f64| GeneralisedAlphaParameters { rho }.method();
    let rows = [
        (method("radau-iia2"), -0.008_193),
        (method("gauss2"), 0.0369),
        (alpha(0.0), -0.5452),
        (alpha(0.5), 0.1162),
        (alpha(0.8), 0.198),
        (method("sdirk2"), -2.417),
        (method("sdirk3"), -2.161),
        (method("sdirk4"), 5.586),
        (method("implicit-midpoint"), 0.210_68),
        (method("trapezoid"), -0.012_34),
        (method("radau-iia3"), -2e-5),
    ];
    for (method, expected) in rows {
        let mut simulation = spring_pendulum(method, 1e6, 1.0 / 32.0);
        let start = simulation.diagnostics().total;
        advance(&mut simulation, 320);
        let gained = simulation.diagnostics().total - start;
        assert_relative(gained, expected, 2e-3, method.documentation.name);
    }
}

// A6: h omega of 31, 50 and 100, every step solved. Schemes without damping gain energy without bound,
// however well their steps are solved; implicit Euler, BDF2 and TR-BDF2 never do.
#[test]
fn at_large_steps_damping_schemes_lose_energy_and_undamped_ones_gain_it() {
    let rows = [
        ("implicit-euler", [-4.755, -4.880, -4.905]),
        ("bdf2", [-0.300_09, -0.969_79, -3.1683]),
        ("tr-bdf2", [-0.023_202, -0.092_236, -0.578_86]),
    ];
    for (name, expected) in rows {
        for (steps, expected) in [320, 200, 100].into_iter().zip(expected) {
            let (_, energy) = after_ten_seconds(name, steps);
            assert_relative(energy, expected, 0.01, &format!("{name} in {steps} steps"));
        }
    }
    for name in ["implicit-midpoint", "trapezoid"] {
        for steps in [200, 100] {
            let mut simulation = spring_pendulum(method(name), 1e6, 10.0 / steps as f64);
            let start = simulation.diagnostics().total;
            let mut highest = 0.0f64;
            for _ in 0..steps {
                simulation.step().unwrap();
                highest = highest.max(simulation.diagnostics().total - start);
            }
            assert!(highest > 10.0, "{name} in {steps} steps gains {highest} J");
        }
    }
}

// A step that fails, or is taken back because the force at its end is not finite, leaves state and memory as
// they were.
#[test]
fn a_step_from_elsewhere_that_fails_leaves_the_memory_of_a_scheme() {
    for name in ["implicit-euler", "newmark", "generalised-alpha", "bdf2", "tr-bdf2", "sdirk4"] {
        let build = || spring_pendulum(method(name), 1e4, 0.01);
        let (mut simulation, mut undisturbed) = (build(), build());
        advance(&mut simulation, 7);
        advance(&mut undisturbed, 7);
        let (x, v) = (simulation.state().x().to_vec(), simulation.state().v().to_vec());
        let (mut far, mut fast) = (vec![0.0, 0.0, f64::NAN, 0.0], v.clone());
        assert!(simulation.advance(&mut far, &mut fast).is_err(), "{name}");
        simulation.state_mut().x_mut().copy_from_slice(&x);
        simulation.state_mut().v_mut().copy_from_slice(&v);
        advance(&mut simulation, 5);
        advance(&mut undisturbed, 5);
        assert_eq!(simulation.state().x(), undisturbed.state().x(), "{name}");
        assert_eq!(simulation.state().v(), undisturbed.state().v(), "{name}");
    }
}
