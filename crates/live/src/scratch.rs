//! Temporary directory.

use std::path::{Path, PathBuf};

use crate::LiveError;
use crate::token::Token;

/// Directory that is removed on drop.
pub(crate) struct ScratchFolder(PathBuf);

impl ScratchFolder {
    /// Creates a directory with a random name in the system's temporary directory.
    ///
    /// # Errors
    /// The directory cannot be created.
    pub(crate) fn new() -> Result<ScratchFolder, LiveError> {
        let path = std::env::temp_dir().join(format!("pliant-live-{}", Token::random()?.text()));
        let what = || format!("cannot make the temporary folder {}", path.display());
        std::fs::create_dir(&path).map_err(LiveError::system(what()))?;
        Ok(ScratchFolder(path))
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for ScratchFolder {
    fn drop(&mut self) {
        // Leftovers are removed by the system.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
