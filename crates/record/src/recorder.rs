//! Observer that records a run.

use std::collections::BTreeMap;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::background_writer::BackgroundWriter;
use super::channels::elements;
use super::chunk_journal::ChunkJournal;
use super::clock::seconds;
use super::container::{Finished, Message};
use super::error::write_error;
use super::frame_encoder::FrameEncoder;
use super::outcome::{RecordedOutcome, RecordedStatus};
use super::sink::{Sink, Tail};
use super::{LogLevel, RecordError, paths, read};
use pliant::observer::{Frame, Observer, ObserverError, Quantities};
use pliant::probe::Probe;
use pliant::topology::Topology;
use pliant_files::{disk, durable_file};
use pliant_scene::Channel;

/// Content and options of a recording.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Replace the output and the remains of an unfinished run to it.
    pub overwrite: bool,
    /// Time that a recorded frame may wait for the next one before it is handed to the operating system;
    /// zero, the default, disables waiting. A kill loses at most what took this long to compute; waiting
    /// makes frames in quick succession cheaper.
    pub max_loss: Duration,
    /// Channels to record. Nothing else is encoded or written.
    pub channels: Vec<Channel>,
    /// Title, one line.
    pub title: Option<String>,
    /// Probed points, each on a channel of its own.
    pub probes: Vec<Probe>,
    /// Names of the pins, `body/pin`, and walls, `wall0`, whose forces `/reactions` holds.
    pub reactions: Vec<String>,
    /// Text of the scene, attached as `scene.toml` unless empty.
    pub scene_text: String,
    /// More key-value pairs for the metadata record `pliant`; they take precedence over its own.
    pub metadata: BTreeMap<String, String>,
}

/// Result of a complete recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recorded {
    /// The file.
    pub path: PathBuf,
    /// Number of frames.
    pub frames: u64,
    /// Size of the file.
    pub bytes: u64,
}

/// Recorder of a run to an MCAP file. See [the module](super) for the format.
///
/// Call [`finish`](Self::finish) or [`finish_with`](Self::finish_with), also if the run has failed. Until
/// then the file is called `<path>.part`, and it keeps that name if the recorder is only dropped.
pub struct McapRecorder {
    path: PathBuf,
    part: PathBuf,
    overwrite: bool,
    writer: BackgroundWriter,
    /// Topics, with the quantities that each needs.
    needs: Vec<(String, Quantities)>,
    element_count: usize,
    /// Required length of `x` and `v`.
    length: usize,
    frames: u64,
    /// Step of the last frame.
    step: u64,
    /// Time of the last frame [s].
    time: f64,
    /// First frame lost because of a write error.
    failed_at: Option<u64>,
}

impl McapRecorder {
    /// Opens `<path>.part` and writes everything known before the first frame.
    ///
    /// # Errors
    /// [`RecordError::Exists`], [`RecordError::LeftOver`] and [`RecordError::InUse`] if this would
    /// destroy data, [`RecordError::VertexIndex`] if the topology is inconsistent,
    /// [`RecordError::Write`].
    pub fn create(path: &Path, options: &Options, topology: &Topology) -> Result<Self, RecordError> {
        if !options.overwrite && disk::exists(path) {
            return Err(RecordError::Exists { path: path.to_owned() });
        }
        check(topology)?;
        let file = paths::create_exclusive(&paths::part_of(path), options.overwrite)?;
        let tail = paths::tail_of(&paths::part_of(path));
        let journal = durable_file::create(&tail)
            .map_err(|error| write_error(&tail, None, mcap::McapError::Io(error)))?;
        let synced = file.try_clone();
        let sink = BufWriter::with_capacity(1 << 16, file);
        let mut recorder = Self::with_sinks(path, options, topology, Box::new(sink), Box::new(journal))?;
        let synced = synced.map_err(mcap::McapError::Io);
        let given = synced.and_then(|file| recorder.writer.encoder().map(|encoder| encoder.sync_with(file)));
        recorder.note_failure(given)?;
        Ok(recorder)
    }

