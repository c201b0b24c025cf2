use super::spectrum::{Derivatives, Spectrum};
use super::{Domain, Isotropic, Lame, Material, MaterialDescription, Model};
use crate::algebra::{Mat, Vect};
use crate::scalar::Scalar;

/// Stable neo-Hookean elasticity with the logarithmic term that resists collapse to a point.
///
/// With `I_C = tr(F^T F)` (in 2D with `F_33 = 1`), `J = det F`, `m = 4 mu / 3`, `Lambda = lambda + 5 mu / 6`
/// and `alpha = 1 + 3 m / (4 Lambda)`:
///
/// ```text
/// psi = m/2 (I_C - 3) + Lambda/2 (J - alpha)^2 - m/2 ln(I_C + 1) - c    [J/m^3]
/// P   = m (1 - 1/(I_C + 1)) F + Lambda (J - alpha) cof F                [Pa]
/// ```
///
/// The constant `c = Lambda/2 (1 - alpha)^2 - m/2 ln 4`, which the paper does not subtract, makes `psi(I) =
/// 0`.
///
/// Source: Smith, de Goes and Kim, "Stable neo-Hookean flesh simulation", 2018, equation 14 (energy), 18
/// (stress), section 3.4 (`m` and `Lambda`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StableNeoHookeanLog {
    mu: f64,
    lambda: f64,
}

/// Returns the contribution of `F_33 = 1` to `I_C`, plus `more`.
#[inline(always)]
fn out_of_plane<const D: usize>(more: f64) -> f64 {
    if D == 2 { more + 1.0 } else { more }
}

impl Model for StableNeoHookeanLog {
    type Parameters = Isotropic;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "Stable neo-Hookean as published: also resists collapse to a point.",
        formula: "m/2 (I_C - 3) + L/2 (J - a)^2 - m/2 ln(I_C + 1) - c, m = 4 mu/3, L = lambda + 5 mu/6, \
                  a = 1 + 3 m/(4 L), c such that psi(I) = 0",
        source: "Smith, de Goes and Kim 2018, equation 14",
        domain: Domain::Everywhere,
        frame_indifferent: true,
        has_rest_shape: true,
    };
    fn new(parameters: &Isotropic) -> Self {
        let Lame { lambda, mu } = parameters.lame();
        StableNeoHookeanLog { mu: 4.0 / 3.0 * mu, lambda: lambda + 5.0 / 6.0 * mu }
    }
}

impl<const D: usize> Material<D> for StableNeoHookeanLog {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        let stretch = f.norm_squared();
        let volume = f.determinant() - S::one();
        // Expanded about the reference configuration, so that no large constants cancel:
        // Lambda/2 ((J - alpha)^2 - (1 - alpha)^2) = (Lambda/2 (J - 1) - 3 m/4) (J - 1).
        let volumetric = S::splat(0.5 * self.lambda).mul_add(volume, S::splat(-0.75 * self.mu)) * volume;
        let ln = ((stretch + S::splat(out_of_plane::<D>(1.0))) * S::splat(0.25)).ln();
        S::splat(0.5 * self.mu).mul_add(stretch - S::splat(D as f64) - ln, volumetric)
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        let mu = S::splat(self.mu);
        let cofactor = f.cofactor();
        let stretch = mu - mu / (f.norm_squared() + S::splat(out_of_plane::<D>(1.0)));
        // Lambda (J - 1) - 3 m/4
        let factor = S::splat(self.lambda)
            .mul_add(f.determinant_with(&cofactor), S::splat(-0.75f64.mul_add(self.mu, self.lambda)));
        f.scale_add(stretch, &cofactor.scale(factor))
    }

    fn spectrum(&self, sigma: &Vect<f64, D>) -> Option<Spectrum<D>> {
        let j: f64 = sigma.iter().product();
        let r = 1.0 / (sigma.iter().map(|s| s * s).sum::<f64>() + out_of_plane::<D>(1.0));
        let a = Derivatives { first: 0.5 * self.mu * (1.0 - r), second: 0.5 * self.mu * r * r };
        let b = Derivatives { first: self.lambda * (j - 1.0) - 0.75 * self.mu, second: self.lambda };
        Some(Spectrum::from_invariants(sigma, a, b))
    }
}
