//! Generalised-alpha method, with the high-frequency damping as its parameter.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::alpha::AlphaCoefficients;
use super::{BadParameter, Documentation, Method, Scheme};
use crate::value::KeyRange;

/// The parameter of the method.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct GeneralisedAlphaParameters {
    /// Spectral radius at infinite frequency, 0 to 1: the factor by which a step damps the fastest motion. 1
    /// damps nothing, 0 all.
    #[schemars(transform = KeyRange::FRACTION.in_schema())]
    pub rho: f64,
}

impl Default for GeneralisedAlphaParameters {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl GeneralisedAlphaParameters {
    /// Default: a step damps the highest frequencies by a fifth.
    pub const DEFAULT: Self = GeneralisedAlphaParameters { rho: 0.8 };

    /// Returns the method with its documentation; Chung, Hulbert 1993, eqs. 17 and 25.
    pub fn method(self) -> Method {
        let alpha_m = (2.0 * self.rho - 1.0) / (self.rho + 1.0);
        let alpha_f = self.rho / (self.rho + 1.0);
        let new = 1.0 - alpha_m + alpha_f;
        Method {
            documentation: Documentation {
                name: "generalised-alpha",
                summary: "Second order, one solve a step, damps high frequencies by `rho`, low ones little",
                order: 2,
                force_evaluations: 0,
                solves: 1,
                stability_limit: f64::INFINITY,
                symplectic: false,
                conserves: "nothing else",
                source: "Chung, Hulbert 1993, A time integration algorithm for structural dynamics, eqs. 17 \
                         and 25",
            },
            scheme: Scheme::Alpha(AlphaCoefficients {
                alpha_m,
                alpha_f,
                beta: 0.25 * new * new,
                gamma: 0.5 - alpha_m + alpha_f,
            }),
        }
    }

    /// Checks the range of `rho`.
    ///
    /// # Errors
    /// [`BadParameter`] if `rho` is not between 0 and 1.
    pub fn check(&self) -> Result<(), BadParameter> {
        if !KeyRange::FRACTION.contains(self.rho) {
            let right = "between 0 (damps high frequencies at once) and 1 (damps nothing)";
            return Err(BadParameter { name: "rho", value: self.rho, right });
        }
        Ok(())
    }
}
