//! Errors of checkpoint files.

use std::io;
use std::path::PathBuf;

/// Error of writing a checkpoint or of resuming from one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The file could not be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file is not a checkpoint.
    #[error("{} is not a checkpoint; `pliant run SCENE --checkpoint 60s` writes one", path.display())]
    NotACheckpoint {
        /// The file.
        path: PathBuf,
    },
    /// The file is truncated or corrupted.
    #[error(
        "{} is damaged: it is truncated, or its checksum does not match; no run can continue from it",
        path.display()
    )]
    Damaged {
        /// The file.
        path: PathBuf,
    },
    /// The file has another format version.
    #[error(
        "{} has format {found} of checkpoints, this program reads format {expected}: continue with \
         the version of pliant that wrote it",
        path.display()
    )]
    Format {
        /// The file.
        path: PathBuf,
        /// Format version of the file.
        found: u32,
        /// Format version of this program.
        expected: u32,
    },
    /// Another version of the program wrote the file.
    #[error(
        "{} was written by pliant {found}, this is {expected}, whose results may differ: continue with \
         {found}, or run the scene again",
        path.display()
    )]
    Version {
        /// The file.
        path: PathBuf,
        /// Version that wrote it.
        found: String,
        /// This version.
        expected: &'static str,
    },
    /// A mesh file has changed or cannot be read.
    #[error("{} cannot be continued: the mesh file {} {reason}", path.display(), file.display())]
    Mesh {
        /// The checkpoint.
        path: PathBuf,
        /// The mesh file.
        file: PathBuf,
        /// Reason, worded to follow the file name.
        reason: String,
    },
}
