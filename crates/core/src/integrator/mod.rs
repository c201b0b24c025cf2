//! Time integrators: one scheme, one file, one line in the registry below.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A scheme by name, with its parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum IntegratorSpec {
    /// Symplectic Euler.
    SymplecticEuler,
}
