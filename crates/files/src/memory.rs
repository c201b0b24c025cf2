//! Files in memory, for programs without a file system: what of `std::fs` readers and writers use.
//!
//! A path is a name: there are no directories, links or permissions, and `./a` is `a`. All files together
//! take at most [`MOST_BYTES`]; a write beyond it fails like one to a full disk.

use std::collections::BTreeMap;
use std::fs::TryLockError;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Bytes of all files.
pub const MOST_BYTES: usize = 512 << 20;

/// Content of a file: of its name and of all handles.
type SharedContent = Arc<Mutex<Vec<u8>>>;

static FILES: Mutex<BTreeMap<PathBuf, SharedContent>> = Mutex::new(BTreeMap::new());

fn files() -> MutexGuard<'static, BTreeMap<PathBuf, SharedContent>> {
    FILES.lock().unwrap_or_else(PoisonError::into_inner)
}

fn locked(content: &SharedContent) -> MutexGuard<'_, Vec<u8>> {
    content.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The name of a path.
fn named(path: &Path) -> PathBuf {
    path.components().filter(|part| !matches!(part, Component::CurDir)).collect()
}

fn found(path: &Path) -> io::Result<SharedContent> {
    files().get(&named(path)).cloned().ok_or_else(|| ErrorKind::NotFound.into())
}

/// Bytes of all files.
pub fn bytes() -> usize {
    files().values().map(|content| locked(content).len()).sum()
}

/// Replaces or adds a file.
///
/// # Errors
/// There is no room for it.
pub fn put(path: &Path, content: Vec<u8>) -> io::Result<()> {
    let mut files = files();
    let others = files.iter().filter(|(name, _)| **name != named(path));
    let taken: usize = others.map(|(_, content)| locked(content).len()).sum();
    if taken.saturating_add(content.len()) > MOST_BYTES {
        return Err(ErrorKind::StorageFull.into());
    }
    files.insert(named(path), Arc::new(Mutex::new(content)));
    Ok(())
}

/// Content of a file.
///
/// # Errors
/// The file does not exist.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    Ok(locked(&found(path)?).clone())
}

/// True if there is a file.
pub fn exists(path: &Path) -> bool {
    found(path).is_ok()
}

/// Size of a file.
///
/// # Errors
/// The file does not exist.
pub fn metadata(path: impl AsRef<Path>) -> io::Result<MemoryMetadata> {
    Ok(MemoryMetadata { length: locked(&found(path.as_ref())?).len() as u64 })
}

/// Removes a name; handles keep the content.
///
/// # Errors
/// The file does not exist.
pub fn remove_file(path: impl AsRef<Path>) -> io::Result<()> {
    files().remove(&named(path.as_ref())).map(|_| ()).ok_or_else(|| ErrorKind::NotFound.into())
}

/// Renames a file; one with the new name is replaced.
///
/// # Errors
/// The file does not exist.
pub fn rename(from: impl AsRef<Path>, to: impl AsRef<Path>) -> io::Result<()> {
    let mut files = files();
    let content = files.remove(&named(from.as_ref())).ok_or(ErrorKind::NotFound)?;
    files.insert(named(to.as_ref()), content);
    Ok(())
}

/// Directory for temporary files.
pub fn temp_dir() -> PathBuf {
    PathBuf::from("temporary")
}

/// Does nothing: names need no directory.
///
/// # Errors
/// None.
pub fn create_dir(_: impl AsRef<Path>) -> io::Result<()> {
    Ok(())
}

/// Removes all files whose paths begin with that of the directory.
///
/// # Errors
/// None.
pub fn remove_dir_all(path: impl AsRef<Path>) -> io::Result<()> {
    let directory = named(path.as_ref());
    files().retain(|name, _| !name.starts_with(&directory));
    Ok(())
}

/// Creates an empty file that must not exist.
///
/// # Errors
/// The file exists.
pub fn create_new(path: &Path) -> io::Result<MemoryFile> {
    let mut files = files();
    if files.contains_key(&named(path)) {
        return Err(ErrorKind::AlreadyExists.into());
    }
    let content = SharedContent::default();
    files.insert(named(path), Arc::clone(&content));
    Ok(MemoryFile { content, position: 0 })
}

/// Properties of a file.
#[derive(Clone, Copy, Debug)]
pub struct MemoryMetadata {
    length: u64,
}

impl MemoryMetadata {
    /// Size [bytes].
    #[allow(clippy::len_without_is_empty)]
    pub fn len(&self) -> u64 {
        self.length
    }

    /// True: there is nothing else.
    pub fn is_file(&self) -> bool {
        true
    }
}

/// A file that is read and written.
#[derive(Clone, Debug)]
pub struct MemoryFile {
    content: SharedContent,
    position: usize,
}

