//! A number that may depend on time, or on position as well.

use std::fmt;
use std::marker::PhantomData;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserializer, Error, Visitor};
use serde::ser::{Serialize, Serializer};

use super::form;
use super::measured::{Measured, ReadAs};
use crate::expression::{Expression, Variable};
use crate::quantity::{Kind, is_quantity};

/// A number in SI units, or a formula of the time `t` [s]; if the key allows it, also of the reference
/// position `X`, `Y`, `Z` [m].
#[derive(Clone, Debug, PartialEq)]
pub enum OverTime {
    /// A value constant in time.
    Constant(f64),
    /// A formula of time, or of time and position.
    Formula(Expression),
}

impl OverTime {
    /// Parses a text: a quantity of one of `kinds`, or a formula of `variables`.
    ///
    /// # Errors
    /// The mistake in the text, in one line.
    pub fn parse(kinds: &[Kind], variables: &[Variable], text: &str) -> Result<OverTime, form::TextError> {
        if is_quantity(text) {
            Ok(OverTime::Constant(Kind::parse_any(kinds, text)?.value))
        } else {
            Ok(OverTime::Formula(Expression::parse(text, variables)?))
        }
    }

    /// The value at the time `t` [s].
    pub fn at(&self, t: f64) -> f64 {
        self.value([0.0; 3], t)
    }

    /// Value at the reference position `x` [m] and the time `t` [s].
    pub fn value(&self, x: [f64; 3], t: f64) -> f64 {
        match self {
            OverTime::Constant(value) => *value,
            OverTime::Formula(formula) => formula.value(x, t),
        }
    }

    /// Derivative with respect to time, at this position and time.
    pub fn rate(&self, x: [f64; 3], t: f64) -> f64 {
        match self {
            OverTime::Constant(_) => 0.0,
            OverTime::Formula(formula) => formula.rate(x, t),
        }
    }

    /// Derivative with respect to the coordinates of `x`, at this position and time.
    pub fn slope(&self, x: [f64; 3], t: f64) -> [f64; 3] {
        match self {
            OverTime::Constant(_) => [0.0; 3],
            OverTime::Formula(formula) => formula.slope(x, t),
        }
    }

    /// Names and values of the formula's parameters.
    pub fn parameters(&self) -> impl Iterator<Item = (&str, f64)> {
        let formula = match self {
            OverTime::Constant(_) => None,
            OverTime::Formula(formula) => Some(formula),
        };
        formula.into_iter().flat_map(Expression::parameters)
    }

    /// Derivative with respect to a parameter of the formula, at this position and time; zero for an
    /// unknown name.
    pub fn derivative(&self, name: &str, x: [f64; 3], t: f64) -> f64 {
        match self {
            OverTime::Constant(_) => 0.0,
            OverTime::Formula(formula) => formula.derivative(name, x, t),
        }
    }

    /// Derivative of the [rate](Self::rate) with respect to a parameter of the formula; zero for an
    /// unknown name.
    pub fn rate_derivative(&self, name: &str, x: [f64; 3], t: f64) -> f64 {
        match self {
            OverTime::Constant(_) => 0.0,
            OverTime::Formula(formula) => formula.rate_derivative(name, x, t),
        }
    }

    /// Derivatives of the [rate](Self::rate) with respect to the coordinates of `x`.
    pub fn rate_slope(&self, x: [f64; 3], t: f64) -> [f64; 3] {
        match self {
            OverTime::Constant(_) => [0.0; 3],
            OverTime::Formula(formula) => formula.rate_slope(x, t),
        }
    }

    /// True if the value depends on position.
    pub fn depends_on_place(&self) -> bool {
        matches!(self, OverTime::Formula(formula) if formula.depends_on_place())
    }

    /// True if the value depends on time.
    pub fn depends_on_time(&self) -> bool {
        matches!(self, OverTime::Formula(formula) if formula.depends_on_time())
    }

    /// True if the value has no jumps, see [`Expression::is_continuous`].
    pub fn is_continuous(&self) -> bool {
        match self {
            OverTime::Constant(_) => true,
            OverTime::Formula(formula) => formula.is_continuous(),
        }
    }

    /// Times in `from < t < to` [s] at which the value changes its branch, see
    /// [`Expression::branch_times`].
    pub fn branch_times(&self, from: f64, to: f64) -> Vec<f64> {
        match self {
            OverTime::Constant(_) => vec![],
            OverTime::Formula(formula) => formula.branch_times(from, to),
        }
    }

    /// The number; `None` for a formula.
    pub fn constant(&self) -> Option<f64> {
        match self {
            OverTime::Constant(value) => Some(*value),
            OverTime::Formula(_) => None,
        }
    }

    /// True for the number zero.
    pub fn is_zero(&self) -> bool {
        self.constant() == Some(0.0)
    }
}

/// Writes the number, or the text of the formula.
impl Serialize for OverTime {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            OverTime::Constant(value) => serializer.serialize_f64(*value),
            OverTime::Formula(formula) => serializer.serialize_str(formula.text()),
        }
    }
}

/// Reads an [`OverTime`] of this kind: a number or a formula of time.
pub struct OverTimeOf<M>(PhantomData<M>);

/// Reads an [`OverTime`] of this kind: a number or a formula of time and reference position.
pub struct OverPlaceOf<M>(PhantomData<M>);

macro_rules! reads {
    ($($reader:ident: $name:ident $variables:ident;)+) => {
        $(
            impl<M: Measured> JsonSchema for $reader<M> {
                fn inline_schema() -> bool {
                    true
                }

                fn schema_name() -> std::borrow::Cow<'static, str> {
                    stringify!($reader).into()
                }

                fn json_schema(_: &mut SchemaGenerator) -> Schema {
                    form::formula_schema(M::KINDS, Variable::$variables)
                }
            }

            impl<M: Measured> ReadAs<OverTime> for $reader<M> {
                fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<OverTime, D::Error> {
                    let visitor = FormulaVisitor { kinds: M::KINDS, variables: Variable::$variables };
                    deserializer.deserialize_newtype_struct(M::$name, visitor)
                }
            }
        )+
    };
}

reads! {
    OverTimeOf: OVER_TIME TIME;
    OverPlaceOf: OVER_PLACE AT_REST;
}

struct FormulaVisitor {
    kinds: &'static [Kind],
    variables: &'static [Variable],
}

impl<'de> Visitor<'de> for FormulaVisitor {
    type Value = OverTime;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(form::A_NUMBER)
    }

    fn visit_f64<E>(self, value: f64) -> Result<OverTime, E> {
        Ok(OverTime::Constant(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<OverTime, E> {
        Ok(OverTime::Constant(value as f64))
    }

    fn visit_u64<E>(self, value: u64) -> Result<OverTime, E> {
        Ok(OverTime::Constant(value as f64))
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<OverTime, E> {
        OverTime::parse(self.kinds, self.variables, text).map_err(E::custom)
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<OverTime, D::Error> {
        deserializer.deserialize_any(self)
    }
}
