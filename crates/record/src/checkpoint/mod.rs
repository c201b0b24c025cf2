//! Checkpoint files, from which a simulation or a whole run is resumed in another process,
//! bit-identically.
//!
//! A file is self-contained except for meshes: it has the text of the scene, hashes of the mesh files it
//! names, the [state of the simulation](pliant::simulation::Checkpoint), that of the
//! [run](pliant::run::RunState), and notes of observers. All numbers are little-endian:
//!
//! | bytes | content |
//! |---|---|
//! | 8 | the bytes `89 50 4C 49 41 4E 54 0A`, `\x89PLIANT\n` |
//! | 4 | version of this format, 1 |
//! | 8 | number of bytes that follow the next 8 |
//! | 8 | FNV-1a hash of these |
//! | 2 | length of the next text |
//! | | version of the program, as UTF-8 |
//! | | content, as CBOR (RFC 8949): a map of `scene`, `simulation`, `run`, `notes` |
//!
//! Only the same program reproduces steps bit by bit, so a file of another version is refused, as is one
//! that is truncated or damaged, or whose mesh files have changed.

mod error;
mod format;
mod scene;
#[cfg(test)]
mod tests;

use std::path::Path;

pub use error::CheckpointError;
pub use scene::{SavedScene, SceneFile};

use pliant::observer::Notes;
use pliant::run::RunState;
use pliant::simulation::Checkpoint;
use pliant_files::durable_file;
use pliant_files::regular_file;

/// Content of a checkpoint file.
#[derive(Clone, Debug, PartialEq, serde::Deserialize)]
pub struct CheckpointFile {
    /// The scene.
    pub scene: SavedScene,
    /// State of the simulation.
    pub simulation: Checkpoint,
    /// State of the run; `None` if steps are taken one by one.
    pub run: Option<RunState>,
    /// Notes of observers, of the command line and of Python.
    pub notes: Notes,
}

/// Content of a checkpoint for writing.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct CheckpointContent<'a> {
    /// The scene.
    pub scene: &'a SavedScene,
    /// State of the simulation.
    pub simulation: &'a Checkpoint,
    /// State of the run; `None` if steps are taken one by one.
    pub run: Option<&'a RunState>,
    /// Notes of observers, of the command line and of Python.
    pub notes: &'a Notes,
}

impl CheckpointContent<'_> {
    /// Writes a file to `path` atomically: at every moment the old or the new one is there, complete.
    ///
    /// # Errors
    /// [`CheckpointError::Write`], also if `path` is not a regular file.
    pub fn write(&self, path: &Path) -> Result<(), CheckpointError> {
        let failed = |source| CheckpointError::Write { path: path.to_owned(), source };
        regular_file::ensure_replaceable(path).map_err(failed)?;
        let bytes = self.to_bytes().map_err(failed)?;
        durable_file::replace(path, &bytes).map_err(failed)
    }

    /// Encodes the content as the bytes of a file.
    ///
    /// # Errors
    /// A path in the content is not Unicode.
    pub fn to_bytes(&self) -> std::io::Result<Vec<u8>> {
        format::encode(self)
    }
}

impl CheckpointFile {
    /// Reads a file, and checks that the mesh files of its scene are unchanged.
    ///
    /// # Errors
    /// [`CheckpointError`].
    pub fn read(path: &Path) -> Result<Self, CheckpointError> {
        let bytes = regular_file::read(path);
        let bytes = bytes.map_err(|source| CheckpointError::Read { path: path.to_owned(), source })?;
        Self::from_bytes(path, &bytes)
    }

    /// Decodes the bytes of a file; `path` is its name in errors.
    ///
    /// # Errors
    /// [`CheckpointError`].
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, CheckpointError> {
        let file: Self = format::decode(path, bytes)?;
        file.scene.ensure_unchanged(path)?;
        Ok(file)
    }
}
