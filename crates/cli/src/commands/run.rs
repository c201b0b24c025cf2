//! `pliant run`: from a scene to a recording.

mod closing;
mod probes;
mod statics;

use std::io::IsTerminal;
use std::sync::Arc;
use std::time::{Duration, Instant};

use pliant::assembly::{Report, UnstableStep};
use pliant::observer::Observer;
use pliant::record;
use pliant::run::{self, Outcome, Summary};
use pliant::scene::Scene;
use rayon::ThreadPoolBuilder;

use super::check;
use crate::arguments::RunArguments;
use crate::failure::{Failure, Status, label};
use crate::input::Input;
use crate::interrupt;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::statistics::Statistics;
use crate::terminal::Terminal;

use closing::Closing;

pub(crate) fn execute(arguments: &RunArguments, terminal: Terminal) -> Result<Status, Failure> {
    if let Some(threads) = arguments.threads {
        use_threads(usize::from(threads.get()))?;
    }
    let input = Input::read(&arguments.scene, &arguments.set, arguments.until)?;
    let mut assembly = input.assemble(UnstableStep::Refuse)?;
    if terminal.verbose {
        terminal.note(&check::describe(&assembly.report, terminal.width()));
    }
    // Before there is a file, so that no signal can leave it unfinished.
    let interrupted = interrupt::flag()?;
    let mut table = probes::table(arguments, &assembly)?;
    let mut recording = Recording::open(arguments, &input, &assembly)?;

    let plan = input.scene.plan();
    let simulation = &mut assembly.simulation;
    let wants_bar = std::io::stderr().is_terminal() && !terminal.quiet && !terminal.json;
    let mut progress = wants_bar.then(|| {
        let start = simulation.diagnostics();
        let scale = run::energy_scale(simulation, &start);
        Progress::new(assembly.report.frames, plan.duration, scale)
    });
    let mut statistics = Statistics::new(&input.scene);
    let started = Instant::now();
    let summary = {
        let mut observers: Vec<&mut dyn Observer> = vec![&mut statistics];
        observers.extend(recording.observer());
        observers.extend(table.as_mut().map(|table| table as &mut dyn Observer));
        observers.extend(progress.as_mut().map(|progress| progress as &mut dyn Observer));
        run::count_losses_for(simulation, &observers);
        simulation.set_stop(Some(Arc::clone(interrupted)));
        run::run(simulation, &plan, &mut observers, interrupted)
    };
    let wall = started.elapsed();
    if let Some(progress) = progress {
        progress.clear();
    }

    let statics = assembly.simulation.static_state(&assembly.topology);
    let closing = Closing::new(&input.scene, &assembly.report, &summary, &statistics, statics.as_ref(), wall);
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
    if let Some(recorded) = &recorded {
        terminal.report(&closing::how_to_open(recorded))?;
    }
    terminal.document(&closing.document(input.source.name(), recorded.as_ref()))?;
    Ok(closing.status())
}

/// What the end of a run leaves in a recording: messages for `/log`, the first of which are warnings for the user, and how it ended.
pub fn closing(
    scene: &Scene,
    report: &Report,
    summary: &Summary,
) -> (Vec<(record::Level, String)>, record::Outcome) {
    let statistics = Statistics::new(scene);
    let closing = Closing::new(scene, report, summary, &statistics, None, Duration::ZERO);
    (closing.messages(), closing.recorded_outcome())
}

/// Makes this many threads do the work. The result is the same bits for any number.
fn use_threads(threads: usize) -> Result<(), Failure> {
    ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .map_err(|error| Failure::failed("threads", format!("cannot start {threads} threads: {error}")))
}
