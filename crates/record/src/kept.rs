//! Frames that are kept until somebody encodes them.

use pliant::diagnostics::{Diagnostics, ElementState, Reaction};
use pliant::observer::{Frame, Work};

/// What of a frame is kept.
#[derive(Clone, Copy, Debug)]
pub(super) struct Needs {
    /// Positions and velocities.
    pub(super) places: bool,
    pub(super) diagnostics: bool,
    pub(super) elements: bool,
    pub(super) points: bool,
    pub(super) reactions: bool,
}

impl Needs {
    /// `frame` with what is needed of it.
    pub(super) fn of<'a>(self, frame: &Frame<'a>) -> Frame<'a> {
        Frame {
            x: if self.places { frame.x } else { &[] },
            v: if self.places { frame.v } else { &[] },
            diagnostics: frame.diagnostics.filter(|_| self.diagnostics),
            elements: frame.elements.filter(|_| self.elements),
            points: frame.points.filter(|_| self.points),
            reactions: frame.reactions.filter(|_| self.reactions),
            ..*frame
        }
    }
}

/// Bytes that a copy of `frame` takes.
pub(super) fn bytes_of(frame: &Frame<'_>) -> usize {
    let Frame { x, v, elements, points, reactions, .. } = *frame;
    let elements = elements.map_or(0, size_of_val) + points.map_or(0, size_of_val);
    size_of::<Kept>() + size_of_val(x) + size_of_val(v) + elements + reactions.map_or(0, size_of_val)
}

/// A slice that may be missing, copied to where the last one was.
#[derive(Debug)]
struct Copied<T> {
    items: Vec<T>,
    is_there: bool,
}

impl<T: Clone> Copied<T> {
    const EMPTY: Self = Copied { items: vec![], is_there: false };

    fn set(&mut self, items: Option<&[T]>) {
        self.is_there = items.is_some();
        self.items.clear();
        self.items.extend_from_slice(items.unwrap_or_default());
    }

    fn get(&self) -> Option<&[T]> {
        self.is_there.then_some(&self.items)
    }
}

/// A copy of a frame.
#[derive(Debug)]
pub(super) struct Kept {
    index: u64,
    step: u64,
    time: f64,
    dimension: usize,
    x: Vec<f64>,
    v: Vec<f64>,
    diagnostics: Option<Diagnostics>,
    elements: Copied<ElementState>,
    points: Copied<ElementState>,
    reactions: Copied<Reaction>,
    work: Work,
}

impl Kept {
    /// Of no frame yet.
    fn new() -> Self {
        Kept {
            index: 0,
            step: 0,
            time: 0.0,
            dimension: 0,
            x: vec![],
            v: vec![],
            diagnostics: None,
            elements: Copied::EMPTY,
            points: Copied::EMPTY,
            reactions: Copied::EMPTY,
            work: Work::default(),
        }
    }

    fn set(&mut self, frame: &Frame<'_>) {
        let Frame { index, step, time, dimension, x, v, diagnostics, elements, points, reactions, work } =
            *frame;
        (self.index, self.step, self.time, self.dimension) = (index, step, time, dimension);
        self.x.clear();
        self.x.extend_from_slice(x);
        self.v.clear();
        self.v.extend_from_slice(v);
        self.diagnostics = diagnostics.cloned();
        self.elements.set(elements);
        self.points.set(points);
        self.reactions.set(reactions);
        self.work = work;
    }

    fn frame(&self) -> Frame<'_> {
        Frame {
            index: self.index,
            step: self.step,
            time: self.time,
            dimension: self.dimension,
            x: &self.x,
            v: &self.v,
            diagnostics: self.diagnostics.as_ref(),
            elements: self.elements.get(),
            points: self.points.get(),
            reactions: self.reactions.get(),
            work: self.work,
        }
    }
}

/// Frames in the order in which they came. Emptied, it keeps its memory for the next.
#[derive(Debug, Default)]
pub(super) struct Batch {
    kept: Vec<Kept>,
    count: usize,
    bytes: usize,
    /// Whether the last of them is to be made safe from a kill, which somebody is to be told of.
    pub(super) is_urgent: bool,
}

impl Batch {
    pub(super) fn push(&mut self, frame: &Frame<'_>) {
        if self.count == self.kept.len() {
            self.kept.push(Kept::new());
        }
        self.kept[self.count].set(frame);
        self.count += 1;
        self.bytes += bytes_of(frame);
    }

    /// Bytes of all frames.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// The frames, each with whether it is to be made safe from a kill.
    pub(super) fn frames(&self) -> impl Iterator<Item = (Frame<'_>, bool)> {
        let kept = self.kept[..self.count].iter();
        kept.zip(1..).map(|(kept, i)| (kept.frame(), self.is_urgent && i == self.count))
    }

    pub(super) fn clear(&mut self) {
        (self.count, self.bytes, self.is_urgent) = (0, 0, false);
    }
}
