//! A whole run: steps, frames, observers, and how it ended.

mod plan;
#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::deadline::until;
use crate::diagnostics::{Diagnostics, Energy, Reaction};
use crate::observer::{Frame, Observer, ObserverError, Work};
use crate::simulation::{MotionJumps, Simulation, StepError};

pub use plan::Plan;

/// The total energy is looked at every so many steps, frames apart: about 1 % of the work.
const GUARD_INTERVAL: u64 = 128;
/// A run is unstable once its energy has grown by this many times all the energy there was to begin with.
const ENERGY_GROWTH_BOUND: f64 = 1e3;

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
    /// The forces with which pins hold their vertices in the last good state; empty where the energy blew up
    /// after it.
    pub reactions: Vec<Reaction>,
    /// Prescribed motion that jumped; `None` without any, and in statics, where every increment is a jump.
    pub motion_jumps: Option<MotionJumps>,
    /// Simulated time of the last frame shown [s].
    pub last_frame_time: f64,
    /// Largest `|E - E_0|` seen at any frame or guard [J], without what is known to have come in from outside and gone out.
    pub largest_energy_change: f64,
    /// Largest growth of the energy seen at any frame or guard [J], without what came in from outside; no
    /// loss makes up for it.
    pub largest_energy_gain: f64,
    /// Whether it went from equilibrium to equilibrium: there is no energy of motion then that could be kept.
    pub is_static: bool,
    /// Energy that `largest_energy_change` is to be compared with [J]: all there was at the start, kinetic and stored, and
    /// what gravity can give over the size of the scene, and the most that came in from outside.
    pub energy_scale: f64,
}

impl Summary {
    /// `|E_end - E_0|` over the energy scale; what is known to have come in from outside and gone out is no
    /// drift. `None` in statics.
    pub fn relative_energy_drift(&self) -> Option<f64> {
        self.relative(self.end.conserved() - self.start.conserved())
    }

    /// Largest `|E - E_0|` seen, over the energy scale. `None` in statics.
    pub fn relative_energy_error(&self) -> Option<f64> {
        self.relative(self.largest_energy_change)
    }

    /// Largest growth of the energy seen, over the energy scale. `None` in statics.
    pub fn relative_energy_gain(&self) -> Option<f64> {
        self.relative(self.largest_energy_gain)
    }

    fn relative(&self, energy: f64) -> Option<f64> {
        (!self.is_static).then(|| energy.abs() / self.energy_scale)
    }

    /// `|p_end - p_0|` [kg m/s]; nothing in statics.
    pub fn momentum_change(&self) -> f64 {
        let d = |i: usize| self.end.linear_momentum[i] - self.start.linear_momentum[i];
        (d(0).powi(2) + d(1).powi(2) + d(2).powi(2)).sqrt()
    }
}

/// Steps `simulation` through `plan`, showing frames to `observers`, until it is done, fails, or `interrupt` is set.
///
/// A state is judged before it is shown: observers see good ones alone, and the last frame is a good one
/// whatever the outcome. Where a step cannot be taken, it is the state before that step. What is lost is
/// counted as `simulation` was told to: [`count_losses_for`] asks for it only where somebody looks.
pub fn run(
    simulation: &mut Simulation,
    plan: &Plan,
    observers: &mut [&mut dyn Observer],
    interrupt: &AtomicBool,
) -> Summary {
    simulation.forget_motion_jumps();
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
        largest_energy_gain: 0.0,
        frames: 0,
    };
    let outcome = run.go_until(plan, interrupt);
    let end = run.simulation.diagnostics();
    let (end, reactions) = match run.guard(&end.energy()) {
        Ok(()) => (end, run.simulation.reactions()),
        Err(_) => (run.last_good, vec![]),
    };
    Summary {
        outcome,
        frames: run.frames,
        reactions,
        work: run.simulation.work(),
        largest_energy_change: run.largest_energy_change,
        largest_energy_gain: run.largest_energy_gain,
        is_static: run.simulation.method().is_static(),
        motion_jumps: run.simulation.motion_jumps().cloned(),
        start: run.start,
        end,
        last_frame_time: run.last_frame_time,
        energy_scale: run.energy_scale,
    }
}

/// Counts what `simulation` loses only if one of these observers reads measurements: the guard against
/// growing energy does without.
pub fn count_losses_for(simulation: &mut Simulation, observers: &[&mut dyn Observer]) {
    simulation.count_losses(observers.iter().any(|observer| observer.wants_diagnostics()));
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
    largest_energy_gain: f64,
    frames: u64,
}

