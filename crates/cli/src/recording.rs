//! The file that a run is recorded to, or none.

use std::path::{Path, PathBuf};

use pliant::observer::Observer;
use pliant_record::{
    Beginning, LogLevel, MAX_LOSS, McapRecorder, Options, RecordError, Recorded, RecordedOutcome,
};
use pliant_scene::assembly::Assembly;

use crate::arguments::RunArguments;
use crate::failure::Failure;
use crate::input::Input;

/// The recorder of a run; without one with `--no-record`.
pub(crate) struct RunRecorder(Option<McapRecorder>);

impl RunRecorder {
    /// Opens the output.
    ///
    /// # Errors
    /// It exists, is left over from a killed run, is a directory or the scene itself, or cannot be written.
    pub(crate) fn open(
        arguments: &RunArguments,
        input: &Input,
        assembly: &Assembly,
    ) -> Result<RunRecorder, Failure> {
        if arguments.options.no_record {
            return Ok(RunRecorder(None));
        }
        let scene = &arguments.scene;
        let path = output(arguments);
        Failure::unless_file(&path)?;
        if path.canonicalize().is_ok_and(|path| scene.canonicalize().is_ok_and(|scene| scene == path)) {
            return Err(Failure::usage(format!("{} is the scene; choose another output", path.display())));
        }
        let options = options(input, assembly, arguments.options.force);
        let recorder = McapRecorder::create(&path, &options, &assembly.topology);
        recorder.map(|recorder| RunRecorder(Some(recorder))).map_err(|error| refusal(&error, &path))
    }

    /// No recording.
    pub(crate) fn none() -> RunRecorder {
        RunRecorder(None)
    }

    /// Opens the output of a run that goes on after the frames of `beginning`.
    ///
    /// # Errors
    /// As [`open`](Self::open); the frames are not there.
    pub(crate) fn resume(
        path: &Path,
        overwrite: bool,
        input: &Input,
        assembly: &Assembly,
        beginning: Beginning<'_>,
    ) -> Result<RunRecorder, Failure> {
        Failure::unless_file(path)?;
        let options = options(input, assembly, overwrite);
        let recorder = McapRecorder::resume(path, &options, &assembly.topology, beginning);
        recorder.map(|recorder| RunRecorder(Some(recorder))).map_err(|error| Failure::recording(&error))
    }

    /// The file, as it will be called.
    pub(crate) fn path(&self) -> Option<&Path> {
        self.0.as_ref().map(McapRecorder::path)
    }

    /// The observer that shows the frames to the file.
    pub(crate) fn observer(&mut self) -> Option<&mut dyn Observer> {
        self.0.as_mut().map(|recorder| recorder as &mut dyn Observer)
    }

    /// Writes what the run has to say, notes how it ended, and gives the file its name.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn finish(
        self,
        messages: &[(LogLevel, String)],
        outcome: &RecordedOutcome,
    ) -> Result<Option<Recorded>, Failure> {
        let Some(recorder) = self.0 else { return Ok(None) };
        let finished = finish(recorder, messages, outcome);
        finished.map(Some).map_err(|error| {
            // Without a frame in it, the error does not say that what was written before is safe.
            let advice = match &error {
                RecordError::Write { path, frame: None, .. } if path.exists() => {
                    format!("; `pliant recover {}` keeps its frames", path.display())
                }
                _ => String::new(),
            };
            Failure::failed("recording", format!("{error}{advice}"))
        })
    }
}

/// Why the recording `path` cannot be begun; where a run to it has left a checkpoint, that it can go on.
fn refusal(error: &RecordError, path: &Path) -> Failure {
    let checkpoint = checkpoint_of(path);
    match error {
        RecordError::LeftOver { .. } if checkpoint.exists() => {
            Failure::usage(format!("{error}; `pliant resume {}` goes on with it", checkpoint.display()))
        }
        _ => Failure::recording(error),
    }
}

/// The checkpoint of a recording: its name with `.checkpoint` in place of `.mcap`.
pub(crate) fn checkpoint_of(recording: &Path) -> PathBuf {
    let is_mcap = recording.extension().is_some_and(|extension| extension == "mcap");
    let mut name = if is_mcap { recording.with_extension("") } else { recording.to_owned() }.into_os_string();
    name.push(".checkpoint");
    name.into()
}

/// Content of the recording of a scene.
pub(crate) fn options(input: &Input, assembly: &Assembly, overwrite: bool) -> Options {
    Options {
        overwrite,
        channels: input.scene.output.channels.clone(),
        title: input.scene.title.clone(),
        probes: assembly.probes.clone(),
        reactions: assembly.simulation.reaction_names(),
        scene_text: input.source.text().to_owned(),
        max_loss: MAX_LOSS,
        ..Options::default()
    }
}

fn finish(
    mut recorder: McapRecorder,
    messages: &[(LogLevel, String)],
    outcome: &RecordedOutcome,
) -> Result<Recorded, RecordError> {
    for (level, message) in messages {
        recorder.log(*level, message, outcome.time)?;
    }
    recorder.finish_with(outcome)
}

/// The file that a run is recorded to: by default `<stem of the scene>.mcap` in the working directory.
pub(crate) fn output(arguments: &RunArguments) -> PathBuf {
    arguments.options.output.clone().unwrap_or_else(|| default_output(&arguments.scene))
}

fn default_output(scene: &Path) -> PathBuf {
    let mut name = scene.file_stem().unwrap_or(scene.as_os_str()).to_owned();
    name.push(".mcap");
    PathBuf::from(name)
}
