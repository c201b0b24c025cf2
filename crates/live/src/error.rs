//! Errors of the live server.

use std::path::PathBuf;

use pliant_record::RecordError;
use pliant_scene::SceneError;
use pliant_scene::experiment::CommandError;
use pliant_view::drawing::DrawError;

/// Error of showing a scene live.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LiveError {
    /// The scene cannot be simulated.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A command of a log was rejected.
    #[error(transparent)]
    ExperimentCommand(#[from] CommandError),
    /// The page cannot be built.
    #[error(transparent)]
    Page(#[from] DrawError),
    /// A recording cannot be started, written or finished.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The recording would be outside the working directory.
    #[error(
        "{} is not below the working folder: give a path without `..` that does not begin at the root",
        path.display()
    )]
    Outside {
        /// Path requested.
        path: PathBuf,
    },
    /// The name of the recording has control characters.
    #[error("{path:?} is no name of a recording: give one without control characters")]
    Name {
        /// Path requested.
        path: PathBuf,
    },
    /// A recording is already active.
    #[error("{} is being recorded; end it first", path.display())]
    Recording {
        /// File of that recording.
        path: PathBuf,
    },
    /// There is no recording.
    #[error("nothing has been recorded")]
    NothingRecorded,
    /// Error of the system.
    #[error("{what}: {source}")]
    System {
        /// Description of the attempt.
        what: String,
        /// Error message.
        source: std::io::Error,
    },
    /// No random numbers for the token.
    #[cfg(feature = "server")]
    #[error("the system gives no random numbers for the address: {0}")]
    Token(getrandom::Error),
}

impl LiveError {
    /// Wraps a system error in an attempt at `what`.
    pub(crate) fn system(what: impl Into<String>) -> impl FnOnce(std::io::Error) -> LiveError {
        |source| LiveError::System { what: what.into(), source }
    }
}
