//! How a run ended, as the file remembers it.

use std::collections::BTreeMap;

use serde::Serialize;

/// Name of the metadata record.
pub(super) const OUTCOME: &str = "outcome";

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Status {
    /// It reached its duration.
    Completed,
    /// It was asked to stop (Ctrl-C); all frames until then are there.
    Interrupted,
    /// A step could not be taken; the last frame is the last good state.
    Failed,
    /// It was killed, and `recover` made this file from what it had written.
    Recovered,
}

impl Status {
    const ALL: [Status; 4] = [Status::Completed, Status::Interrupted, Status::Failed, Status::Recovered];

    fn name(self) -> &'static str {
        match self {
            Status::Completed => "completed",
            Status::Interrupted => "interrupted",
            Status::Failed => "failed",
            Status::Recovered => "recovered",
        }
    }
}

/// How a run ended, where, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// How.
    pub status: Status,
    /// Steps taken; `None` where nobody knows (recovered files without the channel `energy`).
    pub step: Option<u64>,
    /// Simulated time reached [s].
    pub time: f64,
    /// Why, for the reader; empty for completed runs.
    pub message: String,
}

impl Outcome {
    /// As key-value pairs. `{:?}` of a float is the shortest text that reads back to the same number.
    pub(super) fn to_metadata(&self) -> mcap::records::Metadata {
        let mut metadata = BTreeMap::from([
            ("status".to_owned(), self.status.name().to_owned()),
            ("time".to_owned(), format!("{:?}", self.time)),
            ("message".to_owned(), self.message.clone()),
        ]);
        if let Some(step) = self.step {
            metadata.insert("step".to_owned(), step.to_string());
        }
        mcap::records::Metadata { name: OUTCOME.to_owned(), metadata }
    }

    /// Back from key-value pairs; `None` if they are not those of an outcome.
    pub(super) fn from_metadata(metadata: &BTreeMap<String, String>) -> Option<Self> {
        let status = metadata.get("status")?;
        Some(Outcome {
            status: Status::ALL.into_iter().find(|candidate| candidate.name() == status)?,
            step: metadata.get("step").and_then(|step| step.parse().ok()),
            time: metadata.get("time")?.parse().ok()?,
            message: metadata.get("message").cloned().unwrap_or_default(),
        })
    }
}
