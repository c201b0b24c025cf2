//! Numbers that cells at rest are made of.

use crate::algebra::Dual;
use crate::element::Isoparametric;
use crate::scalar::{Compared, Scalar};

/// Part of a number by which it may be off a kink and still be at it.
///
/// It is more than the rounding of lengths in a mesh far from the origin, and less than any change that a
/// difference of runs can resolve.
pub(crate) const KINK: f64 = 1e-9;

/// A number, or one that changes along a direction: its rate is then that from the number on ahead, one of
/// two where the number has a kink.
pub(crate) trait RestNumber: Scalar + Compared<Mask = bool> {
    /// The number.
    fn value(self) -> f64;

    /// Its rate, zero where it does not change.
    fn rate(self) -> f64;

    /// The number of this value and rate, which one that does not change leaves out.
    fn with_rate(value: f64, rate: f64) -> Self;

    /// `min(1, self)`.
    fn at_most_one(self) -> Self;

    /// Slopes of the shape functions of a cell.
    fn slopes<const D: usize, const N: usize>(cell: &Isoparametric<D, N>, at: &[Self; D]) -> [[Self; D]; N];
}

impl RestNumber for f64 {
    fn value(self) -> f64 {
        self
    }

    fn rate(self) -> f64 {
        0.0
    }

    fn with_rate(value: f64, _: f64) -> f64 {
        value
    }

    fn at_most_one(self) -> f64 {
        self.min(1.0)
    }

    fn slopes<const D: usize, const N: usize>(cell: &Isoparametric<D, N>, at: &[f64; D]) -> [[f64; D]; N] {
        (cell.slopes)(at)
    }
}

impl RestNumber for Dual<f64> {
    fn value(self) -> f64 {
        self.value
    }

    fn rate(self) -> f64 {
        self.derivative
    }

    fn with_rate(value: f64, rate: f64) -> Self {
        Dual { value, derivative: rate }
    }

    fn at_most_one(self) -> Self {
        let derivative = match below_one(self.value) {
            Some(true) => self.derivative,
            Some(false) => 0.0,
            None => self.derivative.min(0.0),
        };
        Dual { value: self.value.min(1.0), derivative }
    }

    fn slopes<const D: usize, const N: usize>(cell: &Isoparametric<D, N>, at: &[Self; D]) -> [[Self; D]; N] {
        (cell.moving_slopes)(at)
    }
}

/// Side of 1 that a number is on; `None` at 1.
pub(super) fn below_one(number: f64) -> Option<bool> {
    ((number - 1.0).abs() > KINK).then_some(number < 1.0)
}
