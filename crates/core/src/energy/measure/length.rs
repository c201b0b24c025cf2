//! Distance between two vertices.

use super::ScalarStrain;
use crate::energy::Fault;
use crate::scalar::Scalar;

/// Squares of lengths below this count as this: two vertices in the same place have no direction.
const TINY: f64 = 1e-280;

/// `s = |x_0 - x_1|` [m]; `rest` is the rest length.
///
/// Springs whose force is linear have a loop of their own ([`crate::energy::spring`]): this is for formulas
/// of the length, and for what damps springs.
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
