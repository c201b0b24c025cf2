//! Stress of a material: analytical, or by differentiation of its energy.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the stress `P` of a material is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Stress {
    /// By the model's closed form.
    #[default]
    Analytic,
    /// By automatic differentiation of its energy density.
    Autodiff,
}
