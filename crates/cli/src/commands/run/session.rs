//! A run, from its first step or from a checkpoint on, to its last word.

use std::fs::File;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use pliant::observer::Observer;
use pliant::probe::Table;
use pliant::run::{self, Outcome, RunState, Summary};
use pliant_lab::quantity::QuantityOfInterest;
use pliant_record::checkpoint::CheckpointFile;
use pliant_scene::assembly::Assembly;

use super::closing::{self, Closing};
use super::errors;
use super::keeper::CheckpointKeeper;
use crate::commands::view;
use crate::failure::{ExitStatus, Failure, label};
use crate::input::Input;
use crate::progress::RunProgress;
use crate::recording::RunRecorder;
use crate::statistics::Statistics;
use crate::terminal::Terminal;
use crate::text::number;

/// Everything that a run needs.
pub(crate) struct Session {
    pub(crate) input: Input,
    pub(crate) assembly: Assembly,
    pub(crate) recording: RunRecorder,
    pub(crate) table: Option<Table<File>>,
    pub(crate) keeper: Option<CheckpointKeeper>,
    /// The checkpoint to go on from.
    pub(crate) from: Option<CheckpointFile>,
    /// Page of the recording, to be written at the end.
    pub(crate) page: Option<PathBuf>,
    /// Quantities whose errors are estimated after the run.
    pub(crate) errors: Option<Vec<QuantityOfInterest>>,
    /// Set by the signals that end a run.
    pub(crate) interrupted: &'static Arc<AtomicBool>,
}

impl Session {
    /// Takes the steps, finishes the recording and reports.
    ///
    /// # Errors
    /// The checkpoint is one of another scene; the recording or standard output cannot be written.
    pub(crate) fn run(mut self, terminal: Terminal) -> Result<ExitStatus, Failure> {
        let mut statistics = Statistics::new(&self.input.scene, &self.assembly.topology.bodies);
        let mut progress = self.progress(terminal);
        let started = Instant::now();
        let summary = self.take_steps(&mut statistics, progress.as_mut())?;
        let wall =
            started.elapsed() + self.keeper.as_ref().map(CheckpointKeeper::earlier).unwrap_or_default();
        if let Some(progress) = progress {
            progress.clear();
        }

        let Session { input, mut assembly, recording, keeper, page, errors, interrupted, .. } = self;
        let statics = assembly.simulation.static_state(&assembly.topology);
        let closing =
            Closing::new(&input.scene, &assembly.report, &summary, &statistics, statics.as_ref(), wall);
        let path = recording.path().map(|path| path.display().to_string());
        let trouble = closing.trouble(path.as_deref());
        let warnings = closing.warnings();
        let finished = match summary.outcome {
            // The file ends where writing it failed, and keeps its temporary name.
            Outcome::ObserverFailed(_) => Ok(None),
            _ => recording.finish(&closing.messages(), &closing.recorded_outcome()),
        };
        terminal.report(&closing.numbers(terminal.width()))?;
        for warning in &warnings {
            terminal.warn(warning);
        }
        let recorded = finished?;
        if let Some(trouble) = trouble {
            match summary.outcome {
                Outcome::Interrupted => terminal.complain(&trouble),
                _ => terminal.complain(&label("error", &trouble, terminal.color)),
            }
        }
        if let (Outcome::Interrupted, Some(keeper)) = (&summary.outcome, &keeper) {
            let (checkpoint, time) = (keeper.path().display(), number(keeper.time()));
            terminal.complain(&format!("`pliant resume {checkpoint}` goes on from t = {time} s"));
        }
        if let Some(recorded) = &recorded {
            terminal.report(&closing::how_to_open(recorded))?;
        }
        let mut document = closing.document(input.source.name(), recorded.as_ref());
        if let (Outcome::Done, Some(quantities)) = (&summary.outcome, &errors) {
            let budget = errors::estimated(&input.source, quantities, interrupted, terminal)?;
            terminal.report(&errors::described(&budget, terminal.width()))?;
            document["errors"] = serde_json::json!(budget);
        }
        if let (Some(page), Some(recorded)) = (page, &recorded) {
            document["view"] = view::show(&recorded.path, &page, true, terminal)?;
        }
        terminal.document(&document)?;
        Ok(closing.status())
    }

    /// The progress bar; `None` where standard error is no terminal.
    fn progress(&mut self, terminal: Terminal) -> Option<RunProgress> {
        let wanted = std::io::stderr().is_terminal() && !terminal.quiet && !terminal.json;
        wanted.then(|| {
            let simulation = &mut self.assembly.simulation;
            let start = simulation.diagnostics();
            let scale = run::energy_scale(simulation, &start);
            let duration = self.input.scene.plan().duration;
            let mut progress = RunProgress::new(self.assembly.report.frames, duration, scale);
            if let Some(state) = self.from.as_ref().and_then(|from| from.run.as_ref()) {
                progress.begin_from(state.start().conserved());
            }
            progress
        })
    }

    fn take_steps(
        &mut self,
        statistics: &mut Statistics,
        progress: Option<&mut RunProgress>,
    ) -> Result<Summary, Failure> {
        let plan = self.input.scene.plan();
        let simulation = &mut self.assembly.simulation;
        let mut state: Option<RunState> = None;
        if let Some(from) = self.from.take() {
            simulation.resume(&from.simulation).map_err(|error| Failure::usage(error.to_string()))?;
            statistics.resume(&from.notes);
            state = from.run;
        }
        let mut observers: Vec<&mut dyn Observer> = vec![statistics];
        observers.extend(self.recording.observer());
        observers.extend(self.table.as_mut().map(|table| table as &mut dyn Observer));
        observers.extend(progress.map(|progress| progress as &mut dyn Observer));
        if state.is_none() {
            run::count_losses_for(simulation, &observers);
        }
        Ok(match &mut self.keeper {
            None => {
                simulation.set_stop(Some(Arc::clone(self.interrupted)));
                run::run(simulation, &plan, &mut observers, self.interrupted)
            }
            Some(keeper) => {
                run::run_with_checkpoints(simulation, &plan, &mut observers, self.interrupted, keeper, state)
            }
        })
    }
}
