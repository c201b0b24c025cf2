//! Errors of a server.

use std::path::PathBuf;

use pliant_record::RecordError;
use pliant_scene::SceneError;
use pliant_scene::experiment::CommandError;
use pliant_view::drawing::DrawError;

/// A scene could not be shown live.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LiveError {
    /// It cannot be simulated.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A command of a log was refused.
    #[error(transparent)]
    ExperimentCommand(#[from] CommandError),
    /// Its page cannot be made.
    #[error(transparent)]
    Page(#[from] DrawError),
    /// A recording cannot be begun, written or ended.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A recording would be outside of the working folder.
    #[error(
        "{} is not below the working folder: give a path without `..` that does not begin at the root",
        path.display()
    )]
    Outside {
        /// The path.
        path: PathBuf,
    },
    /// The name of a recording has control characters.
    #[error("{path:?} is no name of a recording: give one without control characters")]
    Name {
        /// The path.
        path: PathBuf,
    },
    /// A recording is being made already.
    #[error("{} is being recorded; end it first", path.display())]
    Recording {
        /// Its file.
        path: PathBuf,
    },
    /// The system refuses something.
    #[error("{what}: {source}")]
    System {
        /// Description of the attempt.
        what: String,
        /// Message of the system.
        source: std::io::Error,
    },
    /// No randomness for the token.
    #[error("the system gives no random numbers for the address: {0}")]
    Token(getrandom::Error),
}

impl LiveError {
    /// An error of the system in an attempt at `what`.
    pub(crate) fn system(what: impl Into<String>) -> impl FnOnce(std::io::Error) -> LiveError {
        |source| LiveError::System { what: what.into(), source }
    }
}
