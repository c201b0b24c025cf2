//! Uniform gravity.

use super::{ForceUse, Parameter};

/// Acceleration of uniform gravity [m/s^2], a number for each dimension; that at the time of each force where
/// gravity changes with time.
#[derive(Clone, Copy, Debug)]
pub struct Gravity {
    dimension: usize,
}

impl Gravity {
    /// Gravity in `dimension` dimensions.
    pub fn new(dimension: usize) -> Self {
        Gravity { dimension }
    }
}

impl Parameter for Gravity {
    fn len(&self) -> usize {
        self.dimension
    }

    fn add_change(&mut self, of: &ForceUse<'_>, change: &[f64], force: &mut [f64]) -> bool {
        for (force, mass) in force.chunks_exact_mut(self.dimension).zip(of.system.mass()) {
            force.iter_mut().zip(change).for_each(|(force, change)| *force += mass * change);
        }
        true
    }

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        for (p, mass) in of.p.chunks_exact(self.dimension).zip(of.system.mass()) {
            derivative.iter_mut().zip(p).for_each(|(derivative, p)| *derivative += mass * p);
        }
    }
}