impl Run<'_, '_> {
    /// How a run ends whose step was not taken.
    fn not_taken(&self, error: StepError) -> Outcome {
        if self.simulation.system().is_stopped() { Outcome::Interrupted } else { Outcome::Failed(error) }
    }

    /// Lets steps and solves that have begun end as well once `interrupt` is set, unless the simulation has a
    /// flag of its own. A thread looks for them, but for steps that none of them is long in.
    fn go_until(&mut self, plan: &Plan, interrupt: &AtomicBool) -> Outcome {
        let simulation = &self.simulation;
        let method = simulation.method();
        let is_brief = !method.iterates() && simulation.step_control().is_none();
        if is_brief || simulation.system().can_be_stopped() {
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
            self.simulation.set_to_be_measured(guard_due || frame_due);
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
            } else if guard_due && let Err(error) = self.judge() {
                return Outcome::Failed(error);
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
                if guard_due && let Err(error) = self.judge() {
                    return Outcome::Failed(error);
                }
            }
            if let Err(outcome) = self.show() {
                return outcome;
            }
            shown = step;
        }
        Outcome::Done
    }

    /// Shows the last state, if it has not been shown and is a good one, and ends.
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

    /// Judges the present state between frames, and remembers its measurements.
    fn judge(&mut self) -> Result<(), StepError> {
        let diagnostics = self.simulation.diagnostics();
        self.guard(&diagnostics.energy())?;
        self.last_good = diagnostics;
        Ok(())
    }

    /// Judges the present state as a frame: its measurements where an observer reads them, its energy alone
    /// where none does.
    fn judge_frame(&mut self) -> Result<Option<Diagnostics>, StepError> {
        if !self.measures_frames {
            let energy = self.simulation.energy();
            return self.guard(&energy).map(|()| None);
        }
        self.judge()?;
        Ok(Some(self.last_good.clone()))
    }

    /// One frame for every observer, if the present state is a good one. A state without a finite energy is
    /// none: an element may have left the domain of its material in the last drift.
    fn show(&mut self) -> Result<(), Outcome> {
        let diagnostics = self.judge_frame().map_err(Outcome::Failed)?;
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
        Ok(())
    }

    /// Whether this energy of the present state is one that a run can have: finite, and not grown beyond any
    /// physical cause. Statics has no motion whose energy could grow.
    fn guard(&mut self, energy: &Energy) -> Result<(), StepError> {
        if !energy.total.is_finite() {
            return Err(self.simulation.not_finite_here());
        }
        if self.simulation.method().is_static() {
            return Ok(());
        }
        let start = self.start.energy();
        let gain = energy.gain(&start);
        let supplied = energy.balance.map_or(0.0, |balance| balance.turnover());
        let scale = self.energy_scale.max(self.scale_at_start + supplied);
        if gain <= ENERGY_GROWTH_BOUND * scale {
            self.energy_scale = scale;
            let change = (energy.conserved() - start.conserved()).abs();
            self.largest_energy_change = self.largest_energy_change.max(change);
            self.largest_energy_gain = self.largest_energy_gain.max(gain);
            return Ok(());
        }
        let state = self.simulation.state();
        Err(StepError::Unstable {
            step: state.step,
            time: state.time,
            energy: energy.total,
            start: self.start.total,
            step_size: self.simulation.step_size(),
            stable_step: self.simulation.stable_step(),
        })
    }
}

/// The energy that a change of energy is compared with: what is kinetic and stored at the start, what gravity can give
/// over the size of the scene, and at least the motion of a billionth of that size per step, which is where rounding ends.
pub fn energy_scale(simulation: &mut Simulation, start: &Diagnostics) -> f64 {
    let size = simulation.length_scale();
    let floor =
        0.5 * simulation.system().mass().iter().sum::<f64>() * (1e-9 * size / simulation.step_size()).powi(2);
    (start.kinetic + simulation.potential_scale()).max(floor).max(f64::MIN_POSITIVE)
}

/// Growth of the energy from `start` to `now` that did not come in from outside, over the `scale` [J] and
/// what did come in; zero in statics, where there is no motion whose energy could grow, not a number where
/// the energy is not finite.
pub(crate) fn energy_growth(
    simulation: &Simulation,
    start: &Diagnostics,
    now: &Diagnostics,
    scale: f64,
) -> f64 {
    if !now.total.is_finite() {
        return f64::NAN;
    }
    if simulation.method().is_static() {
        return 0.0;
    }
    let supplied = now.balance.map_or(0.0, |balance| balance.turnover());
    now.energy().gain(&start.energy()) / (scale + supplied)
}
