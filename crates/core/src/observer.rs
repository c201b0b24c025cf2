//! Frames of a run, and observers of them: recorder, progress bar, statistics, Python.

mod quantities;

use std::collections::BTreeMap;

use crate::diagnostics::{Diagnostics, ElementState, Reaction};
use crate::energy::SurfaceContact;
use crate::simulation::Simulation;
pub use crate::simulation::Work;
pub use quantities::Quantities;

/// One moment of a run. Borrowed: an observer copies what it keeps.
///
/// Quantities that no observer reads are `None`: they are not computed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Frame<'a> {
    /// Number of the frame, from 0.
    pub index: u64,
    /// Steps taken so far.
    pub step: u64,
    /// Simulated time [s].
    pub time: f64,
    /// Load factor; `None` unless a path of equilibria is followed by arc length.
    pub load_factor: Option<f64>,
    /// 2 or 3.
    pub dimension: usize,
    /// Positions, flat `(n, dimension)` [m].
    pub x: &'a [f64],
    /// Velocities, flat `(n, dimension)` [m/s].
    pub v: &'a [f64],
    /// Energies and momenta.
    pub diagnostics: Option<&'a Diagnostics>,
    /// Deformation and stress of every finite element, body after body, each in the order of its mesh.
    pub elements: Option<&'a [ElementState]>,
    /// Deformation and stress at the points of elements that probes have named.
    pub points: Option<&'a [ElementState]>,
    /// Forces with which pins that have not let go hold their vertices, and walls push.
    pub reactions: Option<&'a [Reaction]>,
    /// Surfaces that touch, in a fixed order.
    pub contacts: Option<&'a [SurfaceContact]>,
    /// Work counters.
    pub work: Work,
}

impl Frame<'_> {
    /// Frame number `index` of the present state, for as long as `show` looks at it, with those of
    /// `quantities` that are asked for here; `diagnostics` are computed before, for they judge a state.
    pub fn of_state<R>(
        simulation: &mut Simulation,
        index: u64,
        quantities: Quantities,
        diagnostics: Option<&Diagnostics>,
        show: impl FnOnce(&Frame<'_>) -> R,
    ) -> R {
        let reads = |quantity| quantities.contains(quantity);
        let reactions = reads(Quantities::REACTIONS).then(|| simulation.reactions());
        let contacts = reads(Quantities::CONTACTS).then(|| simulation.contacts());
        let points = reads(Quantities::POINTS).then(|| simulation.point_states());
        let elements = reads(Quantities::ELEMENTS).then(|| simulation.element_states());
        let (x, v, state) = (simulation.positions(), simulation.velocities(), simulation.state());
        show(&Frame {
            index,
            step: state.step,
            time: state.time,
            load_factor: simulation.load_factor(),
            dimension: simulation.system().dimension(),
            x: &x,
            v: &v,
            diagnostics,
            elements: elements.as_deref(),
            points: points.as_deref(),
            reactions: reactions.as_deref(),
            contacts: contacts.as_deref(),
            work: simulation.work(),
        })
    }
}

impl<'a> Frame<'a> {
    /// Quantities that it has. Positions and velocities always count: without vertices they are empty.
    pub fn quantities(&self) -> Quantities {
        Quantities::STATE
            | Quantities::DIAGNOSTICS.only_if(self.diagnostics.is_some())
            | Quantities::ELEMENTS.only_if(self.elements.is_some())
            | Quantities::POINTS.only_if(self.points.is_some())
            | Quantities::REACTIONS.only_if(self.reactions.is_some())
            | Quantities::CONTACTS.only_if(self.contacts.is_some())
    }

    /// The same moment with these quantities at most.
    pub fn only(&self, quantities: Quantities) -> Frame<'a> {
        let has = |quantity| quantities.contains(quantity);
        Frame {
            x: if has(Quantities::STATE) { self.x } else { &[] },
            v: if has(Quantities::STATE) { self.v } else { &[] },
            diagnostics: self.diagnostics.filter(|_| has(Quantities::DIAGNOSTICS)),
            elements: self.elements.filter(|_| has(Quantities::ELEMENTS)),
            points: self.points.filter(|_| has(Quantities::POINTS)),
            reactions: self.reactions.filter(|_| has(Quantities::REACTIONS)),
            contacts: self.contacts.filter(|_| has(Quantities::CONTACTS)),
            ..*self
        }
    }
}

/// Watches a run, frame by frame.
pub trait Observer {
    /// Quantities of a [`Frame`] that this observer reads; they are computed only if one does. Positions and
    /// velocities are always there.
    fn quantities(&self) -> Quantities {
        Quantities::NONE
    }

    /// Called at every output frame, the initial state included.
    ///
    /// # Errors
    /// Whatever keeps the observer from doing its work; the run stops and reports it.
    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError>;

    /// Called at every checkpoint, whether or not it is kept: notes what going on from here takes.
    fn note(&mut self, notes: &mut Notes) {
        let _ = notes;
    }

    /// Called before a checkpoint is kept: makes what was shown so far durable.
    ///
    /// # Errors
    /// Whatever keeps the observer from doing so; the run stops and reports it.
    fn secure(&mut self) -> Result<(), ObserverError> {
        Ok(())
    }
}

/// Notes of observers at a checkpoint, by names that they choose.
pub type Notes = BTreeMap<String, Vec<u8>>;

/// An observer could not do its work.
#[derive(Debug, thiserror::Error)]
#[error("{what}: {source}")]
pub struct ObserverError {
    /// Its action, e.g. `writing out.mcap.part`.
    pub what: String,
    /// Why it failed.
    #[source]
    pub source: Box<dyn std::error::Error + Send + Sync>,
}
