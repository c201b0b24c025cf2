//! Errors of writing, reading and recovering trajectories.

use std::io;
use std::path::{Path, PathBuf};

use pliant::observer::{ObserverError, Quantities};

/// Error of writing, reading or recovering a trajectory.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// The output exists and overwriting was not requested.
    #[error("{} exists; choose another name with `-o`, or replace it with `--force`", path.display())]
    Exists {
        /// Existing file.
        path: PathBuf,
    },
    /// An earlier run to the same output did not finish.
    #[error(
        "{0} is left over from a run that did not finish; keep its frames with `pliant recover {0}`, or \
         discard it with `--force`",
        part.display()
    )]
    LeftOver {
        /// Unfinished file.
        part: PathBuf,
    },
    /// Another process is writing this file.
    #[error("{} is being written by another process", path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// A recording to be continued lacks the earlier frames.
    #[error(
        "{} {reason}: the frames before the checkpoint are missing; put back the recording that the run \
         wrote, or go on without one (`--no-record`)",
        path.display()
    )]
    NoBeginning {
        /// The file.
        path: PathBuf,
        /// Reason, worded to follow the file name.
        reason: &'static str,
    },
    /// The file could not be written; if `frame` is given, earlier frames are recoverable.
    #[error("cannot write {}{}: {source}{}", path.display(), at_frame(*frame), advice(path, *frame))]
    Write {
        /// The file.
        path: PathBuf,
        /// First frame known to be lost: after a device error, `pliant recover` may find more. `None` if
        /// no frame is lost.
        frame: Option<u64>,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The recorder was used after a write had failed.
    #[error("{0} ends before frame {frame}, which could not be written; `pliant recover {0}` keeps the \
             others", part.display())]
    Incomplete {
        /// The unfinished file.
        part: PathBuf,
        /// First missing frame.
        frame: u64,
    },
    /// A frame does not fit the topology of the recording.
    #[error(
        "frame {frame} has {found} numbers per field where the topology has {expected} (vertices x dimension)"
    )]
    FrameShape {
        /// Frame number.
        frame: u64,
        /// Expected length of `x` and `v`.
        expected: usize,
        /// Length found.
        found: usize,
    },
    /// A frame lacks a quantity that a channel records.
    #[error("frame {frame} has no {quantities}, which the channel {topic} records")]
    MissingQuantities {
        /// Frame number.
        frame: u64,
        /// Missing quantities.
        quantities: Quantities,
        /// Topic of the channel.
        topic: String,
    },
    /// A frame has states for another number of elements than the topology.
    #[error("frame {frame} has the states of {found} elements, of {expected} that channels record")]
    ElementCount {
        /// Frame number.
        frame: u64,
        /// Number of elements of the topology.
        expected: usize,
        /// Number of elements in the frame.
        found: usize,
    },
    /// An element refers to a vertex that does not exist.
    #[error("body `{body}` refers to vertex {index}, but there are {vertex_count}")]
    VertexIndex {
        /// Name of the body.
        body: String,
        /// Vertex index.
        index: u32,
        /// Number of vertices.
        vertex_count: usize,
    },
    /// The file could not be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file is not MCAP.
    #[error("{} is not an MCAP file", path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
    },
    /// The file is MCAP, but damaged.
    #[error("{} is damaged: {source}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Error of the MCAP reader.
        source: mcap::McapError,
    },
    /// The file ends early: its run is still active, or was killed.
    #[error("{0} is not finished; once its run has ended, `pliant recover {0}` makes it \
             readable", path.display())]
    NotFinished {
        /// The file.
        path: PathBuf,
    },
    /// The file lacks something that every file of this program has.
    #[error("{} was not written by pliant, or by a newer version: {what}", path.display())]
    Unexpected {
        /// The file.
        path: PathBuf,
        /// Missing or unexpected part.
        what: &'static str,
    },
    /// The channel was not recorded.
    #[error("{} has no channel {topic}; add it to `channels` in `[output]` and run again", path.display())]
    NoChannel {
        /// The file.
        path: PathBuf,
        /// Topic of the channel.
        topic: String,
    },
    /// The frame does not exist.
    #[error("{} has {count} frames, so there is no frame {frame}", path.display())]
    NoFrame {
        /// The file.
        path: PathBuf,
        /// Requested frame, counted from 0.
        frame: usize,
        /// Number of frames.
        count: usize,
    },
}

fn at_frame(frame: Option<u64>) -> String {
    frame.filter(|frame| *frame > 0).map_or_else(String::new, |frame| format!(" at frame {frame}"))
}

fn advice(path: &Path, frame: Option<u64>) -> String {
    match frame {
        None => String::new(),
        // More may have reached the disk than is known.
        Some(0) => format!("; `pliant recover {}` keeps what was written", path.display()),
        Some(_) => format!("; `pliant recover {}` keeps at least the frames before", path.display()),
    }
}

impl From<RecordError> for ObserverError {
    fn from(error: RecordError) -> Self {
        ObserverError { what: "recording the trajectory".to_owned(), source: Box::new(error) }
    }
}

/// Converts an error of the MCAP writer, with the file and the frame.
pub(super) fn write_error(path: &Path, frame: Option<u64>, error: mcap::McapError) -> RecordError {
    let source = match error {
        mcap::McapError::Io(source) => source,
        other => io::Error::other(other),
    };
    RecordError::Write { path: path.to_owned(), frame, source }
}

/// Converts an error of the MCAP reader, with the file.
pub(super) fn read_error(path: &Path, error: mcap::McapError) -> RecordError {
    let path = path.to_owned();
    match error {
        mcap::McapError::Io(source) => RecordError::Read { path, source },
        mcap::McapError::BadMagic => RecordError::NotMcap { path },
        source => RecordError::Damaged { path, source },
    }
}
