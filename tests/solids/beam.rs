//! A beam of 8 x 2 cells, 4 m x 1 m, clamped at x = 0, let go under gravity: every vertex against an
//! independent code.

use pliant::run::Outcome;
use serde_json::json;

use crate::support::reference::{Case, beam as references};
use crate::support::solid::{Solid, at_zero, isotropic};
use crate::support::{
    advance, assert_relative, displacements, largest_difference, method, run_watched, weighted_rms,
};

/// Lengths times `s`, times times `s`, gravity by `s`; stiffness and density times `r`.
fn beam(material: &str, s: f64, r: f64) -> Solid {
    let mut solid = Solid::grid(&[8, 2], &[4.0 * s, s], isotropic(material, 1e6 * r, 0.3));
    solid.mass = json!({ "density": 1000.0 * r });
    solid.pin = at_zero(2, 0);
    solid.gravity = Some(vec![0.0, -9.81 / s]);
    solid
}

fn reference(material: &str) -> Case {
    references().into_iter().find(|case| case.material == material).unwrap()
}

// lecture 16, 18, 19; C13 W1
#[test]
fn every_vertex_is_where_an_independent_code_finds_it_after_one_second() {
    for case in references() {
        let mut simulation = beam(&case.material, 1.0, 1.0).simulation(method("rk4"), 1.0 / 2000.0);
        let rest = simulation.state().x().to_vec();
        advance(&mut simulation, 2000);
        let name = &case.material;
        let u = displacements(simulation.state().x(), &rest);
        let (u, v) = (largest_difference(&u, &case.u), largest_difference(simulation.state().v(), &case.v));
        assert!(u < 2e-9, "{name}: displacements off by {u:e} m");
        assert!(v < 1e-7, "{name}: velocities off by {v:e} m/s");
        let diagnostics = simulation.diagnostics();
        assert_relative(diagnostics.kinetic, case.kinetic, 1e-8, name);
        assert_relative(diagnostics.elastic, case.elastic, 1e-8, name);
    }
}

// lecture 16; C13 W1: the tip, tests/verification.md.
#[test]
fn the_tip_is_where_the_plan_has_it() {
    let rows = [
        ("neo-hookean", 0.5, [-0.021_851_204_289_5, -1.583_765_004_38]),
        ("neo-hookean", 1.0, [-1.100_354_095_79, -3.429_259_839_75]),
        ("stable-neo-hookean", 1.0, [-1.138_024_130_89, -3.430_429_729_68]),
        ("stvk", 1.0, [-1.177_030_394_39, -3.214_911_625_58]),
    ];
    for (material, time, expected) in rows {
        let mut simulation = beam(material, 1.0, 1.0).simulation(method("rk4"), 1.0 / 2000.0);
        advance(&mut simulation, (time * 2000.0) as usize);
        let x = simulation.state().x();
        let tip = [x[x.len() - 2] - 4.0, x[x.len() - 1] - 1.0];
        let error = largest_difference(&tip, &expected);
        assert!(error < 2e-9, "{material} at t = {time}: tip off by {error:e} m");
    }
}

