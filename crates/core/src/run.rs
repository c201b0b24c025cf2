//! A whole run: steps, frames, observers, and how it ended.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::deadline::until;
use crate::diagnostics::{Diagnostics, Reaction};
use crate::observer::{Frame, Observer, ObserverError, Work};
use crate::simulation::{Simulation, StepError};

/// The total energy is looked at every so many steps, frames apart: about 1 % of the work.
const GUARD_INTERVAL: u64 = 128;
/// A run is unstable once its energy has grown by this many times all the energy there was to begin with.
const ENERGY_GROWTH_BOUND: f64 = 1e3;

/// Frames nearer to each other than this part of the time between them are one.
const SAME_FRAME: f64 = 1e-6;

/// How far to go and how often to show a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Simulated time [s]; the run ends with the step nearest to it, exactly there where step sizes follow the error.
    pub duration: f64,
    /// Frames per simulated second. A frame is taken at the step nearest to each multiple of `1 / rate`, exactly there where step sizes
    /// follow the error, and at the end.
    pub rate: f64,
}

impl Plan {
    /// Number of steps of size `h` that the plan takes.
    pub fn steps(&self, h: f64) -> u64 {
        let steps = (self.duration / h).round() as u64;
        if self.duration > 0.0 { steps.max(1) } else { 0 }
    }

    /// Number of frames, the first and the last included.
    pub fn frames(&self, h: f64) -> u64 {
        let steps = self.steps(h);
        let (mut count, mut step) = (1, 0);
        // Only as many iterations as frames.
        while step < steps {
            step = self.frame_step(count, h).max(step + 1).min(steps);
            count += 1;
        }
        count
    }

    /// Number of frames, the first and the last included, where steps land on their times.
    pub fn exact_frames(&self) -> u64 {
        if self.duration > 0.0 {
            (self.duration * self.rate - SAME_FRAME).ceil().max(1.0) as u64 + 1
        } else {
            1
        }
    }

    /// When frame `index` is taken [s], counted from the start, where steps land on that time.
    pub fn frame_time(&self, index: u64) -> f64 {
        if index + 1 < self.exact_frames() { index as f64 / self.rate } else { self.duration }
    }

    /// The step at which frame `index` is taken.
    fn frame_step(&self, index: u64, h: f64) -> u64 {
        (index as f64 / (self.rate * h)).round() as u64
    }
}

/// How a run ended.
#[derive(Debug)]
#[non_exhaustive]
pub enum Outcome {
    /// It reached its duration.
    Done,
    /// It was asked to stop.
    Interrupted,
    /// A step could not be taken, or the energy blew up.
    Failed(StepError),
    /// An observer could not do its work.
    ObserverFailed(ObserverError),
}

/// What can be said at the end.
#[derive(Debug)]
pub struct Summary {
    /// How it ended.
    pub outcome: Outcome,
    /// Frames shown.
    pub frames: u64,
    /// Work done in this run.
    pub work: Work,
    /// Measurements at the start.
    pub start: Diagnostics,
    /// Measurements of the last good state that was measured.
    pub end: Diagnostics,
    /// The forces with which pins hold their vertices in the last good state.
    pub reactions: Vec<Reaction>,
    /// Simulated time of the last frame shown [s].
    pub last_frame_time: f64,
    /// Largest `|E - E_0|` seen at any frame or guard [J], without what is known to have come in from outside and gone out.
    pub largest_energy_change: f64,
    /// Energy that `largest_energy_change` is to be compared with [J]: all there was at the start, kinetic and stored, and
    /// what gravity can give over the size of the scene, and the most that came in from outside.
    pub energy_scale: f64,
}

impl Summary {
    /// `|E_end - E_0|` over the energy scale; what is known to have come in from outside and gone out is no drift.
    pub fn relative_energy_drift(&self) -> f64 {
        (self.end.conserved() - self.start.conserved()).abs() / self.energy_scale
    }

    /// Largest `|E - E_0|` seen, over the energy scale.
    pub fn relative_energy_error(&self) -> f64 {
        self.largest_energy_change / self.energy_scale
    }

    /// `|p_end - p_0|` [kg m/s].
    pub fn momentum_change(&self) -> f64 {
        let d = |i: usize| self.end.linear_momentum[i] - self.start.linear_momentum[i];
        (d(0).powi(2) + d(1).powi(2) + d(2).powi(2)).sqrt()
    }
}

