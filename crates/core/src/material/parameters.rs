//! Parameters of a material in a scene: elastic constants and the checks of their ranges.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Deserializer, Serialize};

use super::constants::GivenConstants;
use super::preset::{AboutPreset, Preset};
use crate::value::{As, KeyRange, Pressure};

/// A parameter has an invalid value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field}{} = {value}: {problem}", index.map_or_else(String::new, |index| format!("[{index}]")))]
#[non_exhaustive]
pub struct ParameterError {
    /// Name of the field, as in the scene.
    pub field: &'static str,
    /// Index of the entry, from 0, if the field is a list.
    pub index: Option<usize>,
    /// The invalid value.
    pub value: f64,
    /// The error, and the valid range.
    pub problem: Cow<'static, str>,
}

impl ParameterError {
    pub(super) fn new(field: &'static str, value: f64, problem: impl Into<Cow<'static, str>>) -> Self {
        ParameterError { field, index: None, value, problem: problem.into() }
    }

    /// Sets the index of a list's entry.
    pub(super) fn at(self, index: usize) -> Self {
        ParameterError { index: Some(index), ..self }
    }
}

/// The parameters of a model, as a table of a scene.
pub trait Parameters {
    /// Checks all fields and reports the first invalid value.
    ///
    /// # Errors
    /// [`ParameterError`] with the field, its value and the range it must be in.
    fn check(&self) -> Result<(), ParameterError>;

    /// Returns the Lame parameters of the linear elasticity that the model reduces to at `F = I`; `None`
    /// if it does not reduce to linear elasticity.
    fn lame(&self) -> Option<Lame>;

    /// Returns the preset of some of the parameters, if there is one.
    fn preset(&self) -> Option<Preset> {
        None
    }

    /// Returns plane strain or plane stress in two dimensions, if the parameters specify it.
    fn plane(&self) -> Option<Plane> {
        None
    }

    /// True if the material is isotropic: a rotation before the deformation changes nothing.
    fn is_isotropic(&self) -> bool {
        true
    }

    /// True if the material has directions relative to material axes, which elements may rotate: its
    /// energy depends on `C` and is anisotropic.
    fn has_axes(&self) -> bool {
        false
    }

    /// Returns sensible values, for lists, documentation and tests.
    fn example() -> Self
    where
        Self: Sized;
}

/// Solid of which a body in two dimensions is a section.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Plane {
    /// Of something long, whose ends are held: no strain out of the plane.
    Strain,
    /// Of a thin sheet, whose faces are free: no stress out of the plane.
    Stress,
}

/// Lame parameters [Pa] of isotropic linear elasticity, `sigma = 2 mu eps + lambda tr(eps) I`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lame {
    /// First parameter.
    pub lambda: f64,
    /// Second parameter, the shear modulus.
    pub mu: f64,
}

impl Lame {
    /// Computes `mu = E / (2 (1 + nu))`, `lambda = E nu / ((1 + nu) (1 - 2 nu))`; in two dimensions this
    /// is plane strain.
    pub fn new(young: f64, poisson: f64) -> Lame {
        Lame {
            lambda: young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)),
            mu: young / (2.0 * (1.0 + poisson)),
        }
    }

    /// Returns Young's modulus [Pa] and Poisson's ratio: `E = mu (3 lambda + 2 mu) / (lambda + mu)`,
    /// `nu = lambda / (2 (lambda + mu))`.
    pub fn young_and_poisson(&self) -> (f64, f64) {
        let Lame { lambda, mu } = self;
        let sum = lambda + mu;
        (mu * (3.0 * lambda + 2.0 * mu) / sum, lambda / (2.0 * sum))
    }

    /// Returns the bulk modulus `kappa = lambda + 2 mu / 3` of the solid, also in plane strain.
    pub(super) fn bulk(&self) -> f64 {
        self.lambda + 2.0 / 3.0 * self.mu
    }
}

/// Isotropic elastic constants. For small strains every model with these parameters reduces to linear
/// elasticity with the same `young` and `poisson`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Isotropic {
    /// Young's modulus E [Pa], positive.
    pub young: f64,
    /// Poisson's ratio nu, above -1 and below 0.5; the same range in 2D, which is plane strain.
    pub poisson: f64,
    /// Preset that provides the constants the scene does not give.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset: Option<Preset>,
}

