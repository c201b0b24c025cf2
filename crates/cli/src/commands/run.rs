//! `pliant run`: from a scene to a recording.

mod closing;
pub(super) mod errors;
pub(super) mod keeper;
pub(super) mod probes;
pub(super) mod session;
mod statics;

use std::num::NonZeroU16;
use std::time::Duration;

use pliant::run::Summary;
use pliant_scene::assembly::{Report, UnstableStep};
use pliant_scene::{Scene, Source};
use rayon::ThreadPoolBuilder;

use super::{check, view};
use crate::arguments::RunArguments;
use crate::failure::{ExitStatus, Failure};
use crate::input::Input;
use crate::interrupt;
use crate::recording::{self, RunRecorder};
use crate::statistics::Statistics;
use crate::terminal::Terminal;

use closing::Closing;
use keeper::{CheckpointKeeper, Settings};
use session::Session;

pub(crate) fn execute(arguments: &RunArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    use_threads(arguments.options.threads)?;
    let input = Input::read(&arguments.scene, &arguments.set, arguments.options.until)?;
    let assembly = input.assemble(UnstableStep::Refuse)?;
    if terminal.verbose {
        terminal.note(&check::describe(&input, &assembly, terminal.width()));
    }
    let errors = arguments.errors.as_ref().map(|names| errors::quantities(names, &assembly)).transpose()?;
    // Before there is a file, so that no signal can leave it unfinished.
    let interrupted = interrupt::flag()?;
    let keeper = keeper(arguments, &input)?;
    let page = arguments.view.then(|| view::page_of(&recording::output(arguments)));
    if let Some(page) = &page {
        view::refuse_existing(page, arguments.options.force, "-o")?;
    }
    let table = probes::table(arguments, &assembly)?;
    let recording = RunRecorder::open(arguments, &input, &assembly)?;
    let keeper = keeper.map(|keeper| keeper.with_table(table.as_ref().map(|(file, _)| file)));
    let table = table.map(|(_, table)| table);
    let session =
        Session { input, assembly, recording, table, keeper, from: None, page, errors, interrupted };
    session.run(terminal)
}

/// The keeper of checkpoints; `None` without `--checkpoint`.
///
/// # Errors
/// There is a checkpoint already, or what is there is no file.
fn keeper(arguments: &RunArguments, input: &Input) -> Result<Option<CheckpointKeeper>, Failure> {
    let Some(interval) = arguments.options.checkpoint else { return Ok(None) };
    let output = recording::output(arguments);
    let path = recording::checkpoint_of(&output);
    if path.exists() && !arguments.options.force {
        return Err(Failure::usage(format!(
            "{0} exists; go on from it with `pliant resume {0}`, or replace it with `--force`",
            path.display()
        )));
    }
    let settings = Settings {
        recording: (!arguments.options.no_record).then(|| keeper::noted(&output, &path)),
        probes: arguments.probes.as_ref().map(|probes| keeper::noted(probes, &path)),
        interval,
        wall: 0.0,
        written: Source::from_path(&arguments.scene)?.text().to_owned(),
    };
    CheckpointKeeper::new(&path, settings, input).map(Some)
}

/// Closing lines of a run in a recording: messages for `/log`, the first of which are warnings for the
/// user, and how it ended.
pub fn closing(
    scene: &Scene,
    report: &Report,
    summary: &Summary,
) -> (Vec<(pliant_record::LogLevel, String)>, pliant_record::RecordedOutcome) {
    let statistics = Statistics::new(scene, &[]);
    let closing = Closing::new(scene, report, summary, &statistics, None, Duration::ZERO);
    (closing.messages(), closing.recorded_outcome())
}

/// Makes this many threads do the work, all cores without a number, the one that calls among them: to hand
/// every loop to others and wait costs a cloth in contact a tenth of its time. The result is the same bits
/// for any.
///
/// # Errors
/// So many threads cannot be started, or others are there already.
pub(super) fn use_threads(threads: Option<NonZeroU16>) -> Result<(), Failure> {
    if rayon::current_thread_index().is_some() {
        return Ok(());
    }
    // Without a number rayon goes by `RAYON_NUM_THREADS`, and by the cores.
    let pool = ThreadPoolBuilder::new().use_current_thread();
    let pool = pool.num_threads(threads.map_or(0, |threads| usize::from(threads.get())));
    match (pool.build_global(), threads) {
        (Err(error), Some(threads)) => {
            Err(Failure::failed("threads", format!("cannot start {threads} threads: {error}")))
        }
        // Where no number is asked for, threads that are there already serve, too.
        _ => Ok(()),
    }
}
