//! Access to regular files only: a named pipe blocks its reader, a device may have no end.

use std::io::{self, Read};
use std::path::Path;

use crate::disk::{self, File};

/// Opens a regular file, or a link to one.
///
/// # Errors
/// Errors of the system; [`io::ErrorKind::InvalidInput`] if it is not a regular file, which is then not
/// opened.
pub fn open(path: &Path) -> io::Result<File> {
    ensure_regular(&disk::metadata(path)?)?;
    File::open(path)
}

/// Reads a regular file.
///
/// # Errors
/// The errors of [`open`].
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut content = Vec::new();
    open(path)?.read_to_end(&mut content)?;
    Ok(content)
}

/// Refuses a path with something other than a regular file: a rename would replace a device by a file.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] in this case.
pub fn ensure_replaceable(path: &Path) -> io::Result<()> {
    disk::metadata(path).map_or(Ok(()), |there| ensure_regular(&there))
}

/// In memory there are regular files only.
#[cfg(target_family = "wasm")]
fn ensure_regular(_: &crate::memory::MemoryMetadata) -> io::Result<()> {
    Ok(())
}

#[cfg(not(target_family = "wasm"))]
fn ensure_regular(there: &std::fs::Metadata) -> io::Result<()> {
    if there.is_file() {
        return Ok(());
    }
    let message = format!("it is a {}, not a regular file", described(there.file_type()));
    Err(io::Error::new(io::ErrorKind::InvalidInput, message))
}

#[cfg(not(target_family = "wasm"))]
fn described(kind: std::fs::FileType) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        let special = [
            (kind.is_fifo(), "named pipe"),
            (kind.is_char_device(), "device"),
            (kind.is_block_device(), "device"),
            (kind.is_socket(), "socket"),
        ];
        if let Some((_, name)) = special.into_iter().find(|(is, _)| *is) {
            return name;
        }
    }
    if kind.is_dir() { "directory" } else { "special file" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_regular_file_is_not_opened() {
        let directory = tempfile::tempdir().unwrap();
        let error = read(directory.path()).unwrap_err().to_string();
        assert_eq!(error, "it is a directory, not a regular file");
        let path = directory.path().join("a");
        std::fs::write(&path, "content").unwrap();
        assert_eq!(read(&path).unwrap(), b"content");
        #[cfg(unix)]
        assert_eq!(
            read(Path::new("/dev/zero")).unwrap_err().to_string(),
            "it is a device, not a regular file"
        );
    }
}
