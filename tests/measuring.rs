//! Energies are measured where they are read, and nowhere else.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use pliant::energy::{EnergyKind, EnergyTerm, Fault, TermProperties, TermViews};
use pliant::observer::{Frame, Observer, ObserverError, Quantities};
use pliant::run::{Plan, run};
use pliant::simulation::Simulation;
use pliant::state::State;
use pliant::system::System;

use crate::support::method;
use crate::support::solid::{Solid, isotropic, scattered};

/// `E = 1/2 |x|^2`, which counts how often it is asked for.
struct Counting {
    energies: Arc<AtomicU64>,
    gradient: Vec<f64>,
}

impl EnergyTerm for Counting {
    fn name(&self) -> String {
        "counting".into()
    }
    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Elastic)
    }
    fn energy(&mut self, x: &[f64]) -> f64 {
        self.energies.fetch_add(1, Ordering::Relaxed);
        0.5 * x.iter().map(|x| x * x).sum::<f64>()
    }
    fn evaluate(&mut self, x: &[f64]) -> bool {
        self.gradient.clear();
        self.gradient.extend_from_slice(x);
        true
    }
    fn add_rows(&self, first: usize, g: &mut [f64]) {
        for (g, own) in g.iter_mut().zip(&self.gradient[2 * first..]) {
            *g += own;
        }
    }
    fn add_hessian_product(&mut self, _: &[f64], p: &[f64], y: &mut [f64]) {
        y.iter_mut().zip(p).for_each(|(y, p)| *y += p);
    }
    fn fault(&self, _: &[f64]) -> Option<Fault> {
        None
    }
}

impl TermViews for Counting {}

/// Looks at frames, with or without their energies.
struct Watching {
    energies: bool,
    frames: u64,
}

impl Observer for Watching {
    fn quantities(&self) -> Quantities {
        Quantities::DIAGNOSTICS.only_if(self.energies)
    }
    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        assert_eq!(frame.diagnostics.is_some(), self.energies);
        self.frames += 1;
        Ok(())
    }
}

/// Evaluations of the energy in 100 steps with 21 frames.
fn evaluations(mut observer: Option<Watching>) -> u64 {
    let energies = Arc::new(AtomicU64::new(0));
    let mut system = System::new(2, vec![1.0]);
    system.add_term(Box::new(Counting { energies: energies.clone(), gradient: vec![] }));
    let state = State::new(vec![1.0, 0.0], vec![0.0, 1.0]);
    let mut simulation = Simulation::new(system, state, method("velocity-verlet"), 0.01);
    let mut observers: Vec<&mut dyn Observer> = vec![];
    observers.extend(observer.as_mut().map(|observer| observer as &mut dyn Observer));
    let summary =
        run(&mut simulation, &Plan { duration: 1.0, rate: 20.0 }, &mut observers, &AtomicBool::new(false));
    assert_eq!((summary.work.steps, summary.frames), (100, 21));
    if let Some(observer) = observer {
        assert_eq!(observer.frames, 21);
    }
    energies.load(Ordering::Relaxed)
}

// The start and the end are measured for the summary, and every frame is judged by its energy, once, whoever
// reads it.
#[test]
fn only_frames_whose_energies_are_read_are_measured() {
    let unwatched = evaluations(None);
    assert!((2 + 21..=4 + 21).contains(&unwatched), "{unwatched}");
    assert_eq!(evaluations(Some(Watching { energies: false, frames: 0 })), unwatched);
    assert_eq!(evaluations(Some(Watching { energies: true, frames: 0 })), unwatched);
}

// The stability limit may be asked for at any time: products with the Hessian use the memory of the force,
// and the next step must not take what they leave there for it.
#[test]
fn measuring_between_steps_does_not_change_a_step() {
    let solid = Solid::grid(&[4, 3, 3], &[0.4, 0.3, 0.3], isotropic("stable-neo-hookean", 1e5, 0.3));
    let outcome = |measured: bool| {
        let mut simulation = solid.simulation(method("velocity-verlet"), 1e-4);
        for (k, v) in simulation.state_mut().v_mut().iter_mut().enumerate() {
            *v = 0.1 * scattered(k);
        }
        for _ in 0..5 {
            simulation.step().unwrap();
            if measured {
                assert!(simulation.stability_limit(1.0).unwrap().step > 1e-4);
                assert!(simulation.diagnostics().total.is_finite());
            }
        }
        let state = simulation.state();
        state.x().iter().chain(state.v()).map(|x| x.to_bits()).collect::<Vec<u64>>()
    };
    assert!(outcome(true) == outcome(false));
}
