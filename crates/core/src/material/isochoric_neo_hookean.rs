use super::barrier::{admissible, infinite_outside};
use super::spectrum::{InvariantDerivatives, Spectrum, out_of_plane};
use super::{Domain, Isotropic, Material, MaterialDescription, Model};
use crate::algebra::{Mat, Vect};
use crate::scalar::{Elementary, Scalar};

/// Neo-Hookean elasticity with separate shape (isochoric) and volume terms.
///
/// With `I1 = tr(F^T F)` (in 2D with `F_33 = 1`), `J = det F` and the bulk modulus `kappa = lambda + 2 mu/3`:
///
/// ```text
/// psi = mu/2 (J^(-2/3) I1 - 3) + kappa/2 (J - 1)^2                                        [J/m^3]
/// P   = mu J^(-2/3) F + (kappa (J - 1) - mu/3 J^(-2/3) I1 / J) cof F                      [Pa]
/// ```
///
/// The model is defined for `J > 0` only.
///
/// Source: Bonet and Wood, "Nonlinear continuum mechanics for finite element analysis", 2nd edition, 2008.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IsochoricNeoHookean {
    mu: f64,
    bulk: f64,
}

impl Model for IsochoricNeoHookean {
    type Parameters = Isotropic;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "Neo-Hookean, shape and volume apart: for nearly incompressible rubber, forbids inversion.",
        formula: "mu/2 (J^(-2/3) I1 - 3) + kappa/2 (J - 1)^2, I1 = tr(F^T F) in 3D, J = det F, kappa = \
                  lambda + 2 mu/3",
        source: "Bonet and Wood 2008",
        domain: Domain::PositiveJ,
        frame_indifferent: true,
        has_rest_shape: true,
    };
    fn new(parameters: &Isotropic) -> Self {
        let lame = parameters.lame();
        IsochoricNeoHookean { mu: lame.mu, bulk: lame.bulk() }
    }
}

impl<const D: usize> Material<D> for IsochoricNeoHookean {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        let stretch = f.norm_squared() + S::splat(out_of_plane::<D>());
        let j = f.determinant();
        let shape = j.powf(S::splat(-2.0 / 3.0)).mul_add(stretch, S::splat(-3.0));
        let volume = j - S::one();
        let volumetric = S::splat(0.5 * self.bulk) * volume * volume;
        infinite_outside(j, stretch, S::splat(0.5 * self.mu).mul_add(shape, volumetric))
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        let stretch = f.norm_squared() + S::splat(out_of_plane::<D>());
        let cofactor = f.cofactor();
        let j = admissible(f.determinant_with(&cofactor));
        let shear = S::splat(self.mu) * j.powf(S::splat(-2.0 / 3.0));
        let factor = S::splat(self.bulk).mul_add(j - S::one(), -(shear * stretch / (S::splat(3.0) * j)));
        f.scale_add(shear, &cofactor.scale(factor))
    }

    fn spectrum(&self, sigma: &Vect<f64, D>) -> Option<Spectrum<D>> {
        let j: f64 = admissible(sigma.iter().product());
        let stretch = sigma.iter().map(|s| s * s).sum::<f64>() + out_of_plane::<D>();
        let shear = self.mu * Elementary::powf(j, -2.0 / 3.0);
        let derivatives = InvariantDerivatives {
            i1: 0.5 * shear,
            j: self.bulk * (j - 1.0) - shear * stretch / (3.0 * j),
            i1_j: -shear / (3.0 * j),
            j_j: self.bulk + 5.0 * shear * stretch / (9.0 * j * j),
            ..InvariantDerivatives::default()
        };
        Some(Spectrum::from_three_invariants(sigma, &derivatives))
    }

    fn domain(&self) -> Domain {
        Self::ABOUT.domain
    }
}
