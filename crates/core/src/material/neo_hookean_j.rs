use super::barrier::{admissible, infinite_outside};
use super::spectrum::{Derivatives, Spectrum};
use super::{Domain, Isotropic, Lame, Material, MaterialDescription, Model};
use crate::algebra::{Mat, Vect};
use crate::scalar::Scalar;

/// Compressible neo-Hookean elasticity whose volume term is quadratic in `J`.
///
/// With `I_C = F : F` and `J = det F`:
///
/// ```text
/// psi = mu/2 (I_C - d) - mu ln J + lambda/2 (J - 1)^2       [J/m^3]
/// P   = mu F + (lambda (J - 1) - mu/J) cof F                [Pa]
/// ```
///
/// The model is defined for `J > 0` only, like [`NeoHookean`](super::NeoHookean). Its barrier is even weaker,
/// and it resists expansion more.
///
/// Source: Bonet and Wood, "Nonlinear continuum mechanics for finite element analysis", 2nd edition,
/// 2008, with a different volume term that is also in common use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NeoHookeanJ {
    lame: Lame,
}

impl Model for NeoHookeanJ {
    type Parameters = Isotropic;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "Neo-Hookean with (J - 1)^2: rubber-like, forbids inversion.",
        formula: "mu/2 (I_C - d) - mu ln J + lambda/2 (J - 1)^2, I_C = F:F, J = det F",
        source: "Bonet and Wood 2008, with another volume term",
        domain: Domain::PositiveJ,
        frame_indifferent: true,
        has_rest_shape: true,
    };
    fn new(parameters: &Isotropic) -> Self {
        NeoHookeanJ { lame: parameters.lame() }
    }
}

impl<const D: usize> Material<D> for NeoHookeanJ {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        let stretch = f.norm_squared();
        let j = f.determinant();
        let volume = j - S::one();
        let volumetric = S::splat(0.5 * self.lame.lambda) * volume * volume;
        let isochoric = (stretch - S::splat(D as f64)).mul_add(S::splat(0.5), -j.ln());
        infinite_outside(j, stretch, S::splat(self.lame.mu).mul_add(isochoric, volumetric))
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        let cofactor = f.cofactor();
        let j = admissible(f.determinant_with(&cofactor));
        let mu = S::splat(self.lame.mu);
        let factor = S::splat(self.lame.lambda).mul_add(j - S::one(), -(mu / j));
        f.scale_add(mu, &cofactor.scale(factor))
    }

    fn spectrum(&self, sigma: &Vect<f64, D>) -> Option<Spectrum<D>> {
        let Lame { lambda, mu } = self.lame;
        let j: f64 = admissible(sigma.iter().product());
        let a = Derivatives { first: 0.5 * mu, second: 0.0 };
        let b = Derivatives { first: lambda * (j - 1.0) - mu / j, second: lambda + mu / (j * j) };
        Some(Spectrum::from_invariants(sigma, a, b))
    }

    fn domain(&self) -> Domain {
        Self::ABOUT.domain
    }
}
