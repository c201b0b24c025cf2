//! Complete runs: steps, frames, observers and the outcome.

mod checkpoint;
mod plan;
mod summary;
#[cfg(test)]
mod tests;
mod watch;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::deadline::until;
use crate::diagnostics::{Diagnostics, Energy};
use crate::observer::{Frame, Notes, Observer, Quantities};
use crate::simulation::{Simulation, StepError};

pub use checkpoint::{Checkpoints, RunCheckpoint, RunState};
pub use plan::Plan;
pub use summary::{Outcome, Summary};
pub use watch::EnergyWatch;

/// Steps between energy checks without a frame: about 1 % of the work.
const GUARD_INTERVAL: u64 = 128;
/// Energy growth at which a run is unstable, relative to the energy scale.
const ENERGY_GROWTH_BOUND: f64 = 1e3;

/// Steps `simulation` through `plan`, showing frames to `observers`, until it is done, fails, or
/// `interrupt` is set.
///
/// A state is validated before it is shown: observers only see valid ones, and the last frame is valid
/// whatever the outcome. After a failed step it is the state before that step. Losses are counted as set
/// in `simulation`; [`count_losses_for`] requests them only if they are read.
///
/// ```
/// use std::sync::atomic::AtomicBool;
///
/// use pliant::integrator::IntegratorSpec;
/// use pliant::run::{Outcome, Plan, run};
/// use pliant::{simulation::Simulation, state::State, system::System};
///
/// let thrown = State::new(vec![0.0; 3], vec![1.0, 2.0, 3.0]);
/// let mut simulation =
///     Simulation::new(System::new(3, vec![1.0]), thrown, IntegratorSpec::Rk4.method(), 1e-2);
/// let plan = Plan { duration: 1.0, rate: 10.0 };
/// let summary = run(&mut simulation, &plan, &mut [], &AtomicBool::new(false));
/// assert!(matches!(summary.outcome, Outcome::Done));
/// assert_eq!(simulation.state().step, 100);
/// ```
pub fn run(
    simulation: &mut Simulation,
    plan: &Plan,
    observers: &mut [&mut dyn Observer],
    interrupt: &AtomicBool,
) -> Summary {
    let state = RunState::new(simulation);
    let mut run = Run::new(simulation, observers, None, state);
    let outcome = run.go_until(plan, interrupt);
    run.summary(outcome)
}

/// Runs as [`run`] does, with checkpoints: from the beginning or, with `from`, from a checkpoint that
/// `simulation` has [resumed](Simulation::resume). Further frames and the summary of the whole run are
/// bit-identical either way.
///
/// A run is bit-identical with and without checkpoints: those of implicit integrators are taken when
/// solvers are [reset](Simulation::has_forgotten) anyway, and the last one is kept when one is due or the
/// run ends. A checkpoint precedes the frame of its step. A step that has started is completed before
/// `interrupt` ends the run.
pub fn run_with_checkpoints(
    simulation: &mut Simulation,
    plan: &Plan,
    observers: &mut [&mut dyn Observer],
    interrupt: &AtomicBool,
    checkpoints: &mut dyn Checkpoints,
    from: Option<RunState>,
) -> Summary {
    let state = from.unwrap_or_else(|| RunState::new(simulation));
    let mut run = Run::new(simulation, observers, Some(checkpoints), state);
    let outcome = run.go(plan, interrupt);
    run.summary(outcome)
}

/// Counts losses of `simulation` only if one of these observers reads diagnostics; the energy check works
/// without them.
pub fn count_losses_for(simulation: &mut Simulation, observers: &[&mut dyn Observer]) {
    simulation.count_losses(quantities_of(observers).contains(Quantities::DIAGNOSTICS));
}

/// Returns the quantities that any of these observers reads.
fn quantities_of(observers: &[&mut dyn Observer]) -> Quantities {
    observers.iter().map(|observer| observer.quantities()).collect()
}

