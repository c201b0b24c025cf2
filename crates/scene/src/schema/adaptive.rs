//! Steps whose size follows the error, or the effort of their solves.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use pliant::value::*;

/// Step sizes that follow the estimated error of each step: a step whose error is larger than allowed is
/// taken back and tried again with a smaller size. The error of a step is `sqrt(1/(2n) sum_i (|e_x|^2 /
/// position^2 + |e_v|^2 / (velocity + tolerance |v|)^2))` over the `n` vertices that are free to move, and
/// has to be at most 1. Frames are taken exactly at multiples of `1 / rate`.
///
/// In statics, `quasi-static`, the size of an increment follows the effort of its solve: one that Newton's
/// method does not solve, within the `iterations` of [time] solver, is taken back and a quarter of it is
/// tried; after two in a row that took at most 4 matrices, the next is half as large again; after one that
/// took more than 10, a quarter smaller. Frames, keyframes, releases and the times at which formulas of `t`
/// have kinks or jumps are landed on exactly.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Adaptive {
    /// Relative error of a step; 1e-6 without it. Schemes with a criterion of their own have it among their
    /// parameters.
    #[serde(skip_serializing_if = "Option::is_none")]
    // Below the least, rounding is larger than the error that is allowed.
    #[schemars(extend("minimum" = 1e-14, "exclusiveMaximum" = 1.0))]
    pub tolerance: Option<f64>,
    /// Error of positions [m]; without it, `tolerance` times the size of the scene at the start.
    #[serde(skip_serializing_if = "Option::is_none", with = "As::<Option<Length>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub position: Option<f64>,
    /// Error of velocities [m/s], beside `tolerance` times the speed of each vertex; without it, `tolerance`
    /// times `sqrt(2 E / m)`, `E` being the energy in play at the start and `m` the mass of all bodies.
    #[serde(skip_serializing_if = "Option::is_none", with = "As::<Option<Velocity>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub velocity: Option<f64>,
    /// The first step to try [s]; found from the forces at the start without it, in statics a tenth of the
    /// duration.
    #[serde(skip_serializing_if = "Option::is_none", with = "As::<Option<Duration>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub first: Option<f64>,
    /// A run that needs smaller steps [s] ends with a message; without it, where steps would no longer
    /// advance the time, in statics a millionth of the duration.
    #[serde(skip_serializing_if = "Option::is_none", with = "As::<Option<Duration>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub smallest: Option<f64>,
    /// No step is larger [s]; without it, steps go from frame to frame at most.
    #[serde(skip_serializing_if = "Option::is_none", with = "As::<Option<Duration>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub largest: Option<f64>,
}

impl Adaptive {
    /// The relative error of a step.
    pub fn tolerance_or_default(&self) -> f64 {
        self.tolerance.unwrap_or(1e-6)
    }
}
