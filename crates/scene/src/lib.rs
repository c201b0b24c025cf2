//! Scenes: what a user writes. Text to plain data here; plain data to a simulation in
//! [`pliant::simulation`].
//!
//! [`Scene`] knows nothing of text. A [`Problem`] names its place by a [`KeyPath`]; [`Source`] finds the line
//! and column of that path when there is an error to show, and only then.
//!
//! ```
//! use pliant_scene::Scene;
//! let error = Scene::from_toml("dimension = 2\n[time]\nstep = 'small'").unwrap_err();
//! // Every mistake is told; this one beside what `[time]` lacks.
//! let step = error.problems().iter().find(|problem| problem.path.to_string() == "time.step").unwrap();
//! assert_eq!((step.line, step.column), (Some(3), Some(8)));
//! ```

// Loops over small fixed ranges index several arrays at once.
#![allow(clippy::needless_range_loop)]

pub mod assembly;
mod bounds;
mod deserialize;
mod document;
mod error;
pub mod experiment;
mod formulas;
mod json_schema;
mod key_path;
mod overrides;
mod render;
mod schema;
mod source;
mod suggest;
#[cfg(test)]
mod tests;
mod text;
mod validate;
pub mod vary;

use std::path::{Path, PathBuf};

pub use error::{Problem, ProblemKind, SceneError};
pub use json_schema::schema;
pub use key_path::{KeyPath, KeyPathError, KeySegment};
pub use schema::*;
pub use source::{Source, near_file};
pub use suggest::{meant, nearest};

impl Scene {
    /// Reads and validates a scene written in TOML.
    ///
    /// # Errors
    /// As for [`Source::scene`].
    pub fn from_toml(text: &str) -> Result<Scene, SceneError> {
        Source::new("<scene>", text).scene()
    }

    /// Reads and validates a scene file.
    ///
    /// # Errors
    /// The file cannot be read, and as for [`Source::scene`].
    pub fn from_path(path: impl AsRef<Path>) -> Result<Scene, SceneError> {
        Source::from_path(path)?.scene()
    }

    /// The scene as TOML, which reads as an equal scene. Comments and order of the text that it came from
    /// are lost; [`Source::text`] has them.
    ///
    /// # Errors
    /// A path that is not Unicode, which TOML cannot hold.
    pub fn to_toml(&self) -> Result<String, SceneError> {
        toml::to_string(self).map_err(|error| {
            let message = format!("the scene cannot be written as TOML: {error}");
            SceneError::new(vec![Problem::new(ProblemKind::Unwritable, KeyPath::root(), message)])
        })
    }

    /// Where a file named in the scene is.
    pub fn resolve(&self, path: &Path) -> PathBuf {
        self.directory.join(path)
    }

    /// Mesh files that the scene names, relative to its directory; of TetGen's pairs both.
    pub fn mesh_files(&self) -> Vec<PathBuf> {
        let files = self.body.iter().filter_map(|body| body.mesh.file().map(pliant_mesh::files));
        files.flatten().collect()
    }

    /// Everything that makes the scene impossible to simulate and shows without building meshes.
    pub fn validate(&self) -> Vec<Problem> {
        validate::problems(self)
    }
}
