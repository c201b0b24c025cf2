//! The checkpoints of a run.

use std::fs::File;
use std::path::{Component, Path, PathBuf};
use std::time::{Duration, Instant};

use pliant::observer::{Notes, ObserverError};
use pliant::run::{Checkpoints, RunCheckpoint};
use pliant_record::checkpoint::{CheckpointContent, CheckpointFile, SavedScene};
use serde::{Deserialize, Serialize};

use crate::failure::Failure;
use crate::input::Input;

/// Name of the note of the command line.
const SETTINGS: &str = "command line";

/// Settings from the command line of a run, and how long it has taken: noted in every checkpoint.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Settings {
    /// Recording; relative to the checkpoint where it is beside it, `None` without one.
    pub(crate) recording: Option<PathBuf>,
    /// Table of probes, likewise.
    pub(crate) probes: Option<PathBuf>,
    /// Time between checkpoints [s].
    pub(crate) interval: f64,
    /// Time that steps and recording have taken [s].
    pub(crate) wall: f64,
    /// Text of the scene file, before changes on the command line.
    pub(crate) written: String,
}

impl Settings {
    /// The settings noted in a checkpoint; `None` where another program than the command line has kept it.
    pub(crate) fn of(file: &CheckpointFile) -> Option<Settings> {
        serde_json::from_slice(file.notes.get(SETTINGS)?).ok()
    }
}

/// Keeps one checkpoint, the last.
pub(crate) struct CheckpointKeeper {
    path: PathBuf,
    scene: SavedScene,
    settings: Settings,
    /// Table of probes, to be on the disk before a checkpoint is.
    table: Option<File>,
    started: Instant,
    last: Instant,
    /// Simulated time of the checkpoint that was kept last [s].
    time: f64,
}

impl CheckpointKeeper {
    /// A keeper of the checkpoint `path`.
    ///
    /// # Errors
    /// `path` is a directory or a device; a mesh file cannot be read.
    pub(crate) fn new(path: &Path, settings: Settings, input: &Input) -> Result<CheckpointKeeper, Failure> {
        Failure::unless_file(path)?;
        let scene = SavedScene::new(&input.source, &input.scene);
        let scene = scene.map_err(|error| Failure::checkpoint(&error))?;
        let now = Instant::now();
        let path = path.to_owned();
        Ok(CheckpointKeeper { path, scene, settings, table: None, started: now, last: now, time: 0.0 })
    }

    /// Waits for the disk to have `table` before it keeps a checkpoint.
    pub(crate) fn with_table(self, table: Option<&File>) -> CheckpointKeeper {
        CheckpointKeeper { table: table.and_then(|table| table.try_clone().ok()), ..self }
    }

    /// The checkpoint.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Simulated time of the checkpoint that was kept last [s].
    pub(crate) fn time(&self) -> f64 {
        self.time
    }

    /// Time that steps and recording had taken before this process went on.
    pub(crate) fn earlier(&self) -> Duration {
        Duration::try_from_secs_f64(self.settings.wall).unwrap_or_default()
    }

    fn write(&self, checkpoint: &RunCheckpoint) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
        if let Some(table) = &self.table {
            table.sync_all()?;
        }
        let wall = self.settings.wall + self.started.elapsed().as_secs_f64();
        let mut notes: Notes = checkpoint.notes.clone();
        notes.insert(SETTINGS.into(), serde_json::to_vec(&Settings { wall, ..self.settings.clone() })?);
        let RunCheckpoint { simulation, run, .. } = checkpoint;
        let content = CheckpointContent { scene: &self.scene, simulation, run: Some(run), notes: &notes };
        Ok(content.write(&self.path)?)
    }
}

impl Checkpoints for CheckpointKeeper {
    fn is_due(&mut self, _: u64) -> bool {
        self.last.elapsed().as_secs_f64() >= self.settings.interval
    }

    fn keep(&mut self, checkpoint: &RunCheckpoint) -> Result<(), ObserverError> {
        let written = self.write(checkpoint);
        // From its end on: where the disk is slow, steps are not left behind.
        self.last = Instant::now();
        self.time = checkpoint.simulation.snapshot().time;
        written.map_err(|source| ObserverError { what: "keeping a checkpoint".into(), source })
    }
}

/// True if both paths are one file that is there.
pub(crate) fn is_one(a: &Path, b: &Path) -> bool {
    same_file::is_same_file(a, b).unwrap_or(false)
}

/// The directory that `path` is in.
fn directory_of(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// `path` as the checkpoint `from` notes it: its name where both are in one directory, else all of it.
pub(crate) fn noted(path: &Path, from: &Path) -> PathBuf {
    match path.file_name() {
        Some(name) if is_one(directory_of(path), directory_of(from)) => name.into(),
        _ => std::path::absolute(path).unwrap_or_else(|_| path.to_owned()),
    }
}

/// The path that the checkpoint `from` has noted, to be read.
pub(crate) fn resolved(noted: &Path, from: &Path) -> PathBuf {
    from.parent().map_or_else(|| noted.to_owned(), |directory| directory.join(noted))
}

/// The path that the checkpoint `from` has noted, to be written: `said` where the command line names it, else
/// a file beside the checkpoint. A checkpoint may come from somebody else; what it names elsewhere is not its
/// to write to.
///
/// # Errors
/// It is not a bare name; `what` and `option` say so.
pub(crate) fn writable(
    noted: &Path,
    said: Option<&Path>,
    from: &Path,
    (what, option): (&str, &str),
) -> Result<PathBuf, Failure> {
    if let Some(said) = said {
        return Ok(said.to_owned());
    }
    let mut parts = noted.components();
    if let (Some(Component::Normal(name)), None) = (parts.next(), parts.next()) {
        return Ok(from.with_file_name(name));
    }
    Err(Failure::usage(format!(
        "{} names {what} {1}, which is not next to it; to write there, add `{option} {1}`",
        from.display(),
        noted.display()
    )))
}
