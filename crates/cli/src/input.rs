//! From the command line to a scene and its assembly.

use std::path::Path;

use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{Problem, Scene, SceneError, Source};

use crate::failure::Failure;

/// A scene with the text that it came from, in which errors are shown.
pub(crate) struct Input {
    /// The text, changes included.
    pub(crate) source: Source,
    /// Its contents.
    pub(crate) scene: Scene,
}

impl Input {
    /// Reads a scene and applies the changes of `--set`; `until` replaces its duration [s].
    ///
    /// # Errors
    /// The scene cannot be read, changed or simulated.
    pub(crate) fn read(path: &Path, set: &[String], until: Option<f64>) -> Result<Input, Failure> {
        let changes = set.iter().map(|set| change(set)).collect::<Result<Vec<_>, _>>()?;
        Self::changed(Source::from_path(path)?, changes, until)
    }

    /// The scene of a checkpoint; `until` replaces its duration [s].
    ///
    /// # Errors
    /// The scene cannot be simulated.
    pub(crate) fn of(source: Source, until: Option<f64>) -> Result<Input, Failure> {
        Self::changed(source, vec![], until)
    }

    fn changed(
        source: Source,
        mut changes: Vec<(String, String)>,
        until: Option<f64>,
    ) -> Result<Input, Failure> {
        // By the same way as `--set`, so that the recorded scene is the one that was run.
        changes.extend(until.map(|seconds| ("time.duration".to_owned(), format!("{seconds:?}"))));
        let source = source.with_overrides(&changes)?;
        let scene = source.scene()?;
        Ok(Input { source, scene })
    }

    /// Builds the simulation.
    ///
    /// # Errors
    /// The problems that show only then, located in the text.
    pub(crate) fn assemble(&self, unstable: UnstableStep) -> Result<Assembly, Failure> {
        self.scene.assemble(unstable).map_err(|problems| self.locate(problems).into())
    }

    /// Problems with their lines and columns.
    pub(crate) fn locate(&self, problems: Vec<Problem>) -> SceneError {
        self.source.error(problems)
    }
}

/// `path=value` in its two parts.
fn change(set: &str) -> Result<(String, String), Failure> {
    match set.split_once('=') {
        Some((path, value)) => Ok((path.trim().to_owned(), value.to_owned())),
        None => Err(Failure::usage(format!(
            "`--set {set}` gives no value; it is `--set PATH=VALUE`, for example `--set time.step=1e-3`"
        ))),
    }
}
