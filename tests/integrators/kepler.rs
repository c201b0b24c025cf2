//! The Kepler problem, `mu = a = 1`, from perihelion: solved by Kepler's equation in 40 digits.

use std::f64::consts::TAU;

use crate::support::particles::kepler;
use crate::support::{advance, assert_relative, distance, method, methods, run_watched};

/// Eccentricity, time, position, velocity.
const STATES: [(f64, f64, [f64; 2], [f64; 2]); 6] = [
    (
        0.6,
        1.0,
        [-0.628_948_176_826_624_2, 0.799_664_730_970_039_3],
        [-0.982_515_690_938_811_3, -0.022_763_170_097_430_42],
    ),
    (
        0.6,
        10.0,
        [-1.535_023_591_909_813_7, -0.283_668_406_499_780_86],
        [0.227_150_732_077_498_34, -0.479_187_758_203_219_57],
    ),
    (
        0.6,
        100.0,
        [-0.104_183_204_434_180_6, -0.694_741_715_567_950_6],
        [1.236_177_762_687_076_3, 0.564_623_251_085_864_6],
    ),
    (
        0.9,
        1.0,
        [-1.187_188_466_345_863_4, 0.417_527_638_739_764_23],
        [-0.761_142_010_521_491_4, -0.099_472_047_870_273_49],
    ),
    (
        0.9,
        10.0,
        [-1.853_853_709_405_579_2, -0.130_885_404_839_925_55],
        [0.161_569_452_558_431_34, -0.223_719_276_791_897_1],
    ),
    (
        0.9,
        100.0,
        [-0.750_633_333_029_645_2, -0.431_000_027_577_321_34],
        [1.142_347_674_435_413_7, 0.075_219_128_096_267_15],
    ),
];

// lecture 8; A2
#[test]
fn the_fourth_order_schemes_reach_the_states_of_keplers_equation() {
    for (eccentricity, time, x, v) in STATES {
        for name in ["rk4", "yoshida4"] {
            // Perihelion passes at a distance of 1 - e: the step follows (1 - e)^(3/2).
            let steps = (time * if eccentricity < 0.8 { 1e3 } else { 1e4 }).round();
            let mut simulation = kepler(method(name), eccentricity, time / steps);
            advance(&mut simulation, steps as usize);
            let state = simulation.state();
            let error = distance(&state.x()[2..], &x).max(distance(&state.v()[2..], &v));
            assert!(error < 1e-7, "{name}, e = {eccentricity}, t = {time}: off by {error:e}");
        }
    }
}

// lecture 4, 5, 7, 8; A2: |q - q_ref| at e = 0.6, t = 10, computed by an independent implementation of each
// scheme.
#[test]
fn errors_at_e_06_are_those_of_an_independent_implementation() {
    let (_, time, x, _) = STATES[1];
    let rows: [(&str, [u32; 3], [f64; 3]); 13] = [
        ("forward-euler", [50_000, 100_000, 200_000], [7.00e-2, 3.5432e-2, 1.78217e-2]),
        ("symplectic-euler", [8000, 16_000, 32_000], [7.36585e-3, 3.74078e-3, 1.88490e-3]),
        ("rk2-midpoint", [4000, 8000, 16_000], [1.89959e-4, 4.85752e-5, 1.22831e-5]),
        ("velocity-verlet", [2000, 4000, 8000], [1.952e-3, 4.881e-4, 1.220e-4]),
        ("rk4", [500, 1000, 2000], [2.068e-5, 1.113e-6, 6.40e-8]),
        ("yoshida4", [500, 1000, 2000], [3.053e-4, 1.921e-5, 1.203e-6]),
        ("implicit-midpoint", [2000, 4000, 8000], [2.592e-3, 6.479e-4, 1.620e-4]),
        ("generalised-alpha", [2000, 4000, 8000], [2.486e-3, 6.212e-4, 1.553e-4]),
        ("bdf2", [2000, 4000, 8000], [1.177e-2, 3.008e-3, 7.595e-4]),
        ("tr-bdf2", [2000, 4000, 8000], [1.481e-3, 3.712e-4, 9.290e-5]),
        ("sdirk2", [2000, 4000, 8000], [1.929e-4, 4.823e-5, 1.206e-5]),
        ("sdirk3", [2000, 4000, 8000], [4.18e-5, 5.22e-6, 6.53e-7]),
        ("sdirk4", [500, 1000, 2000], [5.735e-6, 3.303e-7, 1.978e-8]),
    ];
    for (name, steps, expected) in rows {
        let mut errors = [0.0; 3];
        for i in 0..3 {
            let mut simulation = kepler(method(name), 0.6, time / f64::from(steps[i]));
            advance(&mut simulation, steps[i] as usize);
            errors[i] = distance(&simulation.state().x()[2..], &x);
            assert_relative(errors[i], expected[i], 0.02, &format!("{name} in {} steps", steps[i]));
        }
        let order = (errors[1] / errors[2]).log2();
        let documented = f64::from(method(name).documentation.order);
        assert!((order - documented).abs() < 0.15, "{name} has order {order:.3}");
    }
}

