//! Reasons for which a step is not taken.

use super::{SolveError, SolveFailure};
use crate::energy::Fault;
use crate::system::System;

/// A step could not be taken.
#[derive(Clone, Debug, PartialEq)]
pub struct StepFault {
    /// Where and why, if a term knows.
    pub fault: Option<Fault>,
    /// First vertex whose new position or velocity is not finite.
    pub vertex: Option<usize>,
    /// How the solver of an implicit step ended, where that is the reason.
    pub solve: Option<SolveError>,
}

impl StepFault {
    /// A step that was asked to end.
    pub(crate) fn stopped() -> Self {
        let solve = SolveError { verdict: SolveFailure::Stopped, iterations: 0, correction: 0.0, left: None };
        StepFault { fault: None, vertex: None, solve: Some(solve) }
    }

    /// Finds out what went wrong with these stage values.
    pub(crate) fn at(system: &System, x: &[f64], v: &[f64]) -> Self {
        let vertex = x.iter().zip(v).position(|(x, v)| !(x.is_finite() && v.is_finite()));
        let fault = system.fault(x).or_else(|| system.dissipative_fault(x, v));
        StepFault { fault, vertex: vertex.map(|i| i / system.dimension()), solve: None }
    }
}
