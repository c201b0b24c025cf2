//! Errors of writing, reading and recovering trajectories.

use std::io;
use std::path::{Path, PathBuf};

use pliant::observer::{ObserverError, Quantities};

/// A trajectory could not be written, read or recovered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// The output exists and overwriting was not asked for.
    #[error("{} exists; choose another name with `-o`, or replace it with `--force`", path.display())]
    Exists {
        /// The file that is there.
        path: PathBuf,
    },
    /// An earlier run to the same output did not finish.
    #[error(
        "{0} is left over from a run that did not finish; keep its frames with `pliant recover {0}`, or \
         discard it with `--force`",
        part.display()
    )]
    LeftOver {
        /// The unfinished file.
        part: PathBuf,
    },
    /// Another process is writing this file at this moment.
    #[error("{} is being written by another process", path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// A recording that is to go on does not have the frames before.
    #[error(
        "{} {reason}: the frames before the checkpoint are missing; put back the recording that the run \
         wrote, or go on without one (`--no-record`)",
        path.display()
    )]
    NoBeginning {
        /// The file.
        path: PathBuf,
        /// Reason, after the name of the file.
        reason: &'static str,
    },
    /// The file could not be written; with `frame`, frames before that one are recoverable.
    #[error("cannot write {}{}: {source}{}", path.display(), at_frame(*frame), advice(path, *frame))]
    Write {
        /// The file.
        path: PathBuf,
        /// The first frame that is lost, as far as that is known: after an error of the device, `pliant
        /// recover` may find more. `None` where none is.
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
        /// The first frame that is missing.
        frame: u64,
    },
    /// A frame does not fit the topology that the recording began with.
    #[error(
        "frame {frame} has {found} numbers per field where the topology has {expected} (vertices x dimension)"
    )]
    FrameShape {
        /// The frame.
        frame: u64,
        /// Numbers in `x` and `v` that the topology asks for.
        expected: usize,
        /// Numbers in the frame.
        found: usize,
    },
    /// A frame does not have what a channel records.
    #[error("frame {frame} has no {quantities}, which the channel {topic} records")]
    MissingQuantities {
        /// The frame.
        frame: u64,
        /// Quantities that the frame does not have.
        quantities: Quantities,
        /// Topic of the channel.
        topic: String,
    },
    /// A frame has the states of other elements than those of the topology.
    #[error("frame {frame} has the states of {found} elements, of {expected} that channels record")]
    ElementCount {
        /// The frame.
        frame: u64,
        /// Elements of the topology.
        expected: usize,
        /// Elements in the frame.
        found: usize,
    },
    /// A cell names a vertex that does not exist.
    #[error("body `{body}` refers to vertex {index}, but there are {vertex_count}")]
    VertexIndex {
        /// Name of the body.
        body: String,
        /// The index.
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
        /// The damage.
        source: mcap::McapError,
    },
    /// The file ends early: the run that wrote it is still going, or was killed.
    #[error("{0} is not finished; once its run has ended, `pliant recover {0}` makes it \
             readable", path.display())]
    NotFinished {
        /// The file.
        path: PathBuf,
    },
    /// The file does not hold what a file of this program holds.
    #[error("{} was not written by pliant, or by a newer version: {what}", path.display())]
    Unexpected {
        /// The file.
        path: PathBuf,
        /// The part that is missing or different.
        what: &'static str,
    },
    /// The channel was not recorded.
    #[error("{} has no channel {topic}; add it to `channels` in `[output]` and run again", path.display())]
    NoChannel {
        /// The file.
        path: PathBuf,
        /// The channel.
        topic: String,
    },
    /// There is no such frame.
    #[error("{} has {count} frames, so there is no frame {frame}", path.display())]
    NoFrame {
        /// The file.
        path: PathBuf,
        /// The frame asked for, from 0.
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

/// An error of the MCAP writer, with the file and the frame.
pub(super) fn write_error(path: &Path, frame: Option<u64>, error: mcap::McapError) -> RecordError {
    let source = match error {
        mcap::McapError::Io(source) => source,
        other => io::Error::other(other),
    };
    RecordError::Write { path: path.to_owned(), frame, source }
}

/// An error of the MCAP reader, with the file.
pub(super) fn read_error(path: &Path, error: mcap::McapError) -> RecordError {
    let path = path.to_owned();
    match error {
        mcap::McapError::Io(source) => RecordError::Read { path, source },
        mcap::McapError::BadMagic => RecordError::NotMcap { path },
        source => RecordError::Damaged { path, source },
    }
}