// lecture 4, 5, 7; C13 W1: mass-weighted rms error of all vertices, computed by independent implementations
// of the schemes on an independent finite element code.
#[test]
fn errors_in_time_are_those_of_independent_implementations() {
    let steps = [
        ("symplectic-euler", 200),
        ("symplectic-euler", 400),
        ("velocity-verlet", 200),
        ("velocity-verlet", 400),
        ("velocity-verlet", 800),
        ("yoshida4", 200),
        ("yoshida4", 400),
        ("rk4", 100),
        ("rk4", 200),
        ("rk4", 400),
        ("rk2-midpoint", 400),
        ("rk2-midpoint", 800),
    ];
    let errors = [
        (
            "neo-hookean",
            [
                2.0865e-3, 1.0356e-3, 8.8311e-5, 2.1959e-5, 5.4770e-6, 1.0610e-5, 7.1982e-7, 1.5262e-5,
                1.3628e-6, 8.8560e-8, 8.9153e-5, 2.2009e-5,
            ],
        ),
        (
            "stable-neo-hookean",
            [
                2.2606e-3, 1.1227e-3, 8.8763e-5, 2.2039e-5, 5.4956e-6, 9.9211e-6, 7.2219e-7, 1.4956e-5,
                1.3109e-6, 8.7659e-8, 8.9234e-5, 2.2067e-5,
            ],
        ),
        (
            "stvk",
            [
                2.6124e-3, 1.3066e-3, 7.5468e-5, 1.9129e-5, 4.7910e-6, 8.3392e-6, 6.5447e-7, 1.7471e-5,
                1.1822e-6, 7.6444e-8, 7.3075e-5, 1.8376e-5,
            ],
        ),
        (
            "corotated",
            [
                1.7665e-3, 8.7524e-4, 8.7191e-5, 2.1698e-5, 5.4099e-6, 1.0004e-5, 7.2336e-7, 1.5100e-5,
                1.3449e-6, 8.8320e-8, 8.7648e-5, 2.1709e-5,
            ],
        ),
    ];
    for (material, expected) in errors {
        let case = reference(material);
        for ((scheme, steps), expected) in steps.iter().zip(expected) {
            let mut simulation = beam(material, 1.0, 1.0).simulation(method(scheme), 1.0 / f64::from(*steps));
            let rest = simulation.state().x().to_vec();
            advance(&mut simulation, *steps as usize);
            let u = displacements(simulation.state().x(), &rest);
            let error = weighted_rms(&simulation, &u, &case.u);
            assert_relative(error, expected, 0.02, &format!("{material}, {scheme} in {steps} steps"));
        }
    }
}

// C13 W1, neo-Hookean: mass-weighted rms errors at t = 1 of independent implementations of implicit schemes.
// Their order is not the classical one yet, as modes with h omega > 1 are not resolved.
#[test]
fn errors_in_time_of_implicit_schemes_are_those_of_independent_implementations() {
    let rows: [(&str, &[(u32, f64)]); 7] = [
        ("implicit-euler", &[(100, 2.90e-2), (400, 7.40e-3)]),
        ("implicit-midpoint", &[(50, 2.319e-3), (100, 6.475e-4), (200, 1.715e-4)]),
        ("bdf2", &[(50, 4.81e-3), (100, 2.04e-3), (200, 6.12e-4)]),
        ("tr-bdf2", &[(25, 3.60e-3), (50, 1.148e-3), (100, 3.19e-4), (200, 8.38e-5)]),
        ("sdirk3", &[(25, 1.22e-3), (50, 3.38e-4), (100, 6.5e-5)]),
        ("sdirk4", &[(25, 2.45e-4), (50, 2.86e-5)]),
        ("generalised-alpha", &[(50, 2.44e-3), (100, 6.81e-4), (200, 1.81e-4)]),
    ];
    let case = reference("neo-hookean");
    for (scheme, errors) in rows {
        for (steps, expected) in errors {
            let mut simulation =
                beam("neo-hookean", 1.0, 1.0).simulation(method(scheme), 1.0 / f64::from(*steps));
            let rest = simulation.state().x().to_vec();
            advance(&mut simulation, *steps as usize);
            let u = displacements(simulation.state().x(), &rest);
            let error = weighted_rms(&simulation, &u, &case.u);
            assert_relative(error, *expected, 0.01, &format!("{scheme} in {steps} steps"));
        }
    }
}

