//! Replay of command logs into recordings.

use std::path::Path;

use pliant_record::Recorded;
use pliant_scene::Source;
use pliant_scene::experiment::{CommandLog, Experiment};

use crate::LiveError;
use crate::recording::LiveRecording;

/// Replays the steps and commands of `log` on `source` and records them to `path` below `folder`. The
/// file has the same bytes as a live recording from the start to the end of the log without going back.
///
/// # Errors
/// The log belongs to another scene; the recording exists or cannot be written.
pub fn replay(source: Source, log: &CommandLog, folder: &Path, path: &Path) -> Result<Recorded, LiveError> {
    let mut recording = None;
    let mut first_error = Ok(());
    let experiment = Experiment::replay(source, log, |experiment| {
        let recorded = match &mut recording {
            None => LiveRecording::begin(folder, path, experiment).map(|begun| recording = Some(begun)),
            Some(recording) => recording.after_step(experiment),
        };
        if first_error.is_ok() {
            first_error = recorded;
        }
    })?;
    first_error?;
    let recording = recording.ok_or_else(|| LiveError::Outside { path: path.to_owned() })?;
    recording.end(&experiment)
}
