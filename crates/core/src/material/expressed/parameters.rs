//! Scene table of an energy density that is a formula.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Deserializer, Serialize};

use super::ExpressedEnergy;
use super::measures::{Compiled, FormulaSource, NAMES};
use crate::algebra::direction;
use crate::expression::{ExpressionError, signatures};
use crate::material::{Lame, ParameterError, Parameters};
use crate::value::{As, EnergyParameter};

/// Error in the formula or the parameters of an energy density.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EnergyMistake {
    /// The text is not a formula of the measures and parameters; places are in bytes of it.
    #[error(transparent)]
    Formula(#[from] ExpressionError),
    /// The formula mixes principal stretches and components.
    #[error(
        "has both {stretch} and {component}: principal stretches have no direction, components have; write \
         the isotropic part with I1, I2 and J"
    )]
    Mixed {
        /// A stretch in the formula.
        stretch: &'static str,
        /// A component in the formula.
        component: &'static str,
    },
    /// A parameter is invalid, or a value that follows from it in the reference configuration.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
}

/// Energy density given as a formula, with its parameters.
///
/// ```
/// use pliant::material::{EnergyExpression, Parameters};
/// let rubber = EnergyExpression::new(
///     "mu/2*(I1 - 3) - mu*log(J) + lambda/2*log(J)^2",
///     [("mu", 1e6), ("lambda", 2e6)],
///     &[],
/// );
/// assert_eq!(rubber.check(), Ok(()));
/// assert!((rubber.lame().unwrap().lambda - 2e6).abs() < 1.0);
/// ```
#[derive(Clone, Debug, Serialize)]
pub struct EnergyExpression {
    psi: String,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    parameters: BTreeMap<String, f64>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    fibres: Vec<Vec<f64>>,
    /// Parameter that the formula is differentiated by, if any.
    #[serde(skip)]
    by: Option<String>,
    #[serde(skip)]
    compiled: Result<Arc<Compiled>, EnergyMistake>,
    /// Small-strain Lame parameters, if the energy is isotropic.
    #[serde(skip)]
    lame: Option<Lame>,
}

/// Compares what was written, not the compiled programs.
impl PartialEq for EnergyExpression {
    fn eq(&self, other: &Self) -> bool {
        let written =
            |one: &Self| (one.psi.clone(), one.parameters.clone(), one.fibres.clone(), one.by.clone());
        written(self) == written(other)
    }
}

/// Table of a scene that [`EnergyExpression`] is read from.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct EnergyExpressionTable {
    /// The energy density [J/m^3]: a formula of the invariants `I1`, `I2`, `I3`, `J`, or of the principal
    /// stretches `l1`, `l2`, `l3`, or of components of the deformation gradient (`F12`), of C = F^T F
    /// (`C12`), of Green's strain (`E12`) and of `I4`, `I6` of `fibres`; and of `parameters`. In 2D in
    /// plane strain: `F33 = 1`.
    psi: String,
    /// Numbers of the formula by their names.
    #[serde(default, with = "As::<BTreeMap<String, EnergyParameter>>")]
    parameters: BTreeMap<String, f64>,
    /// Directions of fibres at rest, at most two, of any length: `I4` and `I6` are the squares of their
    /// stretches.
    #[serde(default)]
    #[schemars(length(max = 2))]
    fibres: Vec<Vec<f64>>,
}

impl<'de> Deserialize<'de> for EnergyExpression {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let EnergyExpressionTable { psi, parameters, fibres } =
            EnergyExpressionTable::deserialize(deserializer)?;
        Ok(EnergyExpression::of(psi, parameters, fibres))
    }
}

impl JsonSchema for EnergyExpression {
    fn schema_name() -> Cow<'static, str> {
        "EnergyExpression".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = EnergyExpressionTable::json_schema(generator);
        schema.insert("description".into(), "An energy density as a formula, with its numbers.".into());
        schema
    }
}

impl EnergyExpression {
    /// Creates the energy density from the formula `psi` [J/m^3] of measures and `parameters`, in SI
    /// units, with the fibre directions `fibres`. [`Parameters::check`] reports errors in them.
    pub fn new<'a>(
        psi: &str,
        parameters: impl IntoIterator<Item = (&'a str, f64)>,
        fibres: &[Vec<f64>],
    ) -> EnergyExpression {
        let parameters = parameters.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        EnergyExpression::of(psi.to_owned(), parameters, fibres.to_vec())
    }

    fn of(psi: String, parameters: BTreeMap<String, f64>, fibres: Vec<Vec<f64>>) -> EnergyExpression {
        let compiled = compile(&psi, &parameters, &fibres, None);
        let lame = compiled.as_ref().ok().and_then(|compiled| ExpressedEnergy::of(compiled).lame_at_rest());
        EnergyExpression { psi, parameters, fibres, by: None, compiled, lame }
    }

    /// Returns the derivative of the energy density with respect to a parameter, as an energy density
    /// with the same domain; `None` if there is no parameter of that name.
    pub fn derivative(&self, parameter: &str) -> Option<EnergyExpression> {
        let mut compiled = compile(&self.psi, &self.parameters, &self.fibres, Some(parameter)).ok()?;
        Arc::make_mut(&mut compiled).domain = self.compiled.as_ref().ok()?.domain;
        self.parameters.contains_key(parameter).then(|| EnergyExpression {
            by: Some(parameter.to_owned()),
            compiled: Ok(compiled),
            lame: None,
            ..self.clone()
        })
    }

