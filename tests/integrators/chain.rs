//! Chains of springs between two walls: solved by their normal modes.

use std::f64::consts::PI;

use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;

use crate::support::fields::CubicChain;
use crate::support::particles::{chain, chain_displacements};
use crate::support::{advance, assert_relative, largest_difference, method};

const SPACING: f64 = 4.0;

/// Ten equal masses between two walls, the first displaced by 1.
fn ten_masses(name: &str, mass: f64, stiffness: f64, h: f64) -> Simulation {
    chain(method(name), &[mass; 10], &[stiffness; 11], SPACING, &[1.0], h)
}

// lecture 2 and 9; A5: x_i(t) = sum_j 2/(N+1) sin(j pi i0/(N+1)) sin(j pi i/(N+1)) cos(omega_j t), in 30
// digits.
#[test]
fn a_chain_of_ten_masses_follows_its_normal_modes() {
    for name in ["rk4", "yoshida4"] {
        let h = 5e-5;
        let mut simulation = ten_masses(name, 0.1, 100.0, h);
        advance(&mut simulation, (1.0 / h).round() as usize);
        let u = chain_displacements(&simulation, SPACING);
        let measured = [u[0], u[4], u[9], simulation.state().v()[2]];
        let expected = [
            -0.476_280_915_542_335_7,
            -0.168_517_239_575_251_1,
            -0.114_906_277_002_299_4,
            2.119_392_883_014_632,
        ];
        let error = largest_difference(&measured, &expected);
        assert!(error < 1e-8, "{name} is off by {error:e} at t = 1");
        advance(&mut simulation, (9.0 / h).round() as usize);
        let u = chain_displacements(&simulation, SPACING);
        let expected = [-0.032_935_764_409_860_31, 0.324_371_872_909_184_1, 0.189_318_132_579_711_4];
        let error = largest_difference(&[u[0], u[4], u[9]], &expected);
        assert!(error < 1e-8, "{name} is off by {error:e} at t = 10");
    }
}

// lecture 9; A5
#[test]
fn a_stiff_chain_follows_its_normal_modes() {
    let h = 2e-6;
    let mut simulation = ten_masses("rk4", 1.0, 1e6, h);
    advance(&mut simulation, (0.1 / h).round() as usize);
    let u = chain_displacements(&simulation, SPACING);
    let error = largest_difference(&[u[0], u[4]], &[0.420_847_075_767_715_3, -0.075_408_825_838_339_55]);
    assert!(error < 1e-8, "off by {error:e}");
}

// lecture 2 and 7; A5: omega_j = 2 sqrt(k/m) sin(j pi / 2(N+1)).
#[test]
fn the_stability_limit_of_a_chain_is_that_of_its_fastest_mode() {
    let mut simulation = ten_masses("velocity-verlet", 0.1, 100.0, 1e-3);
    let limit = simulation.stability_limit(1.0).unwrap();
    assert_relative(limit.frequency, 62.601_804_664_314_65, 1e-11, "largest frequency");
    assert_relative(limit.step, 2.0 / 62.601_804_664_314_65, 1e-10, "largest stable step");
    let mut above = ten_masses("velocity-verlet", 0.1, 100.0, 1.001 * limit.step);
    let mut below = ten_masses("velocity-verlet", 0.1, 100.0, 0.999 * limit.step);
    let start = below.diagnostics().total;
    advance(&mut below, 10_000);
    assert!(below.diagnostics().total < 1e3 * start);
    let grown = (0..10_000).any(|_| above.step().is_err()) || above.diagnostics().total > 1e3 * start;
    assert!(grown, "0.1 % above the limit the chain has {} J of {start} J", above.diagnostics().total);
}

