//! The observer that writes.

use std::collections::BTreeMap;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::channel::{ENERGY, LOG, MESH, REACTIONS, STATE, TRANSFORM};
use super::clock::nanoseconds;
use super::cloud::Cloud;
use super::container::{Container, Message};
use super::elements::Elements;
use super::error::write_error;
use super::journal::Journal;
use super::outcome::{OUTCOME, Outcome, Status};
use super::probe::Probes;
use super::sink::Sink;
use super::surface::Drawing;
use super::{Level, RecordError, attachments, energy, paths, reactions, state, transform, warning};
use crate::observer::{Frame, Observer, ObserverError};
use crate::probe::Probe;
use crate::scene::Channel;
use crate::topology::Topology;

/// What to record.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Replace the output, and what an unfinished run to it has left.
    pub overwrite: bool,
    /// How long a recorded frame may wait for the next one before it is handed to the operating system; zero, the default: not at
    /// all. A kill loses at most what took this long to compute, and frames that follow each other faster cost less.
    pub patience: Duration,
    /// What each frame holds. Nothing else is encoded or written.
    pub channels: Vec<Channel>,
    /// One line that says what this is.
    pub title: Option<String>,
    /// Points that are followed, each on a channel of its own.
    pub probes: Vec<Probe>,
    /// Names of the pins, `body/pin`, whose forces `/reactions` holds.
    pub pins: Vec<String>,
    /// Text of the scene, attached as `scene.toml` unless empty.
    pub scene_text: String,
    /// More key-value pairs for the metadata record `pliant`; they take precedence over its own.
    pub metadata: BTreeMap<String, String>,
}

/// A complete recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recorded {
    /// The file.
    pub path: PathBuf,
    /// Number of frames.
    pub frames: u64,
    /// Its size.
    pub bytes: u64,
}

/// Writes a run to an MCAP file. See [the module](super) for the format.
///
/// Call [`finish`](Self::finish) or [`finish_with`](Self::finish_with), also when the run has failed: until then the
/// file is called `<path>.part`, and it keeps that name if the recorder is only dropped.
pub struct McapRecorder {
    path: PathBuf,
    part: PathBuf,
    overwrite: bool,
    container: Container<Box<dyn Sink>>,
    /// `x` and `v` must have this length.
    length: usize,
    states: Option<Cloud>,
    elements: Option<Elements>,
    probes: Probes,
    records_energy: bool,
    records_reactions: bool,
    drawing: Option<Drawing>,
    buffers: [Vec<u8>; 4],
    frames: u64,
    logged: u32,
    /// Of the last frame.
    step: u64,
    /// Of the last frame.
    time: f64,
    /// The frame at which writing failed.
    failed_at: Option<u64>,
}

impl McapRecorder {
    /// Opens `<path>.part` and writes everything that is known before the first frame.
    ///
    /// # Errors
    /// [`RecordError::Exists`], [`RecordError::LeftOver`] and [`RecordError::InUse`] if that would destroy something,
    /// [`RecordError::VertexIndex`] if the topology contradicts itself, [`RecordError::Write`].
    pub fn create(path: &Path, options: &Options, topology: &Topology) -> Result<Self, RecordError> {
        if !options.overwrite && path.exists() {
            return Err(RecordError::Exists { path: path.to_owned() });
        }
        check(topology)?;
        let file = paths::create_exclusive(&paths::part_of(path), options.overwrite)?;
        Self::with_sink(path, options, topology, Box::new(BufWriter::with_capacity(1 << 16, file)))
    }

