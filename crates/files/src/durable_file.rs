//! Files that are there as a whole or not at all, whatever happens to the process or to the power.

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Puts a file with this content in the place of `path`: at every moment the old one or the new one is
/// there.
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
    let mut file = create(path)?;
    file.write_all(content)?;
    file.sync_all()
}

/// Creates an empty file in the place of `path`. A link there is replaced; the file that it leads to keeps
/// its content, so that a folder from somebody else can have nothing of yours overwritten.
///
/// # Errors
/// Errors of the system.
pub fn create(path: &Path) -> io::Result<File> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => File::options().write(true).create_new(true).open(path),
    }
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
