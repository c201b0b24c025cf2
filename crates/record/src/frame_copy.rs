//! Copies of frames, kept until they are encoded.

use pliant::diagnostics::{ContactTraction, Diagnostics, ElementState, Reaction, SymmetricTensor};
use pliant::energy::SurfaceContact;
use pliant::observer::{Frame, Work};

/// Size of a copy of `frame` [bytes].
pub(super) fn bytes_of(frame: &Frame<'_>) -> usize {
    let Frame { x, v, elements, points, reactions, contacts, nodal_stress, stress_error, .. } = *frame;
    let elements = elements.map_or(0, size_of_val) + points.map_or(0, size_of_val);
    let tractions = frame.contact_tractions.map_or(0, size_of_val);
    let forces = reactions.map_or(0, size_of_val) + contacts.map_or(0, size_of_val) + tractions;
    let recovered = nodal_stress.map_or(0, size_of_val) + stress_error.map_or(0, size_of_val);
    size_of::<FrameCopy>() + size_of_val(x) + size_of_val(v) + elements + forces + recovered
}

/// Copy of an optional slice, which reuses its memory.
#[derive(Debug)]
struct OptionalCopy<T> {
    items: Vec<T>,
    is_there: bool,
}

impl<T: Clone> OptionalCopy<T> {
    const EMPTY: Self = OptionalCopy { items: vec![], is_there: false };

    fn set(&mut self, items: Option<&[T]>) {
        self.is_there = items.is_some();
        self.items.clear();
        self.items.extend_from_slice(items.unwrap_or_default());
    }

    fn get(&self) -> Option<&[T]> {
        self.is_there.then_some(&self.items)
    }
}

/// Copy of a frame.
#[derive(Debug)]
pub(super) struct FrameCopy {
    index: u64,
    step: u64,
    time: f64,
    load_factor: Option<f64>,
    dimension: usize,
    x: Vec<f64>,
    v: Vec<f64>,
    diagnostics: Option<Diagnostics>,
    elements: OptionalCopy<ElementState>,
    points: OptionalCopy<ElementState>,
    reactions: OptionalCopy<Reaction>,
    contacts: OptionalCopy<SurfaceContact>,
    nodal_stress: OptionalCopy<SymmetricTensor>,
    stress_error: OptionalCopy<f64>,
    contact_tractions: OptionalCopy<ContactTraction>,
    work: Work,
}

impl FrameCopy {
    /// Empty copy.
    fn new() -> Self {
        FrameCopy {
            index: 0,
            step: 0,
            time: 0.0,
            load_factor: None,
            dimension: 0,
            x: vec![],
            v: vec![],
            diagnostics: None,
            elements: OptionalCopy::EMPTY,
            points: OptionalCopy::EMPTY,
            reactions: OptionalCopy::EMPTY,
            contacts: OptionalCopy::EMPTY,
            nodal_stress: OptionalCopy::EMPTY,
            stress_error: OptionalCopy::EMPTY,
            contact_tractions: OptionalCopy::EMPTY,
            work: Work::default(),
        }
    }

    fn set(&mut self, frame: &Frame<'_>) {
        let Frame { x, v, diagnostics, elements, points, reactions, contacts, work, .. } = *frame;
        (self.index, self.step) = (frame.index, frame.step);
        (self.time, self.dimension) = (frame.time, frame.dimension);
        self.load_factor = frame.load_factor;
        self.x.clear();
        self.x.extend_from_slice(x);
        self.v.clear();
        self.v.extend_from_slice(v);
        self.diagnostics = diagnostics.cloned();
        self.elements.set(elements);
        self.points.set(points);
        self.reactions.set(reactions);
        self.contacts.set(contacts);
        self.nodal_stress.set(frame.nodal_stress);
        self.stress_error.set(frame.stress_error);
        self.contact_tractions.set(frame.contact_tractions);
        self.work = work;
    }

    fn frame(&self) -> Frame<'_> {
        Frame {
            index: self.index,
            step: self.step,
            time: self.time,
            load_factor: self.load_factor,
            dimension: self.dimension,
            x: &self.x,
            v: &self.v,
            diagnostics: self.diagnostics.as_ref(),
            elements: self.elements.get(),
            points: self.points.get(),
            reactions: self.reactions.get(),
            contacts: self.contacts.get(),
            nodal_stress: self.nodal_stress.get(),
            stress_error: self.stress_error.get(),
            contact_tractions: self.contact_tractions.get(),
            work: self.work,
        }
    }
}

/// Frames in order of arrival. Memory is reused after emptying.
#[derive(Debug, Default)]
pub(super) struct Batch {
    copies: Vec<FrameCopy>,
    count: usize,
    bytes: usize,
    /// True if the last frame is to be made durable against a kill, with an acknowledgement.
    pub(super) is_urgent: bool,
}

impl Batch {
    pub(super) fn push(&mut self, frame: &Frame<'_>) {
        if self.count == self.copies.len() {
            self.copies.push(FrameCopy::new());
        }
        self.copies[self.count].set(frame);
        self.count += 1;
        self.bytes += bytes_of(frame);
    }

    /// Size of all frames [bytes].
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// Frames, each with whether it is to be made durable against a kill.
    pub(super) fn frames(&self) -> impl Iterator<Item = (Frame<'_>, bool)> {
        let copies = self.copies[..self.count].iter();
        copies.zip(1..).map(|(copy, i)| (copy.frame(), self.is_urgent && i == self.count))
    }

    pub(super) fn clear(&mut self) {
        (self.count, self.bytes, self.is_urgent) = (0, 0, false);
    }
}