    /// The same, for a sink that is `<path>.part`.
    pub(super) fn with_sink(
        path: &Path,
        options: &Options,
        topology: &Topology,
        sink: Box<dyn Sink>,
    ) -> Result<Self, RecordError> {
        let part = paths::part_of(path);
        let tail = paths::tail_of(&part);
        let failed = |error| write_error(&part, None, error);
        let journal = Journal::create(&tail, options.patience)
            .map_err(|error| write_error(&tail, None, mcap::McapError::Io(error)))?;
        let mut container = Container::create(sink, Some(journal)).map_err(failed)?;
        attachments::write(&mut container, options, topology).map_err(failed)?;

        let asked = |channel| options.channels.contains(&channel);
        let drawing = if asked(Channel::Mesh) { Drawing::new(topology) } else { None };
        let elements = Elements::new(&options.channels, topology);
        let mut channels = Vec::new();
        if asked(Channel::State) || drawing.is_some() || elements.is_some() {
            channels.push(transform::channel());
        }
        if drawing.is_some() {
            channels.push(Drawing::channel());
        }
        let probes = Probes::new(&options.probes);
        channels.extend(probes.channels());
        channels.extend(elements.iter().flat_map(Elements::channels));
        if asked(Channel::Reactions) {
            channels.push(reactions::channel(&options.pins));
        }
        if asked(Channel::Energy) {
            channels.push(energy::channel());
        }
        if asked(Channel::State) {
            channels.push(state::channel(topology.vertex_count));
        }
        container.add_channels(&channels).map_err(failed)?;
        if container.has_channel(TRANSFORM.0) {
            let message = transform::message();
            container.write(&[Message::new(TRANSFORM.0, 0, 0, &message)]).map_err(failed)?;
        }
        Ok(McapRecorder {
            path: path.to_owned(),
            part,
            overwrite: options.overwrite,
            container,
            length: topology.vertex_count * topology.dimension,
            states: asked(Channel::State).then(state::cloud),
            records_energy: asked(Channel::Energy),
            records_reactions: asked(Channel::Reactions),
            elements,
            probes,
            drawing,
            buffers: Default::default(),
            frames: 0,
            logged: 0,
            step: 0,
            time: 0.0,
            failed_at: None,
        })
    }

    /// The file as it will be called.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Number of frames recorded.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Records a frame. A kill no longer loses it when this returns, or where it came within the [patience](Options::patience) of the
    /// last write, when a later one does.
    ///
    /// # Errors
    /// [`RecordError::FrameShape`], [`RecordError::MissingDiagnostics`], [`RecordError::MissingReactions`], [`RecordError::Write`]; after the latter,
    /// [`RecordError::Incomplete`].
    pub fn record(&mut self, frame: &Frame<'_>) -> Result<(), RecordError> {
        self.ensure_sound()?;
        for found in [frame.x.len(), frame.v.len()] {
            if found != self.length {
                return Err(RecordError::FrameShape { frame: self.frames, expected: self.length, found });
            }
        }
        let log_time = nanoseconds(frame.time);
        // Sequence numbers are those of the frames, so that gaps in /mesh show.
        let sequence = self.frames as u32;
        let [mesh, forces, energies, states] = &mut self.buffers;
        let mut group = Vec::with_capacity(3);
        if let Some(drawing) = &mut self.drawing
            && drawing.is_due(log_time)
        {
            drawing.encode_frame(frame, log_time, mesh);
            group.push(Message::new(MESH.0, sequence, log_time, mesh));
        }
        self.probes.encode_frame(frame);
        group.extend(self.probes.messages(sequence, log_time));
        if let Some(elements) = &mut self.elements {
            let (frame_number, expected) = (self.frames, elements.count());
            let states = frame.elements.ok_or(RecordError::MissingElements {
                frame: frame_number,
                expected,
                found: 0,
            })?;
            if states.len() != expected {
                let found = states.len();
                return Err(RecordError::MissingElements { frame: frame_number, expected, found });
            }
            elements.encode_frame(frame, states, log_time);
            group.extend(elements.messages(sequence, log_time));
        }
        if self.records_reactions {
            let of_pins = frame.reactions.ok_or(RecordError::MissingReactions { frame: self.frames })?;
            reactions::encode_frame(frame.time, of_pins, forces);
            group.push(Message::new(REACTIONS.0, sequence, log_time, forces));
        }
        if self.records_energy {
            let diagnostics =
                frame.diagnostics.ok_or(RecordError::MissingDiagnostics { frame: self.frames })?;
            energy::encode_frame(frame.step, diagnostics, frame.work, energies);
            group.push(Message::new(ENERGY.0, sequence, log_time, energies));
        }
        // Last, because recovery takes a frame for complete when it has seen this one.
        if let Some(cloud) = &self.states {
            state::encode_frame(cloud, frame, log_time, states);
            group.push(Message::new(STATE.0, sequence, log_time, states));
        }
        let written = self.container.write(&group);
        self.note_failure(written)?;
        self.frames += 1;
        (self.step, self.time) = (frame.step, frame.time);
        Ok(())
    }

