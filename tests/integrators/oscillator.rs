//! One mass, one spring: what a scheme does to it is known in closed form.

use std::sync::atomic::AtomicBool;

use pliant::run::{Outcome, Plan, run};
use pliant::simulation::{Simulation, StepError};

use crate::support::oscillator::{closed_form, oscillator, power_applied};
use crate::support::{advance, largest_difference, method, methods};

/// `(x_10, v_10 / omega)` from `(1, 0)`.
fn after_ten(simulation: &mut Simulation, omega: f64) -> [f64; 2] {
    advance(simulation, 10);
    let state = simulation.state();
    [state.x()[2], state.v()[2] / omega]
}

/// Reference vectors at `z = 0.1` and `z = 1`, from powers of amplification matrices in 40 digits.
const VECTORS: [(&str, [f64; 2], [f64; 2]); 6] = [
    ("forward-euler", [0.5707904499, -0.88250801], [0.0, -32.0]),
    ("rk2-midpoint", [0.538_970_697_569_425_6, -0.842_472_916_649_788_7], [0.231_445_312_5, 3.042_968_75]),
    (
        "rk4",
        [0.540_302_967_116_884_2, -0.841_470_477_800_274_4],
        [-0.816_618_156_599_970_4, 0.466_949_881_766_836_3],
    ),
    ("symplectic-euler", [0.497_813_731_513_215_3, -0.842_750_388_405_864_2], [0.0, 1.0]),
    ("velocity-verlet", [0.539_951_250_933_508_5, -0.840_643_512_434_849_5], [-0.5, 0.75]),
    (
        "yoshida4",
        [0.540_307_880_889_840_6, -0.841_470_629_569_782_2],
        [-0.973_132_446_514_624_3, -0.248_246_751_931_800_9],
    ),
];

// lecture 3 to 6; A1a
#[test]
fn ten_steps_on_the_oscillator_are_the_reference_vectors() {
    for method in methods() {
        let name = method.documentation.name;
        let (_, small, large) = VECTORS
            .iter()
            .find(|(n, ..)| *n == name)
            .unwrap_or_else(|| panic!("{name} has no reference vectors: compute them independently"));
        for (z, expected) in [(0.1, small), (1.0, large)] {
            // omega = sqrt(k / m) = 2: mass, stiffness and step enter as they should.
            let measured = after_ten(&mut oscillator(method, 3.0, 12.0, z / 2.0), 2.0);
            let scale = expected[0].hypot(expected[1]).max(1.0);
            let error = largest_difference(&measured, expected) / scale;
            assert!(error < 1e-13, "{name} at z = {z}: {measured:?} instead of {expected:?}");
            let closed = power_applied(closed_form(name, z), 10, [1.0, 0.0]);
            assert!(largest_difference(&closed, expected) / scale < 1e-13, "closed form of {name}");
        }
    }
}

/// Largest `|x|` over `steps` steps, infinite if one could not be taken.
fn largest_excursion(simulation: &mut Simulation, steps: usize) -> f64 {
    let mut largest: f64 = 0.0;
    for _ in 0..steps {
        if simulation.step().is_err() {
            return f64::INFINITY;
        }
        largest = largest.max(simulation.state().x()[2].abs());
    }
    largest
}

// lecture 7; A1b
#[test]
fn ten_thousand_steps_stay_bounded_below_the_documented_limit_and_not_above() {
    for method in methods().filter(|m| m.documentation.stability_limit > 0.0) {
        let (name, limit) = (method.documentation.name, method.documentation.stability_limit);
        let below = largest_excursion(&mut oscillator(method, 1.0, 1.0, 0.999 * limit), 10_000);
        assert!(below < 1e3, "{name} below its limit reaches {below:e}");
        let above = largest_excursion(&mut oscillator(method, 1.0, 1.0, 1.001 * limit), 10_000);
        assert!(above > 1e6, "{name} above its limit reaches {above:e}");
    }
}

