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

/// A reference, and how good it is.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Reference {
    /// Name that tells it from others: how it was found, and the [`key`] of the problem.
    pub id: String,
    /// Description of the method.
    pub how: String,
    /// Its own error, estimated, relative as [`Errors`](super::Errors) are: of positions and of velocities,
    /// the larger.
    pub error: f64,
    /// Distance of the solution by a second scheme of another family, relative as `error` is: 0 beside an
    /// exact solution, `None` where no second scheme came to its end.
    #[serde(default)]
    pub disagreement: Option<f64>,
    /// The states.
    pub trajectory: StateSamples,
}

impl Reference {
    /// Errors below this say more about the reference than about a scheme.
    pub fn floor(&self) -> f64 {
        10.0 * self.error
    }

    /// The least error that advice may speak of: ten times the error and the disagreement; infinite where
    /// nothing confirms the reference.
    pub fn trusted(&self) -> f64 {
        10.0 * self.disagreement.map_or(f64::INFINITY, |distance| distance.max(self.error))
    }
}

/// Data needed to find a reference.
pub(crate) struct ReferenceSearch<'a, 'b> {
    pub(crate) scene: &'a Scene,
    pub(crate) runner: Runner<'a>,
    pub(crate) weights: &'a ErrorScales,
    pub(crate) choice: ReferenceChoice,
    /// When to stop refining.
    pub(crate) deadline: f64,
    /// When to give up, where there is nothing yet that could be refined.
    pub(crate) last: f64,
    pub(crate) watch: &'a mut (dyn FnMut(Event<'_>) + 'b),
}

impl ReferenceSearch<'_, '_> {
    pub(crate) fn grid(&self) -> TimeGrid {
        self.runner.grid
    }

    /// The reference.
    pub(crate) fn find(&mut self) -> Result<Reference, StudyError> {
        let key = key(self.scene, &self.grid());
        // Contact is neither two bodies under gravity nor linear, even where nothing touches at a time of
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
