//! Sizes of the steps of a run.
//!
//! Step sizes that follow the error are found in a run of their own, and every later pass over it takes
//! the same steps: derivatives are those of the run at the sizes that were chosen, which do not change with
//! what they are taken by.

use pliant::simulation::{Simulation, Snapshot, StepError};

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
    /// Number of steps of the run.
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
}

impl Schedule {
    /// The steps that `simulation` takes from where it is, which it then goes back to.
    ///
    /// # Errors
    /// A step that fails, or a run that is told to stop.
    pub(crate) fn of(simulation: &mut Simulation, length: RunLength<'_>) -> Result<Self, GradientError> {
        let first = simulation.state().step;
        if simulation.step_control().is_none() {
            let steps = match length {
                RunLength::Steps(steps) => steps,
                RunLength::Times(times) => {
                    let span = times.last().map_or(0.0, |last| last - simulation.state().time);
                    (span / simulation.step_size()).round().max(0.0) as u64
                }
            };
            return Ok(Schedule { first, steps, chosen: None });
        }
        // What a solver has learnt may decide whether a step is solved: each run begins without.
        let start = simulation.snapshot();
        simulation.restore(&start)?;
        let mut chosen = vec![];
        let mut step_towards = |simulation: &mut Simulation, target: f64| {
            if simulation.system().is_stopped() {
                return Err(GradientError::Stopped { step: simulation.state().step });
            }
            simulation.step_towards(target)?;
            chosen.push(ChosenStep { size: simulation.last_step_size(), end: simulation.state().time });
            Ok(())
        };
        match length {
            RunLength::Steps(steps) => {
                for _ in 0..steps {
                    step_towards(simulation, f64::INFINITY)?;
                }
            }
            RunLength::Times(times) => {
                for time in times {
                    while simulation.state().time < *time {
                        step_towards(simulation, *time)?;
                    }
                }
            }
        }
        let end = simulation.snapshot();
        simulation.restore(&start)?;
        Ok(Schedule { first, steps: chosen.len() as u64, chosen: Some((chosen, end)) })
    }

    fn chosen(&self, step: u64) -> Option<ChosenStep> {
        let (chosen, _) = self.chosen.as_ref()?;
        chosen.get((step - self.first) as usize).copied()
    }

    /// Size of the step after so many [s].
    pub(crate) fn step_size(&self, simulation: &Simulation, step: u64) -> f64 {
        self.chosen(step).map_or(simulation.step_size(), |chosen| chosen.size)
    }

    /// Takes the next step of `simulation`.
    ///
    /// # Errors
    /// The step fails.
    pub(crate) fn step(&self, simulation: &mut Simulation) -> Result<(), StepError> {
        match self.chosen(simulation.state().step) {
            Some(ChosenStep { size, end }) => simulation.repeat_step(size, end),
            None => simulation.step(),
        }
    }

    /// The end of the run as it was when its steps were chosen, with what they have taught.
    pub(crate) fn end(&self) -> Option<&Snapshot> {
        self.chosen.as_ref().map(|(_, end)| end)
    }
}