// lecture 9; A5: a wall and masses 1, 1e-4, 1, 1e-4, 100; solved by its normal modes in 30 digits.
#[test]
fn masses_in_the_ratio_of_a_million_are_right_below_the_stability_limit() {
    let mass = [1.0, 1e-4, 1.0, 1e-4, 100.0];
    let expected = [
        -0.014_421_233_742_679,
        -0.018_253_172_716_327,
        -0.006_865_344_758_776_7,
        -0.036_422_712_051_951,
        -0.024_592_307_852_944,
    ];
    let build = |name, h| chain(method(name), &mass, &[1e4; 5], SPACING, &[0.0, 0.0, 0.0, 0.0, 0.1], h);
    let limit = build("velocity-verlet", 1e-5).stability_limit(1.0).unwrap();
    assert_relative(limit.step, 1.414_167_233e-4, 1e-9, "largest stable step");

    let mut verlet = build("velocity-verlet", 1e-5);
    advance(&mut verlet, 100_000);
    let u = chain_displacements(&verlet, SPACING);
    let error = largest_difference(&[u[0], u[2], u[4]], &[expected[0], expected[2], expected[4]]);
    assert!(error < 5e-6, "the heavy masses are off by {error:e}");

    // The light masses move at 14 kHz: only now are they resolved too.
    let mut runge_kutta = build("rk4", 1.0 / 7e5);
    advance(&mut runge_kutta, 700_000);
    let error = largest_difference(&chain_displacements(&runge_kutta, SPACING), &expected);
    assert!(error < 1e-6, "off by {error:e}");
}

// lecture 9; A5: a wall and springs 1e2, 1e8, 1e2; solved by its normal modes in 30 digits.
#[test]
fn stiffnesses_in_the_ratio_of_a_million_are_right_below_the_stability_limit() {
    let expected = [-0.008_274_872_412_942_9, -0.008_274_847_213_033_1, 0.076_091_357_737_221];
    let mut simulation =
        chain(method("velocity-verlet"), &[1.0; 3], &[1e2, 1e8, 1e2], SPACING, &[0.0, 0.0, 0.1], 1e-5);
    let limit = simulation.stability_limit(1.0).unwrap();
    assert_relative(limit.frequency, 14_142.139_159_265, 1e-12, "largest frequency");
    advance(&mut simulation, 100_000);
    let error = largest_difference(&chain_displacements(&simulation, SPACING), &expected);
    assert!(error < 1e-7, "off by {error:e}");
}

const FPUT_MASSES: usize = 31;

/// Energy of normal mode `j` of the chain without its cubic part.
fn mode_energy(simulation: &Simulation, j: usize) -> f64 {
    let shape = |n: usize| (PI * (j * (n + 1)) as f64 / 32.0).sin() * (2.0f64 / 32.0).sqrt();
    let project = |a: &[f64]| a.iter().enumerate().map(|(n, a)| a * shape(n)).sum::<f64>();
    let omega = 2.0 * (PI * j as f64 / 64.0).sin();
    let (q, p) = (project(simulation.state().x()), project(simulation.state().v()));
    0.5 * (p * p + omega * omega * q * q)
}

// lecture 1 (an energy is all a new model has to give); A5: Fermi, Pasta, Ulam, Tsingou, alpha = 1/4.
#[test]
fn the_energy_of_the_fermi_pasta_ulam_tsingou_chain_wanders_and_returns() {
    let mut system = System::new(1, vec![1.0; FPUT_MASSES]);
    system.add_term(Box::new(CubicChain::new(0.25)));
    let x: Vec<f64> = (1..=FPUT_MASSES).map(|n| (PI * n as f64 / 32.0).sin()).collect();
    let state = State::new(x, vec![0.0; FPUT_MASSES]);
    let mut simulation = Simulation::new(system, state, method("velocity-verlet"), 0.1);
    let start = mode_energy(&simulation, 1);
    assert_relative(start, 0.077_044_373_244_849_82, 1e-14, "energy of the first mode");
    advance(&mut simulation, 10_000);
    let expected = [0.053_465_332_09, 0.010_775_348_38, 0.004_884_702_471, 0.003_334_707_906];
    for (j, expected) in expected.into_iter().enumerate() {
        let energy = mode_energy(&simulation, j + 1);
        assert_relative(energy, expected, 1e-2, &format!("energy of mode {} at t = 1000", j + 1));
    }
    advance(&mut simulation, 83_760);
    assert_relative(mode_energy(&simulation, 1) / start, 0.98127, 1e-2, "energy returned at t = 9376");
}
