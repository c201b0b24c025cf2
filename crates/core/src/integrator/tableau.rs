//! Butcher tableaux, explicit and diagonally implicit.

use super::estimate::Companion;

/// A Butcher tableau without entries above the diagonal; Hairer, Norsett, Wanner 1993, *Solving Ordinary
/// Differential Equations I*, eq. II.1.8, and Hairer, Wanner 1996, *Solving Ordinary Differential Equations
/// II*, section IV.6.
///
/// The nodes are the sums of the rows, `c_i = sum_j a_ij`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tableau {
    /// Row `i` holds `a_ij`: `j < i` for an explicit method, `j <= i` for an implicit one, whose stages
    /// with `a_ii = 0` are explicit.
    pub a: &'static [&'static [f64]],
    /// Weights.
    pub b: &'static [f64],
    /// Weights of the error estimate, if any.
    pub companion: Option<Companion>,
}

impl Tableau {
    /// True if the last stage of an explicit method is the new state, so that the next step starts with
    /// its force.
    pub fn is_first_same_as_last(&self) -> bool {
        let last = self.b.len() - 1;
        last > 0 && self.b[last] == 0.0 && self.a[last] == &self.b[..last]
    }

    /// True if a step has one stage, at its end.
    pub fn is_backward_euler(&self) -> bool {
        self.a.len() == 1 && self.is_stiffly_accurate()
    }

    /// True if the last stage of an implicit method is the new state.
    pub fn is_stiffly_accurate(&self) -> bool {
        self.a[self.a.len() - 1] == self.b
    }
}

/// Velocities and accelerations of the stages of a step.
pub(super) struct Stages {
    pub(super) velocity: Vec<Vec<f64>>,
    pub(super) acceleration: Vec<Vec<f64>>,
}

impl Stages {
    /// Allocates the stages of `tableau` for `unknowns` coordinates.
    pub(super) fn new(tableau: &Tableau, unknowns: usize) -> Self {
        let velocity = vec![vec![0.0; unknowns]; tableau.b.len()];
        Stages { acceleration: velocity.clone(), velocity }
    }
}
