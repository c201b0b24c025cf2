//! Damping of a body.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use pliant::dissipation::{DashpotFormula, DashpotFormulaError};
use pliant::value::*;

/// Damping: at least one kind; those given add up. None but `mass_proportional` slows rigid motion.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DampingSpec {
    /// Viscosity of the finite elements (Kelvin-Voigt): a stress in proportion to the rate of Green's strain.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strain_rate: Option<StrainRateSpec>,
    /// Dashpot beside every spring [N s/m]: the force along the spring per rate of its length.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Dashpot>>")]
    #[schemars(range(min = 0.0))]
    pub dashpot: Option<f64>,
    /// Dashpot beside every spring by a formula.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expression: Option<DashpotExpressionSpec>,
    /// Time constant `beta` [s] of Rayleigh's `C = beta K` for small strains: elements get the viscosities
    /// `beta mu` and `beta lambda`, springs the dashpot `beta k`, hinges and joints `beta` times their
    /// stiffness. A mode of angular frequency `omega` has the damping ratio `beta omega / 2`: fast motion
    /// dies first.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Duration>>")]
    #[schemars(range(min = 0.0))]
    pub stiffness_proportional: Option<f64>,
    /// Rate `alpha` [1/s] of Rayleigh's `C = alpha M`: a mode of angular frequency `omega` has the damping
    /// ratio `alpha / (2 omega)`, and rigid motion slows down as `exp(-alpha t)`.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Rate>>")]
    #[schemars(range(min = 0.0))]
    pub mass_proportional: Option<f64>,
}

/// Dissipation function of every spring as a formula: its derivative by the rate of the length is the force
/// that resists along the spring. The power taken away is the force times the rate, twice the function where
/// that is a square.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[serde(rename = "DashpotExpression")]
pub struct DashpotExpressionSpec {
    /// The dissipation function [W]: a formula of the `rate` of the length [m/s], of the length `l`, the rest
    /// length `l0` [m] and of `parameters`, `"c/2*rate^2 + d/4*rate^4"`. Without a rate it is zero, and so is
    /// the force.
    pub dissipation: String,
    /// Numbers of the formula by their names.
    #[serde(
        default,
        skip_serializing_if = "BTreeMap::is_empty",
        with = "As::<BTreeMap<String, DashpotParameter>>"
    )]
    pub parameters: BTreeMap<String, f64>,
}

impl DashpotExpressionSpec {
    /// The dissipation function.
    ///
    /// # Errors
    /// [`DashpotFormulaError`]: the text is no formula of what there is.
    pub fn formula(&self) -> Result<DashpotFormula, DashpotFormulaError> {
        let parameters: Vec<(&str, f64)> =
            self.parameters.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        DashpotFormula::new(&self.dissipation, &parameters)
    }
}

/// Viscous stress `S = 2 shear Edot + second tr(Edot) I` (second Piola-Kirchhoff), `Edot` the rate of
/// Green's strain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StrainRateSpec {
    /// Shear viscosity [Pa s].
    #[serde(with = "As::<ViscosityUnit>")]
    #[schemars(range(min = 0.0))]
    pub shear: f64,
    /// Second viscosity [Pa s], of changes of volume; 0 without it.
    #[serde(default, with = "As::<ViscosityUnit>")]
    #[schemars(range(min = 0.0))]
    pub second: f64,
}