struct Run<'a, 'b> {
    simulation: &'a mut Simulation,
    observers: &'a mut [&'b mut dyn Observer],
    checkpoints: Option<&'a mut dyn Checkpoints>,
    /// Last checkpoint, and whether it was kept.
    last_checkpoint: Option<(RunCheckpoint, bool)>,
    /// Quantities that any observer reads.
    quantities: Quantities,
    state: RunState,
    /// Step shown last.
    shown: Option<u64>,
}

impl<'a, 'b> Run<'a, 'b> {
    fn new(
        simulation: &'a mut Simulation,
        observers: &'a mut [&'b mut dyn Observer],
        checkpoints: Option<&'a mut dyn Checkpoints>,
        state: RunState,
    ) -> Self {
        let quantities = quantities_of(observers);
        Run { simulation, quantities, observers, checkpoints, last_checkpoint: None, state, shown: None }
    }

    /// Builds the summary.
    fn summary(mut self, outcome: Outcome) -> Summary {
        let end = self.simulation.diagnostics();
        let (end, reactions) = match self.guard(&end.energy()) {
            Ok(()) => (end, self.simulation.reactions()),
            Err(_) => (self.state.last_good.clone(), vec![]),
        };
        let state = self.state;
        Summary {
            outcome,
            frames: state.frames,
            reactions,
            work: self.simulation.work(),
            largest_energy_change: state.largest_energy_change,
            largest_energy_gain: state.largest_energy_gain,
            is_static: self.simulation.method().is_static(),
            path: self.simulation.path().cloned(),
            motion_jumps: self.simulation.motion_jumps().cloned(),
            contact: self.simulation.contact_extremes().clone(),
            start: state.start,
            end,
            last_frame_time: state.last_frame_time,
            energy_scale: state.energy_scale,
        }
    }

    /// Returns the outcome after a failed step.
    fn not_taken(&self, error: StepError) -> Outcome {
        if self.simulation.system().is_stopped() { Outcome::Interrupted } else { Outcome::Failed(error) }
    }

    /// Runs so that `interrupt` also ends steps and solves under way, unless the simulation has its own
    /// flag. A thread polls it, except for integrators with short steps.
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
        let end = match self.simulation.step_control() {
            Some(_) => self.go_by_error(plan, interrupt),
            None => self.go_by_steps(plan, interrupt),
        };
        end.unwrap_or_else(|outcome| outcome)
    }

    /// Steps since the start.
    fn steps(&self) -> u64 {
        self.simulation.state().step - self.state.first_step
    }

    /// True if the energy is checked after `step` steps, with or without a frame.
    fn is_guarded(step: u64) -> bool {
        step > 0 && step.is_multiple_of(GUARD_INTERVAL)
    }

    /// True if an interruption during a frame ends the run here. A run with checkpoints takes one more
    /// step: its last checkpoint precedes the frame of that step.
    fn is_interrupted_after_frame(&self, interrupt: &AtomicBool) -> bool {
        self.checkpoints.is_none() && interrupt.load(Ordering::Relaxed)
    }

    fn go_by_steps(&mut self, plan: &Plan, interrupt: &AtomicBool) -> Result<Outcome, Outcome> {
        let h = self.simulation.step_size();
        let steps = plan.steps(h);
        loop {
            let step = self.steps();
            let is_done = step >= steps || self.simulation.path_has_ended();
            let is_stopping = !is_done && interrupt.load(Ordering::Relaxed);
            // The checkpoint precedes the frame of this step.
            self.checkpoint(is_done || is_stopping)?;
            if step == self.state.next_frame.min(steps) || is_done && self.shown != Some(step) {
                self.show()?;
                while self.state.next_frame <= step {
                    let next = plan.frame_step(self.state.frames, h);
                    self.state.next_frame = next.max(self.state.next_frame + 1);
                }
            } else if Self::is_guarded(step) {
                self.judge().map_err(Outcome::Failed)?;
            }
            if is_done {
                return Ok(Outcome::Done);
            }
            if is_stopping || self.is_interrupted_after_frame(interrupt) {
                return Ok(self.end_with(Outcome::Interrupted));
            }
            // Step; diagnostics that follow share work with its force.
            let is_frame = step + 1 == self.state.next_frame.min(steps);
            self.simulation.set_to_be_measured(is_frame || Self::is_guarded(step + 1));
            if let Err(error) = self.simulation.step() {
                let outcome = self.not_taken(error);
                return Ok(self.end_with(outcome));
            }
        }
    }

    /// Runs with adaptive step sizes.
    fn go_by_error(&mut self, plan: &Plan, interrupt: &AtomicBool) -> Result<Outcome, Outcome> {
        let last = plan.exact_frames() - 1;
        let target = |state: &RunState| state.first_time + plan.frame_time(state.frames.min(last));
        loop {
            let (step, time) = (self.steps(), self.simulation.state().time);
            let is_done = time >= target(&self.state) && self.state.frames >= last;
            let is_stopping = !is_done && interrupt.load(Ordering::Relaxed);
            self.checkpoint(is_done || is_stopping)?;
            if Self::is_guarded(step) {
                self.judge().map_err(Outcome::Failed)?;
            }
            // Several frames may be due at one time.
            while time >= target(&self.state) {
                self.show()?;
                if self.state.frames > last {
                    return Ok(Outcome::Done);
                }
            }
            if is_stopping || self.is_interrupted_after_frame(interrupt) {
                return Ok(self.end_with(Outcome::Interrupted));
            }
            self.simulation.set_to_be_measured(Self::is_guarded(step + 1));
            if let Err(error) = self.simulation.step_towards(target(&self.state)) {
                let outcome = self.not_taken(error);
                return Ok(self.end_with(outcome));
            }
        }
    }

    /// Keeps the last checkpoint if one is due or the run `ends`.
    fn checkpoint(&mut self, ends: bool) -> Result<(), Outcome> {
        self.simulation.forget_in_time();
        let (step, time) = (self.simulation.state().step, self.simulation.state().time);
        let Run { simulation, observers, checkpoints, last_checkpoint, state, .. } = self;
        let Some(checkpoints) = checkpoints else { return Ok(()) };
        let is_due = checkpoints.is_due(step) || ends;
        // Without solvers, each step can be a checkpoint.
        let is_rare = simulation.method().documentation.solves > 0;
        if simulation.has_forgotten() && (is_due || is_rare) {
            let mut notes = Notes::new();
            observers.iter_mut().for_each(|observer| observer.note(&mut notes));
            let simulation = simulation.checkpoint();
            *last_checkpoint = Some((RunCheckpoint { simulation, run: state.clone(), notes }, false));
        }
        match last_checkpoint {
            Some((last, is_kept)) if is_due && (ends || !*is_kept) => {
                let mut secured = observers.iter_mut().map(|observer| observer.secure());
                secured.try_for_each(|secured| secured).map_err(Outcome::ObserverFailed)?;
                (last.run.reached_step, last.run.reached_time) = (step, time);
                *is_kept = true;
                checkpoints.keep(last).map_err(Outcome::ObserverFailed)
            }
            _ => Ok(()),
        }
    }

    /// Shows the last state, if it is valid and was not shown, and ends.
    fn end_with(&mut self, outcome: Outcome) -> Outcome {
        if self.shown == Some(self.simulation.state().step) {
            return outcome;
        }
        match self.show() {
            // Report the failure of the run, not a second failure while showing its last state.
            Err(Outcome::ObserverFailed(error)) => Outcome::ObserverFailed(error),
            _ => outcome,
        }
    }

    /// Validates the current state between frames, and stores its diagnostics.
    fn judge(&mut self) -> Result<(), StepError> {
        let diagnostics = self.simulation.diagnostics();
        self.guard(&diagnostics.energy())?;
        self.state.last_good = diagnostics;
        Ok(())
    }

    /// Validates the current state for a frame: with its diagnostics if an observer reads them, with its
    /// energy alone otherwise.
    fn judge_frame(&mut self) -> Result<Option<Diagnostics>, StepError> {
        if !self.quantities.contains(Quantities::DIAGNOSTICS) {
            let energy = self.simulation.energy();
            return self.guard(&energy).map(|()| None);
        }
        self.judge()?;
        Ok(Some(self.state.last_good.clone()))
    }

    /// Shows a frame to all observers, if the current state is valid. A state without a finite energy is
    /// not: an element may have left the domain of its material in the last drift.
    fn show(&mut self) -> Result<(), Outcome> {
        let diagnostics = self.judge_frame().map_err(Outcome::Failed)?;
        let Run { simulation, observers, quantities, state, .. } = self;
        let show = |frame: &Frame<'_>| observers.iter_mut().try_for_each(|observer| observer.frame(frame));
        Frame::of_state(simulation, state.frames, *quantities, diagnostics.as_ref(), show)
            .map_err(Outcome::ObserverFailed)?;
        let shown = simulation.state();
        (state.frames, state.last_frame_time) = (state.frames + 1, shown.time);
        self.shown = Some(shown.step);
        Ok(())
    }

    /// Checks that the energy of the current state is finite and has not grown beyond any physical cause.
    /// Statics has no kinetic energy that could grow.
    fn guard(&mut self, energy: &Energy) -> Result<(), StepError> {
        let start = self.state.start.energy();
        let gain = energy.gain(&start);
        let supplied = energy.balance.map_or(0.0, |balance| balance.turnover());
        let scale = self.state.energy_scale.max(self.state.scale_at_start + supplied);
        ensure_bounded(self.simulation, [start.total, energy.total], gain, scale)?;
        if self.simulation.method().is_static() {
            return Ok(());
        }
        self.state.energy_scale = scale;
        let change = (energy.conserved() - start.conserved()).abs();
        self.state.largest_energy_change = self.state.largest_energy_change.max(change);
        self.state.largest_energy_gain = self.state.largest_energy_gain.max(gain);
        Ok(())
    }
}