/// Steps `simulation` through `plan`, showing frames to `observers`, until it is done, fails, or `interrupt` is set.
///
/// Every observer has seen the last good state when this returns, whatever the outcome.
pub fn run(
    simulation: &mut Simulation,
    plan: &Plan,
    observers: &mut [&mut dyn Observer],
    interrupt: &AtomicBool,
) -> Summary {
    // The guard against growing energy does without what is lost.
    simulation.count_losses(observers.iter().any(|o| o.wants_diagnostics()));
    let start = simulation.diagnostics();
    let energy_scale = energy_scale(simulation, &start);
    let last_good = start.clone();
    let mut run = Run {
        simulation,
        measures_frames: observers.iter().any(|o| o.wants_diagnostics()),
        measures_points: observers.iter().any(|o| o.wants_points()),
        measures_reactions: observers.iter().any(|o| o.wants_reactions()),
        measures_elements: observers.iter().any(|o| o.wants_elements()),
        observers,
        start,
        last_good,
        last_frame_time: 0.0,
        scale_at_start: energy_scale,
        energy_scale,
        largest_energy_change: 0.0,
        frames: 0,
    };
    let outcome = run.go_until(plan, interrupt);
    let mut end = run.simulation.diagnostics();
    if !end.total.is_finite() {
        end = run.last_good;
    }
    Summary {
        outcome,
        frames: run.frames,
        reactions: run.simulation.reactions(),
        work: run.simulation.work(),
        largest_energy_change: run.largest_energy_change.max((end.conserved() - run.start.conserved()).abs()),
        start: run.start,
        end,
        last_frame_time: run.last_frame_time,
        energy_scale: run.energy_scale,
    }
}

struct Run<'a, 'b> {
    simulation: &'a mut Simulation,
    observers: &'a mut [&'b mut dyn Observer],
    /// Whether any observer reads the measurements of a frame.
    measures_frames: bool,
    /// Whether any observer reads the states at points.
    measures_points: bool,
    /// Whether any observer reads the forces of pins.
    measures_reactions: bool,
    /// Whether any observer reads the states of elements.
    measures_elements: bool,
    start: Diagnostics,
    last_good: Diagnostics,
    last_frame_time: f64,
    scale_at_start: f64,
    energy_scale: f64,
    largest_energy_change: f64,
    frames: u64,
}

impl Run<'_, '_> {
    /// How a run ends whose step was not taken.
    fn not_taken(&self, error: StepError) -> Outcome {
        if self.simulation.system().is_stopped() { Outcome::Interrupted } else { Outcome::Failed(error) }
    }

    /// Lets steps and solves that have begun end as well once `interrupt` is set, unless something else may end them already.
    fn go_until(&mut self, plan: &Plan, interrupt: &AtomicBool) -> Outcome {
        if self.simulation.system().can_be_stopped() {
            return self.go(plan, interrupt);
        }
        let outcome = until(
            || interrupt.load(Ordering::Relaxed),
            |stop| {
                self.simulation.system_mut().set_stop(Some(Arc::clone(stop)));
                self.go(plan, interrupt)
            },
        );
        self.simulation.system_mut().set_stop(None);
        outcome
    }

    fn go(&mut self, plan: &Plan, interrupt: &AtomicBool) -> Outcome {
        if self.simulation.step_control().is_some() {
            return self.go_by_error(plan, interrupt);
        }
        let h = self.simulation.step_size();
        let first = self.simulation.state().step;
        let steps = plan.steps(h);
        let mut shown = 0;
        let mut next_frame = plan.frame_step(1, h).max(1);
        if let Err(outcome) = self.show() {
            return outcome;
        }
        for step in 1..=steps {
            if interrupt.load(Ordering::Relaxed) {
                return self.end_with(Outcome::Interrupted, shown, step - 1);
            }
            let frame_due = step == next_frame.min(steps);
            let guard_due = step % GUARD_INTERVAL == 0;
            self.simulation.set_to_be_measured(guard_due || frame_due && self.measures_frames);
            if let Err(error) = self.simulation.step() {
                let outcome = self.not_taken(error);
                return self.end_with(outcome, shown, step - 1);
            }
            debug_assert_eq!(self.simulation.state().step, first + step, "one step at a time");
            if frame_due {
                if let Err(outcome) = self.show() {
                    return outcome;
                }
                shown = step;
                while next_frame <= step {
                    next_frame = plan.frame_step(self.frames, h).max(next_frame + 1);
                }
            }
            // A frame that is measured has been looked at.
            if guard_due && !(frame_due && self.measures_frames) {
                let diagnostics = self.simulation.diagnostics();
                if let Err(error) = self.guard(&diagnostics) {
                    return self.end_with(Outcome::Failed(error), shown, step);
                }
            }
        }
        Outcome::Done
    }

