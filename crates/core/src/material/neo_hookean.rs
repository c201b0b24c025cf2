use super::spectrum::{Derivatives, Spectrum};
use super::{Domain, Isotropic, Lame, Material, MaterialDescription, Model};
use crate::algebra::{Mat, Vect};
use crate::scalar::{Elementary, Scalar};

/// Compressible neo-Hookean elasticity with a logarithmic barrier.
///
/// With `I_C = F : F` and `J = det F`:
///
/// ```text
/// psi = mu/2 (I_C - d) - mu ln J + lambda/2 (ln J)^2        [J/m^3]
/// P   = mu F + (lambda ln J - mu) F^-T                      [Pa]
/// ```
///
/// The model is defined for `J > 0` only: `psi = +inf` where `J <= 0` (below the smallest normal number, to
/// be exact), and `P` is then not finite. The barrier is weak: `psi` grows like `(ln J)^2` only.
///
/// Source: Bonet and Wood, "Nonlinear continuum mechanics for finite element analysis", 2nd edition, 2008.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NeoHookean {
    lame: Lame,
}

impl Model for NeoHookean {
    type Parameters = Isotropic;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "Neo-Hookean with ln J: rubber-like, forbids inversion.",
        formula: "mu/2 (I_C - d) - mu ln J + lambda/2 (ln J)^2, I_C = F:F, J = det F",
        source: "Bonet and Wood 2008",
        domain: Domain::PositiveJ,
        frame_indifferent: true,
        has_rest_shape: true,
    };
    fn new(parameters: &Isotropic) -> Self {
        NeoHookean { lame: parameters.lame() }
    }
}

impl<const D: usize> Material<D> for NeoHookean {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        let stretch = f.norm_squared();
        let j = f.determinant();
        let ln = j.ln();
        let inside = S::splat(0.5 * self.lame.mu).mul_add(
            stretch - S::splat(D as f64),
            S::splat(0.5 * self.lame.lambda).mul_add(ln, S::splat(-self.lame.mu)) * ln,
        );
        // The value depends on `F`: the derivative of a constant would be a plausible zero. NaN stays
        // NaN.
        let outside = S::splat(f64::INFINITY) * (stretch + S::one());
        S::select(j.lt(S::splat(f64::MIN_POSITIVE)), outside, inside)
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        let cofactor = f.cofactor();
        let j = f.determinant_with(&cofactor);
        let factor = S::splat(self.lame.lambda).mul_add(j.ln(), S::splat(-self.lame.mu)) / j;
        f.scale_add(S::splat(self.lame.mu), &cofactor.scale(factor))
    }

    fn spectrum(&self, sigma: &Vect<f64, D>) -> Option<Spectrum<D>> {
        let Lame { lambda, mu } = self.lame;
        let j: f64 = sigma.iter().product();
        // The platform's logarithm has different bits on different machines.
        let g = lambda * Elementary::ln(j) - mu;
        let a = Derivatives { first: 0.5 * mu, second: 0.0 };
        let b = Derivatives { first: g / j, second: (lambda - g) / (j * j) };
        Some(Spectrum::from_invariants(sigma, a, b))
    }

    fn domain(&self) -> Domain {
        Self::ABOUT.domain
    }
}
