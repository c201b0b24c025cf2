use super::{About, Domain, Isotropic, Lame, Material, Model, Psd, Tangent};
use crate::algebra::Mat;
use crate::scalar::Scalar;

/// Small-strain linear elasticity.
///
/// With `eps = (F + F^T) / 2 - I`:
///
/// ```text
/// psi = mu eps : eps + lambda/2 tr(eps)^2       [J/m^3]
/// P   = 2 mu eps + lambda tr(eps) I             [Pa]
/// ```
///
/// Linear in `F`, so a constant stiffness matrix, vibration modes and exact modal solutions; not frame indifferent: a
/// body that rotates by a large angle swells. Under a plane rotation by `theta`, `P = 2 (mu + lambda) (cos theta - 1) I`
/// in 2D.
///
/// Sifakis and Barbic, "FEM simulation of 3D deformable solids", SIGGRAPH course, 2012, part one, section 3.2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linear {
    lame: Lame,
}

impl Model for Linear {
    type Parameters = Isotropic;
    const ABOUT: About = About {
        summary: "Small-strain linear elasticity: exact for vibrations, wrong for large rotations.",
        formula: "mu eps:eps + lambda/2 tr(eps)^2, eps = (F + F^T)/2 - I",
        source: "Sifakis and Barbic 2012, part one, section 3.2",
        domain: Domain::Everywhere,
        frame_indifferent: false,
        has_rest_shape: true,
    };
    fn new(parameters: &Isotropic) -> Self {
        Linear { lame: parameters.lame() }
    }
}

impl<const D: usize> Material<D> for Linear {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        let strain = f.symmetric() - Mat::identity();
        let trace = strain.trace();
        S::splat(self.lame.mu)
            .mul_add(strain.norm_squared(), S::splat(0.5 * self.lame.lambda) * trace * trace)
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        let strain = f.symmetric() - Mat::identity();
        let pressure = S::splat(self.lame.lambda) * strain.trace();
        strain.scale_add(S::splat(2.0 * self.lame.mu), &Mat::scalar(pressure))
    }

    /// Constant, and positive semi-definite as it is.
    fn hessian(&self, _: &Mat<f64, D>, _: Psd) -> Tangent<D> {
        let mut t = Tangent::zero();
        for i in 0..D {
            for j in 0..D {
                t.0[i][j][i][j] += self.lame.mu;
                t.0[i][j][j][i] += self.lame.mu;
                t.0[i][i][j][j] += self.lame.lambda;
            }
        }
        t
    }
}
