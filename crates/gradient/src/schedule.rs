//! Step sizes of a run for repeated passes.
//!
//! Adaptive step sizes, and subdivided steps, are determined in a separate run, and every later pass
//! repeats the same steps: derivatives are those of the run at these fixed sizes. The parts of a
//! subdivided step count as steps of their own; losses see only the ends of full steps.

use pliant::simulation::{Simulation, Snapshot};

use crate::GradientError;

/// Length of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) enum RunLength<'a> {
    /// Number of steps.
    Steps(u64),
    /// Times, ascending [s]: steps land on each, and the run ends at the last.
    Times(&'a [f64]),
}

/// Steps of a run.
pub(crate) struct Schedule {
    /// Number of steps before the run.
    first: u64,
    /// Number of steps of the run, counting each part.
    pub(crate) steps: u64,
    /// Steps determined beforehand, and the state after them; `None` if all have the fixed size.
    chosen: Option<(Vec<ChosenStep>, Snapshot)>,
}

/// Step whose size was determined beforehand.
#[derive(Clone, Copy)]
struct ChosenStep {
    /// Size [s].
    size: f64,
    /// Time at its end [s].
    end: f64,
    /// Number of full steps of the run before it, or before the one it is a part of.
    whole: u64,
    /// True for full steps and for the last part of one.
    is_last: bool,
}

impl Schedule {
    /// Determines the steps that `simulation` takes from its present state, to which it returns.
    ///
    /// # Errors
    /// A step that fails, or a run that is told to stop.
    pub(crate) fn of(simulation: &mut Simulation, length: RunLength<'_>) -> Result<Self, GradientError> {
        if !simulation.may_take_parts() {
            return Self::whole_steps(simulation, length);
        }
        Self::found(simulation, length)
    }

    /// Full steps of a fixed size, without a separate run: none is expected to be subdivided, and
    /// [`step`](Self::step) refuses those that are. Contact alone rarely needs it, and a separate run
    /// costs as much as the run.
    pub(crate) fn whole_steps(
        simulation: &mut Simulation,
        length: RunLength<'_>,
    ) -> Result<Self, GradientError> {
        if simulation.step_control().is_some() {
            return Self::found(simulation, length);
        }
        let first = simulation.state().step;
        Ok(Schedule { first, steps: Self::count(simulation, length), chosen: None })
    }

    /// Number of steps of a fixed size.
    fn count(simulation: &Simulation, length: RunLength<'_>) -> u64 {
        match length {
            RunLength::Steps(steps) => steps,
            RunLength::Times(times) => {
                let span = times.last().map_or(0.0, |last| last - simulation.state().time);
                (span / simulation.step_size()).round().max(0.0) as u64
            }
        }
    }

    fn found(simulation: &mut Simulation, length: RunLength<'_>) -> Result<Self, GradientError> {
        let first = simulation.state().step;
        let is_fixed = simulation.step_control().is_none();
        let count = Self::count(simulation, length);
        // Solver state may decide whether a step is solved: each run starts without.
        let start = simulation.snapshot();
        simulation.restore(&start)?;
        let mut chosen = vec![];
        let mut step_towards = |simulation: &mut Simulation, target: f64| -> Result<(), GradientError> {
            if simulation.system().is_stopped() {
                return Err(GradientError::Stopped { step: simulation.state().step });
            }
            simulation.step_towards(target)?;
            let whole = chosen.last().map_or(0, |last: &ChosenStep| last.whole + 1);
            let end = simulation.state().time;
            match simulation.last_parts() {
                [] => {
                    chosen.push(ChosenStep { size: simulation.last_step_size(), end, whole, is_last: true })
                }
                parts => chosen.extend(parts.iter().map(|&[size, part_end]| ChosenStep {
                    size,
                    end: part_end,
                    whole,
                    is_last: part_end == end,
                })),
            }
            Ok(())
        };
        // The run, and the return to its start.
        match length {
            RunLength::Times(times) if !is_fixed => {
                for time in times {
                    while simulation.state().time < *time {
                        step_towards(simulation, *time)?;
                    }
                }
            }
            _ => (0..count).try_for_each(|_| step_towards(simulation, f64::INFINITY))?,
        }
        let end = simulation.snapshot();
        simulation.restore(&start)?;
        Ok(Schedule { first, steps: chosen.len() as u64, chosen: Some((chosen, end)) })
    }

    fn chosen(&self, step: u64) -> Option<ChosenStep> {
        let (chosen, _) = self.chosen.as_ref()?;
        chosen.get((step - self.first) as usize).copied()
    }

    /// Number of full steps of the run before `step`.
    pub(crate) fn whole(&self, step: u64) -> u64 {
        self.chosen(step).map_or(step - self.first, |chosen| chosen.whole)
    }

    /// Index of the state after these steps, as losses see it; `None` within a full step.
    pub(crate) fn frame(&self, step: u64) -> Option<u64> {
        match step.checked_sub(self.first + 1).and_then(|last| self.chosen(self.first + last)) {
            Some(ChosenStep { whole, is_last, .. }) => is_last.then_some(self.first + whole + 1),
            None => Some(step),
        }
    }

    /// Number of full steps of the run.
    pub(crate) fn frames(&self) -> u64 {
        self.steps.checked_sub(1).map_or(0, |last| self.whole(self.first + last) + 1)
    }

    /// Size of the step after these steps [s].
    pub(crate) fn step_size(&self, simulation: &Simulation, step: u64) -> f64 {
        self.chosen(step).map_or(simulation.step_size(), |chosen| chosen.size)
    }

    /// Ratio of the size of the step after these steps to that of the one before; 1 for the first.
    pub(crate) fn growth(&self, simulation: &Simulation, step: u64) -> f64 {
        let before = if step > self.first { step - 1 } else { step };
        self.step_size(simulation, step) / self.step_size(simulation, before)
    }

    /// Takes the next step of `simulation`.
    ///
    /// # Errors
    /// A step that fails, or that is subdivided unexpectedly.
    pub(crate) fn step(&self, simulation: &mut Simulation) -> Result<(), GradientError> {
        let step = simulation.state().step;
        if let Some(ChosenStep { size, end, .. }) = self.chosen(step) {
            return Ok(simulation.repeat_step(size, end)?);
        }
        simulation.step()?;
        if simulation.last_parts().is_empty() { Ok(()) } else { Err(GradientError::Parts { step }) }
    }

    /// State at the end of the run when its steps were determined, including solver state.
    pub(crate) fn end(&self) -> Option<&Snapshot> {
        self.chosen.as_ref().map(|(_, end)| end)
    }
}
