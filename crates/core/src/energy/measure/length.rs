//! Distance between two vertices.

use super::ScalarStrain;
use crate::energy::Fault;
use crate::scalar::Scalar;

/// Added to squared lengths: coincident vertices have no direction.
const TINY: f64 = 1e-280;

/// Length of an edge relative to rest: `s = |x_0 - x_1|` minus the rest length, which is `rest` [m].
///
/// Linear springs have a loop of their own ([`crate::energy::spring`]). This measure is for formulas of the
/// length, and for dashpots of springs.
#[derive(Clone, Copy, Debug)]
pub struct Length;

impl<const D: usize> ScalarStrain<D, 2> for Length {
    const OF: &'static str = "spring";

    fn fault(body: &str, index: usize, x: &[[f64; D]; 2]) -> Fault {
        let (length, _) = Self::deviation(x, &[0.0; 2]);
        Fault::Spring { body: body.into(), spring: index, length }
    }

    #[inline(always)]
    fn deviation<S: Scalar>(x: &[[S; D]; 2], rest: &[S; 2]) -> (S, [[S; D]; 2]) {
        let mut d = [S::zero(); D];
        let mut square = S::splat(TINY);
        for c in 0..D {
            d[c] = x[0][c] - x[1][c];
            square = d[c].mul_add(d[c], square);
        }
        let length = square.sqrt();
        let mut gradient = [[S::zero(); D]; 2];
        for c in 0..D {
            gradient[0][c] = d[c] / length;
            gradient[1][c] = -gradient[0][c];
        }
        (length - rest[0], gradient)
    }
}
