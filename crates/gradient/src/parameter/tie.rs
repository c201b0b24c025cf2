//! Rest lengths of attachments.

use super::{ForceUse, Parameter, ParameterNeeds};
use crate::adjoint::{add_scaled, dot};

/// The rest length `l` [m] of the ties of an attachment, `E = sum k/2 (|d| - l)^2`.
#[derive(Clone, Debug)]
pub struct TieRestLength {
    /// Name of its term.
    term: String,
}

impl TieRestLength {
    /// Of the term of this name.
    pub fn new(term: String) -> Self {
        TieRestLength { term }
    }
}

impl Parameter for TieRestLength {
    fn len(&self) -> usize {
        1
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        ParameterNeeds { rest_lengths: vec![&self.term], ..ParameterNeeds::default() }
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        add_scaled(force, -change[0], of.by_rest_length(&self.term));
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        derivative[0] -= dot(of.by_rest_length(&self.term), of.p);
    }
}
