//! Paths of equilibria by arc length.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use pliant::value::*;

/// The path of equilibria of statics, followed by arc length: through limit points, where no more load can
/// be borne, and turning points, where displacements go back too. The load factor is an unknown. It takes
/// the place of the time `t` in the formulas of loads, gravity and prescribed motion, which say with `force
/// = ["0", "-10*t"]` what grows with it and without `t` what stays. Steps go a given distance, `sqrt(1/n
/// sum_i |dx_i|^2)` over the `n` vertices that are free, which follows from the iterations that the last
/// one took; a step that is not solved is taken back and tried with a quarter of it. Time counts steps, 1 s
/// each, and `duration` is the number of steps at most; frames and tables of probes have the load factor.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ArcLengthSpec {
    /// The first increment of the load factor; 0.1 without it. The distance that it leads to is that of the
    /// first step.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub first: Option<f64>,
    /// One load factor or two: the run ends where the path comes to one of them, exactly there.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1, max = 2))]
    pub until: Option<Vec<f64>>,
    /// Largest distance of a step [m]; a twentieth of the size of the scene without it.
    #[serde(skip_serializing_if = "Option::is_none", with = "As::<Option<Length>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub largest: Option<f64>,
}

impl ArcLengthSpec {
    /// The first increment of the load factor.
    pub fn first_or_default(&self) -> f64 {
        self.first.unwrap_or(0.1)
    }
}
