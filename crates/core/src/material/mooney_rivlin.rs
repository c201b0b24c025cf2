use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

use super::barrier::{admissible, infinite_outside};
use super::constants::poisson_of;
use super::parameters::{check_poisson, check_positive};
use super::spectrum::{InvariantDerivatives, Spectrum, out_of_plane};
use super::{Domain, Lame, Material, MaterialDescription, Model, ParameterError, Parameters};
use crate::algebra::{Mat, Vect};
use crate::scalar::{Elementary, Scalar};
use crate::value::{As, Compressibility, KeyRange, Pressure};

/// Mooney-Rivlin elasticity of compressible rubber, in both isochoric invariants.
///
/// With `I1 = tr C`, `I2 = (I1^2 - tr C^2)/2` of `C = F^T F` (in 2D with `F_33 = 1`), `J = det F` and the
/// bulk modulus `kappa`:
///
/// ```text
/// psi = C10 (J^(-2/3) I1 - 3) + C01 (J^(-4/3) I2 - 3) + kappa/2 (J - 1)^2                 [J/m^3]
/// P   = 2 C10 J^(-2/3) F + C01 J^(-4/3) dI2/dF
///       + (kappa (J - 1) - (2 C10 J^(-2/3) I1 + 4 C01 J^(-4/3) I2) / (3 J)) cof F         [Pa]
/// ```
///
/// with `dI2/dF = 2 (I1 F - F F^T F)` in 3D and `2 (F + J cof F)` in 2D. For small strains
/// `mu = 2 (C10 + C01)`. The model is defined for `J > 0` only.
///
/// Source: Bonet and Wood, "Nonlinear continuum mechanics for finite element analysis", 2nd edition, 2008.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MooneyRivlin {
    c10: f64,
    c01: f64,
    bulk: f64,
}

/// Mooney-Rivlin constants, either absolute or scaled to a given Young's modulus.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TwoConstants {
    /// Young's modulus E [Pa], positive. If given, only the ratio of `c10` to `c01` matters: both are
    /// scaled so that `E = 4 (1 + nu) (c10 + c01)`. If absent, they are used unscaled.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub young: Option<f64>,
    /// Poisson's ratio nu for small strains, above -1 and below 0.5; it sets the bulk modulus.
    pub poisson: f64,
    /// Weight of the first invariant [Pa].
    pub c10: f64,
    /// Weight of the second invariant [Pa]; either weight may be zero, and their sum must be positive.
    pub c01: f64,
    /// Compressibility D1 = 2 / kappa [1/Pa] if the scene gave it instead of `poisson`, which was
    /// computed from it. Derivatives with respect to `c10` and `c01` then keep D1 fixed.
    #[serde(skip_serializing)]
    pub d1: Option<f64>,
}

/// Table of a scene that [`TwoConstants`] is read from.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct TwoConstantsTable {
    /// Young's modulus E [Pa], positive. With it only the ratio of `c10` to `c01` counts: both are scaled so
    /// that `E = 4 (1 + nu) (c10 + c01)`. Without it they are taken as they are.
    #[serde(default, with = "As::<Option<Pressure>>")]
    #[schemars(transform = KeyRange::POSITIVE.in_schema())]
    young: Option<f64>,
    /// Poisson's ratio nu for small strains, above -1 and below 0.5; it sets the bulk modulus.
    #[serde(default)]
    #[schemars(transform = KeyRange::POISSON.in_schema())]
    poisson: Option<f64>,
    /// Weight of the first invariant [Pa].
    #[serde(with = "As::<Pressure>")]
    c10: f64,
    /// Weight of the second invariant [Pa]; not both may be zero, and their sum must be positive.
    #[serde(with = "As::<Pressure>")]
    c01: f64,
    /// Compressibility D1 = 2 / kappa [1/Pa], positive, in place of `poisson`; without `young`.
    #[serde(default, with = "As::<Option<Compressibility>>")]
    #[schemars(transform = KeyRange::POSITIVE.in_schema())]
    d1: Option<f64>,
}

/// Reads `d1` as `nu = (3 kappa - 2 mu) / (2 (3 kappa + mu))` with `kappa = 2 / D1` and `mu = 2 (C10 + C01)`.
impl<'de> Deserialize<'de> for TwoConstants {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let TwoConstantsTable { young, poisson, c10, c01, d1 } =
            TwoConstantsTable::deserialize(deserializer)?;
        let poisson = match (poisson, d1, young) {
            (Some(poisson), None, _) => poisson,
            (None, Some(d1), None) => of_compressibility(c10, c01, d1).map_err(D::Error::custom)?,
            (None, None, _) => return Err(D::Error::missing_field("poisson")),
            (Some(_), Some(_), _) => {
                return Err(D::Error::custom(
                    "`poisson` and `d1` both set the bulk modulus: give one of them",
                ));
            }
            (None, Some(_), Some(_)) => {
                let problem = "`young` scales `c10` and `c01`, `d1` is for those that are taken as they \
                               are: give `poisson` with `young`";
                return Err(D::Error::custom(problem));
            }
        };
        Ok(TwoConstants { young, poisson, c10, c01, d1 })
    }
}

impl JsonSchema for TwoConstants {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "TwoConstants".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = TwoConstantsTable::json_schema(generator);
        let about =
            "The constants of Mooney and Rivlin, with or without a Young's modulus that they are scaled to.";
        schema.insert("description".into(), about.into());
        schema
    }
}

