//! What a run shows to whoever watches it: recorder, progress bar, statistics, Python.

use std::collections::BTreeMap;

use crate::diagnostics::{Diagnostics, ElementState, Reaction};
pub use crate::simulation::Work;

/// One moment of a run. Borrowed: an observer copies what it keeps.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// Number of the frame, from 0.
    pub index: u64,
    /// Steps taken so far.
    pub step: u64,
    /// Simulated time [s].
    pub time: f64,
    /// 2 or 3.
    pub dimension: usize,
    /// Positions, flat `(n, dimension)` [m].
    pub x: &'a [f64],
    /// Velocities, flat `(n, dimension)` [m/s].
    pub v: &'a [f64],
    /// Energies and momenta of this moment; `None` where no observer asked for them.
    pub diagnostics: Option<&'a Diagnostics>,
    /// Deformation and stress of every finite element, body after body, each in the order of its mesh; `None` where no observer
    /// asked for them.
    pub elements: Option<&'a [ElementState]>,
    /// Deformation and stress at the points of elements that probes have named; `None` where no observer asked for them.
    pub points: Option<&'a [ElementState]>,
    /// The forces with which pins hold their vertices, of those that have not let go; `None` where no observer asked for them.
    pub reactions: Option<&'a [Reaction]>,
    /// Work counters.
    pub work: Work,
}

/// Watches a run, frame by frame.
pub trait Observer {
    /// Whether this observer reads [`Frame::diagnostics`]; they are computed only if one does.
    fn wants_diagnostics(&self) -> bool {
        false
    }

    /// Whether this observer reads [`Frame::elements`]; they are computed only if one does.
    fn wants_elements(&self) -> bool {
        false
    }

    /// Whether this observer reads [`Frame::points`]; they are computed only if one does.
    fn wants_points(&self) -> bool {
        false
    }

    /// Whether this observer reads [`Frame::reactions`]; they are computed only if one does.
    fn wants_reactions(&self) -> bool {
        false
    }

    /// Called at every output frame, the initial state included.
    ///
    /// # Errors
    /// Whatever keeps the observer from doing its work; the run stops and reports it.
    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError>;

    /// Called at every checkpoint: makes what was shown so far durable, and notes what going on from here
    /// takes.
    ///
    /// # Errors
    /// Whatever keeps the observer from doing so; the run stops and reports it.
    fn checkpoint(&mut self, notes: &mut Notes) -> Result<(), ObserverError> {
        let _ = notes;
        Ok(())
    }
}

/// What observers have noted at a checkpoint, by names that they choose.
pub type Notes = BTreeMap<String, Vec<u8>>;

/// An observer could not do its work.
#[derive(Debug, thiserror::Error)]
#[error("{what}: {source}")]
pub struct ObserverError {
    /// What it was doing, e.g. `writing out.mcap.part`.
    pub what: String,
    /// Why it failed.
    #[source]
    pub source: Box<dyn std::error::Error + Send + Sync>,
}
