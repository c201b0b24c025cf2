//! One number that several depend on.

use super::{ForceUse, HeldUse, ModeUse, Parameter, ParameterNeeds, StateUse};
use crate::adjoint::dot;

/// A number `theta` that the numbers of another parameter grow with, `d theta_i = w_i d theta`.
pub struct Weighted {
    of: Box<dyn Parameter>,
    weights: Vec<f64>,
    derivative: Vec<f64>,
}

impl Weighted {
    /// The number that those `of` a parameter grow with by these weights.
    ///
    /// # Panics
    /// If there are more or fewer weights than numbers.
    pub fn new(of: Box<dyn Parameter>, weights: Vec<f64>) -> Self {
        assert_eq!(of.len(), weights.len(), "one weight for each number");
        Weighted { derivative: vec![0.0; weights.len()], of, weights }
    }
}

impl Parameter for Weighted {
    fn begin(&mut self, steps: u64) {
        self.of.begin(steps);
    }

    fn len(&self) -> usize {
        1
    }

    fn needs(&self) -> ParameterNeeds<'_> {
        self.of.needs()
    }

    fn add_held(&mut self, of: &HeldUse<'_>, derivative: &mut [f64]) {
        self.derivative.fill(0.0);
        self.of.add_held(of, &mut self.derivative);
        derivative[0] += dot(&self.derivative, &self.weights);
    }

    fn add_state(&mut self, of: &StateUse<'_>, derivative: &mut [f64]) {
        self.derivative.fill(0.0);
        self.of.add_state(of, &mut self.derivative);
        derivative[0] += dot(&self.derivative, &self.weights);
    }

    fn add_mode(&mut self, of: &ModeUse<'_>, derivative: &mut [f64]) -> bool {
        self.derivative.fill(0.0);
        let is_known = self.of.add_mode(of, &mut self.derivative);
        derivative[0] += dot(&self.derivative, &self.weights);
        is_known
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        let changes: Vec<f64> = self.weights.iter().map(|weight| weight * change[0]).collect();
        self.of.add_change(of, &changes, force)
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        self.derivative.fill(0.0);
        self.of.add(of, &mut self.derivative);
        derivative[0] += dot(&self.derivative, &self.weights);
    }
}
