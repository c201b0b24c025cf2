//! Frames of a run, and their observers: recorder, progress bar, statistics, Python.

mod quantities;

use std::collections::BTreeMap;

use crate::diagnostics::{ContactTraction, Diagnostics, ElementState, Reaction, SymmetricTensor};
use crate::energy::SurfaceContact;
use crate::simulation::Simulation;
pub use crate::simulation::Work;
pub use quantities::Quantities;

/// One moment of a run. Borrowed: observers copy what they keep.
///
/// Quantities that no observer reads are not computed and `None`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Frame<'a> {
    /// Number of the frame, from 0.
    pub index: u64,
    /// Steps taken so far.
    pub step: u64,
    /// Simulated time [s].
    pub time: f64,
    /// Load factor; `None` without arc-length continuation.
    pub load_factor: Option<f64>,
    /// 2 or 3.
    pub dimension: usize,
    /// Positions, flat `(n, dimension)` [m].
    pub x: &'a [f64],
    /// Velocities, flat `(n, dimension)` [m/s].
    pub v: &'a [f64],
    /// Energies and momenta.
    pub diagnostics: Option<&'a Diagnostics>,
    /// Deformation and stress of all finite elements, body after body, each in mesh order.
    pub elements: Option<&'a [ElementState]>,
    /// Deformation and stress at the element points of probes.
    pub points: Option<&'a [ElementState]>,
    /// Reaction forces of active pins and walls.
    pub reactions: Option<&'a [Reaction]>,
    /// Surfaces in contact, in a fixed order.
    pub contacts: Option<&'a [SurfaceContact]>,
    /// Recovered Cauchy stress at every vertex [Pa]; NaN at a vertex of no element. `None` also without
    /// [`Simulation::set_recovery`].
    pub nodal_stress: Option<&'a [SymmetricTensor]>,
    /// Estimated error of the stress of all finite elements, in the order of `elements` [sqrt(J)]. `None`
    /// also without [`Simulation::set_recovery`].
    pub stress_error: Option<&'a [f64]>,
    /// Pressure and friction of contact at every vertex; NaN at a vertex of no surface, empty without
    /// contact.
    pub contact_tractions: Option<&'a [ContactTraction]>,
    /// Work counters.
    pub work: Work,
}

impl Frame<'_> {
    /// Builds frame `index` of the current state and passes it to `show`, with the requested
    /// `quantities`. `diagnostics` are computed before, as they validate the state.
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
        let nodal_stress = reads(Quantities::NODAL_STRESS).then(|| simulation.recovered_stress()).flatten();
        let stress_error = reads(Quantities::STRESS_ERROR).then(|| simulation.recovered_error()).flatten();
        let tractions = reads(Quantities::CONTACT_TRACTIONS).then(|| simulation.contact_tractions());
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
            nodal_stress: nodal_stress.as_deref(),
            stress_error: stress_error.as_deref(),
            contact_tractions: tractions.as_deref(),
            work: simulation.work(),
        })
    }
}

impl<'a> Frame<'a> {
    /// Returns the quantities of this frame. Positions and velocities always count; without vertices they
    /// are empty.
    pub fn quantities(&self) -> Quantities {
        Quantities::STATE
            | Quantities::DIAGNOSTICS.only_if(self.diagnostics.is_some())
            | Quantities::ELEMENTS.only_if(self.elements.is_some())
            | Quantities::POINTS.only_if(self.points.is_some())
            | Quantities::REACTIONS.only_if(self.reactions.is_some())
            | Quantities::CONTACTS.only_if(self.contacts.is_some())
            | Quantities::NODAL_STRESS.only_if(self.nodal_stress.is_some())
            | Quantities::STRESS_ERROR.only_if(self.stress_error.is_some())
            | Quantities::CONTACT_TRACTIONS.only_if(self.contact_tractions.is_some())
    }

    /// Returns the frame restricted to these quantities.
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
            nodal_stress: self.nodal_stress.filter(|_| has(Quantities::NODAL_STRESS)),
            stress_error: self.stress_error.filter(|_| has(Quantities::STRESS_ERROR)),
            contact_tractions: self.contact_tractions.filter(|_| has(Quantities::CONTACT_TRACTIONS)),
            ..*self
        }
    }
}

/// Observes a run frame by frame.
pub trait Observer {
    /// Returns the quantities of a [`Frame`] that this observer reads; others are not computed. Positions
    /// and velocities are always available.
    fn quantities(&self) -> Quantities {
        Quantities::NONE
    }

    /// Receives an output frame, including the initial state.
    ///
    /// # Errors
    /// If the observer fails; the run stops and reports it.
    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError>;

    /// Adds notes to a checkpoint, kept or not: whatever the observer needs to continue from here.
    fn note(&mut self, notes: &mut Notes) {
        let _ = notes;
    }

    /// Makes everything shown so far durable, before a checkpoint is kept.
    ///
    /// # Errors
    /// If the observer fails; the run stops and reports it.
    fn secure(&mut self) -> Result<(), ObserverError> {
        Ok(())
    }
}

/// Notes of observers at a checkpoint, under names that they choose.
pub type Notes = BTreeMap<String, Vec<u8>>;

/// Error of an observer.
#[derive(Debug, thiserror::Error)]
#[error("{what}: {source}")]
pub struct ObserverError {
    /// Action that failed, e.g. `writing out.mcap.part`.
    pub what: String,
    /// Cause.
    #[source]
    pub source: Box<dyn std::error::Error + Send + Sync>,
}
