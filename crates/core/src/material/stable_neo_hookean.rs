use super::spectrum::{Derivatives, Spectrum};
use super::{Domain, Isotropic, Lame, Material, MaterialDescription, Model};
use crate::algebra::{Mat, Vect};
use crate::scalar::Scalar;

/// Stable neo-Hookean elasticity without the logarithmic term.
///
/// With `I_C = F : F`, `J = det F` and `Lambda = lambda + mu`:
///
/// ```text
/// psi = mu/2 (I_C - d) - mu (J - 1) + Lambda/2 (J - 1)^2    [J/m^3]
/// P   = mu F + (Lambda (J - 1) - mu) cof F                  [Pa]
/// ```
///
/// The energy is a polynomial, defined and smooth everywhere, and pushes an inverted body back. With `lambda`
/// in place of `Lambda` it would be too soft at `F = I` and not reduce to linear elasticity.
///
/// Source: Smith, de Goes and Kim, "Stable neo-Hookean flesh simulation", 2018, equation 11, up to a constant
/// and with the Lame parameters matched at `F = I`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StableNeoHookean {
    mu: f64,
    lambda: f64,
}

impl Model for StableNeoHookean {
    type Parameters = Isotropic;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "Stable neo-Hookean without logarithm: rubber-like, cheap, recovers from inversion.",
        formula: "mu/2 (I_C - d) - mu (J - 1) + (lambda + mu)/2 (J - 1)^2, I_C = F:F, J = det F",
        source: "Smith, de Goes and Kim 2018, equation 11",
        domain: Domain::Everywhere,
        frame_indifferent: true,
        has_rest_shape: true,
    };
    fn new(parameters: &Isotropic) -> Self {
        let Lame { lambda, mu } = parameters.lame();
        StableNeoHookean { mu, lambda: lambda + mu }
    }
}

impl<const D: usize> Material<D> for StableNeoHookean {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        let volume = f.determinant() - S::one();
        S::splat(0.5 * self.mu).mul_add(
            f.norm_squared() - S::splat(D as f64),
            S::splat(0.5 * self.lambda).mul_add(volume, S::splat(-self.mu)) * volume,
        )
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        let cofactor = f.cofactor();
        // Lambda (J - 1) - mu
        let factor =
            S::splat(self.lambda).mul_add(f.determinant_with(&cofactor), S::splat(-(self.lambda + self.mu)));
        f.scale_add(S::splat(self.mu), &cofactor.scale(factor))
    }

    fn spectrum(&self, sigma: &Vect<f64, D>) -> Option<Spectrum<D>> {
        let j: f64 = sigma.iter().product();
        let a = Derivatives { first: 0.5 * self.mu, second: 0.0 };
        let b = Derivatives { first: self.lambda * (j - 1.0) - self.mu, second: self.lambda };
        Some(Spectrum::from_invariants(sigma, a, b))
    }
}
