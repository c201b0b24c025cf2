use super::{Domain, Material, MaterialDescription, Model, Psd, Stiffness, Tangent};
use crate::algebra::Mat;
use crate::scalar::Scalar;

/// The square of the displacement gradient as an elastic energy, a naive first choice.
///
/// ```text
/// psi = k/2 |F - I|^2       [J/m^3]
/// P   = k (F - I)           [Pa]
/// ```
///
/// The model is for teaching. It resists rotation: a rotated body is pulled back to its initial orientation,
/// as if each vertex were tied to the reference configuration. It is not frame indifferent, and not linear
/// elasticity either.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplacementGradient {
    stiffness: f64,
}

impl Model for DisplacementGradient {
    type Parameters = Stiffness;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "For teaching: penalises every displacement gradient, rotations included.",
        formula: "k/2 |F - I|^2",
        source: "elementary; the first guess that frame indifference rules out",
        domain: Domain::Everywhere,
        frame_indifferent: false,
        has_rest_shape: true,
    };
    fn new(parameters: &Stiffness) -> Self {
        DisplacementGradient { stiffness: parameters.stiffness }
    }
}

impl<const D: usize> Material<D> for DisplacementGradient {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        S::splat(0.5 * self.stiffness) * (*f - Mat::identity()).norm_squared()
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        (*f - Mat::identity()).scale(S::splat(self.stiffness))
    }

    fn hessian(&self, _: &Mat<f64, D>, _: Psd) -> Tangent<D> {
        Tangent::identity().scale(self.stiffness)
    }
}
