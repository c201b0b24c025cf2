//! Causes of failed steps.

use super::{SolveError, SolveFailure};
use crate::energy::Fault;
use crate::system::System;

/// Error of a failed step.
#[derive(Clone, Debug, PartialEq)]
pub struct StepFault {
    /// Location and cause, if a term knows them.
    pub fault: Option<Fault>,
    /// First vertex whose new position or velocity is not finite.
    pub vertex: Option<usize>,
    /// Error of the implicit solver, if it is the cause.
    pub solve: Option<SolveError>,
}

impl StepFault {
    /// Returns the error of a step that was asked to stop.
    pub(crate) fn stopped() -> Self {
        let solve = SolveError { verdict: SolveFailure::Stopped, iterations: 0, correction: 0.0, left: None };
        StepFault { fault: None, vertex: None, solve: Some(solve) }
    }

    /// Diagnoses the failure at these stage positions and velocities.
    pub(crate) fn at(system: &System, x: &[f64], v: &[f64]) -> Self {
        let vertex = x.iter().zip(v).position(|(x, v)| !(x.is_finite() && v.is_finite()));
        let fault = system.fault(x).or_else(|| system.dissipative_fault(x, v));
        StepFault { fault, vertex: vertex.map(|i| i / system.dimension()), solve: None }
    }
}
