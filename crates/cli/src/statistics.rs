//! Facts of a run that are remembered beside its end.

use std::ops::Range;

use pliant::observer::{Frame, Notes, Observer, ObserverError, Quantities};
use pliant::topology::{BodyKind, BodyTopology};
use pliant_scene::assembly::{first_meeting, passes_through};
use pliant_scene::{Channel, Scene};

/// Names of its notes at a checkpoint.
const MIN_J: &str = "statistics.min_j";
const MOST_INVERTED: &str = "statistics.most_inverted";
const MEETING: &str = "statistics.meeting";

/// Extremes over the frames of a run.
pub(crate) struct Statistics {
    quantities: Quantities,
    /// Smallest `det F` of any element at any frame that was measured.
    pub(crate) min_j: Option<f64>,
    /// Most elements with `det F <= 0` at any frame that was measured.
    pub(crate) most_inverted: Option<u64>,
    /// Number and vertices of the bodies whose boxes are looked at; none where contact or an attachment says
    /// what they do.
    bodies: Vec<(usize, Range<usize>)>,
    /// First meeting of two of them.
    meeting: Option<Meeting>,
}

/// Boxes of two bodies that meet while nothing makes bodies collide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Meeting {
    /// Numbers of both in the scene.
    pub(crate) bodies: [usize; 2],
    /// Time of the first frame at which they do [s].
    pub(crate) time: f64,
}

impl Statistics {
    /// Frames are measured if the scene records energies: so that a run without a file is the same run.
    pub(crate) fn new(scene: &Scene, bodies: &[BodyTopology]) -> Statistics {
        let measures = scene.output.channels.contains(&Channel::Energy);
        let looks = passes_through(scene);
        let solid = bodies.iter().enumerate();
        let solid =
            solid.filter(|(_, body)| looks && !matches!(body.kind, BodyKind::Particles | BodyKind::Obstacle));
        let vertices = |body: &BodyTopology| body.vertices.start as usize..body.vertices.end as usize;
        let bodies = solid.map(|(i, body)| (i, vertices(body)));
        Statistics {
            quantities: Quantities::DIAGNOSTICS.only_if(measures),
            min_j: None,
            most_inverted: None,
            bodies: bodies.collect(),
            meeting: None,
        }
    }

    /// First meeting of two bodies under way: of those that meet at the start a check warns.
    pub(crate) fn meeting(&self) -> Option<&Meeting> {
        self.meeting.as_ref().filter(|meeting| meeting.time > 0.0)
    }

    /// Goes on from what was noted at a checkpoint.
    pub(crate) fn resume(&mut self, notes: &Notes) {
        let number = |name: &str| notes.get(name)?.as_slice().try_into().ok();
        self.min_j = number(MIN_J).map(f64::from_le_bytes);
        self.most_inverted = number(MOST_INVERTED).map(u64::from_le_bytes);
        self.meeting = notes.get(MEETING).and_then(|bytes| {
            let (numbers, rest) = bytes.as_chunks::<8>();
            let &[a, b, time] = numbers else { return None };
            let bodies = [a, b].map(|body| u64::from_le_bytes(body) as usize);
            rest.is_empty().then(|| Meeting { bodies, time: f64::from_le_bytes(time) })
        });
    }

    /// Looks whether boxes of bodies meet, until any have.
    fn look_for_meeting(&mut self, frame: &Frame<'_>) {
        if self.meeting.is_some() || self.bodies.len() < 2 {
            return;
        }
        let d = frame.dimension;
        let places = self.bodies.iter().map(|(_, body)| &frame.x[body.start * d..body.end * d]);
        self.meeting = first_meeting(places, d).map(|both| {
            let bodies = both.map(|body| self.bodies[body].0);
            Meeting { bodies, time: frame.time }
        });
    }
}

impl Observer for Statistics {
    fn quantities(&self) -> Quantities {
        self.quantities
    }

    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        if let Some(diagnostics) = frame.diagnostics {
            if let Some(j) = diagnostics.min_j {
                self.min_j = Some(self.min_j.map_or(j, |smallest| smallest.min(j)));
            }
            self.most_inverted = self.most_inverted.max(diagnostics.inverted);
        }
        self.look_for_meeting(frame);
        Ok(())
    }

    fn note(&mut self, notes: &mut Notes) {
        notes.extend(self.min_j.map(|j| (MIN_J.to_owned(), j.to_le_bytes().to_vec())));
        notes.extend(self.most_inverted.map(|n| (MOST_INVERTED.to_owned(), n.to_le_bytes().to_vec())));
        notes.extend(self.meeting.map(|Meeting { bodies: [a, b], time }| {
            let numbers = [(a as u64).to_le_bytes(), (b as u64).to_le_bytes(), time.to_le_bytes()];
            (MEETING.to_owned(), numbers.concat())
        }));
    }
}
