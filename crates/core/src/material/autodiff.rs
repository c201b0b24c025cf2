//! Stress by automatic differentiation of the energy density.

use super::Material;
use crate::algebra::{Dual, Mat};
use crate::scalar::Scalar;

/// `P = d psi / dF` [Pa], exact to rounding, by running `psi` on dual numbers.
///
/// Outside the domain of a barrier model the result is not finite.
#[inline(always)]
pub fn autodiff_stress<S: Scalar, const D: usize, M: Material<D> + ?Sized>(
    material: &M,
    f: &Mat<S, D>,
) -> Mat<S, D> {
    material.psi(&Dual::variable(f)).partial
}
