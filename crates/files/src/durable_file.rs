//! Files that are there as a whole or not at all, whatever happens to the process or to the power.

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Puts a file with this content in the place of `path`: at every moment the old one or the new one is there.
///
/// # Errors
/// Errors of the system; the old file is there then.
pub fn replace(path: &Path, content: &[u8]) -> io::Result<()> {
    let temporary = with_suffix(path, ".new");
    let written = write(&temporary, content).and_then(|()| std::fs::rename(&temporary, path));
    if written.is_err() {
        // The next one to this name overwrites what cannot be removed.
        let _ = std::fs::remove_file(&temporary);
    }
    written?;
    sync_directory_of(path);
    Ok(())
}

fn write(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(content)?;
    file.sync_all()
}

/// The path with something appended to its last component.
pub fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(suffix);
    PathBuf::from(name)
}

/// Makes a rename survive a power cut, where the system allows to sync a directory.
pub fn sync_directory_of(path: &Path) {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    if let Ok(directory) = File::open(parent.unwrap_or(Path::new("."))) {
        // The file itself is synced; if its directory cannot be, nothing can be done about it.
        let _ = directory.sync_all();
    }
}
