//! Materials defined in the principal stretches.

use super::{Domain, Material, Spectrum};
use crate::algebra::{IsotropicFunction, Mat, Vect};
use crate::scalar::Scalar;

/// An isotropic model given as `psi(sigma)` in the signed principal stretches of `F = U diag(sigma) V^T`,
/// like those of Ogden and Hencky. Implement [`IsotropicFunction::in_stretches`]; the type is then a
/// [`Material`].
///
/// In two dimensions `sigma` are the stretches in the plane; the one out of it is 1 (plane strain).
/// Stress `P = U diag(psi_i) V^T` and tangent follow. The model may give [`IsotropicFunction::slopes`] in
/// closed form if that is faster.
pub trait Stretches<const D: usize>: IsotropicFunction<D> + Send + Sync + 'static {
    /// Returns the domain of the model. Outside, [`IsotropicFunction::in_stretches`] gives `+inf` and
    /// gradients are not finite.
    fn domain(&self) -> Domain {
        Domain::Everywhere
    }
}

impl<const D: usize, M: Stretches<D>> Material<D> for M {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        S::isotropic_value(self, f)
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        S::isotropic_gradient(self, f)
    }

    fn spectrum(&self, sigma: &Vect<f64, D>) -> Option<Spectrum<D>> {
        Some(Spectrum::from_stretches(sigma, &self.slopes(sigma), &self.curvatures(sigma)))
    }

    fn domain(&self) -> Domain {
        Stretches::domain(self)
    }
}
