//! `pliant resume`: goes on with a run from its last checkpoint.

use std::cmp::Ordering;
use std::path::{Path, PathBuf};

use pliant::probe;
use pliant::run::RunState;
use pliant_record::checkpoint::CheckpointFile;
use pliant_record::{Beginning, RecordedStatus, read};
use pliant_scene::Source;
use pliant_scene::assembly::{Assembly, UnstableStep};
use serde_json::json;

use super::check;
use super::run::keeper::{self, CheckpointKeeper, Settings};
use super::run::probes::{self, TableEnd};
use super::run::session::Session;
use super::run::use_threads;
use crate::arguments::ResumeArguments;
use crate::failure::{ExitStatus, Failure};
use crate::input::Input;
use crate::interrupt;
use crate::recording::RunRecorder;
use crate::terminal::Terminal;
use crate::text::number;

pub(crate) fn execute(arguments: &ResumeArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    use_threads(arguments.options.threads)?;
    let path = &arguments.file;
    let from = CheckpointFile::read(path).map_err(|error| Failure::checkpoint(&error))?;
    let (Some(state), Some(settings)) = (&from.run, Settings::of(&from)) else {
        return Err(Failure::usage(format!(
            "{0} is a simulation that Python has saved, not a run: \
             `pliant.Simulation.restore({0:?})` goes on from it",
            path.display()
        )));
    };
    let input = Input::of(from.scene.source(), arguments.options.until)?;
    let assembly = input.assemble(UnstableStep::Refuse)?;
    let recording = recording_of(arguments, &settings)?;
    let elapsed = state.elapsed();
    match state.against(&input.scene.plan(), &assembly.simulation) {
        Ordering::Greater => return Err(too_far(path, elapsed, &input)),
        Ordering::Equal if is_recorded(recording.as_deref(), state) => {
            return complete(path, elapsed, terminal);
        }
        _ => {}
    }
    if terminal.verbose {
        terminal.note(&check::describe(&input, &assembly, terminal.width()));
    }
    note_changes(&from, &settings, terminal);
    session(arguments, recording.as_deref(), from, settings, input, assembly)?.run(terminal)
}

/// The rest of the run.
fn session(
    arguments: &ResumeArguments,
    recording: Option<&Path>,
    from: CheckpointFile,
    settings: Settings,
    input: Input,
    assembly: Assembly,
) -> Result<Session, Failure> {
    let path = &arguments.file;
    // Before there is a file, so that no signal can leave it unfinished.
    let interrupted = interrupt::flag()?;
    let begun = settings.recording.as_ref().map(|noted| keeper::resolved(noted, path));
    let (probes, end) = (table_of(arguments, &settings)?, table_end(&from));
    // Before the recording is opened: where the command is refused, no file has changed.
    let table = probes
        .as_deref()
        .map(|path| Ok::<_, Failure>((path, probes::found(path, end, &assembly)?)))
        .transpose()?;
    let opened = open(arguments, recording, begun.as_deref(), &from, &input, &assembly)?;
    let table = table.map(|(path, file)| probes::resumed(file, path, end, &assembly)).transpose()?;
    let settings = Settings {
        recording: recording.map(|recording| keeper::noted(recording, path)),
        probes: probes.as_deref().map(|probes| keeper::noted(probes, path)),
        interval: arguments.options.checkpoint.unwrap_or(settings.interval),
        ..settings
    };
    let keeper =
        CheckpointKeeper::new(path, settings, &input)?.with_table(table.as_ref().map(|(file, _)| file));
    let table = table.map(|(_, table)| table);
    let (keeper, from) = (Some(keeper), Some(from));
    Ok(Session {
        input,
        assembly,
        recording: opened,
        table,
        keeper,
        from,
        page: None,
        errors: None,
        interrupted,
    })
}

/// The run has gone farther than it is asked to go.
fn too_far(path: &Path, elapsed: f64, input: &Input) -> Failure {
    Failure::usage(format!(
        "{} is at t = {} s, beyond the {} s that `--until` asks for",
        path.display(),
        number(elapsed),
        number(input.scene.plan().duration),
    ))
}

