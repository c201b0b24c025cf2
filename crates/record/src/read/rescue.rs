//! Recovery: a complete file from the remains of a killed run.

use std::collections::{HashMap, HashSet};
use std::io::BufWriter;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::records::Record;
use mcap::{Channel, McapError, Schema};

use super::recording_file::{RecordingFile, ensure_mcap};
use super::walk::walk;
use crate::RecordError;
use crate::channels::{energy, last_of_frame, place_in_frame};
use crate::clock::seconds;
use crate::container::{Container, Message};
use crate::error::write_error;
use crate::outcome::{OUTCOME, RecordedOutcome, RecordedStatus};
use crate::paths;
use crate::sink::Sink;
use pliant_files::disk::{self, File};
use pliant_files::regular_file;

/// Outcome of a run that left none.
const KILLED: (RecordedStatus, &str) =
    (RecordedStatus::Recovered, "the run was killed; these are the frames that it had recorded");

/// Outcome in a copy of a recording that goes on.
const ACTIVE: (RecordedStatus, &str) =
    (RecordedStatus::Interrupted, "the run went on; these are the frames that it had recorded");

/// Result of a recovery.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Recovered {
    /// The complete file.
    pub path: PathBuf,
    /// Number of frames.
    pub frames: u64,
    /// Simulated time of the last frame [s].
    pub last_time: f64,
    /// Size of the complete file.
    pub bytes: u64,
    /// Damaged parts, which the complete file lacks.
    pub skipped: Vec<String>,
}

/// Writes a complete file with everything in an unfinished one and its tail: metadata, attachments, and
/// all complete frames. The unfinished file stays; [`discard`] removes it.
///
/// From a damaged file it takes everything before the damage and, if the file has an index, everything
/// else that is indexed and readable.
///
/// Except for the metadata `outcome`, the result has the same bytes as if the run had been stopped after
/// that frame.
///
/// # Errors
/// [`RecordError::InUse`] if the run that writes `part` is still active; [`RecordError::Exists`] unless
/// `overwrite`; [`RecordError::NotMcap`] if `part` is not MCAP; [`RecordError::Read`],
/// [`RecordError::Write`].
pub fn recover(part: &Path, out: &Path, overwrite: bool) -> Result<Recovered, RecordError> {
    if disk::exists(out) && !overwrite {
        return Err(RecordError::Exists { path: out.to_owned() });
    }
    let mut source =
        regular_file::open(part).map_err(|source| RecordError::Read { path: part.to_owned(), source })?;
    ensure_mcap(&mut source, part)?;
    paths::ensure_unlocked(&source, part)?;
    // A separate name, because `<out>.part` may be the file to recover. A stale file is from a recovery
    // that was itself killed.
    let temporary = paths::with_suffix(out, ".recovering");
    let file = paths::create_exclusive(&temporary, true)?;
    let rescued = rescue(part, file, &temporary, KILLED);
    let (frames, last_time, skipped) = rescued.inspect_err(|_| {
        // Removes the incomplete result. If this fails, the next recovery overwrites it.
        let _ = disk::remove_file(&temporary);
    })?;
    let renamed = disk::rename(&temporary, out).and_then(|()| disk::metadata(out));
    let bytes = renamed.map_err(|error| write_error(out, None, McapError::Io(error)))?.len();
    paths::sync_directory_of(out);
    Ok(Recovered { path: out.to_owned(), frames, last_time, bytes, skipped })
}

/// Writes a complete file with everything that an active recorder has written to `part` and its tail.
pub(crate) fn copy(part: &Path, out: &Path) -> Result<(), RecordError> {
    let file = paths::create_exclusive(out, true)?;
    rescue(part, file, out, ACTIVE).map(|_| ())
}

/// Copies everything; returns the number of frames, the time of the last one and the damaged parts.
fn rescue(
    part: &Path,
    file: File,
    temporary: &Path,
    ending: (RecordedStatus, &'static str),
) -> Result<(u64, f64, Vec<String>), RecordError> {
    let stream = BufWriter::with_capacity(1 << 16, file);
    let container = Container::create(stream, None).map_err(|error| write_error(temporary, None, error))?;
    let mut rescue = Rescue::new(container, temporary, ending);
    let mut skipped = Vec::new();
    let mut seen = HashSet::new();
    let fault = walk(part, &mut |offset, record| {
        seen.insert(offset);
        rescue.take(record).map(|()| ControlFlow::Continue(()))
    })?;
    if let Some(fault) = fault {
        match RecordingFile::open(part)? {
            Some(mut source) => skipped = rescue.take_indexed(&mut source, &seen)?,
            // A kill truncates the last record, which the tail has.
            None if matches!(fault.error, McapError::UnexpectedEof) => {}
            None => skipped.push(format!("all after byte {}: {}", fault.offset, fault.error)),
        }
    }
    let tail = paths::tail_of(part);
    if disk::exists(&tail) {
        walk(&tail, &mut |_, record| rescue.take(record).map(|()| ControlFlow::Continue(())))?;
    }
    let (frames, last_time) = rescue.end()?;
    Ok((frames, last_time, skipped))
}

/// Removes an unfinished file and its tail.
///
/// # Errors
/// [`RecordError::InUse`] if the run that writes it is still active, [`RecordError::Write`] if it cannot
/// be removed.
pub fn discard(part: &Path) -> Result<(), RecordError> {
    let failed = |source| RecordError::Write { path: part.to_owned(), frame: None, source };
    let file = File::open(part).map_err(failed)?;
    paths::ensure_unlocked(&file, part)?;
    disk::remove_file(part).map_err(failed)?;
    match disk::remove_file(paths::tail_of(part)) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(failed(error)),
        _ => Ok(()),
    }
}