    /// Recorder to sinks for `<path>.part` and `<path>.part.tail`.
    pub(super) fn with_sinks(
        path: &Path,
        options: &Options,
        topology: &Topology,
        sink: Box<dyn Sink>,
        tail: Box<dyn Tail>,
    ) -> Result<Self, RecordError> {
        let part = paths::part_of(path);
        let journal = ChunkJournal::new(paths::tail_of(&part), tail);
        let encoder = FrameEncoder::new(sink, journal, options, topology)
            .map_err(|error| write_error(&part, None, error))?;
        Ok(McapRecorder {
            path: path.to_owned(),
            part,
            overwrite: options.overwrite,
            length: topology.vertex_count * topology.dimension,
            needs: encoder.needs(),
            element_count: elements::count(topology),
            writer: BackgroundWriter::new(encoder, options.max_loss),
            frames: 0,
            step: 0,
            time: 0.0,
            failed_at: None,
        })
    }

    /// Name of the file once complete.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Number of frames recorded.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Records a frame. After return a kill no longer loses it; a frame within the [largest
    /// loss](Options::max_loss) of the last write is safe after a later one.
    ///
    /// # Errors
    /// [`RecordError::FrameShape`], [`RecordError::MissingQuantities`], [`RecordError::ElementCount`];
    /// [`RecordError::Write`] if an earlier frame could not be written, which is recoverable together
    /// with all others before this one; after that, [`RecordError::Incomplete`].
    pub fn record(&mut self, frame: &Frame<'_>) -> Result<(), RecordError> {
        self.ensure_sound()?;
        self.ensure_whole(frame)?;
        let recorded = self.writer.frame(frame);
        self.note_failure(recorded)?;
        self.frames += 1;
        (self.step, self.time) = (frame.step, frame.time);
        Ok(())
    }

    /// Waits until every frame recorded so far is on the disk: neither a kill nor a power failure loses
    /// it.
    ///
    /// # Errors
    /// [`RecordError::Write`]; after it, [`RecordError::Incomplete`].
    pub fn secure(&mut self) -> Result<(), RecordError> {
        self.ensure_sound()?;
        let secured = self.writer.encoder().and_then(FrameEncoder::secure);
        self.note_failure(secured)
    }

    /// Writes a complete file with all frames recorded so far, in place of one with that name. The recording
    /// goes on.
    ///
    /// # Errors
    /// The errors of [`secure`](Self::secure); [`RecordError::Read`].
    pub fn copy_to(&mut self, path: &Path) -> Result<(), RecordError> {
        self.secure()?;
        read::copy(&self.part, path)
    }

