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

    fn add(&mut self, of: &ForceUse<'_>, derivative: &mut [f64]) {
        for (p, mass) in of.p.chunks_exact(self.dimension).zip(of.system.mass()) {
            derivative.iter_mut().zip(p).for_each(|(derivative, p)| *derivative += mass * p);
        }
    }
}
