//! Stress by automatic differentiation of the energy density.

use super::{Domain, Material, Psd, Tangent};
use crate::algebra::{Dual, Mat};
use crate::scalar::Scalar;

/// `P = d psi / dF` [Pa], exact to rounding, by running `psi` on dual numbers.
///
/// Outside the domain of a barrier model the result is not finite.
#[inline(always)]
pub fn gradient<S: Scalar, const D: usize, M: Material<D> + ?Sized>(
    material: &M,
    f: &Mat<S, D>,
) -> Mat<S, D> {
    material.psi(&Dual::variable(f)).partial
}

/// A model whose stress is computed by [`gradient`] even though it has a closed form.
///
/// Equal to rounding, slower: a check of the closed form, selected by `stress = "autodiff"` in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Autodiff<M>(pub M);

impl<const D: usize, M: Material<D>> Material<D> for Autodiff<M> {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        self.0.psi(f)
    }
    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        gradient(&self.0, f)
    }
    fn hessian(&self, f: &Mat<f64, D>, psd: Psd) -> Tangent<D> {
        self.0.hessian(f, psd)
    }
    fn domain(&self) -> Domain {
        self.0.domain()
    }
}
