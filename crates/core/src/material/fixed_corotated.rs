use super::spectrum::{Derivatives, Spectrum};
use super::{Domain, Isotropic, Lame, Material, MaterialDescription, Model};
use crate::algebra::{Mat, Vect};
use crate::scalar::Scalar;

/// Fixed corotated elasticity: corotated shear, and a volume term in `J`.
///
/// With `F = R S`, `R` a rotation also where `det F < 0`, and `J = det F`:
///
/// ```text
/// psi = mu |F - R|^2 + lambda/2 (J - 1)^2       [J/m^3]
/// P   = 2 mu (F - R) + lambda (J - 1) cof F     [Pa]
/// ```
///
/// The model replaces the volume term of the corotated model: `tr(S - I)` measures volume for small strains
/// only, and lets a body of Poisson's ratio near 0.5 vanish under large ones. It pushes an inverted body
/// back; `P` jumps where `R` does.
///
/// Source: Stomakhin, Howes, Schroeder and Teran, "Energetically consistent invertible elasticity", 2012.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedCorotated {
    lame: Lame,
}

impl Model for FixedCorotated {
    type Parameters = Isotropic;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "Fixed corotated: corotated shear with a true volume term, recovers from inversion.",
        formula: "mu |F - R|^2 + lambda/2 (J - 1)^2, F = R S, J = det F",
        source: "Stomakhin, Howes, Schroeder and Teran 2012",
        domain: Domain::Everywhere,
        frame_indifferent: true,
        has_rest_shape: true,
    };
    fn new(parameters: &Isotropic) -> Self {
        FixedCorotated { lame: parameters.lame() }
    }
}

impl<const D: usize> Material<D> for FixedCorotated {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        let r = S::rotation(f);
        let volume = f.determinant() - S::one();
        S::splat(self.lame.mu)
            .mul_add((*f - r).norm_squared(), S::splat(0.5 * self.lame.lambda) * volume * volume)
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        let r = S::rotation(f);
        let cofactor = f.cofactor();
        let pressure = S::splat(self.lame.lambda) * (f.determinant_with(&cofactor) - S::one());
        (*f - r).scale_add(S::splat(2.0 * self.lame.mu), &cofactor.scale(pressure))
    }

    fn spectrum(&self, sigma: &Vect<f64, D>) -> Option<Spectrum<D>> {
        let Lame { lambda, mu } = self.lame;
        let j: f64 = sigma.iter().product();
        let a = Derivatives { first: mu, second: 0.0 };
        let b = Derivatives { first: lambda * (j - 1.0), second: lambda };
        Some(Spectrum::from_invariants(sigma, a, b).plus_trace(sigma, -2.0 * mu))
    }
}
