//! The spring pendulum: soft, stiff, and on both sides of the stability limit of explicit schemes.

use pliant::run::Outcome;

use crate::support::particles::spring_pendulum;
use crate::support::{advance, distance, method, run_watched};

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

// lecture 7; A6: at k = 1e6 the limits 2 / omega and 2 sqrt 2 / omega are 2e-3 and 2.83e-3. Positions by an independent
// implementation of each scheme, which blows up at the second step size.
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
        let limit = simulation.stability_limit(10.0).step;
        assert!(below < limit && limit < above, "{name}: the limit {limit:e} is between the two");
        let summary = run_watched(&mut simulation, 10.0, 60.0);
        let Outcome::Failed(error) = summary.outcome else {
            panic!("{name} at {above} must not end with {:?}", summary.outcome)
        };
        assert!(error.to_string().contains("above the stability limit"), "{error}");
        assert!(simulation.state().x().iter().all(|x| x.is_finite()), "the state is the last good one");
    }
}
