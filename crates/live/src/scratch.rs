//! A folder for files that are read at once.

use std::path::{Path, PathBuf};

use crate::LiveError;
use crate::token::Token;

/// A folder that is gone when it is dropped.
pub(crate) struct ScratchFolder(PathBuf);

impl ScratchFolder {
    /// A new one with a random name in the system's temporary folder.
    ///
    /// # Errors
    /// It cannot be made.
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
        // The system removes what stays behind.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
