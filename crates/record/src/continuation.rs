//! Recordings that continue from a checkpoint.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use mcap::records::Record;

use super::attachments::SCENE;
use super::channels::{self, is_in_every_frame, place_in_frame};
use super::container::Message;
use super::read::{recover, walk};
use super::{McapRecorder, Options, RecordError, paths};
use pliant::topology::Topology;
use pliant_files::disk;

/// Recording whose beginning is kept.
#[derive(Clone, Copy, Debug)]
pub struct Beginning<'a> {
    /// File name of the complete recording, which may be unfinished.
    pub path: &'a Path,
    /// Text of the scene that was recorded.
    pub scene_text: &'a str,
    /// Number of frames to be kept.
    pub frames: u64,
}

impl McapRecorder {
    /// Opens `<path>.part` as [`create`](Self::create) does, with the frames of `beginning`: together
    /// with later frames the file is the same as if the run had never stopped. Frames recorded after
    /// `beginning` are dropped.
    ///
    /// `path` may be that of `beginning`: its frames stay readable in the old file until the new one is
    /// complete. An unfinished old file is completed first.
    ///
    /// # Errors
    /// The errors of `create`; [`RecordError::NoBeginning`] if the file does not exist, belongs to
    /// another scene, or ends before the last of the frames; [`RecordError::Read`].
    pub fn resume(
        path: &Path,
        options: &Options,
        topology: &Topology,
        beginning: Beginning<'_>,
    ) -> Result<Self, RecordError> {
        let encoders = channels::encoders(options, topology);
        let holds_every_frame = encoders.iter().any(|encoder| is_in_every_frame(encoder.declaration().id));
        let mut source = beginning.find(holds_every_frame)?;
        let is_same = is_one(path, beginning.path);
        if is_same && source != beginning.path {
            recover(&source, beginning.path, true)?;
            source = beginning.path.to_owned();
        }
        let options = Options { overwrite: options.overwrite || is_same, ..options.clone() };
        let mut recorder = McapRecorder::create(path, &options, topology)?;
        let mut groups = Groups::new(beginning.frames);
        groups.read(&source, &mut |group| recorder.replay(group))?;
        recorder.begin_at(beginning.frames)?;
        Ok(recorder)
    }
}

/// True if recordings to these paths write the same file.
fn is_one(a: &Path, b: &Path) -> bool {
    let place = |path: &Path| {
        let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty());
        let directory = directory.unwrap_or(Path::new(".")).canonicalize().ok()?;
        let part = paths::part_of(&directory.join(path.file_name()?));
        Some(part.canonicalize().unwrap_or(part))
    };
    a == b || place(a).is_some_and(|a| place(b) == Some(a))
}

impl Beginning<'_> {
    /// Finds the file that has the frames: the unfinished one, which may be ahead, or the complete one,
    /// if the unfinished one was still being refilled from it when it was killed.
    ///
    /// Without a channel that has a message for each frame, missing frames cannot be detected; the longer
    /// file is taken.
    fn find(&self, holds_every_frame: bool) -> Result<PathBuf, RecordError> {
        let part = paths::part_of(self.path);
        let mut reason = "is not there";
        let mut best: Option<(u64, PathBuf)> = None;
        for candidate in [&part, self.path].into_iter().filter(|path| disk::exists(path)) {
            let found = FrameSurvey::of(candidate, self.frames, holds_every_frame)?;
            if !self.scene_text.is_empty() && found.scene_text.as_deref() != Some(self.scene_text.as_bytes())
            {
                reason = "was recorded with another scene";
            } else if found.frames < self.frames && holds_every_frame {
                reason = "ends before the checkpoint";
            } else if best.as_ref().is_none_or(|(frames, _)| found.frames > *frames) {
                best = Some((found.frames, candidate.to_owned()));
            }
        }
        let best = best.map(|(_, candidate)| candidate);
        best.ok_or_else(|| RecordError::NoBeginning { path: self.path.to_owned(), reason })
    }
}

/// Result of reading the first frames of a recording.
struct FrameSurvey {
    scene_text: Option<Vec<u8>>,
    /// Index of the last frame read, plus one; if each frame has a message, that of the last before the
    /// first missing one.
    frames: u64,
}

impl FrameSurvey {
    fn of(path: &Path, frames: u64, holds_every_frame: bool) -> Result<Self, RecordError> {
        let mut count = 0;
        let mut groups = Groups::new(frames);
        groups.read(path, &mut |group| {
            let number = u64::from(group[0].header.sequence);
            if number == count || !holds_every_frame {
                count = number + 1;
            }
            Ok(())
        })?;
        Ok(FrameSurvey { scene_text: groups.scene_text, frames: count })
    }
}

/// Reader of messages, frame by frame.
struct Groups {
    /// Number of frames to read.
    frames: u64,
    /// Frame being read.
    frame: Vec<Message<'static>>,
    /// Index of the first frame not yet handed on.
    next: u64,
    scene_text: Option<Vec<u8>>,
}

impl Groups {
    fn new(frames: u64) -> Self {
        Groups { frames, frame: vec![], next: 0, scene_text: None }
    }

    /// Hands the messages of each frame in `path` and in its tail to `visit`.
    fn read(
        &mut self,
        path: &Path,
        visit: &mut dyn FnMut(&[Message<'static>]) -> Result<(), RecordError>,
    ) -> Result<(), RecordError> {
        let tail = paths::tail_of(path);
        for file in [path, &tail].into_iter().filter(|file| *file == path || disk::exists(file)) {
            walk(file, &mut |_, record| self.take(record, visit))?;
            // The tail may repeat it.
            self.hand_on(visit)?;
        }
        Ok(())
    }

    fn take(
        &mut self,
        record: Record<'static>,
        visit: &mut dyn FnMut(&[Message<'static>]) -> Result<(), RecordError>,
    ) -> Result<ControlFlow<()>, RecordError> {
        match record {
            Record::Attachment { header, data, .. } if header.name == SCENE => {
                self.scene_text = Some(data.into_owned());
            }
            Record::Message { header, data } if place_in_frame(header.channel_id).is_some() => {
                let number = u64::from(header.sequence);
                if self.frame.first().is_some_and(|first| first.header.sequence != header.sequence) {
                    self.hand_on(visit)?;
                }
                if number >= self.frames {
                    return Ok(ControlFlow::Break(()));
                }
                if number >= self.next {
                    self.frame.push(Message { header, data });
                }
            }
            _ => {}
        }
        Ok(ControlFlow::Continue(()))
    }

    fn hand_on(
        &mut self,
        visit: &mut dyn FnMut(&[Message<'static>]) -> Result<(), RecordError>,
    ) -> Result<(), RecordError> {
        let Some(first) = self.frame.first() else { return Ok(()) };
        self.next = u64::from(first.header.sequence) + 1;
        visit(&std::mem::take(&mut self.frame))
    }
}
