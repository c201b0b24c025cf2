use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::parameters::check_positive;
use super::spectrum::{Derivatives, Spectrum};
use super::{Domain, Lame, Material, MaterialDescription, Model, ParameterError, Parameters};
use crate::algebra::{Mat, Vect};
use crate::scalar::Scalar;
use crate::value::{As, KeyRange, Pressure};

/// Valid range of Poisson's ratio for a model without Poisson effect.
const NO_POISSON: KeyRange = KeyRange::of(&[("minimum", 0.0), ("maximum", 0.0)]);

/// As-rigid-as-possible (ARAP) elasticity: the squared distance from the nearest rotation.
///
/// With `F = R S`, `R` a rotation also where `det F < 0`, and `mu = E/2`:
///
/// ```text
/// psi = mu |F - R|^2            [J/m^3]
/// P   = 2 mu (F - R)            [Pa]
/// ```
///
/// This is corotated elasticity with `lambda = 0`, so Poisson's ratio is always 0. The model pushes an
/// inverted body back; `P` jumps where `R` does.
///
/// Source: Chao, Pinkall, Sanan and Schroeder, "A simple geometric model for elastic deformations", 2010; the
/// name is from Sorkine and Alexa, "As-rigid-as-possible surface modeling", 2007.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arap {
    mu: f64,
}

/// Isotropic elasticity of a model that has no Poisson effect.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WithoutPoisson {
    /// Young's modulus E [Pa], positive.
    #[serde(with = "As::<Pressure>")]
    #[schemars(transform = KeyRange::POSITIVE.in_schema())]
    pub young: f64,
    /// Poisson's ratio; 0, which it is without this key too, is all that the model can do.
    #[serde(default)]
    #[schemars(transform = NO_POISSON.in_schema())]
    pub poisson: f64,
}

impl Parameters for WithoutPoisson {
    fn check(&self) -> Result<(), ParameterError> {
        check_positive("young", self.young)?;
        if NO_POISSON.contains(self.poisson) {
            return Ok(());
        }
        let problem =
            "the model knows no Poisson effect, so it must be 0; use `fixed-corotated` for any other";
        Err(ParameterError::new("poisson", self.poisson, problem))
    }

    fn lame(&self) -> Option<Lame> {
        Some(Lame::new(self.young, 0.0))
    }

    fn example() -> Self {
        WithoutPoisson { young: 1e6, poisson: 0.0 }
    }
}

impl Model for Arap {
    type Parameters = WithoutPoisson;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "As rigid as possible: corotated with Poisson's ratio 0, recovers from inversion.",
        formula: "mu |F - R|^2, F = R S, mu = E/2",
        source: "Chao, Pinkall, Sanan and Schroeder 2010",
        domain: Domain::Everywhere,
        frame_indifferent: true,
        has_rest_shape: true,
    };
    fn new(parameters: &WithoutPoisson) -> Self {
        Arap { mu: 0.5 * parameters.young }
    }
}

impl<const D: usize> Material<D> for Arap {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        S::splat(self.mu) * (*f - S::rotation(f)).norm_squared()
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        (*f - S::rotation(f)).scale(S::splat(2.0 * self.mu))
    }

    fn spectrum(&self, sigma: &Vect<f64, D>) -> Option<Spectrum<D>> {
        let a = Derivatives { first: self.mu, second: 0.0 };
        let b = Derivatives { first: 0.0, second: 0.0 };
        Some(Spectrum::from_invariants(sigma, a, b).plus_trace(sigma, -2.0 * self.mu))
    }
}