/// Recovery in progress.
struct Rescue<'a> {
    container: Container<BufWriter<File>>,
    path: &'a Path,
    schemas: HashMap<u16, Arc<Schema<'static>>>,
    /// Last sequence number of each channel; repeated messages, both in a chunk and in the tail, are
    /// skipped.
    last_sequence: HashMap<u16, u32>,
    /// Channels announced but not yet added: they are added in one call, as the recorder does.
    announced: Vec<Channel<'static>>,
    /// Messages of the frame being read.
    frame: Vec<Message<'static>>,
    /// Channel whose message ends a frame.
    last_of_frame: Option<u16>,
    frames: u64,
    last_time: u64,
    step: Option<u64>,
    has_outcome: bool,
    /// Status and message of a run without an outcome.
    ending: (RecordedStatus, &'static str),
}

impl<'a> Rescue<'a> {
    fn new(
        container: Container<BufWriter<File>>,
        path: &'a Path,
        ending: (RecordedStatus, &'static str),
    ) -> Self {
        Rescue {
            container,
            path,
            schemas: HashMap::new(),
            last_sequence: HashMap::new(),
            announced: Vec::new(),
            frame: Vec::new(),
            last_of_frame: None,
            frames: 0,
            last_time: 0,
            step: None,
            has_outcome: false,
            ending,
        }
    }

    /// Takes indexed parts not yet seen; returns those that cannot be read.
    fn take_indexed(
        &mut self,
        source: &mut RecordingFile,
        seen: &HashSet<u64>,
    ) -> Result<Vec<String>, RecordError> {
        let mut skipped = Vec::new();
        let mut channels: Vec<_> = source.summary.channels.values().cloned().collect();
        channels.sort_by_key(|channel| channel.id);
        channels.into_iter().for_each(|channel| self.announce(Arc::unwrap_or_clone(channel)));
        for (offset, name) in source.listed() {
            if seen.contains(&offset) {
                continue;
            }
            let taken = source
                .visit_at(offset, &mut |_, record| self.take(record).map(|()| ControlFlow::Continue(())));
            match taken? {
                Ok(_) => {}
                Err(error) => {
                    self.frame.clear();
                    skipped.push(format!("{name}: {error}"));
                }
            }
        }
        Ok(skipped)
    }

    fn take(&mut self, record: Record<'static>) -> Result<(), RecordError> {
        let written = match record {
            Record::Metadata(record) => {
                self.has_outcome |= record.name == OUTCOME;
                self.container.metadata(&record.name, record.metadata)
            }
            Record::Attachment { header, data, .. } => {
                self.container.attach(&header.name, &header.media_type, data)
            }
            Record::Schema { header, data } => {
                let (id, name, encoding) = (header.id, header.name, header.encoding);
                self.schemas.insert(id, Arc::new(Schema { id, name, encoding, data }));
                Ok(())
            }
            Record::Channel(channel) => {
                let schema = self.schemas.get(&channel.schema_id).cloned();
                let (id, topic) = (channel.id, channel.topic);
                let (message_encoding, metadata) = (channel.message_encoding, channel.metadata);
                self.announce(Channel { id, topic, schema, message_encoding, metadata });
                Ok(())
            }
            Record::Message { header, data } => self.message(Message { header, data }),
            _ => Ok(()),
        };
        written.map_err(|error| write_error(self.path, Some(self.frames), error))
    }

    fn announce(&mut self, channel: Channel<'static>) {
        if self.knows(channel.id) {
            return;
        }
        self.announced.push(channel);
        self.last_of_frame = last_of_frame(self.announced.iter().map(|c| c.id).chain(self.last_of_frame));
    }

    fn knows(&self, id: u16) -> bool {
        self.container.has_channel(id) || self.announced.iter().any(|other| other.id == id)
    }

    fn message(&mut self, message: Message<'static>) -> mcap::McapResult<()> {
        if !self.announced.is_empty() {
            self.container.add_channels(&std::mem::take(&mut self.announced))?;
        }
        let id = message.header.channel_id;
        if self.last_sequence.get(&id).is_some_and(|last| message.header.sequence <= *last) {
            return Ok(());
        }
        self.last_sequence.insert(id, message.header.sequence);
        if place_in_frame(id).is_none() {
            return self.container.write(&[message]);
        }
        if id == energy::NUMBER {
            self.step = energy::step_of(&message.data);
        }
        let time = message.header.log_time;
        self.frame.push(message);
        if self.last_of_frame == Some(id) {
            self.container.write(&self.frame)?;
            self.frame.clear();
            (self.frames, self.last_time) = (self.frames + 1, time);
        }
        Ok(())
    }

    fn end(mut self) -> Result<(u64, f64), RecordError> {
        let (path, last_time) = (self.path, seconds(self.last_time));
        let failed = |error| write_error(path, None, error);
        self.container.add_channels(&self.announced).map_err(failed)?;
        if !self.has_outcome {
            let (status, message) = (self.ending.0, self.ending.1.to_owned());
            let outcome = RecordedOutcome { status, step: self.step, time: last_time, message };
            self.container.metadata(OUTCOME, outcome.to_metadata().metadata).map_err(failed)?;
        }
        let mut finished = self.container.finish().map_err(|(error, _)| failed(error))?;
        finished.stream.sync().map_err(|error| failed(McapError::Io(error)))?;
        Ok((self.frames, last_time))
    }
}
