use std::sync::atomic::AtomicBool;

use super::*;
use crate::control::StepControl;
use crate::energy::spring::Springs;
use crate::integrator::IntegratorSpec;
use crate::integrator::estimate::Tolerances;
use crate::observer::ObserverError;
use crate::state::State;
use crate::system::System;

/// Facts of each frame: step, time and stretch of the spring.
struct Witness {
    frames: Vec<(u64, f64, f64)>,
    measures: bool,
}

impl Witness {
    fn new(measures: bool) -> Self {
        Witness { frames: vec![], measures }
    }

    fn steps(&self) -> Vec<u64> {
        self.frames.iter().map(|frame| frame.0).collect()
    }
}

impl Observer for Witness {
    fn quantities(&self) -> Quantities {
        Quantities::DIAGNOSTICS.only_if(self.measures)
    }

    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        self.frames.push((frame.step, frame.time, frame.x[2] - 1.0));
        Ok(())
    }
}

/// A mass of 1 kg on a spring of 1 N/m to a held one, stretched by 1 m: `omega = 1`, `E = 1/2 J`.
fn oscillator(integrator: IntegratorSpec, h: f64) -> Simulation {
    let mut system = System::new(2, vec![1.0, 1.0]);
    system.add_term(Box::new(Springs::<2>::new("spring", &[[0, 1]], &[1.0], &[1.0], 2)));
    system.pin(&[0]);
    let state = State::new(vec![0.0, 0.0, 2.0, 0.0], vec![0.0; 4]);
    Simulation::new(system, state, integrator.method(), h)
}

fn watched(simulation: &mut Simulation, plan: Plan, measures: bool) -> (Witness, Summary) {
    let mut witness = Witness::new(measures);
    let summary = run(simulation, &plan, &mut [&mut witness], &AtomicBool::new(false));
    (witness, summary)
}

/// Frames are 0.1 s apart, which is 10/3 steps of 0.03 s: 3.33, 6.67, 10, .. rounded. The last one is at
/// the end of the run.
#[test]
fn frames_are_at_the_steps_nearest_to_their_times_and_at_the_end() {
    let cases: [(f64, f64, &[u64]); 4] = [
        (0.6, 10.0, &[0, 3, 7, 10, 13, 17, 20]),
        (0.65, 10.0, &[0, 3, 7, 10, 13, 17, 20, 22]),
        // No frame is due before the end.
        (0.6, 0.7, &[0, 20]),
        // More frames than steps.
        (0.15, 100.0, &[0, 1, 2, 3, 4, 5]),
    ];
    for (duration, rate, expected) in cases {
        let plan = Plan { duration, rate };
        let mut simulation = oscillator(IntegratorSpec::VelocityVerlet, 0.03);
        let (witness, summary) = watched(&mut simulation, plan, false);
        assert_eq!(witness.steps(), expected, "{plan:?}");
        assert_eq!((plan.frames(0.03), summary.frames), (expected.len() as u64, expected.len() as u64));
        assert_eq!(plan.steps(0.03), *expected.last().unwrap());
    }
}

/// With adaptive steps, frames are at their exact times, including the end.
#[test]
fn frames_of_adaptive_steps_are_at_their_times_and_at_the_end() {
    let mut simulation = oscillator(IntegratorSpec::DormandPrince5, 0.1);
    let tolerances = Tolerances { position: 1e-6, velocity: 1e-6, relative: 1e-6 };
    simulation.set_step_control(StepControl { tolerances, first: None, smallest: 0.0, largest: 1.0 });
    let plan = Plan { duration: 0.65, rate: 10.0 };
    let (witness, summary) = watched(&mut simulation, plan, false);
    let times: Vec<f64> = witness.frames.iter().map(|frame| frame.1).collect();
    assert_eq!(times, [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.65]);
    assert_eq!((plan.exact_frames(), summary.last_frame_time), (8, 0.65));
}

/// Above its limit of 2, Verlet's energy grows: by `(z^2/2 - 1 + z sqrt(z^2/4 - 1))^2 = 16` in each
/// step at z = 2.5, to more than 1e3 times that of the start in the third or fourth.
#[test]
fn no_frame_is_shown_of_a_run_that_blows_up_whoever_measures() {
    for measures in [false, true] {
        for rate in [1.0 / 2.5, 1.0 / 12.5] {
            let mut simulation = oscillator(IntegratorSpec::VelocityVerlet, 2.5);
            let (witness, summary) = watched(&mut simulation, Plan { duration: 100.0, rate }, measures);
            assert!(matches!(summary.outcome, Outcome::Failed(StepError::Unstable { .. })), "{summary:?}");
            for (step, _, stretch) in &witness.frames {
                // A spring of 1 N/m.
                assert!(0.5 * stretch * stretch <= 1e3 * 0.5, "step {step}: {stretch} m");
            }
            assert_eq!(summary.last_frame_time, witness.frames.last().unwrap().1);
            assert!(summary.end.total <= 1e3 * summary.energy_scale, "{summary:?}");
            assert!(summary.reactions.is_empty(), "those of the last good state are not known");
        }
    }
}

/// Between frames the energy is checked every 128 steps; a failing state is not shown.
#[test]
fn a_state_that_fails_between_frames_is_not_shown() {
    let mut simulation = oscillator(IntegratorSpec::VelocityVerlet, 2.1);
    let (witness, summary) = watched(&mut simulation, Plan { duration: 2100.0, rate: 1e-4 }, true);
    assert!(matches!(summary.outcome, Outcome::Failed(StepError::Unstable { step: 128, .. })), "{summary:?}");
    assert_eq!((witness.steps(), summary.frames), (vec![0], 1));
    assert_eq!(summary.end.total, summary.start.total);
}

/// A step of 50 overflows within 128 steps: the state before the failed step is finite but invalid.
#[test]
fn the_state_before_a_step_that_cannot_be_taken_is_judged() {
    let mut simulation = oscillator(IntegratorSpec::VelocityVerlet, 50.0);
    let (witness, summary) = watched(&mut simulation, Plan { duration: 5e4, rate: 1e-4 }, false);
    assert!(matches!(summary.outcome, Outcome::Failed(StepError::NotFinite { .. })), "{summary:?}");
    assert_eq!((witness.steps(), summary.last_frame_time), (vec![0], 0.0));
    assert!(summary.end.total <= 1e3 * summary.energy_scale, "{summary:?}");
}

/// A run that is interrupted in a frame has shown the state it got to, and shows it once.
#[test]
fn the_last_frame_of_an_interrupted_run_is_not_shown_twice() {
    struct Stop<'a>(&'a AtomicBool, Witness);
    impl Observer for Stop<'_> {
        fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
            self.0.store(frame.index > 0, Ordering::Relaxed);
            self.1.frame(frame)
        }
    }
    let interrupt = AtomicBool::new(false);
    let mut stop = Stop(&interrupt, Witness::new(false));
    let mut simulation = oscillator(IntegratorSpec::VelocityVerlet, 0.1);
    let summary = run(&mut simulation, &Plan { duration: 10.0, rate: 1.0 }, &mut [&mut stop], &interrupt);
    assert!(matches!(summary.outcome, Outcome::Interrupted));
    assert_eq!(stop.1.steps(), [0, 10]);
}
