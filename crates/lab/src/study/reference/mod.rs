//! References for the errors of runs: the exact solution if the problem has one, otherwise a solution on
//! which independent integrators agree.

mod computed;
mod kepler;
mod linear;
mod store;

use super::errors::ErrorScales;
use super::plan::{ReferenceChoice, TimeGrid};
use super::trajectory::{Runner, StateSamples};
use super::{Event, StudyError};
use pliant_scene::Scene;

pub(crate) use store::Store;
pub use store::key;

/// A reference and its accuracy.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Reference {
    /// Identifier: the method, and the [`key`] of the problem.
    pub id: String,
    /// Description of the method.
    pub how: String,
    /// Estimated relative error, as in [`Errors`](super::Errors): the larger of those of positions and
    /// velocities.
    pub error: f64,
    /// Relative distance of the solution by a second integrator of another family: 0 for an exact
    /// solution, `None` if no second integrator completed.
    #[serde(default)]
    pub disagreement: Option<f64>,
    /// States at the times of comparison.
    pub trajectory: StateSamples,
}

impl Reference {
    /// Smallest measurable error: smaller ones depend on the reference's error.
    pub fn floor(&self) -> f64 {
        10.0 * self.error
    }

    /// Smallest error for which advice is given: ten times the reference's error and disagreement;
    /// infinite for an unconfirmed reference.
    pub fn trusted(&self) -> f64 {
        10.0 * self.disagreement.map_or(f64::INFINITY, |distance| distance.max(self.error))
    }
}

/// Data for finding a reference.
pub(crate) struct ReferenceSearch<'a, 'b> {
    pub(crate) scene: &'a Scene,
    pub(crate) runner: Runner<'a>,
    pub(crate) weights: &'a ErrorScales,
    pub(crate) choice: ReferenceChoice,
    /// Time at which refinement stops.
    pub(crate) deadline: f64,
    /// Time at which the search ends if there is nothing to refine yet.
    pub(crate) last: f64,
    pub(crate) watch: &'a mut (dyn FnMut(Event<'_>) + 'b),
}

impl ReferenceSearch<'_, '_> {
    pub(crate) fn grid(&self) -> TimeGrid {
        self.runner.grid
    }

    /// Finds the reference.
    pub(crate) fn find(&mut self) -> Result<Reference, StudyError> {
        let key = key(self.scene, &self.grid());
        // Contact is neither two-body motion nor linear, even without contacts at the times of
        // comparison.
        if self.choice != ReferenceChoice::Computed && self.scene.acting_contact().is_none() {
            for exact in [kepler::solution, linear::solution] {
                if let Some(mut reference) = exact(self)? {
                    reference.id = format!("{}-{key}", reference.id);
                    return Ok(reference);
                }
            }
        }
        if self.choice == ReferenceChoice::Exact {
            return Err(StudyError::NotExact);
        }
        let mut reference = computed::reference(self)?;
        reference.id = format!("{}-{key}", reference.id);
        Ok(reference)
    }
}