// C13 W1s: a hundred times as stiff, nu = 0.49; 7670 rad/s at most. An independent code has the tip at t = 1
// in 8 digits.
#[test]
fn stiff_beams_in_implicit_steps_converge_to_what_an_independent_code_finds() {
    // Largest deflection on the way, and the error of the tip at the end.
    let swing = |scheme: &str, steps: u32| {
        let mut solid = Solid::grid(&[8, 2], &[4.0, 1.0], isotropic("neo-hookean", 1e8, 0.49));
        solid.mass = json!({ "density": 1000.0 });
        solid.pin = at_zero(2, 0);
        solid.gravity = Some(vec![0.0, -9.81]);
        let mut simulation = solid.simulation(method(scheme), 1.0 / f64::from(steps));
        let (mut lowest, mut tip) = (0.0_f64, [0.0; 2]);
        for _ in 0..steps {
            simulation.step().unwrap();
            let x = simulation.state().x();
            tip = [x[x.len() - 2] - 4.0, x[x.len() - 1] - 1.0];
            lowest = lowest.min(tip[1]);
        }
        (lowest, largest_difference(&tip, &[2.047_497_4e-4, -2.448_129_8e-4]))
    };
    // The steps are h omega = 5 to 10 of the fastest mode, the second order is that of the slowest alone.
    for (scheme, steps, part) in [
        ("implicit-midpoint", 1600, 2e-3),
        ("tr-bdf2", 1600, 2e-3),
        ("radau-iia2", 1600, 1e-4),
        ("sdirk4", 800, 1e-4),
        ("gauss2", 800, 1e-4),
        ("radau-iia3", 800, 1e-5),
    ] {
        let ((_, coarse), (lowest, fine)) = (swing(scheme, steps / 4), swing(scheme, steps));
        assert!((-0.03..-0.008).contains(&lowest), "{scheme}: down to {lowest} m");
        assert!(fine < part * -lowest && fine < 0.5 * coarse, "{scheme}: {coarse:e} {fine:e} of {lowest} m");
    }
}

// lecture 7; D2
#[test]
fn verlet_runs_at_098_of_the_stability_limit_and_is_stopped_at_104() {
    let mut below = beam("neo-hookean", 1.0, 1.0).simulation(method("velocity-verlet"), 1.0 / 108.0);
    let limit = below.stability_limit(10.0).unwrap().step;
    assert_relative(limit, 0.009_423_663_239_14, 1e-11, "2 / omega");
    let rest = below.state().x().to_vec();
    let mut largest = 0.0f64;
    for _ in 0..1080 {
        below.step().unwrap();
        largest = largest.max(largest_difference(below.state().x(), &rest));
    }
    assert!(largest < 5.0, "the tip moves by {largest} m");

    let mut above = beam("neo-hookean", 1.0, 1.0).simulation(method("velocity-verlet"), 1.0 / 102.0);
    let summary = run_watched(&mut above, 10.0, 60.0);
    let Outcome::Failed(error) = summary.outcome else {
        panic!("above the limit it ends with {:?}", summary.outcome)
    };
    let message = error.to_string();
    assert!(message.contains("above the stability limit: use at most"), "{message}");
    assert!(above.state().time < 1.0, "stopped at t = {}", above.state().time);
    assert!(above.state().x().iter().chain(above.state().v()).all(|x| x.is_finite()));
}

// D9: u -> s u, v -> v under L -> s L, t -> s t, g -> g / s; nothing changes under E -> r E, rho -> r rho.
#[test]
fn results_do_not_depend_on_the_unit_of_length_or_of_mass() {
    let run = |s: f64, r: f64| {
        let mut simulation = beam("neo-hookean", s, r).simulation(method("velocity-verlet"), s / 400.0);
        let rest = simulation.state().x().to_vec();
        let limit = simulation.stability_limit(1.0).unwrap().step / s;
        advance(&mut simulation, 400);
        let u: Vec<f64> = displacements(simulation.state().x(), &rest).iter().map(|u| u / s).collect();
        let energy = simulation.diagnostics().total / (s * s * r);
        (u, simulation.state().v().to_vec(), energy, limit)
    };
    let (u, v, energy, limit) = run(1.0, 1.0);
    for (s, r) in [(1e-9, 1.0), (1e6, 1.0), (1.0, 1e-9), (1.0, 1e9), (1e6, 1e9), (1e-9, 1e-9)] {
        let scaled = run(s, r);
        let error = largest_difference(&scaled.0, &u) / 3.4;
        assert!(error < 1e-9, "s = {s:e}, r = {r:e}: displacements off by {error:e}");
        let error = largest_difference(&scaled.1, &v) / 2.0;
        assert!(error < 1e-9, "s = {s:e}, r = {r:e}: velocities off by {error:e}");
        assert!((scaled.2 - energy).abs() < 1e-9 * 5e4, "s = {s:e}, r = {r:e}: {} J", scaled.2);
        assert_relative(scaled.3, limit, 1e-9, "stability limit");
    }
}