    /// The same with steps whose size follows the error.
    fn go_by_error(&mut self, plan: &Plan, interrupt: &AtomicBool) -> Outcome {
        let (first, start) = (self.simulation.state().step, self.simulation.state().time);
        if let Err(outcome) = self.show() {
            return outcome;
        }
        let (mut shown, mut step) = (0, 0);
        for index in 1..plan.exact_frames() {
            let target = start + plan.frame_time(index);
            while self.simulation.state().time < target {
                if interrupt.load(Ordering::Relaxed) {
                    return self.end_with(Outcome::Interrupted, shown, step);
                }
                let guard_due = (step + 1) % GUARD_INTERVAL == 0;
                self.simulation.set_to_be_measured(guard_due);
                if let Err(error) = self.simulation.step_towards(target) {
                    let outcome = self.not_taken(error);
                    return self.end_with(outcome, shown, step);
                }
                step = self.simulation.state().step - first;
                if guard_due {
                    let diagnostics = self.simulation.diagnostics();
                    if let Err(error) = self.guard(&diagnostics) {
                        return self.end_with(Outcome::Failed(error), shown, step);
                    }
                }
            }
            if let Err(outcome) = self.show() {
                return outcome;
            }
            shown = step;
        }
        Outcome::Done
    }

    /// Shows the last good state, if it has not been shown, and ends.
    fn end_with(&mut self, outcome: Outcome, shown: u64, step: u64) -> Outcome {
        if step == shown {
            return outcome;
        }
        match self.show() {
            // The failure of the run is the news, not a second failure found while showing its last state.
            Err(Outcome::ObserverFailed(error)) => Outcome::ObserverFailed(error),
            _ => outcome,
        }
    }

    /// One frame for every observer, and a look at the energy if it is computed anyway. A state without a finite energy
    /// is no good state, and is not shown: an element may have left the domain of its material in the last drift.
    fn show(&mut self) -> Result<(), Outcome> {
        let diagnostics = self.measures_frames.then(|| self.simulation.diagnostics());
        if diagnostics.as_ref().is_some_and(|d| !d.total.is_finite()) {
            return Err(Outcome::Failed(self.simulation.not_finite_here()));
        }
        let reactions = self.measures_reactions.then(|| self.simulation.reactions());
        let state = self.simulation.state();
        let points = self.measures_points.then(|| self.simulation.point_states());
        let elements = self.measures_elements.then(|| self.simulation.element_states());
        let (x, v) = (self.simulation.positions(), self.simulation.velocities());
        let frame = Frame {
            index: self.frames,
            step: state.step,
            time: state.time,
            dimension: self.simulation.system().dimension(),
            x: &x,
            v: &v,
            diagnostics: diagnostics.as_ref(),
            elements: elements.as_deref(),
            points: points.as_deref(),
            reactions: reactions.as_deref(),
            work: self.simulation.work(),
        };
        for observer in self.observers.iter_mut() {
            observer.frame(&frame).map_err(Outcome::ObserverFailed)?;
        }
        self.frames += 1;
        self.last_frame_time = frame.time;
        diagnostics.map_or(Ok(()), |d| self.guard(&d).map_err(Outcome::Failed))
    }

    fn guard(&mut self, diagnostics: &Diagnostics) -> Result<(), StepError> {
        let energy = diagnostics.total;
        if !energy.is_finite() {
            return Err(self.simulation.not_finite_here());
        }
        self.last_good.clone_from(diagnostics);
        let change = diagnostics.conserved() - self.start.conserved();
        let supplied = diagnostics.balance.map_or(0.0, |balance| balance.turnover());
        self.energy_scale = self.energy_scale.max(self.scale_at_start + supplied);
        self.largest_energy_change = self.largest_energy_change.max(change.abs());
        if change <= ENERGY_GROWTH_BOUND * self.energy_scale {
            return Ok(());
        }
        let state = self.simulation.state();
        Err(StepError::Unstable {
            step: state.step,
            time: state.time,
            energy,
            start: self.start.total,
            step_size: self.simulation.step_size(),
            stable_step: self.simulation.stable_step(),
        })
    }
}

/// The energy that a change of energy is compared with: what is kinetic and stored at the start, what gravity can give
/// over the size of the scene, and at least the motion of a billionth of that size per step, which is where rounding ends.
pub fn energy_scale(simulation: &mut Simulation, start: &Diagnostics) -> f64 {
    let size = simulation.size();
    let floor =
        0.5 * simulation.system().mass().iter().sum::<f64>() * (1e-9 * size / simulation.step_size()).powi(2);
    (start.kinetic + simulation.potential_scale()).max(floor).max(f64::MIN_POSITIVE)
}
