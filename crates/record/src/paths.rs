//! The names of a file under construction.

use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use super::RecordError;
use pliant_files::durable_file;
pub(super) use pliant_files::durable_file::{sync_directory_of, with_suffix};
use pliant_files::regular_file;

/// `<path>.part`: the file until it is complete.
pub(super) fn part_of(path: &Path) -> PathBuf {
    with_suffix(path, ".part")
}

/// `<part>.tail`: the messages of the chunk that is still open.
pub(super) fn tail_of(part: &Path) -> PathBuf {
    with_suffix(part, ".tail")
}

/// The files of a recording to `path`: the complete one, and those it consists of until then.
pub fn files(path: &Path) -> [PathBuf; 3] {
    let part = part_of(path);
    let tail = tail_of(&part);
    [path.to_owned(), part, tail]
}

/// Creates a file that is empty and that this process alone writes. A file that is overwritten is removed
/// first: other names of it, and what a link leads to, keep their content.
///
/// # Errors
/// [`RecordError::LeftOver`] if it exists and must not be overwritten, [`RecordError::InUse`] if another
/// process writes it, [`RecordError::Write`] if it cannot be created.
pub(super) fn create_exclusive(path: &Path, overwrite: bool) -> Result<File, RecordError> {
    let write_error = |source| RecordError::Write { path: path.to_owned(), frame: None, source };
    let created = if overwrite {
        match regular_file::open(path) {
            Ok(there) => ensure_unlocked(&there, path)?,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(write_error(error)),
        }
        durable_file::create(path)
    } else {
        File::create_new(path)
    };
    let file = created.map_err(|source| match source.kind() {
        io::ErrorKind::AlreadyExists => RecordError::LeftOver { part: path.to_owned() },
        _ => write_error(source),
    })?;
    ensure_unlocked(&file, path)?;
    Ok(file)
}

/// Locks the file for the life of the handle, if its file system can.
///
/// # Errors
/// [`RecordError::InUse`] if another handle holds the lock.
pub(super) fn ensure_unlocked(file: &File, path: &Path) -> Result<(), RecordError> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(RecordError::InUse { path: path.to_owned() }),
        // Some network file systems have no locks; then the user has to take care.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
    }
}
