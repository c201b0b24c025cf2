//! Butcher tableaux, explicit and diagonally implicit.

use super::estimate::Companion;

/// A Butcher tableau without entries above the diagonal; Hairer, Norsett, Wanner 1993, *Solving Ordinary
/// Differential Equations I*, eq. II.1.8, and Hairer, Wanner 1996, *Solving Ordinary Differential Equations
/// II*, section IV.6.
///
/// The nodes are the sums of the rows, `c_i = sum_j a_ij`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tableau {
    /// Row `i` holds `a_ij`: `j < i` of an explicit method, `j <= i` of an implicit one, where a stage with
    /// `a_ii = 0` is explicit.
    pub a: &'static [&'static [f64]],
    /// Weights.
    pub b: &'static [f64],
    /// Difference of weights that the error is estimated by, if any.
    pub companion: Option<Companion>,
}

impl Tableau {
    /// Of an explicit method: whether the last stage is the new state, so that the next step begins with its
    /// force.
    pub fn is_first_same_as_last(&self) -> bool {
        let last = self.b.len() - 1;
        last > 0 && self.b[last] == 0.0 && self.a[last] == &self.b[..last]
    }

    /// True if a step has one stage, and ends there.
    pub fn is_backward_euler(&self) -> bool {
        self.a.len() == 1 && self.is_stiffly_accurate()
    }

    /// Of an implicit method: whether the last stage is the new state.
    pub fn is_stiffly_accurate(&self) -> bool {
        self.a[self.a.len() - 1] == self.b
    }
}

/// Memory for the velocities and accelerations of the stages of a step.
pub(super) struct Stages {
    pub(super) velocity: Vec<Vec<f64>>,
    pub(super) acceleration: Vec<Vec<f64>>,
}

impl Stages {
    /// For `tableau` on `unknowns` coordinates.
    pub(super) fn new(tableau: &Tableau, unknowns: usize) -> Self {
        let velocity = vec![vec![0.0; unknowns]; tableau.b.len()];
        Stages { acceleration: velocity.clone(), velocity }
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        16 * self.velocity.iter().map(Vec::len).sum::<usize>()
    }
}
