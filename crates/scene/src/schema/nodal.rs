//! Elements that do not lock.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Evaluates the material of linear elements at their nodes, each with the mean deformation gradient of the
/// elements around it, but for a part of the shear modulus that stays in the elements and keeps them from
/// moving against each other. Linear elements that are nearly incompressible (a Poisson's ratio of 0.45 and
/// more) are far too stiff without it: they lock.
///
/// Puso and Solberg, "A stabilized nodally integrated tetrahedral", 2006.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NodalIntegrationSpec {
    /// The part `alpha` of the shear modulus that stays in the elements, between 0 and 1; 0.2 without it.
    /// The more, the stiffer; with too little, motions that alternate from vertex to vertex cost no energy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub stabilisation: Option<f64>,
}

impl NodalIntegrationSpec {
    /// `alpha`, or what it is unless something is said.
    pub fn stabilisation_or_default(&self) -> f64 {
        self.stabilisation.unwrap_or(0.2)
    }
}
