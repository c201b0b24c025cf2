//! Three bodies of the masses 3, 4 and 5, let go at rest: small changes grow by six digits in 20 s.

use pliant::energy::nbody::NBody;
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;
use pliant_gradient::{LossFrame, RunGradient, UNLIMITED, gradient};

use crate::support::{case, compare, method, numbers};

fn bodies() -> Simulation {
    let masses = vec![3.0, 4.0, 5.0];
    let mut system = System::new(2, masses.clone());
    system.add_term(Box::new(NBody::<2>::new(vec![0, 1, 2], masses, 1.0, 0.1)));
    let state = State::new(vec![1.0, 3.0, -2.0, -1.0, 1.0, -1.0], vec![0.0; 6]);
    Simulation::new(system, state, method("velocity-verlet"), 1e-3)
}

/// Derivatives of number `component` of the positions, then velocities, after these steps.
fn row(steps: u64, component: usize) -> RunGradient {
    let mut loss = |frame: &LossFrame<'_>, x_bar: &mut [f64], v_bar: &mut [f64]| {
        if frame.step < steps {
            return 0.0;
        }
        let (rows, bar) = if component < 6 { (frame.x, x_bar) } else { (frame.v, v_bar) };
        bar[component % 6] = 1.0;
        rows[component % 6]
    };
    gradient(&mut bodies(), steps, &mut loss, &mut [], UNLIMITED).unwrap()
}

/// Largest singular value, by power iteration.
fn norm(rows: &[Vec<f64>]) -> f64 {
    let mut along = vec![1.0; 12];
    let mut found = 0.0;
    for _ in 0..200 {
        let image: Vec<f64> =
            rows.iter().map(|row| row.iter().zip(&along).map(|(a, b)| a * b).sum()).collect();
        let size = along.iter().map(|a| a * a).sum::<f64>().sqrt();
        found = image.iter().map(|a| a * a).sum::<f64>().sqrt() / size;
        along = (0..12).map(|i| rows.iter().zip(&image).map(|(row, y)| row[i] * y).sum()).collect();
        let size = along.iter().map(|a| a * a).sum::<f64>().sqrt();
        along.iter_mut().for_each(|a| *a /= size);
    }
    found
}

// Rounding grows as changes do: tolerances go by the time. The reference has 11 digits of the norm.
#[test]
fn chaos_has_the_derivatives_of_its_steps_and_its_growth_is_reported() {
    for expected in case("chaos").as_array().unwrap() {
        let steps = expected["step"].as_u64().unwrap();
        let tolerance = match steps {
            ..=1000 => 1e-12,
            1001..=13000 => 1e-10,
            13001..=19000 => 1e-8,
            _ => 1e-6,
        };
        let found = row(steps, 0);
        let both = [found.position, found.velocity].concat();
        let of_start = [numbers(&expected["position"]), numbers(&expected["velocity"])].concat();
        compare(&format!("step {steps}"), &both, &of_start, tolerance);
        if steps % 10_000 != 0 {
            continue;
        }
        let found: Vec<RunGradient> = (0..12).map(|component| row(steps, component)).collect();
        let growth = found.iter().map(|found| found.growth).fold(f64::MIN, f64::max);
        let rows: Vec<_> = found.into_iter().map(|found| [found.position, found.velocity].concat()).collect();
        let whole = norm(&rows);
        compare(&format!("norm at {steps}"), &[whole], &numbers(&expected["norm"]), tolerance.max(1e-9));
        // No row grows faster than the whole; the fastest of twelve is no more than their root behind.
        let (most, time) = (whole.ln() / (1e-3 * steps as f64), 1e-3 * steps as f64);
        assert!(growth <= most + 1e-9 && growth >= most - 12f64.sqrt().ln() / time, "{growth}, {most}");
    }
}