/// Returns Poisson's ratio from constants [Pa] and a compressibility `D1 = 2 / kappa` [1/Pa].
fn of_compressibility(c10: f64, c01: f64, d1: f64) -> Result<f64, ParameterError> {
    if !KeyRange::POSITIVE.contains(d1) {
        return Err(ParameterError::new("d1", d1, "must be positive [1/Pa]: 2 over the bulk modulus"));
    }
    check_sum(c10, c01)?;
    Ok(poisson_of(2.0 / d1, 2.0 * (c10 + c01)))
}

/// Checks that both constants are finite and the shear modulus is positive.
fn check_sum(c10: f64, c01: f64) -> Result<(), ParameterError> {
    for (field, value) in [("c10", c10), ("c01", c01)] {
        if !value.is_finite() {
            return Err(ParameterError::new(field, value, "must be a finite number [Pa]"));
        }
    }
    if c10 + c01 > 0.0 {
        return Ok(());
    }
    let problem = "makes the shear modulus 2 (c10 + c01) zero or negative; their sum must be positive";
    Err(ParameterError::new("c01", c01, problem))
}

impl TwoConstants {
    fn given_young(&self) -> f64 {
        4.0 * (1.0 + self.poisson) * (self.c10 + self.c01)
    }

    fn elasticity(&self) -> Lame {
        Lame::new(self.young.unwrap_or_else(|| self.given_young()), self.poisson)
    }
}

impl Parameters for TwoConstants {
    fn check(&self) -> Result<(), ParameterError> {
        if let Some(young) = self.young {
            check_positive("young", young)?;
        }
        check_poisson(self.poisson)?;
        check_sum(self.c10, self.c01)
    }

    fn lame(&self) -> Option<Lame> {
        Some(self.elasticity())
    }

    fn example() -> Self {
        TwoConstants { young: Some(1e6), poisson: 0.3, c10: 0.4, c01: 0.1, d1: None }
    }
}

impl Model for MooneyRivlin {
    type Parameters = TwoConstants;
    const ABOUT: MaterialDescription = MaterialDescription {
        summary: "Mooney-Rivlin: rubber at moderate stretches, forbids inversion.",
        formula: "C10 (J^(-2/3) I1 - 3) + C01 (J^(-4/3) I2 - 3) + kappa/2 (J - 1)^2, J = det F, mu = 2 (C10 \
                  + C01)",
        source: "Bonet and Wood 2008",
        domain: Domain::PositiveJ,
        frame_indifferent: true,
        has_rest_shape: true,
    };
    fn new(parameters: &TwoConstants) -> Self {
        let lame = parameters.elasticity();
        let scale = match parameters.young {
            Some(_) => 0.5 * lame.mu / (parameters.c10 + parameters.c01),
            None => 1.0,
        };
        MooneyRivlin { c10: scale * parameters.c10, c01: scale * parameters.c01, bulk: lame.bulk() }
    }
}

impl<const D: usize> Material<D> for MooneyRivlin {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        let three = S::splat(-3.0);
        let cofactor = f.cofactor();
        let j = f.determinant_with(&cofactor);
        let (i1, i2) = invariants(f, &cofactor, j);
        let c = j.powf(S::splat(-2.0 / 3.0));
        let volume = j - S::one();
        let volumetric = S::splat(0.5 * self.bulk) * volume * volume;
        let second = S::splat(self.c01).mul_add((c * c).mul_add(i2, three), volumetric);
        infinite_outside(j, i1, S::splat(self.c10).mul_add(c.mul_add(i1, three), second))
    }

    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        let cofactor = f.cofactor();
        let j = admissible(f.determinant_with(&cofactor));
        let (i1, i2) = invariants(f, &cofactor, j);
        let c = j.powf(S::splat(-2.0 / 3.0));
        let first = S::splat(2.0 * self.c10) * c;
        let second = S::splat(2.0 * self.c01) * c * c;
        let shape = first.mul_add(i1, (second + second) * i2) / (S::splat(3.0) * j);
        let pressure = S::splat(self.bulk).mul_add(j - S::one(), -shape);
        if D == 2 {
            return f.scale_add(first + second, &cofactor.scale(second.mul_add(j, pressure)));
        }
        let bent = f.mul(&f.transpose_mul(f));
        let stretched = f.scale_add(second.mul_add(i1, first), &cofactor.scale(pressure));
        bent.scale_add(-second, &stretched)
    }

    fn spectrum(&self, sigma: &Vect<f64, D>) -> Option<Spectrum<D>> {
        let diagonal = Mat::diagonal(sigma);
        let j: f64 = admissible(sigma.iter().product());
        let (i1, i2) = invariants(&diagonal, &diagonal.cofactor(), j);
        let c = Elementary::powf(j, -2.0 / 3.0);
        let (first, second) = (self.c10 * c, self.c01 * c * c);
        let derivatives = InvariantDerivatives {
            i1: first,
            i2: second,
            j: self.bulk * (j - 1.0) - (2.0 * first * i1 + 4.0 * second * i2) / (3.0 * j),
            i1_j: -2.0 * first / (3.0 * j),
            i2_j: -4.0 * second / (3.0 * j),
            j_j: self.bulk + (10.0 * first * i1 + 28.0 * second * i2) / (9.0 * j * j),
        };
        Some(Spectrum::from_three_invariants(sigma, &derivatives))
    }

    fn domain(&self) -> Domain {
        Self::ABOUT.domain
    }
}

/// Returns `I1 = |F|^2` and `I2 = |cof F|^2`, with `F_33 = 1` in 2D.
#[inline(always)]
fn invariants<S: Scalar, const D: usize>(f: &Mat<S, D>, cofactor: &Mat<S, D>, j: S) -> (S, S) {
    let square = f.norm_squared();
    let i1 = square + S::splat(out_of_plane::<D>());
    (i1, if D == 2 { j.mul_add(j, square) } else { cofactor.norm_squared() })
}
