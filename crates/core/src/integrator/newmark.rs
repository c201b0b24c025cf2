//! Newmark's family of methods: implicit, with coefficients `beta` and `gamma`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::alpha::AlphaCoefficients;
use super::{BadParameter, Documentation, Method, Scheme};
use crate::value::KeyRange;

/// Valid range of `gamma`; below it every step gains energy.
const GAMMA: KeyRange = KeyRange::of(&[("minimum", 0.5)]);

/// Coefficients of `x_(n+1) = x_n + h v_n + h^2 ((1/2 - beta) a_n + beta a_(n+1))` and
/// `v_(n+1) = v_n + h ((1 - gamma) a_n + gamma a_(n+1))`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct NewmarkParameters {
    /// `beta`, above 0; 1/4 is the average acceleration, 1/6 the linear one.
    #[schemars(transform = KeyRange::POSITIVE.in_schema())]
    pub beta: f64,
    /// `gamma`, at least 1/2; above it damps, and the order falls to 1.
    #[schemars(transform = GAMMA.in_schema())]
    pub gamma: f64,
}

impl Default for NewmarkParameters {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl NewmarkParameters {
    /// Default: the average acceleration method.
    pub const DEFAULT: Self = NewmarkParameters { beta: 0.25, gamma: 0.5 };

    /// Largest stable `h omega` without damping: infinite if `2 beta >= gamma`, else
    /// `1 / sqrt(gamma/2 - beta)`; Hughes 2000, *The Finite Element Method*, eq. 9.1.19.
    fn stability_limit(&self) -> f64 {
        if 2.0 * self.beta >= self.gamma {
            f64::INFINITY
        } else {
            1.0 / (0.5 * self.gamma - self.beta).sqrt()
        }
    }

    /// Returns the method with its documentation.
    pub fn method(self) -> Method {
        Method {
            documentation: Documentation {
                name: "newmark",
                summary: "Newmark's method; with the default coefficients the trapezoidal rule in another \
                          form",
                order: if self.gamma == 0.5 { 2 } else { 1 },
                force_evaluations: 0,
                solves: 1,
                stability_limit: self.stability_limit(),
                symplectic: false,
                conserves: "nothing else",
                source: "Newmark 1959, A method of computation for structural dynamics",
            },
            scheme: Scheme::Alpha(AlphaCoefficients {
                alpha_m: 0.0,
                alpha_f: 0.0,
                beta: self.beta,
                gamma: self.gamma,
            }),
        }
    }

    /// Checks the ranges of the parameters.
    ///
    /// # Errors
    /// [`BadParameter`] for the first one out of range.
    pub fn check(&self) -> Result<(), BadParameter> {
        if !KeyRange::POSITIVE.contains(self.beta) {
            return Err(BadParameter {
                name: "beta",
                value: self.beta,
                right: "positive: 0.25 is the average acceleration",
            });
        }
        if !GAMMA.contains(self.gamma) {
            return Err(BadParameter {
                name: "gamma",
                value: self.gamma,
                right: "at least 0.5: below it every step gains energy",
            });
        }
        Ok(())
    }
}
