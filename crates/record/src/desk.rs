//! Where frames become messages, and messages a file.

use std::fs::File;

use mcap::{McapError, McapResult};

use super::channel::{ENERGY, LOG, MESH, REACTIONS, STATE, TRANSFORM};
use super::clock::nanoseconds;
use super::cloud::Cloud;
use super::container::{Container, Finished, Message};
use super::elements::Elements;
use super::journal::Journal;
use super::kept::{Batch, Needs};
use super::outcome::{OUTCOME, Outcome};
use super::probe::Probes;
use super::sink::Sink;
use super::surface::Drawing;
use super::{Level, Options, attachments, energy, reactions, state, transform, warning};
use pliant::observer::Frame;
use pliant::topology::Topology;
use pliant_scene::Channel;

/// Encodes what it is given, and writes it.
pub(super) struct Desk {
    container: Container<Box<dyn Sink>>,
    states: Option<Cloud>,
    elements: Option<Elements>,
    probes: Probes,
    needs: Needs,
    drawing: Option<Drawing>,
    buffers: [Vec<u8>; 4],
    frames: u64,
    logged: u32,
}

impl Desk {
    /// Writes everything that is known before the first frame.
    pub(super) fn new(
        sink: Box<dyn Sink>,
        journal: Journal,
        options: &Options,
        topology: &Topology,
    ) -> McapResult<Self> {
        let mut container = Container::create(sink, Some(journal))?;
        attachments::write(&mut container, options, topology)?;
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
            channels.push(reactions::channel(&options.reactions));
        }
        if asked(Channel::Energy) {
            channels.push(energy::channel());
        }
        if asked(Channel::State) {
            channels.push(state::channel(topology.vertex_count));
        }
        container.add_channels(&channels)?;
        if container.has_channel(TRANSFORM.0) {
            let message = transform::message();
            container.keep(&[Message::new(TRANSFORM.0, 0, 0, &message)], None);
        }
        let needs = Needs {
            places: asked(Channel::State)
                || drawing.is_some()
                || elements.is_some()
                || !options.probes.is_empty(),
            diagnostics: asked(Channel::Energy),
            elements: elements.is_some(),
            points: probes.wants_points(),
            reactions: asked(Channel::Reactions),
        };
        Ok(Desk {
            container,
            needs,
            states: asked(Channel::State).then(state::cloud),
            elements,
            probes,
            drawing,
            buffers: Default::default(),
            frames: 0,
            logged: 0,
        })
    }

    /// What it reads of a frame.
    pub(super) fn needs(&self) -> Needs {
        self.needs
    }

    /// Number of elements whose states it reads.
    pub(super) fn element_count(&self) -> usize {
        self.elements.as_ref().map_or(0, Elements::count)
    }

    /// Records a frame that has all that [`needs`](Self::needs) names, and calls `safe`, where that is given, once a kill cannot lose it
    /// any more. [`failure`](Self::failure) says whether that went well.
    pub(super) fn frame(&mut self, frame: &Frame<'_>, safe: Option<&dyn Fn()>) {
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
        if let (Some(elements), Some(states)) = (&mut self.elements, frame.elements) {
            elements.encode_frame(frame, states, log_time);
            group.extend(elements.messages(sequence, log_time));
        }
        if let (true, Some(now)) = (self.needs.reactions, frame.reactions) {
            reactions::encode_frame(frame.time, now, forces);
            group.push(Message::new(REACTIONS.0, sequence, log_time, forces));
        }
        if let (true, Some(diagnostics)) = (self.needs.diagnostics, frame.diagnostics) {
            energy::encode_frame(frame.step, diagnostics, frame.work, energies);
            group.push(Message::new(ENERGY.0, sequence, log_time, energies));
        }
        // Last, because recovery takes a frame for complete when it has seen this one.
        if let Some(cloud) = &self.states {
            state::encode_frame(cloud, frame, log_time, states);
            group.push(Message::new(STATE.0, sequence, log_time, states));
        }
        self.container.keep_frame(&group, safe);
        self.frames += 1;
    }

    /// Records the frames of `batch` and empties it; where that is urgent, `safe` is called once a kill cannot lose the last one any
    /// more.
    pub(super) fn take(&mut self, batch: &mut Batch, safe: &dyn Fn()) {
        for (frame, is_urgent) in batch.frames() {
            self.frame(&frame, is_urgent.then_some(safe));
        }
        batch.clear();
    }

    /// Records the messages of a frame that another recorder has encoded.
    pub(super) fn replay(&mut self, group: &[Message<'_>]) -> McapResult<()> {
        for message in group.iter().filter(|message| message.header.channel_id == MESH.0) {
            if let Some(drawing) = &mut self.drawing {
                drawing.is_due(message.header.log_time);
            }
        }
        self.container.keep_frame(group, None);
        self.failure().map_or(Ok(()), Err)
    }

    /// Goes on with frame number `frames`.
    pub(super) fn begin_at(&mut self, frames: u64) {
        self.frames = frames;
    }

    /// Says which file the sink writes to.
    pub(super) fn sync_with(&mut self, file: File) {
        self.container.sync_with(file);
    }

    /// Returns when the disk has all frames.
    pub(super) fn secure(&mut self) -> McapResult<()> {
        self.container.secure()
    }

    /// Records a message about the run at a simulated time [s].
    pub(super) fn log(&mut self, level: Level, text: &str, time: f64) -> McapResult<()> {
        if !self.container.has_channel(LOG.0) {
            self.container.add_channels(&[warning::channel()])?;
        }
        let log_time = nanoseconds(time);
        let message = warning::message(level, text, log_time);
        self.container.keep(&[Message::new(LOG.0, self.logged, log_time, &message)], Some(&|| ()));
        self.logged += 1;
        Ok(())
    }

    /// Why something could not be written, once. It is in the journal, unless that is the reason.
    pub(super) fn failure(&mut self) -> Option<McapError> {
        self.container.failure()
    }

    /// Whether something could not be written.
    pub(super) fn has_failed(&self) -> bool {
        self.container.has_failed()
    }

    /// Number of frames that recovery finds, see [`Container::salvage`].
    pub(super) fn salvage(&mut self) -> u64 {
        self.container.salvage()
    }

    /// Ends the file.
    ///
    /// # Errors
    /// As [`Container::finish`].
    pub(super) fn finish(mut self, outcome: &Outcome) -> Result<Finished<Box<dyn Sink>>, (McapError, u64)> {
        match self.container.metadata(OUTCOME, outcome.to_metadata().metadata) {
            Ok(()) => self.container.finish(),
            Err(error) => Err((error, self.container.salvage())),
        }
    }
}
