//! IAS15, an adaptive Gauss-Radau method of order 15; Rein and Spiegel 2015, after Everhart.
//!
//! The acceleration is a polynomial in time through its values at the start of the step and at seven
//! Gauss-Radau nodes, `a(s h) = a_0 + b_0 s + b_1 s^2 + ... + b_6 s^7`, and is integrated twice. A
//! fixed-point iteration finds values and polynomial to rounding, starting from the extrapolated last
//! step. Adaptive steps keep the last term, without which the method would have order 14, at the fraction
//! `epsilon` of the acceleration:
//!
//! ```text
//! h_(n+1) = h_n (epsilon / (max |b_6| / max |a|))^(1/7)
//! ```
//!
//! The nodes include the start of a step but not its end, so that amplitudes grow at any step size,
//! though by less than rounding up to `h omega` of about two. The iteration converges up to about five,
//! best below two.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BadParameter, Documentation, Method, Scheme};
use crate::value::KeyRange;

/// Parameters of the Gauss-Radau method.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Ias15Parameters {
    /// Largest last term of the acceleration beside the whole where steps are `adaptive`; the error of a
    /// step is far below. 1e-9 is where rounding begins to be the larger part of the error.
    #[schemars(transform = KeyRange::PART.in_schema())]
    pub epsilon: f64,
}

impl Default for Ias15Parameters {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl Ias15Parameters {
    /// Default of Rein and Spiegel.
    pub const DEFAULT: Self = Ias15Parameters { epsilon: 1e-9 };

    /// Checks the ranges of the parameters.
    ///
    /// # Errors
    /// [`BadParameter`] if `epsilon` is not between 0 and 1.
    pub fn check(&self) -> Result<(), BadParameter> {
        if KeyRange::PART.contains(self.epsilon) {
            return Ok(());
        }
        Err(BadParameter {
            name: "epsilon",
            value: self.epsilon,
            right: "above 0 and below 1: 1e-9 is accurate to round-off",
        })
    }

    /// Returns the method with its documentation.
    pub fn method(self) -> Method {
        Method {
            documentation: Documentation {
                name: "ias15",
                summary: "Gauss-Radau method of order 15 with its own step size control: orbits and close \
                          encounters to round-off",
                order: 15,
                force_evaluations: 0,
                solves: 0,
                stability_limit: 0.0,
                symplectic: false,
                conserves: "energy and angular momentum to round-off, if it chooses its own steps",
                source: "Rein, Spiegel 2015, IAS15: a fast, adaptive, high-order integrator for \
                         gravitational dynamics, MNRAS 446, 1424",
            },
            scheme: Scheme::GaussRadau(self),
        }
    }
}