    /// Records the messages of a frame that another recorder has encoded.
    pub(super) fn replay(&mut self, group: &[Message<'_>]) -> Result<(), RecordError> {
        let replayed = self.writer.encoder().and_then(|encoder| encoder.replay(group));
        self.note_failure(replayed)?;
        self.time = group.last().map_or(self.time, |message| seconds(message.header.log_time));
        Ok(())
    }

    /// Continues with frame number `frames`, after replaying those before.
    pub(super) fn begin_at(&mut self, frames: u64) -> Result<(), RecordError> {
        self.frames = frames;
        let begun = self.writer.encoder().map(|encoder| encoder.begin_at(frames));
        self.note_failure(begun)?;
        self.secure()
    }

    /// Records a message about the run at a simulated time [s].
    ///
    /// # Errors
    /// [`RecordError::Write`]; after it, [`RecordError::Incomplete`].
    pub fn log(&mut self, level: LogLevel, text: &str, time: f64) -> Result<(), RecordError> {
        self.ensure_sound()?;
        let logged = self.writer.encoder().and_then(|encoder| encoder.log(level, text, time));
        self.note_failure(logged)
    }

    /// Finishes the file of a completed run.
    ///
    /// # Errors
    /// The errors of [`finish_with`](Self::finish_with).
    pub fn finish(self) -> Result<Recorded, RecordError> {
        let (step, time) = (Some(self.step), self.time);
        self.finish_with(&RecordedOutcome {
            status: RecordedStatus::Completed,
            step,
            time,
            message: String::new(),
        })
    }

    /// Finishes the file: writes the outcome and the indexes, waits for the disk, and renames the file.
    ///
    /// # Errors
    /// [`RecordError::Write`]; [`RecordError::Incomplete`] if a frame could not be written;
    /// [`RecordError::Exists`] if a file with that name has appeared meanwhile. In all cases
    /// `<path>.part` stays, with all frames that were written.
    pub fn finish_with(mut self, outcome: &RecordedOutcome) -> Result<Recorded, RecordError> {
        self.ensure_sound()?;
        let written = self.writer.encoder().map(|_| ());
        self.note_failure(written)?;
        // No frame number if all frames are durable.
        let failed = |error, durable| {
            write_error(&self.part, Some(durable).filter(|durable| *durable < self.frames), error)
        };
        let encoder = self.writer.into_encoder().map_err(|error| failed(error, 0))?;
        let mut finished = encoder.finish(outcome).map_err(|(error, durable)| failed(error, durable))?;
        if let Err(error) = finished.stream.sync() {
            return Err(failed(mcap::McapError::Io(error), finished.salvage()));
        }
        let Finished { stream, journal, .. } = finished;
        // Windows cannot rename an open file.
        drop(stream);
        if !self.overwrite && disk::exists(&self.path) {
            return Err(RecordError::Exists { path: self.path });
        }
        let named = disk::rename(&self.part, &self.path).and_then(|()| disk::metadata(&self.path));
        let bytes = named.map_err(|error| write_error(&self.path, None, mcap::McapError::Io(error)))?.len();
        paths::sync_directory_of(&self.path);
        if let Some(journal) = journal {
            // A tail without its file is harmless; the next recording to this name replaces it.
            let _ = journal.remove();
        }
        Ok(Recorded { path: self.path, frames: self.frames, bytes })
    }

    fn ensure_sound(&self) -> Result<(), RecordError> {
        self.failed_at.map_or(Ok(()), |frame| Err(RecordError::Incomplete { part: self.part.clone(), frame }))
    }

    /// Checks that `frame` has everything to be recorded.
    fn ensure_whole(&self, frame: &Frame<'_>) -> Result<(), RecordError> {
        let (number, expected) = (self.frames, self.length);
        for found in [frame.x.len(), frame.v.len()] {
            if found != expected {
                return Err(RecordError::FrameShape { frame: number, expected, found });
            }
        }
        let has = frame.quantities();
        for (topic, needed) in &self.needs {
            let quantities = needed.without(has);
            if !quantities.is_empty() {
                let topic = topic.clone();
                return Err(RecordError::MissingQuantities { frame: number, quantities, topic });
            }
            let counts = [
                (Quantities::ELEMENTS, frame.elements.map_or(0, <[_]>::len)),
                (Quantities::STRESS_ERROR, frame.stress_error.map_or(0, <[_]>::len)),
            ];
            let expected = self.element_count;
            let mut counts = counts.into_iter().filter(|(quantities, _)| needed.contains(*quantities));
            if let Some((_, found)) = counts.find(|(_, found)| *found != expected) {
                return Err(RecordError::ElementCount { frame: number, expected, found });
            }
        }
        Ok(())
    }

    fn note_failure(&mut self, written: mcap::McapResult<()>) -> Result<(), RecordError> {
        written.map_err(|error| {
            let durable = self.writer.salvage().min(self.frames);
            self.failed_at = Some(durable);
            write_error(&self.part, Some(durable), error)
        })
    }
}

impl Observer for McapRecorder {
    fn quantities(&self) -> Quantities {
        self.needs.iter().map(|(_, quantities)| *quantities).collect()
    }

    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        Ok(self.record(frame)?)
    }

    fn secure(&mut self) -> Result<(), ObserverError> {
        Ok(McapRecorder::secure(self)?)
    }
}

fn check(topology: &Topology) -> Result<(), RecordError> {
    let vertex_count = topology.vertex_count;
    let outside = |index: &u32| *index as usize >= vertex_count;
    topology.bodies.iter().try_for_each(|body| match body.largest_index().filter(outside) {
        Some(index) => Err(RecordError::VertexIndex { body: body.name.clone(), index, vertex_count }),
        None => Ok(()),
    })
}
