//! Outcome of a run, stored in its recording.

use std::collections::BTreeMap;

use serde::Serialize;

/// Name of the metadata record.
pub(super) const OUTCOME: &str = "outcome";

/// Way in which a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum RecordedStatus {
    /// The run reached its duration.
    Completed,
    /// The run was asked to stop (Ctrl-C); all frames until then are recorded.
    Interrupted,
    /// A step failed; the last frame is the last valid state.
    Failed,
    /// The run was killed, and `recover` made this file from its data.
    Recovered,
}

impl RecordedStatus {
    const ALL: [RecordedStatus; 4] = [
        RecordedStatus::Completed,
        RecordedStatus::Interrupted,
        RecordedStatus::Failed,
        RecordedStatus::Recovered,
    ];

    fn name(self) -> &'static str {
        match self {
            RecordedStatus::Completed => "completed",
            RecordedStatus::Interrupted => "interrupted",
            RecordedStatus::Failed => "failed",
            RecordedStatus::Recovered => "recovered",
        }
    }
}

/// End of a run: status, step, time and cause.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordedOutcome {
    /// Status.
    pub status: RecordedStatus,
    /// Number of steps; `None` if unknown (recovered files without the channel `energy`).
    pub step: Option<u64>,
    /// Simulated time reached [s].
    pub time: f64,
    /// Cause in words; empty for completed runs.
    pub message: String,
}

impl RecordedOutcome {
    /// Converts to key-value pairs. `{:?}` of a float is the shortest text that reads back to the same
    /// number.
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

    /// Parses key-value pairs; `None` if they are not an outcome.
    pub(super) fn from_metadata(metadata: &BTreeMap<String, String>) -> Option<Self> {
        let status = metadata.get("status")?;
        Some(RecordedOutcome {
            status: RecordedStatus::ALL.into_iter().find(|candidate| candidate.name() == status)?,
            step: metadata.get("step").and_then(|step| step.parse().ok()),
            time: metadata.get("time")?.parse().ok()?,
            message: metadata.get("message").cloned().unwrap_or_default(),
        })
    }
}
