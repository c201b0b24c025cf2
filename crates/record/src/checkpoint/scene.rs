//! Scene of a checkpoint.

use std::io;
use std::path::{Path, PathBuf};

use super::CheckpointError;
use pliant_files::fnv::fnv1a;
use pliant_files::regular_file;
use pliant_scene::{Scene, Source};

/// Scene of a run, with hashes of the files that it names.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SavedScene {
    /// Name in messages: the path of the scene file.
    pub name: String,
    /// Text, including changes on the command line.
    pub text: String,
    /// Absolute directory of relative file names in the scene.
    pub directory: PathBuf,
    /// True if the text was generated from tables of a program.
    #[serde(default)]
    pub is_made_from_tables: bool,
    /// Mesh files.
    pub files: Vec<SceneFile>,
}

/// File named in a scene, with a hash of its content.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SceneFile {
    /// Path, relative to the directory of the scene.
    pub path: PathBuf,
    /// FNV-1a hash of its bytes.
    pub hash: u64,
}

impl SavedScene {
    /// Saves `scene`, which `source` describes.
    ///
    /// # Errors
    /// A mesh file cannot be read.
    pub fn new(source: &Source, scene: &Scene) -> Result<Self, CheckpointError> {
        let file = |path: PathBuf| {
            let found = hash(&scene.resolve(&path));
            let hash = found.map_err(|source| CheckpointError::Read { path: path.clone(), source })?;
            Ok(SceneFile { path, hash })
        };
        let directory = source.directory();
        Ok(SavedScene {
            name: source.name().to_owned(),
            text: source.text().to_owned(),
            // An empty path means the working directory.
            directory: std::path::absolute(directory.join(".")).unwrap_or_else(|_| directory.to_owned()),
            is_made_from_tables: source.is_made_from_tables(),
            files: scene.mesh_files().into_iter().map(file).collect::<Result<_, _>>()?,
        })
    }

    /// Converts back to the text of a scene.
    pub fn source(&self) -> Source {
        let source = Source::new(&self.name, &self.text).in_directory(&self.directory);
        if self.is_made_from_tables { source.made_from_tables() } else { source }
    }

    /// Checks that the mesh files are unchanged; `path` is the checkpoint.
    pub(super) fn ensure_unchanged(&self, path: &Path) -> Result<(), CheckpointError> {
        self.files.iter().try_for_each(|file| {
            let place = self.directory.join(&file.path);
            let reason = match hash(&place) {
                Ok(found) if found == file.hash => return Ok(()),
                Ok(_) => "has changed since; restore it, or run the scene again".to_owned(),
                Err(error) => format!("cannot be read: {error}"),
            };
            Err(CheckpointError::Mesh { path: path.to_owned(), file: place, reason })
        })
    }
}

fn hash(path: &Path) -> io::Result<u64> {
    Ok(fnv1a(&regular_file::read(path)?))
}
