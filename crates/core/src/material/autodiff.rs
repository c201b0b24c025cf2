//! Stress by automatic differentiation of the energy density.

use super::Material;
use crate::algebra::{Dual, Mat};
use crate::scalar::Scalar;

/// `P = d psi / dF` [Pa], exact to rounding, by running `psi` on dual numbers, once for each entry of `F`.
///
/// Outside the domain of a barrier model the result is not finite.
#[inline(always)]
pub fn autodiff_stress<S: Scalar, const D: usize, M: Material<D> + ?Sized>(
    material: &M,
    f: &Mat<S, D>,
) -> Mat<S, D> {
    let mut p = Mat::zero();
    for k in 0..D {
        for l in 0..D {
            let mut direction = Mat::zero();
            direction[k][l] = S::one();
            p[k][l] = material.psi(&Dual::along(f, &direction)).derivative;
        }
    }
    p
}
