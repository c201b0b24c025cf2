//! How a command ends: the exit code, and what is said where it is not zero.

use std::path::Path;

use pliant_record::RecordError;
use pliant_record::checkpoint::CheckpointError;
use pliant_scene::{Problem, SceneError, near_file};
use serde_json::{Value, json};

use crate::printable;

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ExitStatus {
    /// It did what it was asked to do.
    Done,
    /// It was understood but could not be done.
    Failed,
    /// The command line or the scene makes no sense.
    Invalid,
    /// It was stopped by the user.
    Interrupted,
}

impl ExitStatus {
    /// The exit code of the program.
    pub(crate) fn code(self) -> u8 {
        match self {
            ExitStatus::Done => 0,
            ExitStatus::Failed => 1,
            ExitStatus::Invalid => 2,
            // What shells report of a program that SIGINT ended.
            ExitStatus::Interrupted => 130,
        }
    }
}

/// Why a command could not go on.
#[derive(Debug)]
pub(crate) struct Failure {
    /// [`ExitStatus::Failed`] or [`ExitStatus::Invalid`].
    pub(crate) status: ExitStatus,
    reason: Reason,
}

#[derive(Debug)]
enum Reason {
    Scene(Box<SceneError>),
    Message { kind: &'static str, message: String },
}

impl Failure {
    /// The command line asks for something that cannot be.
    pub(crate) fn usage(message: impl Into<String>) -> Failure {
        Failure {
            status: ExitStatus::Invalid,
            reason: Reason::Message { kind: "usage", message: message.into() },
        }
    }

    /// Something outside of the program went wrong; `kind` is for machines.
    pub(crate) fn failed(kind: &'static str, message: impl Into<String>) -> Failure {
        Failure { status: ExitStatus::Failed, reason: Reason::Message { kind, message: message.into() } }
    }

    /// A recording could not be written or read.
    ///
    /// What the user can put right with another command line is invalid, the rest has failed.
    pub(crate) fn recording(error: &RecordError) -> Failure {
        let avoidable = match error {
            RecordError::Exists { .. } | RecordError::LeftOver { .. } | RecordError::InUse { .. } => true,
            RecordError::NoBeginning { .. } => true,
            RecordError::NotMcap { .. } | RecordError::NotFinished { .. } | RecordError::NoChannel { .. } => {
                true
            }
            RecordError::Read { path, .. } => !path.is_file(),
            _ => false,
        };
        let status = if avoidable { ExitStatus::Invalid } else { ExitStatus::Failed };
        Failure { status, ..Failure::failed("recording", error.to_string() + &advice(error)) }
    }

    /// A checkpoint could not be written or gone on from; only a disk that fails is no mistake of the user.
    pub(crate) fn checkpoint(error: &CheckpointError) -> Failure {
        let status = match error {
            CheckpointError::Write { .. } => ExitStatus::Failed,
            CheckpointError::Read { path, .. } if path.is_file() => ExitStatus::Failed,
            _ => ExitStatus::Invalid,
        };
        Failure { status, ..Failure::failed("checkpoint", error.to_string()) }
    }

    /// Refuses a path that is there and is no file: a directory, a device.
    ///
    /// # Errors
    /// `path` is one.
    pub(crate) fn unless_file(path: &Path) -> Result<(), Failure> {
        // An output is written beside and then renamed: that would replace a device such as /dev/null.
        let message = match std::fs::metadata(path) {
            Ok(there) if there.is_dir() => "is a directory; name a file",
            Ok(there) if !there.is_file() => "is no regular file",
            _ => return Ok(()),
        };
        Err(Failure::usage(format!("{} {message}", path.display())))
    }

    /// For a person, with `error:` in front, ending without a newline.
    pub(crate) fn render(&self, color: bool) -> String {
        match &self.reason {
            Reason::Scene(error) => error.render(color),
            Reason::Message { message, .. } => label("error", message, color),
        }
    }

    /// The message, without a label.
    pub(crate) fn message(&self) -> String {
        match &self.reason {
            Reason::Scene(error) => error.render(false),
            Reason::Message { message, .. } => message.clone(),
        }
    }

    /// The problems, for a program.
    pub(crate) fn problems(&self) -> Value {
        match &self.reason {
            Reason::Scene(error) => located(error.problems()),
            Reason::Message { kind, message } => json!([{ "kind": kind, "message": message }]),
        }
    }
}

fn located(problems: &[Problem]) -> Value {
    json!(problems)
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Failure {
        Failure { status: ExitStatus::Invalid, reason: Reason::Scene(Box::new(error)) }
    }
}

/// `error: message`, the label in the colours of the compiler.
pub(crate) fn label(label: &str, message: &str, color: bool) -> String {
    // Before there are colours in it, which pass.
    let message = printable::plain(message);
    let code = if label == "error" { "1;91" } else { "1;33" };
    if color { format!("\x1b[{code}m{label}\x1b[0m: {message}") } else { format!("{label}: {message}") }
}

/// What to do where the file that should be read is no recording, or not there.
fn advice(error: &RecordError) -> String {
    match error {
        RecordError::NotMcap { path } if path.extension().is_some_and(|ending| ending == "toml") => {
            let (scene, recording) = (path.display(), path.with_extension("mcap"));
            let recorded = match recording.is_file() {
                true => format!("; its recording is {}", recording.display()),
                false => String::new(),
            };
            format!(": it is a scene, which `pliant run {scene} --view` runs and shows{recorded}")
        }
        RecordError::Read { path, .. } if !path.exists() => {
            let [_, part, _] = pliant_record::files(path);
            if part.is_file() {
                return unfinished(&part);
            }
            near_file(path, "mcap")
                .map_or_else(String::new, |near| format!("; did you mean {}?", near.display()))
        }
        _ => String::new(),
    }
}

/// Hint at a recording that is not finished.
fn unfinished(part: &Path) -> String {
    let part = part.display();
    format!(
        "; {part} is there: its run goes on or was killed; `pliant info {part}` tells what it holds, \
         `pliant recover {part}` makes a recording of it"
    )
}