/// Table of a scene that [`Isotropic`] is read from.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct IsotropicTable {
    /// Young's modulus E [Pa], positive; that of the preset without it.
    #[serde(default, with = "As::<Option<Pressure>>")]
    #[schemars(transform = KeyRange::POSITIVE.in_schema())]
    young: Option<f64>,
    /// Poisson's ratio nu, above -1 and below 0.5; the same range in 2D, which is plane strain. That of the
    /// preset without it.
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
}

/// Returns the given value, or that of the preset.
///
/// # Errors
/// If there is neither.
pub(super) fn or_preset<E: serde::de::Error>(
    given: Option<f64>,
    preset: Option<Preset>,
    field: &'static str,
    of_preset: fn(&AboutPreset) -> f64,
) -> Result<f64, E> {
    given.or(preset.map(|preset| of_preset(preset.about()))).ok_or_else(|| E::missing_field(field))
}

impl<'de> Deserialize<'de> for Isotropic {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let IsotropicTable { young, poisson, bulk, shear, lambda, mu, preset } =
            IsotropicTable::deserialize(deserializer)?;
        GivenConstants { young, poisson, bulk, shear, lambda, mu, preset }.isotropic()
    }
}

impl JsonSchema for Isotropic {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Isotropic".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = IsotropicTable::json_schema(generator);
        schema.insert("description".into(), ISOTROPIC.into());
        schema
    }
}

const ISOTROPIC: &str = "Isotropic elasticity. Every model that takes these reduces to linear elasticity \
                         with the same `young` and `poisson` for small strains. Both are needed, or `bulk` \
                         and `shear`, or `lambda` and `mu`, or a `preset`.";

impl Isotropic {
    /// Creates constants from Young's modulus `young` [Pa] and Poisson's ratio `poisson`.
    pub const fn new(young: f64, poisson: f64) -> Isotropic {
        Isotropic { young, poisson, preset: None }
    }

    /// Returns the equivalent Lame parameters.
    pub fn lame(&self) -> Lame {
        Lame::new(self.young, self.poisson)
    }
}

impl Parameters for Isotropic {
    fn check(&self) -> Result<(), ParameterError> {
        check_positive("young", self.young)?;
        check_poisson(self.poisson)
    }

    fn lame(&self) -> Option<Lame> {
        Some(self.lame())
    }

    fn preset(&self) -> Option<Preset> {
        self.preset
    }

    fn example() -> Self {
        Isotropic::new(1e6, 0.3)
    }
}

/// One stiffness for everything.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stiffness {
    /// Stiffness k [Pa], positive.
    #[serde(with = "As::<Pressure>")]
    #[schemars(transform = KeyRange::POSITIVE.in_schema())]
    pub stiffness: f64,
}

impl Parameters for Stiffness {
    fn check(&self) -> Result<(), ParameterError> {
        check_positive("stiffness", self.stiffness)
    }

    fn lame(&self) -> Option<Lame> {
        None
    }

    fn example() -> Self {
        Stiffness { stiffness: 1e6 }
    }
}

pub(super) fn check_positive(field: &'static str, value: f64) -> Result<(), ParameterError> {
    if KeyRange::POSITIVE.contains(value) {
        return Ok(());
    }
    let problem = if value.is_finite() {
        "must be positive [Pa]; 1e5 is soft rubber, 2e11 steel"
    } else {
        "must be a finite number [Pa]"
    };
    Err(ParameterError::new(field, value, problem))
}

/// Checks the range of an isotropic solid's Poisson's ratio.
pub(super) fn check_poisson(poisson: f64) -> Result<(), ParameterError> {
    if KeyRange::POISSON.contains(poisson) {
        return Ok(());
    }
    let problem = if !poisson.is_finite() {
        "must be a finite number"
    } else if poisson == 0.5 {
        "makes the bulk modulus infinite; use at most 0.4999, or 0.45 for rubber"
    } else if poisson > 0.0 {
        "makes the bulk modulus negative; must be below 0.5, for example 0.45 for rubber"
    } else {
        "makes the shear modulus infinite or negative; must be above -1, and is 0 to 0.5 in ordinary \
         materials"
    };
    Err(ParameterError::new("poisson", poisson, problem))
}
