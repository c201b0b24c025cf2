//! Encoder of frames into messages, and of messages into a file.

use mcap::{McapError, McapResult};

use super::channels::{self, ChannelEncoder};
use super::chunk_journal::ChunkJournal;
use super::clock::nanoseconds;
use super::container::{Container, Finished, Message};
use super::declaration::PROTOBUF;
use super::frame_copy::Batch;
use super::outcome::{OUTCOME, RecordedOutcome};
use super::sink::Sink;
use super::{LogLevel, Options, attachments, log, transform};
use pliant::observer::{Frame, Quantities};
use pliant::topology::Topology;
use pliant_files::disk::File;

/// Encoder of all channels of a recording.
pub(super) struct FrameEncoder {
    container: Container<Box<dyn Sink>>,
    /// Channels in the order of their messages in a frame.
    channels: Vec<OpenChannel>,
    frames: u64,
    logged: u32,
}

/// Channel with its last message.
struct OpenChannel {
    number: u16,
    topic: String,
    encoder: Box<dyn ChannelEncoder>,
    buffer: Vec<u8>,
}

impl FrameEncoder {
    /// Writes everything known before the first frame.
    pub(super) fn new(
        sink: Box<dyn Sink>,
        journal: ChunkJournal,
        options: &Options,
        topology: &Topology,
    ) -> McapResult<Self> {
        let mut container = Container::create(sink, Some(journal))?;
        attachments::write(&mut container, options, topology)?;
        let encoders = channels::encoders(options, topology);
        let mut declared: Vec<_> = encoders.iter().map(|encoder| encoder.declaration()).collect();
        let opened = encoders.into_iter().zip(&declared);
        let channels = opened.map(|(encoder, channel)| OpenChannel {
            number: channel.id,
            topic: channel.topic.clone(),
            encoder,
            buffer: vec![],
        });
        let channels = channels.collect();
        let is_drawn = declared.iter().any(|channel| channel.message_encoding == PROTOBUF);
        if is_drawn {
            declared.insert(0, transform::channel());
        }
        container.add_channels(&declared)?;
        if is_drawn {
            let message = transform::message();
            container.keep(&[Message::new(transform::NUMBER, 0, 0, &message)], None);
        }
        Ok(FrameEncoder { container, channels, frames: 0, logged: 0 })
    }

    /// Topics, with the frame quantities that each needs.
    pub(super) fn needs(&self) -> Vec<(String, Quantities)> {
        let of = |channel: &OpenChannel| (channel.topic.clone(), channel.encoder.quantities());
        self.channels.iter().map(of).collect()
    }

    /// Frame quantities that any channel needs.
    pub(super) fn quantities(&self) -> Quantities {
        self.channels.iter().map(|channel| channel.encoder.quantities()).collect()
    }

    /// Records a frame with all [`quantities`](Self::quantities), and calls `durable`, if given, once a
    /// kill cannot lose it any more. [`failure`](Self::failure) returns a write error.
    pub(super) fn frame(&mut self, frame: &Frame<'_>, durable: Option<&dyn Fn()>) {
        let log_time = nanoseconds(frame.time);
        // Sequence numbers are frame indices, so that gaps in /mesh are visible.
        let sequence = self.frames as u32;
        let mut group = Vec::with_capacity(self.channels.len());
        for OpenChannel { number, encoder, buffer, .. } in &mut self.channels {
            if encoder.is_due(log_time) {
                buffer.clear();
                encoder.encode(frame, log_time, buffer);
                group.push(Message::new(*number, sequence, log_time, buffer));
            }
        }
        self.container.keep_frame(&group, durable);
        self.frames += 1;
    }

    /// Records the frames of `batch` and empties it. If the batch is urgent, `durable` is called once a
    /// kill cannot lose its last frame any more.
    pub(super) fn take(&mut self, batch: &mut Batch, durable: &dyn Fn()) {
        for (frame, is_urgent) in batch.frames() {
            self.frame(&frame, is_urgent.then_some(durable));
        }
        batch.clear();
    }

    /// Records the messages of a frame that another recorder has encoded.
    pub(super) fn replay(&mut self, group: &[Message<'_>]) -> McapResult<()> {
        for Message { header, .. } in group {
            let of = |channel: &&mut OpenChannel| channel.number == header.channel_id;
            self.channels.iter_mut().filter(of).for_each(|channel| {
                channel.encoder.is_due(header.log_time);
            });
        }
        self.container.keep_frame(group, None);
        self.failure().map_or(Ok(()), Err)
    }

    /// Continues with frame number `frames`.
    pub(super) fn begin_at(&mut self, frames: u64) {
        self.frames = frames;
    }

    /// Sets the file behind the sink.
    pub(super) fn sync_with(&mut self, file: File) {
        self.container.sync_with(file);
    }

    /// Waits until all frames are on the disk.
    pub(super) fn secure(&mut self) -> McapResult<()> {
        self.container.secure()
    }

    /// Records a message about the run at a simulated time [s].
    pub(super) fn log(&mut self, level: LogLevel, text: &str, time: f64) -> McapResult<()> {
        if !self.container.has_channel(log::NUMBER) {
            self.container.add_channels(&[log::channel()])?;
        }
        let log_time = nanoseconds(time);
        let message = log::message(level, text, log_time);
        self.container.keep(&[Message::new(log::NUMBER, self.logged, log_time, &message)], Some(&|| ()));
        self.logged += 1;
        Ok(())
    }

    /// Write error, returned once. The data are in the journal, unless the journal failed.
    pub(super) fn failure(&mut self) -> Option<McapError> {
        self.container.failure()
    }

    /// True if something could not be written.
    pub(super) fn has_failed(&self) -> bool {
        self.container.has_failed()
    }

    /// Number of frames that recovery finds, see [`Container::salvage`].
    pub(super) fn salvage(&mut self) -> u64 {
        self.container.salvage()
    }

    /// Finishes the file.
    ///
    /// # Errors
    /// The errors of [`Container::finish`].
    pub(super) fn finish(
        mut self,
        outcome: &RecordedOutcome,
    ) -> Result<Finished<Box<dyn Sink>>, (McapError, u64)> {
        match self.container.metadata(OUTCOME, outcome.to_metadata().metadata) {
            Ok(()) => self.container.finish(),
            Err(error) => Err((error, self.container.salvage())),
        }
    }
}
