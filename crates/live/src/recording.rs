//! Recordings of a running scene, with their command logs.

use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};

use pliant::observer::{Frame, Quantities};
use pliant_files::{disk, durable_file, regular_file};
use pliant_record::RecordError;
use pliant_record::{MAX_LOSS, McapRecorder, Options, Recorded, RecordedOutcome, RecordedStatus};
use pliant_scene::Channel;
use pliant_scene::experiment::Experiment;

use crate::LiveError;

/// Suffix of the log of a recording.
const LOG: &str = ".commands.jsonl";

/// Recording from some step on, with the rate and channels of the scene.
pub(crate) struct LiveRecording {
    recorder: McapRecorder,
    /// Path as given.
    pub(crate) path: PathBuf,
    /// Time of the first frame [s].
    begin: f64,
}

impl LiveRecording {
    /// Starts a recording at the present state; `path` is below `folder`.
    ///
    /// # Errors
    /// [`LiveError::Outside`]; the file exists or cannot be written.
    pub(crate) fn begin(folder: &Path, path: &Path, experiment: &mut Experiment) -> Result<Self, LiveError> {
        let full = folder.join(confined(path)?);
        let mut channels = experiment.scene().output.channels.clone();
        if !channels.contains(&Channel::State) {
            channels.push(Channel::State);
        }
        let log = log_of(&full);
        if disk::exists(&log) {
            return Err(RecordError::Exists { path: log }.into());
        }
        let recorder = McapRecorder::create(&full, &options(experiment, channels), experiment.topology())?;
        let begin = experiment.simulation().state().time;
        let mut recording = LiveRecording { recorder, path: path.to_owned(), begin };
        recording.after_step(experiment)?;
        Ok(recording)
    }

    /// Records the present state if it is due.
    ///
    /// # Errors
    /// A write error.
    pub(crate) fn after_step(&mut self, experiment: &mut Experiment) -> Result<(), LiveError> {
        let (index, rate) = (self.recorder.frames(), experiment.scene().output.rate);
        let (time, h) = (experiment.simulation().state().time, experiment.simulation().step_size());
        // The step nearest to the frame's time; a product, so that no rounding accumulates.
        if time + 0.5 * h >= self.begin + index as f64 / rate {
            record(&mut self.recorder, experiment)?;
        }
        Ok(())
    }

    /// Content of a complete file with the frames so far. The recording goes on.
    ///
    /// # Errors
    /// An error of writing or reading.
    pub(crate) fn so_far(&mut self) -> Result<Vec<u8>, LiveError> {
        let copy = durable_file::with_suffix(self.recorder.path(), ".copy");
        let copied = self.recorder.copy_to(&copy).map_err(LiveError::from);
        let read = copied.and_then(|()| content(&copy));
        // Nothing but room is lost if it stays.
        let _ = disk::remove_file(&copy);
        read
    }

    /// Finishes the file, and writes the log of all commands next to it.
    ///
    /// # Errors
    /// A write error.
    pub(crate) fn end(self, experiment: &Experiment) -> Result<Recorded, LiveError> {
        let state = experiment.simulation().state();
        let message = experiment.failure().map(|failure| failure.message.clone());
        let status = match message {
            Some(_) => RecordedStatus::Failed,
            None => RecordedStatus::Completed,
        };
        let (step, time) = (Some(state.step), state.time);
        let outcome = RecordedOutcome { status, step, time, message: message.unwrap_or_default() };
        let recorded = self.recorder.finish_with(&outcome)?;
        let log = log_of(&recorded.path);
        let what = || format!("cannot write {}", log.display());
        let text = experiment.log().to_json_lines().map_err(std::io::Error::from);
        let written = text.and_then(|text| durable_file::replace(&log, text.as_bytes()));
        written.map_err(LiveError::system(what()))?;
        Ok(recorded)
    }
}

/// Content of a recording.
///
/// # Errors
/// The file cannot be read.
pub(crate) fn content(path: &Path) -> Result<Vec<u8>, LiveError> {
    regular_file::read(path).map_err(LiveError::system(format!("cannot read {}", path.display())))
}

/// Removes a recording and its log, if they exist.
///
/// # Errors
/// They cannot be removed.
pub(crate) fn forget(folder: &Path, path: &Path) -> Result<(), LiveError> {
    let full = folder.join(confined(path)?);
    for path in [log_of(&full), full] {
        match disk::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                return Err(LiveError::system(format!("cannot remove {}", path.display()))(error));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Path of the log of a recording.
fn log_of(recording: &Path) -> PathBuf {
    durable_file::with_suffix(&recording.with_extension(""), LOG)
}

/// Returns the path if it stays below the directory it is relative to.
fn confined(path: &Path) -> Result<&Path, LiveError> {
    if path.to_str().is_none_or(|text| text.contains(char::is_control)) {
        return Err(LiveError::Name { path: path.to_owned() });
    }
    let is_confined = path.components().all(|part| matches!(part, Component::Normal(_)));
    if is_confined && path.file_name().is_some() {
        return Ok(path);
    }
    Err(LiveError::Outside { path: path.to_owned() })
}

/// Recording options of an experiment.
pub(crate) fn options(experiment: &Experiment, channels: Vec<Channel>) -> Options {
    Options {
        channels,
        title: experiment.scene().title.clone(),
        probes: experiment.probes().to_vec(),
        reactions: experiment.simulation().reaction_names(),
        scene_text: experiment.source().text().to_owned(),
        max_loss: MAX_LOSS,
        ..Options::default()
    }
}

/// Records the present state.
///
/// # Errors
/// A write error.
pub(crate) fn record(recorder: &mut McapRecorder, experiment: &mut Experiment) -> Result<(), RecordError> {
    use pliant::observer::Observer;
    let (quantities, index) = (recorder.quantities(), recorder.frames());
    let simulation = experiment.simulation_mut();
    let diagnostics = quantities.contains(Quantities::DIAGNOSTICS).then(|| simulation.diagnostics());
    let show = |frame: &Frame<'_>| recorder.record(frame);
    Frame::of_state(simulation, index, quantities, diagnostics.as_ref(), show)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recordings_stay_below_the_working_folder() {
        for inside in ["a.mcap", "runs/a.mcap"] {
            assert!(confined(Path::new(inside)).is_ok(), "{inside}");
        }
        for outside in [
            "",
            "/tmp/a.mcap",
            "../a.mcap",
            "runs/../../a.mcap",
            "./a.mcap",
            "..",
            "a\u{1b}[31m.mcap",
            "a\n.mcap",
        ] {
            assert!(confined(Path::new(outside)).is_err(), "{outside}");
        }
        assert_eq!(log_of(Path::new("a/run.mcap")), Path::new("a/run.commands.jsonl"));
    }
}
