use super::spectrum::{Spectrum, sum_of_stretches};
use super::{Domain, Isotropic, Lame, Material, MaterialDescription, Model};
use crate::algebra::{Mat, Vect};
use crate::scalar::Scalar;

/// Corotated linear elasticity: linear elasticity in the frame that rotates with the body.
///
/// With `F = R S`, `R` a rotation also where `det F < 0`:
///
/// ```text
/// psi = mu |F - R|^2 + lambda/2 tr(S - I)^2     [J/m^3]
/// P   = 2 mu (F - R) + lambda tr(S - I) R       [Pa]
/// ```
///
/// The derivative of `R` does not enter `P`, because `R` maximises `tr(R^T F)`; it does enter `dP/dF`. The
/// model pushes an inverted body back. Where the two smallest stretches add up to zero, `R` and `P` jump.
///
/// Source: Sifakis and Barbic, "FEM simulation of 3D deformable solids", SIGGRAPH course, 2012, part one,
/// section 3.4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corotated {
    lame: Lame,
}

impl Corotated {
    fn spectrum<const D: usize>(&self, sigma: &Vect<f64, D>) -> Spectrum<D> {
        let Lame { lambda, mu } = self.lame;
        let trace = sigma.iter().sum::<f64>() - D as f64;
        let mut s = Spectrum { scaling: Mat::zero(), twist: Mat::zero(), flip: Mat::zero() };
        for i in 0..D {
            for j in 0..D {
                s.scaling[i][j] = if i == j { 2.0 * mu + lambda } else { lambda };
                if i < j {
                    let sum = sum_of_stretches(sigma, i, j);
                    s.twist[i][j] = 2.0 * mu + (2.0 * lambda * trace - 4.0 * mu) / sum;
                    s.flip[i][j] = 2.0 * mu;
                }
            }
        }
        s
    }
}

impl Model for Corotated {
    type Parameters = Isotropic;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "Corotated linear elasticity: linear in the rotated frame, recovers from inversion.",
        formula: "mu |F - R|^2 + lambda/2 tr(S - I)^2, F = R S",
        source: "Sifakis and Barbic 2012, part one, section 3.4",
        domain: Domain::Everywhere,
        frame_indifferent: true,
        has_rest_shape: true,
    };
    fn new(parameters: &Isotropic) -> Self {
        Corotated { lame: parameters.lame() }
    }
}

impl<const D: usize> Material<D> for Corotated {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        let r = S::rotation(f);
        let trace = r.dot(f) - S::splat(D as f64);
        S::splat(self.lame.mu)
            .mul_add((*f - r).norm_squared(), S::splat(0.5 * self.lame.lambda) * trace * trace)
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        let r = S::rotation(f);
        let trace = r.dot(f) - S::splat(D as f64);
        // 2 mu F + (lambda tr(S - I) - 2 mu) R
        let factor = S::splat(self.lame.lambda).mul_add(trace, S::splat(-2.0 * self.lame.mu));
        f.scale_add(S::splat(2.0 * self.lame.mu), &r.scale(factor))
    }

    fn spectrum(&self, sigma: &Vect<f64, D>) -> Option<Spectrum<D>> {
        Some(self.spectrum(sigma))
    }
}
