//! Atomic file replacement: a file is complete or absent, even after a kill or a power failure.

use std::ffi::OsString;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::disk::{self, File};

/// Replaces the file at `path` by one with this content: at every moment the old or the new one is there.
///
/// # Errors
/// Errors of the system; the old file is kept then.
pub fn replace(path: &Path, content: &[u8]) -> io::Result<()> {
    let temporary = with_suffix(path, ".new");
    let written = write(&temporary, content).and_then(|()| disk::rename(&temporary, path));
    if written.is_err() {
        // If it cannot be removed, the next write to this name overwrites it.
        let _ = disk::remove_file(&temporary);
    }
    written?;
    sync_directory_of(path);
    Ok(())
}

fn write(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut file = create(path)?;
    file.write_all(content)?;
    file.sync_all()
}

/// Creates an empty file at `path`. A link there is replaced and its target keeps its content, so that a
/// prepared directory cannot make you overwrite other files.
///
/// # Errors
/// Errors of the system.
pub fn create(path: &Path) -> io::Result<File> {
    match disk::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => disk::create_new(path),
    }
}

/// Appends to the last component of a path.
pub fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(suffix);
    PathBuf::from(name)
}

/// Makes a rename survive a power failure, if the system can sync a directory.
pub fn sync_directory_of(path: &Path) {
    let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    if let Ok(directory) = File::open(parent.unwrap_or(Path::new("."))) {
        // The file itself is synced; an error of its directory is ignored.
        let _ = directory.sync_all();
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_link_is_replaced_and_its_target_stays() {
        let directory = tempfile::tempdir().unwrap();
        let (precious, path) = (directory.path().join("precious"), directory.path().join("a"));
        std::fs::write(&precious, "mine").unwrap();
        for place in [with_suffix(&path, ".new"), path.clone()] {
            std::os::unix::fs::symlink(&precious, &place).unwrap();
            replace(&path, b"new").unwrap();
            assert_eq!(std::fs::read(&precious).unwrap(), b"mine");
            assert_eq!(std::fs::read(&path).unwrap(), b"new");
            assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 2);
            std::fs::remove_file(&path).unwrap();
        }
    }
}
