//! Recordings that go on where a checkpoint was taken.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use mcap::records::Record;

use super::attachments::SCENE;
use super::channels::{self, is_in_every_frame, place_in_frame};
use super::container::Message;
use super::read::{recover, walk};
use super::{McapRecorder, Options, RecordError, paths};
use pliant::topology::Topology;

/// A recording whose beginning is to be kept.
#[derive(Clone, Copy, Debug)]
pub struct Beginning<'a> {
    /// The file as it is called when it is complete; it may be unfinished.
    pub path: &'a Path,
    /// Text of the scene that it was recorded with.
    pub scene_text: &'a str,
    /// Number of frames to be kept.
    pub frames: u64,
}

impl McapRecorder {
    /// Opens `<path>.part` as [`create`](Self::create) does, with the frames of `beginning` in it: those
    /// that follow make the same file as if the run had never stopped. What was recorded after them is left
    /// out.
    ///
    /// `path` may be that of `beginning`: until the new file is complete, its frames stay readable in the
    /// old one, which is made complete first where it is unfinished.
    ///
    /// # Errors
    /// As `create`; [`RecordError::NoBeginning`] where the file is not there, is one of another scene, or
    /// ends before the last of the frames; [`RecordError::Read`].
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

/// True if recordings to these paths are written to the same file.
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
    /// The file that has the frames: the unfinished one, which may be ahead, or the complete one, where the
    /// unfinished one was still being filled again from it when it was killed.
    ///
    /// Where no channel has a message for each frame, a file cannot be told to be too short; the one that
    /// goes farther is taken.
    fn find(&self, holds_every_frame: bool) -> Result<PathBuf, RecordError> {
        let part = paths::part_of(self.path);
        let mut reason = "is not there";
        let mut best: Option<(u64, PathBuf)> = None;
        for candidate in [&part, self.path].into_iter().filter(|path| path.exists()) {
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

/// Facts about a recording after a look at its first frames.
struct FrameSurvey {
    scene_text: Option<Vec<u8>>,
    /// Number of the last frame, of those looked at, and one; where each has a message, of the last before
    /// the first that is missing.
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

/// Messages of frames, frame by frame.
struct Groups {
    /// Frames that are read.
    frames: u64,
    /// The frame that is being read.
    frame: Vec<Message<'static>>,
    /// Number of the first frame that has not been handed on.
    next: u64,
    scene_text: Option<Vec<u8>>,
}

impl Groups {
    fn new(frames: u64) -> Self {
        Groups { frames, frame: vec![], next: 0, scene_text: None }
    }

    /// Hands the messages of each frame in `path`, and in the tail beside it, to `visit`.
    fn read(
        &mut self,
        path: &Path,
        visit: &mut dyn FnMut(&[Message<'static>]) -> Result<(), RecordError>,
    ) -> Result<(), RecordError> {
        let tail = paths::tail_of(path);
        for file in [path, &tail].into_iter().filter(|file| *file == path || file.exists()) {
            walk(file, &mut |_, record| self.take(record, visit))?;
            // In the tail it may come again.
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
