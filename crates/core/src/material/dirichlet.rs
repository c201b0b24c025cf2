use super::{Domain, Material, MaterialDescription, Model, Psd, Stiffness, Tangent};
use crate::algebra::Mat;
use crate::scalar::Scalar;

/// The Dirichlet energy, under which a free body collapses to a point.
///
/// ```text
/// psi = k/2 |F|^2           [J/m^3]
/// P   = k F                 [Pa]
/// ```
///
/// The model is for teaching. It is frame indifferent, but has no stress-free reference configuration: `P(I)
/// = k I`, and only `F = 0` is free of stress. Springs of rest length zero behave this way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dirichlet {
    stiffness: f64,
}

impl Model for Dirichlet {
    type Parameters = Stiffness;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "For teaching: the Dirichlet energy, without a rest shape; a free body shrinks to a point.",
        formula: "k/2 |F|^2",
        source: "elementary; the first term of the neo-Hookean energies",
        domain: Domain::Everywhere,
        frame_indifferent: true,
        has_rest_shape: false,
    };
    fn new(parameters: &Stiffness) -> Self {
        Dirichlet { stiffness: parameters.stiffness }
    }
}

impl<const D: usize> Material<D> for Dirichlet {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        S::splat(0.5 * self.stiffness) * f.norm_squared()
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        f.scale(S::splat(self.stiffness))
    }

    fn hessian(&self, _: &Mat<f64, D>, _: Psd) -> Tangent<D> {
        Tangent::identity().scale(self.stiffness)
    }
}
