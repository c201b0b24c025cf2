//! Sizes of the steps of a run.
//!
//! Step sizes that follow the error, and steps that are taken in parts, are found in a run of their own, and
//! every later pass over it takes the same steps: derivatives are those of the run at the sizes that were
//! chosen, which do not change with what they are taken by. Parts are steps of their own there, between whose
//! ends nothing is looked at.

use pliant::simulation::{Simulation, Snapshot};

use crate::GradientError;

/// End of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) enum RunLength<'a> {
    /// After so many steps.
    Steps(u64),
    /// At the last of these times, ascending [s]: steps land on each.
    Times(&'a [f64]),
}

/// The steps of a run.
pub(crate) struct Schedule {
    /// Steps before the run.
    first: u64,
    /// Number of steps of the run, each part of one counted.
    pub(crate) steps: u64,
    /// Steps that were chosen, and where they led to; none where all are of the fixed size.
    chosen: Option<(Vec<ChosenStep>, Snapshot)>,
}

/// A step whose size was chosen.
#[derive(Clone, Copy)]
struct ChosenStep {
    /// [s]
    size: f64,
    /// Time at its end [s].
    end: f64,
    /// Steps of the run before it, or before that which it is a part of.
    whole: u64,
    /// True but for parts that others of the same step follow.
    is_last: bool,
}

impl Schedule {
    /// The steps that `simulation` takes from where it is, which it then goes back to.
    ///
    /// # Errors
    /// A step that fails, or a run that is told to stop.
    pub(crate) fn of(simulation: &mut Simulation, length: RunLength<'_>) -> Result<Self, GradientError> {
        if !simulation.may_take_parts() {
            return Self::whole_steps(simulation, length);
        }
        Self::found(simulation, length)
    }

    /// Whole steps of a fixed size, which may be taken in parts: none of them is expected to be, and
    /// [`step`](Self::step) refuses those that are. Contact alone rarely asks for it, and a run of its own
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

    /// Number of the steps of a fixed size.
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
        // What a solver has learnt may decide whether a step is solved: each run begins without.
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

    /// Steps of the run before the one after so many, parts of one counted once.
    pub(crate) fn whole(&self, step: u64) -> u64 {
        self.chosen(step).map_or(step - self.first, |chosen| chosen.whole)
    }

    /// Number of the state after so many steps, as losses see it; `None` within a step.
    pub(crate) fn frame(&self, step: u64) -> Option<u64> {
        match step.checked_sub(self.first + 1).and_then(|last| self.chosen(self.first + last)) {
            Some(ChosenStep { whole, is_last, .. }) => is_last.then_some(self.first + whole + 1),
            None => Some(step),
        }
    }

    /// Number of steps of the run, parts of one counted once.
    pub(crate) fn frames(&self) -> u64 {
        self.steps.checked_sub(1).map_or(0, |last| self.whole(self.first + last) + 1)
    }

    /// Size of the step after so many [s].
    pub(crate) fn step_size(&self, simulation: &Simulation, step: u64) -> f64 {
        self.chosen(step).map_or(simulation.step_size(), |chosen| chosen.size)
    }

    /// Size of the step after so many over that of the one before; 1 for the first.
    pub(crate) fn growth(&self, simulation: &Simulation, step: u64) -> f64 {
        let before = if step > self.first { step - 1 } else { step };
        self.step_size(simulation, step) / self.step_size(simulation, before)
    }

    /// Takes the next step of `simulation`.
    ///
    /// # Errors
    /// The step fails, or is taken in parts that were not chosen.
    pub(crate) fn step(&self, simulation: &mut Simulation) -> Result<(), GradientError> {
        let step = simulation.state().step;
        if let Some(ChosenStep { size, end, .. }) = self.chosen(step) {
            return Ok(simulation.repeat_step(size, end)?);
        }
        simulation.step()?;
        if simulation.last_parts().is_empty() { Ok(()) } else { Err(GradientError::Parts { step }) }
    }

    /// The end of the run as it was when its steps were chosen, with what they have taught.
    pub(crate) fn end(&self) -> Option<&Snapshot> {
        self.chosen.as_ref().map(|(_, end)| end)
    }
}
