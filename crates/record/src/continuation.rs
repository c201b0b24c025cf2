//! Recordings that go on where a checkpoint was taken.

use std::collections::HashSet;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use mcap::records::Record;

use super::attachments::SCENE;
use super::channels::{is_in_every_frame, place_in_frame};
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
        let mut source = beginning.find()?;
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
    /// The file that has the frames: the unfinished one, which may be ahead, or the complete one.
    fn find(&self) -> Result<PathBuf, RecordError> {
        let part = paths::part_of(self.path);
        let mut reason = "is not there";
        for candidate in [&part, self.path].into_iter().filter(|path| path.exists()) {
            let found = FrameSurvey::of(candidate, self.frames)?;
            if !self.scene_text.is_empty() && found.scene_text.as_deref() != Some(self.scene_text.as_bytes())
            {
                reason = "was recorded with another scene";
            } else if found.frames < self.frames && found.holds_every_frame {
                reason = "ends before the checkpoint";
            } else {
                return Ok(candidate.to_owned());
            }
        }
        Err(RecordError::NoBeginning { path: self.path.to_owned(), reason })
    }
}

/// Facts about a recording after a look at all of it.
#[derive(Default)]
struct FrameSurvey {
    scene_text: Option<Vec<u8>>,
    frames: u64,
    /// True if it has a channel with a message for each frame.
    holds_every_frame: bool,
}

impl FrameSurvey {
    fn of(path: &Path, frames: u64) -> Result<Self, RecordError> {
        let mut survey = FrameSurvey::default();
        let mut count = 0;
        let mut groups = Groups::new(frames);
        groups.read(path, &mut |group| {
            count = group[0].header.sequence as u64 + 1;
            Ok(())
        })?;
        survey.frames = count;
        survey.holds_every_frame = groups.channels.iter().any(|number| is_in_every_frame(*number));
        survey.scene_text = groups.scene_text;
        Ok(survey)
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
    channels: HashSet<u16>,
    scene_text: Option<Vec<u8>>,
}

impl Groups {
    fn new(frames: u64) -> Self {
        Groups { frames, frame: vec![], next: 0, channels: HashSet::new(), scene_text: None }
    }

    /// Hands the messages of each frame in `path`, and in the tail beside it, to `visit`.
    fn read(
        &mut self,
        path: &Path,
        visit: &mut dyn FnMut(&[Message<'static>]) -> Result<(), RecordError>,
    ) -> Result<(), RecordError> {
        let tail = paths::tail_of(path);
        for file in [path, &tail].into_iter().filter(|file| *file == path || file.exists()) {
            walk(file, &mut |record| self.take(record, visit))?;
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
            Record::Channel(channel) => {
                self.channels.insert(channel.id);
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
