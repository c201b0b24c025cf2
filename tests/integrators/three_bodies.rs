//! Three gravitating bodies: the figure-eight and the Pythagorean problem, solved by Taylor series in 40 to
//! 55 digits.

use pliant::run::Outcome;

use crate::support::particles::{FIGURE_EIGHT_PERIOD, figure_eight, pythagorean};
use crate::support::{advance, assert_relative, distance, largest_difference, method, run_watched};

// lecture 8; A3: max |r(T) - r(0)|, computed by an independent implementation of each scheme.
#[test]
fn the_figure_eight_returns_with_the_error_of_an_independent_implementation() {
    let rows = [
        ("yoshida4", 1000, 1.368e-7),
        ("yoshida4", 2000, 8.553e-9),
        ("rk4", 1000, 5.887e-9),
        ("rk4", 2000, 3.299e-10),
        ("velocity-verlet", 2000, 1.606e-5),
    ];
    for (name, steps, expected) in rows {
        let mut simulation = figure_eight(method(name), FIGURE_EIGHT_PERIOD / steps as f64);
        let start = simulation.state().x().to_vec();
        advance(&mut simulation, steps);
        let error = largest_difference(simulation.state().x(), &start);
        assert_relative(error, expected, 0.05, &format!("{name} in {steps} steps"));
    }
}

// lecture 8; A3
#[test]
fn the_figure_eight_swaps_its_bodies_at_a_third_and_mirrors_them_at_half_of_its_period() {
    let steps = 12_000;
    let mut simulation = figure_eight(method("rk4"), FIGURE_EIGHT_PERIOD / steps as f64);
    let diagnostics = simulation.diagnostics();
    assert!((diagnostics.total + 1.287_141_995_631_857_7).abs() < 1e-14, "E = {}", diagnostics.total);
    assert!(diagnostics.angular_momentum[2].abs() < 1e-15);
    let start = simulation.state().x().to_vec();
    let body = |x: &[f64], i: usize| [x[2 * i], x[2 * i + 1]];

    advance(&mut simulation, steps / 3);
    let x = simulation.state().x().to_vec();
    let defect = |shift: usize| {
        (0..3).map(|i| distance(&body(&x, i), &body(&start, (i + shift) % 3))).fold(0.0, f64::max)
    };
    assert!(defect(1).min(defect(2)) < 1e-11, "off a cyclic permutation by {} and {}", defect(1), defect(2));
    assert!(defect(0) > 0.5);

    advance(&mut simulation, steps / 2 - steps / 3);
    let half = [0.881_816_904_023_615_4, 0.471_591_929_297_147_66];
    let expected = [half[0], half[1], -half[0], -half[1], 0.0, 0.0];
    let error = largest_difference(simulation.state().x(), &expected);
    assert!(error < 1e-11, "off by {error:e} at half the period");
}

// lecture 8; A3
#[test]
fn fourth_order_schemes_follow_the_figure_eight_to_t_20() {
    for name in ["rk4", "yoshida4"] {
        let mut simulation = figure_eight(method(name), 5e-4);
        advance(&mut simulation, 20_000);
        let r1 = [0.456_535_378_996_729_3, 0.473_922_696_268_189_94];
        let v1 = [-1.009_591_390_650_207_5, -0.457_954_301_161_942_74];
        let error =
            distance(&simulation.state().x()[..2], &r1).max(distance(&simulation.state().v()[..2], &v1));
        assert!(error < 1e-9, "{name} is off by {error:e} at t = 10");
        advance(&mut simulation, 20_000);
        let expected = [-0.035_748_430_765_979_085, 0.019_599_399_448_157_258];
        let error = distance(&simulation.state().x()[..2], &expected);
        assert!(error < 1e-9, "{name} is off by {error:e} at t = 20");
    }
}

/// Time, position of the mass 3, position of the mass 4.
const PYTHAGOREAN: [(f64, [f64; 4]); 2] = [
    (
        1.0,
        [0.949_550_134_839_484_2, 2.773_231_694_945_563, -1.666_229_065_913_728_9, -0.949_442_409_147_773_1],
    ),
    (
        10.0,
        [
            0.778_480_410_138_085_5,
            0.141_392_300_290_086_16,
            -2.025_092_477_978_198_6,
            0.097_219_384_146_058_4,
        ],
    ),
];

// lecture 8; A4
#[test]
fn fourth_order_schemes_solve_the_pythagorean_problem_up_to_t_10() {
    for (name, h) in [("rk4", 5e-6), ("yoshida4", 5e-6)] {
        let mut simulation = pythagorean(method(name), h);
        for (time, expected) in PYTHAGOREAN {
            let steps = ((time - simulation.state().time) / h).round() as usize;
            advance(&mut simulation, steps);
            let error = largest_difference(&simulation.state().x()[..4], &expected);
            assert!(error < 1e-6, "{name} is off by {error:e} at t = {time}");
        }
    }
}

// lecture 7 and 8; A4: two bodies pass at a distance of 4e-4 at t = 15.83.
#[test]
fn a_fixed_step_through_a_close_encounter_reports_its_energy_error() {
    for name in ["symplectic-euler", "velocity-verlet", "rk4", "yoshida4"] {
        let mut simulation = pythagorean(method(name), 1e-3);
        let summary = run_watched(&mut simulation, 20.0, 60.0);
        match summary.outcome {
            Outcome::Done => {
                let error = summary.relative_energy_error().unwrap();
                assert!(error > 1e-3, "{name} reports an energy error of {error:e} only");
            }
            Outcome::Failed(error) => assert!(error.to_string().contains("energy"), "{error}"),
            other => panic!("{name} ended with {other:?}"),
        }
    }
}
