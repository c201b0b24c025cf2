use super::spectrum::Spectrum;
use super::{Domain, Isotropic, Lame, Material, MaterialDescription, Model};
use crate::algebra::{Mat, Vect};
use crate::scalar::Scalar;

/// St. Venant-Kirchhoff elasticity: linear elasticity in the Green strain.
///
/// With `E = (F^T F - I) / 2`:
///
/// ```text
/// psi = mu E : E + lambda/2 tr(E)^2             [J/m^3]
/// P   = F (2 mu E + lambda tr(E) I)             [Pa]
/// ```
///
/// The energy is a polynomial, so cheap and smooth. The model softens under compression and does not resist
/// inversion: a mirrored body has no energy at all.
///
/// Source: Sifakis and Barbic, "FEM simulation of 3D deformable solids", SIGGRAPH course, 2012, part one,
/// section 3.3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stvk {
    lame: Lame,
}

impl Stvk {
    fn spectrum<const D: usize>(&self, sigma: &Vect<f64, D>) -> Spectrum<D> {
        let Lame { lambda, mu } = self.lame;
        let squares = sigma.iter().map(|s| s * s).sum::<f64>() - D as f64;
        let t = 0.5 * lambda * squares - mu;
        let mut s = Spectrum { scaling: Mat::zero(), twist: Mat::zero(), flip: Mat::zero() };
        for i in 0..D {
            s.scaling[i][i] = t + (3.0 * mu + lambda) * sigma[i] * sigma[i];
            for j in i + 1..D {
                let (sum, product) = (sigma[i] * sigma[i] + sigma[j] * sigma[j], sigma[i] * sigma[j]);
                s.scaling[i][j] = lambda * product;
                s.scaling[j][i] = lambda * product;
                s.twist[i][j] = t + mu * (sum - product);
                s.flip[i][j] = t + mu * (sum + product);
            }
        }
        s
    }
}

impl Model for Stvk {
    type Parameters = Isotropic;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "St. Venant-Kirchhoff: Green strain, cheap; collapses under strong compression.",
        formula: "mu E:E + lambda/2 tr(E)^2, E = (F^T F - I)/2",
        source: "Sifakis and Barbic 2012, part one, section 3.3",
        domain: Domain::Everywhere,
        frame_indifferent: true,
        has_rest_shape: true,
    };
    fn new(parameters: &Isotropic) -> Self {
        Stvk { lame: parameters.lame() }
    }
}

impl<const D: usize> Material<D> for Stvk {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        let strain = (f.transpose_mul(f) - Mat::identity()).scale(S::splat(0.5));
        let trace = strain.trace();
        S::splat(self.lame.mu)
            .mul_add(strain.norm_squared(), S::splat(0.5 * self.lame.lambda) * trace * trace)
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        // 2 E, so that the halves cancel.
        let strain = f.transpose_mul(f) - Mat::identity();
        let pressure = S::splat(0.5 * self.lame.lambda) * strain.trace();
        Mat::mul(f, &strain.scale_add(S::splat(self.lame.mu), &Mat::scalar(pressure)))
    }

    fn spectrum(&self, sigma: &Vect<f64, D>) -> Option<Spectrum<D>> {
        Some(self.spectrum(sigma))
    }
}
