//! Steps that were not taken.

use pliant::energy::Fault;
use pliant::simulation::StepError;

/// Cause and place of a step that was not taken.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct StepFailure {
    /// Message.
    pub message: String,
    /// Time at the beginning of the step [s].
    pub time: f64,
    /// Number of the element in its body.
    pub element: Option<usize>,
    /// The vertex, in the order of the scene.
    pub vertex: Option<usize>,
    /// Name of the body.
    pub body: Option<String>,
}

impl StepFailure {
    pub(super) fn new(error: &StepError) -> StepFailure {
        let (StepError::NotFinite { time, .. }
        | StepError::StepTooSmall { time, .. }
        | StepError::Unsolved { time, .. }
        | StepError::Unstable { time, .. }) = error;
        let vertex = error.vertex();
        let failure =
            StepFailure { message: error.to_string(), time: *time, element: None, vertex, body: None };
        failure.at(error.fault())
    }

    fn at(self, fault: Option<&Fault>) -> StepFailure {
        match fault {
            Some(
                Fault::Element { body, element, .. }
                | Fault::Material { body, element, .. }
                | Fault::Sheet { body, element, .. },
            ) => StepFailure { element: Some(*element), body: Some(body.clone()), ..self },
            Some(Fault::Spring { body, .. } | Fault::Stencil { body, .. }) => {
                StepFailure { body: Some(body.clone()), ..self }
            }
            Some(Fault::Pair { first, .. }) => StepFailure { vertex: Some(*first), ..self },
            _ => self,
        }
    }
}