/// The file that the run is recorded to from now on; `None` without one.
fn recording_of(arguments: &ResumeArguments, settings: &Settings) -> Result<Option<PathBuf>, Failure> {
    let noted = settings.recording.as_ref().filter(|_| !arguments.options.no_record);
    let said = arguments.options.output.as_deref();
    noted.map(|noted| keeper::writable(noted, said, &arguments.file, ("the recording", "-o"))).transpose()
}

/// The table of probes that the run has written so far; `None` without one.
fn table_of(arguments: &ResumeArguments, settings: &Settings) -> Result<Option<PathBuf>, Failure> {
    let said = arguments.probes.as_deref();
    match &settings.probes {
        None if said.is_some() => {
            Err(Failure::usage("`--probes` has nothing to go on with: the run wrote no table of probes"))
        }
        None => Ok(None),
        Some(noted) => {
            let table = keeper::writable(noted, said, &arguments.file, ("the table", "--probes"))?;
            if said.is_none() && table.is_symlink() {
                let table = table.display();
                let message = format!("{table} is a link; to write where it leads, add `--probes {table}`");
                return Err(Failure::usage(message));
            }
            Ok(Some(table))
        }
    }
}

/// Where the table of probes ended at a checkpoint.
fn table_end(from: &CheckpointFile) -> TableEnd {
    let written = probe::written_at(&from.notes).unwrap_or(0);
    TableEnd { written, time: from.run.as_ref().and_then(RunState::last_frame_time) }
}

/// Opens the recording behind the frames that were recorded before the checkpoint.
fn open(
    arguments: &ResumeArguments,
    recording: Option<&Path>,
    begun: Option<&Path>,
    from: &CheckpointFile,
    input: &Input,
    assembly: &Assembly,
) -> Result<RunRecorder, Failure> {
    if recording.is_some_and(|recording| keeper::is_one(recording, &arguments.file)) {
        return Err(Failure::usage(format!(
            "{} is the checkpoint; choose another output",
            arguments.file.display()
        )));
    }
    let (Some(recording), Some(begun)) = (recording, begun) else {
        return match &arguments.options.output {
            Some(_) => Err(Failure::usage("`-o` has nothing to go on with: the run was not recorded")),
            None => Ok(RunRecorder::none()),
        };
    };
    let frames = from.run.as_ref().map_or(0, RunState::frames);
    let beginning = Beginning { path: begun, scene_text: &from.scene.text, frames };
    RunRecorder::resume(recording, arguments.options.force, input, assembly, beginning)
}

/// True if the recording, if there is one, has its last frame too.
fn is_recorded(recording: Option<&Path>, state: &RunState) -> bool {
    recording.is_none_or(|recording| {
        let found = read::info(recording).ok();
        let outcome = found.and_then(|info| info.outcome);
        outcome.is_some_and(|outcome| {
            outcome.status == RecordedStatus::Completed && outcome.step == Some(state.reached_step())
        })
    })
}

/// Says that nothing is left to be done.
fn complete(path: &Path, elapsed: f64, terminal: Terminal) -> Result<ExitStatus, Failure> {
    terminal.report(&format!(
        "the run of {} is complete: it reached t = {} s; `--until` takes it further",
        path.display(),
        number(elapsed),
    ))?;
    terminal.document(&json!({ "status": ExitStatus::Done, "complete": true, "time": elapsed }))?;
    Ok(ExitStatus::Done)
}

/// Says that the scene file has changed: the run goes on with the scene that the checkpoint holds.
fn note_changes(from: &CheckpointFile, settings: &Settings, terminal: Terminal) {
    let name = Path::new(&from.scene.name).file_name().unwrap_or_default();
    let place = from.scene.directory.join(name);
    let now = Source::from_path(&place);
    if now.is_ok_and(|now| now.text() != settings.written) {
        terminal.note(&format!(
            "{} has changed since; the run goes on with the scene that it began with",
            place.display()
        ));
    }
}
