//! Temporary directory.

use std::path::{Path, PathBuf};

use pliant_files::disk;

use crate::LiveError;

/// Directory that is removed on drop.
pub(crate) struct ScratchFolder(PathBuf);

impl ScratchFolder {
    /// Creates a directory with a name of its own in the system's temporary directory.
    ///
    /// # Errors
    /// The directory cannot be created.
    pub(crate) fn new() -> Result<ScratchFolder, LiveError> {
        let path = disk::temp_dir().join(format!("pliant-live-{}", own()?));
        let what = || format!("cannot make the temporary folder {}", path.display());
        disk::create_dir(&path).map_err(LiveError::system(what()))?;
        Ok(ScratchFolder(path))
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }
}

/// Random text.
///
/// # Errors
/// The system has no random numbers.
#[cfg(feature = "server")]
fn own() -> Result<String, LiveError> {
    Ok(crate::token::Token::random()?.text().to_owned())
}

/// Number of this process: pages are made one after the other.
#[cfg(not(feature = "server"))]
fn own() -> Result<String, LiveError> {
    Ok(if cfg!(target_family = "wasm") { 0 } else { std::process::id() }.to_string())
}

impl Drop for ScratchFolder {
    fn drop(&mut self) {
        // Leftovers are removed by the system.
        let _ = disk::remove_dir_all(&self.0);
    }
}
