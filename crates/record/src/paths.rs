//! File names of a recording under construction.

use std::fs::TryLockError;
use std::io;
use std::path::{Path, PathBuf};

use super::RecordError;
use pliant_files::disk::{self, File};
use pliant_files::durable_file;
pub(super) use pliant_files::durable_file::{sync_directory_of, with_suffix};
use pliant_files::regular_file;

/// Name until completion: `<path>.part`.
pub(super) fn part_of(path: &Path) -> PathBuf {
    with_suffix(path, ".part")
}

/// Name of the journal of the open chunk: `<part>.tail`.
pub(super) fn tail_of(part: &Path) -> PathBuf {
    with_suffix(part, ".tail")
}

/// Files of a recording to `path`: the complete one, and its parts until then.
pub fn files(path: &Path) -> [PathBuf; 3] {
    let part = part_of(path);
    let tail = tail_of(&part);
    [path.to_owned(), part, tail]
}

/// Creates an empty file that only this process writes. An overwritten file is removed first, so that its
/// other hard links, and the target of a symbolic link, keep their content.
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
        disk::create_new(path)
    };
    let file = created.map_err(|source| match source.kind() {
        io::ErrorKind::AlreadyExists => RecordError::LeftOver { part: path.to_owned() },
        _ => write_error(source),
    })?;
    ensure_unlocked(&file, path)?;
    Ok(file)
}

/// Locks the file while the handle lives, if the file system supports it.
///
/// # Errors
/// [`RecordError::InUse`] if another handle holds the lock.
pub(super) fn ensure_unlocked(file: &File, path: &Path) -> Result<(), RecordError> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(RecordError::InUse { path: path.to_owned() }),
        // Some network file systems have no locks; the user must take care there.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
    }
}
