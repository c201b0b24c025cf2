//! A ring of masses: every plane wave is an oscillator, and the whole stepping loop has a closed form.

use std::f64::consts::TAU;

use pliant::energy::spring::Springs;
use pliant::integrator::Method;
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;

use crate::support::oscillator::from_rest;
use crate::support::{advance, largest_difference, method, methods, solve_to_rounding};

const MASSES: usize = 12;
const MASS: f64 = 0.5;
const STIFFNESS: f64 = 8.0;

/// A ring of springs of rest length zero, whose forces are linear in the positions, displaced by the
/// standing wave `cos(2 pi wave j / n)` along x and by its neighbour, `wave + 1`, along y.
fn ring(method: Method, wave: usize, h: f64) -> Simulation {
    let edges: Vec<[u32; 2]> = (0..MASSES).map(|j| [j as u32, ((j + 1) % MASSES) as u32]).collect();
    let mut system = System::new(2, vec![MASS; MASSES]);
    let springs = Springs::<2>::new("ring", &edges, &[STIFFNESS; MASSES], &[0.0; MASSES], MASSES);
    system.add_term(Box::new(springs));
    let x = (0..MASSES).flat_map(|j| [shape(wave, j), shape(wave + 1, j)]).collect();
    let mut simulation = Simulation::new(system, State::new(x, vec![0.0; 2 * MASSES]), method, h);
    solve_to_rounding(&mut simulation);
    simulation
}

fn shape(wave: usize, j: usize) -> f64 {
    (TAU * (wave * j % MASSES) as f64 / MASSES as f64).cos()
}

/// `omega = 2 sqrt(k/m) |sin(kappa/2)|`.
fn frequency(wave: usize) -> f64 {
    2.0 * (STIFFNESS / MASS).sqrt() * (TAU * wave as f64 / MASSES as f64 / 2.0).sin()
}

/// Amplitudes of both waves. Rounding also sets the ring as a whole adrift, which is no matter of waves.
fn amplitudes(simulation: &Simulation, wave: usize) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for (j, x) in simulation.state().x().chunks_exact(2).enumerate() {
        sums[0] += 2.0 / MASSES as f64 * x[0] * shape(wave, j);
        sums[1] += 2.0 / MASSES as f64 * x[1] * shape(wave + 1, j);
    }
    sums
}

// lecture 5 and 9; A5
#[test]
fn plane_waves_obey_the_discrete_dispersion_relation_of_each_scheme() {
    for method in methods() {
        let documentation = method.documentation;
        for wave in [1, 2, 4] {
            // The fastest wave, which rounding excites, at 0.7 of the limit; schemes that are never stable
            // at a small step, and those that always are at a large one.
            let (h, steps) = match documentation.stability_limit {
                0.0 => (0.01, 1000),
                f64::INFINITY => (3.0 / frequency(MASSES / 2), 1000),
                limit => (0.7 * limit / frequency(MASSES / 2), 10_000),
            };
            let mut simulation = ring(method, wave, h);
            advance(&mut simulation, steps);
            let factor = |wave| from_rest(documentation.name, h * frequency(wave), steps)[0];
            let expected = [factor(wave), factor(wave + 1)];
            let scale = expected.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
            let error = largest_difference(&amplitudes(&simulation, wave), &expected) / scale;
            assert!(
                error < 1e-11,
                "{}, wave {wave}: off by {error:e} after {steps} steps",
                documentation.name
            );
        }
    }
}

// lecture 5; A5: sin(Omega h / 2) = omega h / 2. Verlet from rest gives x_n = x_0 cos(n Omega h), symplectic
// Euler x_n = x_0 (cos(n Omega h) - tan(Omega h / 2) sin(n Omega h)).
#[test]
fn verlet_and_symplectic_euler_run_at_the_same_exactly_known_frequency() {
    let (wave, steps) = (2, 10_000);
    // z of the fastest wave.
    for z in [0.05, 0.7, 1.9] {
        let h = z / frequency(MASSES / 2);
        for name in ["velocity-verlet", "symplectic-euler"] {
            let mut simulation = ring(method(name), wave, h);
            advance(&mut simulation, steps);
            let factor = |wave| {
                let angle = 2.0 * (0.5 * h * frequency(wave)).asin();
                let (s, c) = (steps as f64 * angle).sin_cos();
                if name == "velocity-verlet" { c } else { c - (0.5 * angle).tan() * s }
            };
            let expected = [factor(wave), factor(wave + 1)];
            let error = largest_difference(&amplitudes(&simulation, wave), &expected);
            assert!(error < 1e-11, "{name} at z = {z}: off by {error:e}");
        }
    }
}