/// Checks that the current energy, the second of `totals` [J], is finite, and that its `gain` [J] is
/// physically possible relative to the energy `scale` [J].
fn ensure_bounded(
    simulation: &Simulation,
    [start, energy]: [f64; 2],
    gain: f64,
    scale: f64,
) -> Result<(), StepError> {
    if !energy.is_finite() {
        return Err(simulation.not_finite_here());
    }
    if simulation.method().is_static() || gain <= ENERGY_GROWTH_BOUND * scale {
        return Ok(());
    }
    let state = simulation.state();
    Err(StepError::Unstable {
        step: state.step,
        time: state.time,
        energy,
        start,
        step_size: simulation.step_size(),
        stable_step: simulation.stable_step(),
    })
}

/// Returns the energy scale for energy changes: kinetic and stored energy at the start, plus what gravity
/// can release over the scene size; at least the kinetic energy of a billionth of that size per step, the
/// limit of rounding.
pub fn energy_scale(simulation: &mut Simulation, start: &Diagnostics) -> f64 {
    let size = simulation.length_scale();
    let floor =
        0.5 * simulation.system().mass().iter().sum::<f64>() * (1e-9 * size / simulation.step_size()).powi(2);
    (start.kinetic + simulation.potential_scale()).max(floor).max(f64::MIN_POSITIVE)
}

/// Returns the growth of energy from `start` to `now` without external supply, relative to `scale` [J]
/// plus the energy supplied. Zero in statics, NaN if the energy is not finite.
pub fn energy_growth(simulation: &Simulation, start: &Diagnostics, now: &Diagnostics, scale: f64) -> f64 {
    if !now.total.is_finite() {
        return f64::NAN;
    }
    if simulation.method().is_static() {
        return 0.0;
    }
    let supplied = now.balance.map_or(0.0, |balance| balance.turnover());
    now.energy().gain(&start.energy()) / (scale + supplied)
}