    /// Returns the formula as it was written.
    pub fn text(&self) -> &str {
        &self.psi
    }

    /// Returns the parameters of the formula, in SI units.
    pub fn parameters(&self) -> &BTreeMap<String, f64> {
        &self.parameters
    }

    pub(super) fn compiled(&self) -> Result<Arc<Compiled>, EnergyMistake> {
        self.compiled.clone()
    }

    /// True if the formula contains invariants or principal stretches only.
    pub fn is_isotropic(&self) -> bool {
        self.compiled.as_ref().is_ok_and(|compiled| compiled.is_isotropic())
    }

    /// Checks the energy in the reference configuration, in two or three dimensions. Energy and stress
    /// must vanish, and the body must resist every plane wave (strong ellipticity). An isotropic energy
    /// must also resist every change of volume.
    ///
    /// # Errors
    /// The error in the text or in a parameter, or the value that violates a condition.
    pub fn check_at_rest(&self, dimension: usize) -> Result<(), EnergyMistake> {
        let material = ExpressedEnergy::of(&self.compiled()?);
        match dimension {
            2 => material.check_at_rest::<2>(),
            _ => material.check_at_rest::<3>(),
        }
    }
}

/// True if `name` has letters, digits and `_` only and does not begin with a digit.
fn is_name(name: &str) -> bool {
    let allowed = |c: char| c.is_alphanumeric() || c == '_';
    name.chars().all(allowed) && name.chars().next().is_some_and(|c| !c.is_ascii_digit())
}

fn compile(
    psi: &str,
    parameters: &BTreeMap<String, f64>,
    fibres: &[Vec<f64>],
    by: Option<&str>,
) -> Result<Arc<Compiled>, EnergyMistake> {
    let wrong = |field, value, problem: String| Err(ParameterError::new(field, value, problem).into());
    let is_function = |name: &str| signatures().any(|call| call.split('(').next() == Some(name));
    // Names must be free, values finite.
    for (name, value) in parameters {
        if !is_name(name) {
            let problem = format!("{name:?} cannot be a name in a formula: use letters, digits and `_`");
            return wrong("parameters", *value, problem);
        }
        if NAMES.contains(&name.as_str()) || name == "pi" || is_function(name) {
            let problem = format!("`{name}` has a meaning of its own in a formula: choose another name");
            return wrong("parameters", *value, problem);
        }
        if !value.is_finite() {
            return wrong("parameters", *value, format!("`{name}` must be a finite number"));
        }
    }
    // At most two fibre directions, which are normalised.
    if fibres.len() > 2 {
        let problem = "is the number of directions, and there may be two: I4 and I6 are of these";
        return wrong("fibres", fibres.len() as f64, problem.to_owned());
    }
    let mut units = Vec::new();
    for (index, fibre) in fibres.iter().enumerate() {
        if !(2..=3).contains(&fibre.len()) {
            let problem = "is the number of components: a direction has two or three".to_owned();
            return Err(ParameterError::new("fibres", fibre.len() as f64, problem).at(index).into());
        }
        let Some(unit) = direction(fibre) else {
            let length = fibre.iter().map(|x| x.abs()).sum();
            let problem = "is the length of the direction, which must be finite and not zero".to_owned();
            return Err(ParameterError::new("fibres", length, problem).at(index).into());
        };
        units.push(unit);
    }
    let names: Vec<&str> = parameters.keys().map(String::as_str).collect();
    let values: Vec<f64> = parameters.values().copied().collect();
    let by = by.and_then(|by| names.iter().position(|name| *name == by));
    let mut compiled =
        Compiled::new(&FormulaSource { psi, names: &names, values: &values, fibres: &units, by })?;
    compiled.find_domain();
    Ok(Arc::new(compiled))
}

impl Parameters for EnergyExpression {
    /// Checks an isotropic energy in 3D. Others may suit 2D only:
    /// [`check_at_rest`](EnergyExpression::check_at_rest) checks them in the dimension of the scene.
    fn check(&self) -> Result<(), ParameterError> {
        let mistake = match self.compiled() {
            Ok(compiled) if !compiled.is_isotropic() => return Ok(()),
            Ok(_) => match self.check_at_rest(3) {
                Ok(()) => return Ok(()),
                Err(mistake) => mistake,
            },
            Err(mistake) => mistake,
        };
        match mistake {
            EnergyMistake::Parameter(error) => Err(error),
            EnergyMistake::Formula(error) => {
                let place = error.place().start;
                Err(ParameterError::new(
                    "psi",
                    f64::NAN,
                    format!("is not a valid energy: {error} (at byte {place})"),
                ))
            }
            mixed @ EnergyMistake::Mixed { .. } => {
                Err(ParameterError::new("psi", f64::NAN, mixed.to_string()))
            }
        }
    }

    fn lame(&self) -> Option<Lame> {
        self.lame
    }

    fn is_isotropic(&self) -> bool {
        self.is_isotropic()
    }

    fn has_axes(&self) -> bool {
        self.compiled.as_ref().is_ok_and(|compiled| !compiled.is_isotropic() && !compiled.has_gradient)
    }

    /// Returns the energy of [`StableNeoHookean`](super::super::StableNeoHookean).
    fn example() -> Self {
        let Lame { lambda, mu } = Lame::new(1e6, 0.3);
        let psi = "mu/2*(I1 - 3) - mu*(J - 1) + (lambda + mu)/2*(J - 1)^2";
        EnergyExpression::new(psi, [("mu", mu), ("lambda", lambda)], &[])
    }
}