    /// Records a message about the run at a simulated time [s].
    ///
    /// # Errors
    /// [`RecordError::Write`]; after it, [`RecordError::Incomplete`].
    pub fn log(&mut self, level: Level, text: &str, time: f64) -> Result<(), RecordError> {
        self.ensure_sound()?;
        if !self.container.has_channel(LOG.0) {
            let added = self.container.add_channels(&[warning::channel()]);
            self.note_failure(added)?;
        }
        let log_time = nanoseconds(time);
        let message = warning::message(level, text, log_time);
        let written = self.container.write(&[Message::new(LOG.0, self.logged, log_time, &message)]);
        self.note_failure(written)?;
        self.logged += 1;
        Ok(())
    }

    /// Ends the file of a run that reached its end.
    ///
    /// # Errors
    /// As [`finish_with`](Self::finish_with).
    pub fn finish(self) -> Result<Recorded, RecordError> {
        let (step, time) = (Some(self.step), self.time);
        self.finish_with(&Outcome { status: Status::Completed, step, time, message: String::new() })
    }

    /// Ends the file: notes how the run went, writes the indexes, waits for the disk, and gives the file its name.
    ///
    /// # Errors
    /// [`RecordError::Write`]; [`RecordError::Incomplete`] if a frame could not be written;
    /// [`RecordError::Exists`] if something took the name meanwhile. In all cases `<path>.part` stays, with all
    /// frames that were written.
    pub fn finish_with(mut self, outcome: &Outcome) -> Result<Recorded, RecordError> {
        self.ensure_sound()?;
        let failed = |error| write_error(&self.part, None, error);
        self.container.metadata(OUTCOME, outcome.to_metadata().metadata).map_err(failed)?;
        let (mut sink, journal) = self.container.finish().map_err(failed)?;
        sink.sync().map_err(|error| failed(mcap::McapError::Io(error)))?;
        // Windows cannot rename an open file.
        drop(sink);
        if !self.overwrite && self.path.exists() {
            return Err(RecordError::Exists { path: self.path });
        }
        let named = std::fs::rename(&self.part, &self.path).and_then(|()| std::fs::metadata(&self.path));
        let bytes = named.map_err(|error| write_error(&self.path, None, mcap::McapError::Io(error)))?.len();
        paths::sync_directory_of(&self.path);
        if let Some(journal) = journal {
            // A tail without its file harms nobody; the next recording to this name replaces it.
            let _ = journal.remove();
        }
        Ok(Recorded { path: self.path, frames: self.frames, bytes })
    }

    fn ensure_sound(&self) -> Result<(), RecordError> {
        self.failed_at.map_or(Ok(()), |frame| Err(RecordError::Incomplete { part: self.part.clone(), frame }))
    }

    fn note_failure(&mut self, written: mcap::McapResult<()>) -> Result<(), RecordError> {
        written.map_err(|error| {
            self.failed_at = Some(self.frames);
            write_error(&self.part, Some(self.frames), error)
        })
    }
}

impl Observer for McapRecorder {
    fn wants_diagnostics(&self) -> bool {
        self.records_energy
    }

    fn wants_reactions(&self) -> bool {
        self.records_reactions
    }

    fn wants_elements(&self) -> bool {
        self.elements.is_some()
    }

    fn wants_points(&self) -> bool {
        self.probes.wants_points()
    }

    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        Ok(self.record(frame)?)
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
