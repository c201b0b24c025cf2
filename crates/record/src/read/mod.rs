//! Reading recordings: summaries of files, frames of complete ones, and recovery of unfinished ones.

mod bodies;
mod chunk;
mod info;
mod lengths;
mod message_series;
mod recording_file;
mod rescue;
mod summary;
mod tables;
mod trajectory;
mod walk;

pub use bodies::{RecordedBodies, RecordedBody, RecordedSkin};
pub use info::{AttachmentSummary, FileInfo, FileState, TopicSummary, info};
pub(crate) use rescue::copy;
pub use rescue::{Recovered, discard, recover};
pub use tables::Column;
pub use trajectory::{RecordedRows, Trajectory, in_space};
pub(super) use walk::walk;
