//! An observer: it sees every frame of a run and keeps what it came for, here the highest place of a ball
//! under drag and its energy there.
//!
//! `cargo run --release -p pliant --example observer`

#![allow(clippy::print_stdout, reason = "an example says what it found")]

use std::sync::atomic::AtomicBool;

use pliant::energy::gravity::UniformGravity;
use pliant::integrator::IntegratorSpec;
use pliant::observer::{Frame, Observer, ObserverError, Quantities};
use pliant::run::{Plan, run};
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;

/// The highest frame of a run.
#[derive(Default)]
struct Apex {
    height: f64,
    time: f64,
    energy: f64,
}

impl Observer for Apex {
    fn quantities(&self) -> Quantities {
        // Energies are computed because they are asked for here.
        Quantities::DIAGNOSTICS
    }

    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        let height = frame.x[2];
        if height > self.height {
            let energy = frame.diagnostics.map_or(f64::NAN, |d| d.total);
            *self = Apex { height, time: frame.time, energy };
        }
        Ok(())
    }
}

pub(crate) fn main() {
    let (mass, g, speed, drag) = (0.5, 9.81, 20.0_f64, 0.3);
    let mut system = System::new(3, vec![mass]);
    system.add_term(Box::new(UniformGravity::new(&[0.0, 0.0, -g], &[mass])));
    system.set_ether_drag(drag);
    let thrown = State::new(vec![0.0; 3], vec![5.0, 0.0, speed]);
    let mut simulation = Simulation::new(system, thrown, IntegratorSpec::VelocityVerlet.method(), 1e-3);

    let mut apex = Apex::default();
    let plan = Plan { duration: 4.0, rate: 200.0 };
    let summary = run(&mut simulation, &plan, &mut [&mut apex], &AtomicBool::new(false));

    // v' = -g - c v: it turns round at ln(1 + c v/g) / c, at the height v/c - g/c^2 ln(1 + c v/g).
    let turn = (1.0 + drag * speed / g).ln() / drag;
    let theory = speed / drag - g / drag * turn;
    println!(
        "{} frames; highest at {:.3} s: {:.4} m, energy {:.3} J; in theory {turn:.3} s, {theory:.4} m",
        summary.frames, apex.time, apex.height, apex.energy
    );
    assert!((apex.height - theory).abs() < 1e-3 && (apex.time - turn).abs() <= 2.5e-3);
}