// lecture 4 and 7; A1
#[test]
fn forward_euler_and_the_midpoint_rule_gain_energy_at_any_step_at_the_predicted_rate() {
    // Squared modulus of the eigenvalues of one step.
    let gain = |name: &str, z: f64| match name {
        "forward-euler" => 1.0 + z * z,
        "rk2-midpoint" => 1.0 + z.powi(4) / 4.0,
        _ => panic!("how fast does {name} gain energy?"),
    };
    for method in methods().filter(|m| m.documentation.stability_limit == 0.0) {
        for z in [1e-2, 0.1] {
            let mut simulation = oscillator(method, 1.0, 1.0, z);
            advance(&mut simulation, 1000);
            let energy = simulation.diagnostics().total;
            let expected = 0.5 * gain(method.documentation.name, z).powi(1000);
            assert!(expected > 0.5 + 1e-6);
            let error = (energy / expected - 1.0).abs();
            assert!(
                error < 1e-10,
                "{} at z = {z}: {energy} instead of {expected}",
                method.documentation.name
            );
        }
    }
}

// A1b
#[test]
fn exactly_at_the_limit_the_euler_and_verlet_oscillators_grow_linearly() {
    let mut euler = oscillator(method("symplectic-euler"), 1.0, 1.0, 2.0);
    advance(&mut euler, 101);
    assert_eq!(euler.state().x()[2], -203.0);
    let mut verlet = oscillator(method("velocity-verlet"), 1.0, 1.0, 2.0);
    verlet.state_mut().x_mut()[2] = 0.0;
    verlet.state_mut().v_mut()[2] = 1.0;
    advance(&mut verlet, 100);
    assert_eq!(verlet.state().x()[2], -200.0);
}

// lecture 5; A1
#[test]
fn symplectic_euler_and_velocity_verlet_conserve_their_modified_energies() {
    type Invariant = fn(f64, f64, f64) -> f64;
    let euler: Invariant = |z, x, v| x * x + v * v - z * x * v;
    let verlet: Invariant = |z, x, v| (1.0 - z * z / 4.0) * x * x + v * v;
    for (name, invariant) in [("symplectic-euler", euler), ("velocity-verlet", verlet)] {
        for z in [0.1, 1.0, 1.9] {
            let mut simulation = oscillator(method(name), 1.0, 1.0, z);
            let start = invariant(z, 1.0, 0.0);
            for _ in 0..10_000 {
                simulation.step().unwrap();
                let (x, v) = (simulation.state().x()[2], simulation.state().v()[2]);
                let change = (invariant(z, x, v) / start - 1.0).abs();
                assert!(change < 1e-11, "{name} at z = {z}: relative change {change:e}");
            }
        }
    }
}

// lecture 5 and 7; A1: from (1, 0), H/H_0 fills [1/(1+z/2), 1/(1-z/2)] and [1 - z^2/4, 1].
#[test]
fn the_energy_of_the_symplectic_schemes_oscillates_between_the_predicted_bounds() {
    let z: f64 = 0.1;
    let euler = (1.0 / (1.0 + z / 2.0), 1.0 / (1.0 - z / 2.0));
    let verlet = (1.0 - z * z / 4.0, 1.0);
    for (name, (low, high)) in [("symplectic-euler", euler), ("velocity-verlet", verlet)] {
        let mut simulation = oscillator(method(name), 1.0, 1.0, z);
        let start = simulation.diagnostics().total;
        let (mut lowest, mut highest) = (1.0f64, 1.0f64);
        for _ in 0..10_000 {
            simulation.step().unwrap();
            let ratio = simulation.diagnostics().total / start;
            (lowest, highest) = (lowest.min(ratio), highest.max(ratio));
        }
        let slack = 1e-3 * (high - low);
        assert!(lowest > low - 1e-12 && lowest < low + slack, "{name}: lowest {lowest}, predicted {low}");
        assert!(
            highest < high + 1e-12 && highest > high - slack,
            "{name}: highest {highest}, predicted {high}"
        );
    }
}

// lecture 7: a run looks at its energy also where frames that nobody measures fall on the very steps it looks at.
#[test]
fn a_run_without_measured_frames_still_notices_that_it_blows_up() {
    let step = 2.001;
    let mut simulation = oscillator(method("velocity-verlet"), 1.0, 1.0, step);
    let plan = Plan { duration: 1e5 * step, rate: 1.0 / (128.0 * step) };
    let summary = run(&mut simulation, &plan, &mut [], &AtomicBool::new(false));
    let Outcome::Failed(StepError::Unstable { step, .. }) = summary.outcome else {
        panic!("it ends with {:?}", summary.outcome)
    };
    assert_eq!(step, 128);
}
