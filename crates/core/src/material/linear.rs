use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Deserializer, Serialize};

use super::constants::GivenConstants;
use super::{
    Domain, Isotropic, Lame, Material, MaterialDescription, Model, ParameterError, Parameters, Plane, Preset,
    Psd, Tangent,
};
use crate::algebra::Mat;
use crate::scalar::Scalar;
use crate::value::{As, KeyRange, Pressure};

/// Small-strain linear elasticity.
///
/// With `eps = (F + F^T) / 2 - I`:
///
/// ```text
/// psi = mu eps : eps + lambda/2 tr(eps)^2       [J/m^3]
/// P   = 2 mu eps + lambda tr(eps) I             [Pa]
/// ```
///
/// `P` is linear in `F`: the stiffness matrix is constant, and vibration modes and modal solutions are exact.
/// The model is not frame indifferent: a body that rotates by a large angle swells. Under a plane rotation by
/// `theta`, `P = 2 (mu + lambda) (cos theta - 1) I` in 2D.
///
/// In plane stress (2D, `plane = "stress"`) the thickness is free to change, `sigma_33 = 0`. The in-plane law
/// is the same with `lambda* = 2 lambda mu / (lambda + 2 mu)` for `lambda`, and `eps_33 = -lambda / (lambda +
/// 2 mu) (eps_11 + eps_22)`.
///
/// Source: Sifakis and Barbic, "FEM simulation of 3D deformable solids", SIGGRAPH course, 2012, part one,
/// section 3.2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linear {
    lame: Lame,
    /// `lambda` in two dimensions.
    plane_lambda: f64,
    /// `eps_33 / (eps_11 + eps_22)` in two dimensions.
    contraction: f64,
}

impl Linear {
    #[inline(always)]
    fn lambda<const D: usize>(&self) -> f64 {
        if D == 2 { self.plane_lambda } else { self.lame.lambda }
    }
}

/// Isotropic elasticity, in plane strain or plane stress in two dimensions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PlaneIsotropic {
    /// Constants of the solid.
    #[serde(flatten)]
    pub solid: Isotropic,
    /// Condition across the plane, in 2D only; plane strain without it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plane: Option<Plane>,
}

/// Table of a scene that [`PlaneIsotropic`] is read from.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct PlaneIsotropicTable {
    /// Young's modulus E [Pa], positive; that of the preset without it.
    #[serde(default, with = "As::<Option<Pressure>>")]
    #[schemars(transform = KeyRange::POSITIVE.in_schema())]
    young: Option<f64>,
    /// Poisson's ratio nu of the solid, above -1 and below 0.5; the same range in 2D. That of the preset
    /// without it.
    #[serde(default)]
    #[schemars(transform = KeyRange::POISSON.in_schema())]
    poisson: Option<f64>,
    /// Bulk modulus K [Pa], positive; with `shear` in place of `young` and `poisson`.
    #[serde(default, with = "As::<Option<Pressure>>")]
    #[schemars(transform = KeyRange::POSITIVE.in_schema())]
    bulk: Option<f64>,
    /// Shear modulus G [Pa], positive; with `bulk`.
    #[serde(default, with = "As::<Option<Pressure>>")]
    #[schemars(transform = KeyRange::POSITIVE.in_schema())]
    shear: Option<f64>,
    /// First Lame parameter [Pa], above -2/3 `mu`; with `mu` in place of `young` and `poisson`.
    #[serde(default, with = "As::<Option<Pressure>>")]
    lambda: Option<f64>,
    /// Second Lame parameter [Pa], the shear modulus, positive; with `lambda`.
    #[serde(default, with = "As::<Option<Pressure>>")]
    #[schemars(transform = KeyRange::POSITIVE.in_schema())]
    mu: Option<f64>,
    /// A well-known material that `young` and `poisson` are of, where they are not given; `pliant list
    /// presets` shows them.
    #[serde(default)]
    preset: Option<Preset>,
    /// Condition across the plane, in 2D only; plane strain without it.
    #[serde(default)]
    plane: Option<Plane>,
}

impl<'de> Deserialize<'de> for PlaneIsotropic {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let PlaneIsotropicTable { young, poisson, bulk, shear, lambda, mu, preset, plane } =
            PlaneIsotropicTable::deserialize(deserializer)?;
        let given = GivenConstants { young, poisson, bulk, shear, lambda, mu, preset };
        Ok(PlaneIsotropic { solid: given.isotropic()?, plane })
    }
}

impl JsonSchema for PlaneIsotropic {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "PlaneIsotropic".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = PlaneIsotropicTable::json_schema(generator);
        let about = "Isotropic elasticity that in two dimensions may be in plane stress. `young` and \
                     `poisson` are needed, or `bulk` and `shear`, or `lambda` and `mu`, or a `preset`.";
        schema.insert("description".into(), about.into());
        schema
    }
}

impl From<Isotropic> for PlaneIsotropic {
    fn from(solid: Isotropic) -> Self {
        PlaneIsotropic { solid, plane: None }
    }
}

impl Parameters for PlaneIsotropic {
    fn check(&self) -> Result<(), ParameterError> {
        self.solid.check()
    }

    fn lame(&self) -> Option<Lame> {
        Some(self.solid.lame())
    }

    fn preset(&self) -> Option<Preset> {
        self.solid.preset
    }

    fn plane(&self) -> Option<Plane> {
        self.plane
    }

    fn example() -> Self {
        Isotropic::example().into()
    }
}

impl Model for Linear {
    type Parameters = PlaneIsotropic;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "Small-strain linear elasticity: exact for vibrations, wrong for large rotations.",
        formula: "mu eps:eps + lambda/2 tr(eps)^2, eps = (F + F^T)/2 - I",
        source: "Sifakis and Barbic 2012, part one, section 3.2",
        domain: Domain::Everywhere,
        frame_indifferent: false,
        has_rest_shape: true,
    };
    fn new(parameters: &PlaneIsotropic) -> Self {
        let lame = parameters.solid.lame();
        let Lame { lambda, mu } = lame;
        match parameters.plane {
            None | Some(Plane::Strain) => Linear { lame, plane_lambda: lambda, contraction: 0.0 },
            Some(Plane::Stress) => {
                let longitudinal = lambda + 2.0 * mu;
                let plane_lambda = 2.0 * lambda * mu / longitudinal;
                Linear { lame, plane_lambda, contraction: -lambda / longitudinal }
            }
        }
    }
}

impl<const D: usize> Material<D> for Linear {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        let strain = f.symmetric() - Mat::identity();
        let trace = strain.trace();
        S::splat(self.lame.mu)
            .mul_add(strain.norm_squared(), S::splat(0.5 * self.lambda::<D>()) * trace * trace)
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        let strain = f.symmetric() - Mat::identity();
        let pressure = S::splat(self.lambda::<D>()) * strain.trace();
        strain.scale_add(S::splat(2.0 * self.lame.mu), &Mat::scalar(pressure))
    }

    /// Returns the constant Hessian, which is positive semi-definite without projection.
    fn hessian(&self, _: &Mat<f64, D>, _: Psd) -> Tangent<D> {
        let mut t = Tangent::zero();
        for i in 0..D {
            for j in 0..D {
                t.0[i][j][i][j] += self.lame.mu;
                t.0[i][j][j][i] += self.lame.mu;
                t.0[i][i][j][j] += self.lambda::<D>();
            }
        }
        t
    }
    fn out_of_plane_stretch(&self, f: &Mat<f64, D>) -> f64 {
        if D == 2 { (f.trace() - 2.0).mul_add(self.contraction, 1.0) } else { 1.0 }
    }
}