impl MemoryFile {
    /// Opens a file.
    ///
    /// # Errors
    /// The file does not exist.
    pub fn open(path: impl AsRef<Path>) -> io::Result<MemoryFile> {
        Ok(MemoryFile { content: found(path.as_ref())?, position: 0 })
    }

    /// Size of the file.
    ///
    /// # Errors
    /// None.
    pub fn metadata(&self) -> io::Result<MemoryMetadata> {
        Ok(MemoryMetadata { length: locked(&self.content).len() as u64 })
    }

    /// Does nothing: there is no disk.
    ///
    /// # Errors
    /// None.
    pub fn sync_all(&self) -> io::Result<()> {
        Ok(())
    }

    /// Cuts the file, or fills it up with zeros.
    ///
    /// # Errors
    /// There is no room for it.
    pub fn set_len(&self, length: u64) -> io::Result<()> {
        let taken = bytes() - locked(&self.content).len();
        let length =
            usize::try_from(length).ok().filter(|length| taken.saturating_add(*length) <= MOST_BYTES);
        locked(&self.content).resize(length.ok_or(ErrorKind::StorageFull)?, 0);
        Ok(())
    }

    /// Another handle, at the same place.
    ///
    /// # Errors
    /// None.
    pub fn try_clone(&self) -> io::Result<MemoryFile> {
        Ok(self.clone())
    }

    /// Does nothing: there is no other process.
    ///
    /// # Errors
    /// None.
    pub fn try_lock(&self) -> Result<(), TryLockError> {
        Ok(())
    }
}

impl Read for MemoryFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let content = locked(&self.content);
        let rest = content.get(self.position..).unwrap_or_default();
        let count = rest.len().min(buffer.len());
        buffer[..count].copy_from_slice(&rest[..count]);
        self.position += count;
        Ok(count)
    }
}

impl Write for MemoryFile {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let end = self.position.saturating_add(buffer.len());
        let length = locked(&self.content).len();
        if end > length && (bytes() - length).saturating_add(end) > MOST_BYTES {
            return Err(ErrorKind::StorageFull.into());
        }
        let mut content = locked(&self.content);
        content.resize(end.max(length), 0);
        content[self.position..end].copy_from_slice(buffer);
        self.position = end;
        Ok(buffer.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for MemoryFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let length = locked(&self.content).len();
        let place = match to {
            SeekFrom::Start(offset) => usize::try_from(offset).ok(),
            SeekFrom::End(offset) => isize::try_from(offset).ok().and_then(|o| length.checked_add_signed(o)),
            SeekFrom::Current(offset) => {
                isize::try_from(offset).ok().and_then(|o| self.position.checked_add_signed(o))
            }
        };
        self.position = place.ok_or(ErrorKind::InvalidInput)?;
        Ok(self.position as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The files are of the whole program: one test alone touches them.
    #[test]
    fn files_are_written_read_renamed_and_removed_like_those_of_a_system() {
        let (a, b) = (Path::new("memory/a"), Path::new("./memory/b"));
        assert_eq!(MemoryFile::open(a).unwrap_err().kind(), ErrorKind::NotFound);
        let mut file = create_new(a).unwrap();
        assert_eq!(create_new(a).unwrap_err().kind(), ErrorKind::AlreadyExists);
        file.write_all(b"content").unwrap();
        file.seek(SeekFrom::Start(3)).unwrap();
        file.write_all(b"TEN").unwrap();
        assert_eq!(read(a).unwrap(), b"conTENt");
        let mut reader = MemoryFile::open(a).unwrap();
        reader.seek(SeekFrom::End(-4)).unwrap();
        let mut rest = String::new();
        reader.read_to_string(&mut rest).unwrap();
        assert_eq!((&rest[..], metadata(a).unwrap().len()), ("TENt", 7));
        // A handle keeps a file that was replaced.
        put(b, b"other".to_vec()).unwrap();
        rename(a, b).unwrap();
        file.set_len(2).unwrap();
        assert_eq!((exists(a), read(Path::new("memory/b")).unwrap()), (false, b"co".to_vec()));
        assert!(file.seek(SeekFrom::Current(-100)).is_err());
        // Full.
        assert_eq!(file.set_len(MOST_BYTES as u64 + 1).unwrap_err().kind(), ErrorKind::StorageFull);
        file.seek(SeekFrom::Start(MOST_BYTES as u64)).unwrap();
        assert_eq!(file.write(b"x").unwrap_err().kind(), ErrorKind::StorageFull);
        assert_eq!(bytes(), 2);
        remove_dir_all("memory").unwrap();
        assert!(!exists(b) && remove_file(b).is_err());
    }
}
