//! The state of a simulation: time, positions, velocities.

use crate::integrator::all_finite;
use crate::system::System;

/// Time, positions and velocities, and the acceleration that belongs to those positions once it has been computed.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Steps taken.
    pub step: u64,
    /// Simulated time [s].
    pub time: f64,
    x: Vec<f64>,
    v: Vec<f64>,
    /// `M^-1 f(x)`, valid where `acceleration_is_current`: a method whose last stage is at the new positions passes
    /// its force on to the next step.
    pub(crate) acceleration: Vec<f64>,
    pub(crate) acceleration_is_current: bool,
}

impl State {
    /// The state at time zero.
    ///
    /// # Panics
    /// If the arrays differ in length.
    pub fn new(x: Vec<f64>, v: Vec<f64>) -> Self {
        assert_eq!(x.len(), v.len(), "one velocity per position");
        let acceleration = vec![0.0; x.len()];
        State { step: 0, time: 0.0, x, v, acceleration, acceleration_is_current: false }
    }

    /// Positions, flat `(n, dimension)` [m].
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    /// Velocities, flat `(n, dimension)` [m/s].
    pub fn v(&self) -> &[f64] {
        &self.v
    }

    /// Positions to be changed; whatever was known about the force there is forgotten.
    pub fn x_mut(&mut self) -> &mut [f64] {
        self.acceleration_is_current = false;
        &mut self.x
    }

    /// Velocities to be changed.
    pub fn v_mut(&mut self) -> &mut [f64] {
        &mut self.v
    }

    /// Positions and velocities to be changed, without forgetting the force: for constraints that report whether they
    /// moved anything.
    pub(crate) fn both_mut(&mut self) -> (&mut [f64], &mut [f64]) {
        (&mut self.x, &mut self.v)
    }

    /// Computes the acceleration at the present positions unless it is known; false where it is not finite.
    pub(crate) fn ensure_acceleration(&mut self, system: &mut System) -> bool {
        if !self.acceleration_is_current {
            system.acceleration(&self.x, &mut self.acceleration);
            self.acceleration_is_current = all_finite(&self.acceleration);
        }
        self.acceleration_is_current
    }

    /// Takes over `x` and `v`, handing back the previous ones in their place.
    pub(crate) fn swap(&mut self, x: &mut Vec<f64>, v: &mut Vec<f64>) {
        std::mem::swap(&mut self.x, x);
        std::mem::swap(&mut self.v, v);
    }
}

/// Diagonal of the bounding box of points `(n, dimension)` [m]; zero without points.
pub(crate) fn diagonal(x: &[f64], dimension: usize) -> f64 {
    let mut sum = 0.0;
    for c in 0..dimension {
        let component = || x.iter().skip(c).step_by(dimension);
        let low = component().fold(f64::INFINITY, |a, b| a.min(*b));
        let high = component().fold(f64::NEG_INFINITY, |a, b| a.max(*b));
        if high > low {
            sum += (high - low) * (high - low);
        }
    }
    sum.sqrt()
}
