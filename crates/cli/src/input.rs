//! From the command line to a scene and its assembly.

use pliant::assembly::{Assembly, UnstableStep};
use pliant::scene::{Problem, Scene, SceneError, Source};

use crate::arguments::SceneArguments;
use crate::failure::Failure;

/// A scene with the text that it came from, in which errors are shown.
pub(crate) struct Input {
    /// The text, changes included.
    pub(crate) source: Source,
    /// What it says.
    pub(crate) scene: Scene,
}

impl Input {
    /// Reads a scene and applies `--set`; `until` replaces its duration [s].
    ///
    /// # Errors
    /// The scene cannot be read, changed or simulated.
    pub(crate) fn read(arguments: &SceneArguments, until: Option<f64>) -> Result<Input, Failure> {
        let mut changes = arguments.set.clone();
        // By the same way as `--set`, so that the recorded scene is the one that was run.
        changes.extend(until.map(|seconds| format!("time.duration={seconds:?}")));
        let source = Source::from_path(&arguments.scene)?;
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