// lecture 5; A2: kicks along the line to the sun change no angular momentum, drifts none either.
#[test]
fn exactly_the_symplectic_schemes_conserve_angular_momentum_at_any_step() {
    for method in methods() {
        for steps_per_period in [100.0, 1000.0] {
            let mut simulation = kepler(method, 0.6, TAU / steps_per_period);
            let start = simulation.diagnostics().angular_momentum[2];
            assert!((start - 0.8).abs() < 1e-15, "L = sqrt(1 - e^2)");
            // At large steps those that damp fall into the sun, with the energy that they take.
            advance(&mut simulation, if method.documentation.symplectic { 1000 } else { 12 });
            let change = (simulation.diagnostics().angular_momentum[2] / start - 1.0).abs();
            let name = method.documentation.name;
            if method.documentation.symplectic {
                assert!(change < 1e-13, "{name} changes L by {change:e}");
            } else if method.documentation.order < 5
                || method.documentation.order < 10 && steps_per_period < 1000.0
            {
                // Small steps of order 5 are too accurate to tell, and any of order 15.
                assert!(change > 1e-11, "{name} changes L by {change:e} only");
            }
        }
    }
}

/// Mean energy over the first and last hundred of 1000 periods, and the amplitude of its oscillation.
fn energy_over_a_thousand_periods(name: &str, steps_per_period: usize) -> (f64, f64, f64) {
    let mut simulation = kepler(method(name), 0.6, TAU / steps_per_period as f64);
    let (mut first, mut last, mut low, mut high) = (0.0, 0.0, f64::INFINITY, f64::NEG_INFINITY);
    for period in 0..1000 {
        for _ in 0..steps_per_period {
            simulation.step().unwrap();
            let energy = simulation.diagnostics().total;
            (low, high) = (energy.min(low), energy.max(high));
            if period < 100 {
                first += energy / (100 * steps_per_period) as f64;
            } else if period >= 900 {
                last += energy / (100 * steps_per_period) as f64;
            }
        }
    }
    (first, last, high - low)
}

// lecture 5 and 7; A2
#[test]
fn the_energy_of_symplectic_schemes_does_not_drift_over_a_thousand_periods() {
    for name in ["symplectic-euler", "velocity-verlet", "yoshida4"] {
        let (first, last, amplitude) = energy_over_a_thousand_periods(name, 300);
        let drift = (last - first).abs();
        assert!(drift < 1e-3 * amplitude, "{name} drifts by {drift:e}, amplitude {amplitude:e}");
        assert!((last + 0.5).abs() < amplitude, "{name} stays around -1/2");
    }
    let (first, last, _) = energy_over_a_thousand_periods("rk4", 300);
    assert!(last - first < -1e-4, "Runge-Kutta loses energy all the time: {first} to {last}");
}

// lecture 7: at perihelion again after a whole period the energy is nearly right; what a run reports is how
// wrong it has been, compared with the kinetic energy of 2 and the potential of -2.5 at the start.
#[test]
fn a_run_reports_the_largest_energy_error_and_not_only_the_last() {
    let build = || kepler(method("velocity-verlet"), 0.6, TAU / 200.0);
    let mut by_hand = build();
    let mut errors = vec![];
    for _ in 0..200 {
        by_hand.step().unwrap();
        errors.push((by_hand.diagnostics().total + 0.5).abs() / 4.5);
    }
    let largest = errors.iter().fold(0.0f64, |m, e| m.max(*e));
    let summary = run_watched(&mut build(), TAU, 1e3);
    assert!((summary.relative_energy_error().unwrap() - largest).abs() < 1e-14, "{summary:?}");
    assert!(
        (summary.relative_energy_drift().unwrap() - errors[199]).abs() < 1e-14,
        "{}",
        summary.relative_energy_drift().unwrap()
    );
    assert!(largest > 5.0 * errors[199]);
}
