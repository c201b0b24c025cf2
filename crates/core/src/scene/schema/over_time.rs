//! A number that may change with time.

use std::fmt;
use std::marker::PhantomData;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserializer, Error, Visitor};
use serde::ser::{Serialize, Serializer};

use super::measured::{Measured, ReadAs};
use crate::expression::{Expression, Variable};
use crate::quantity::{Kind, is_quantity};
use crate::scene::text;

/// A number in SI units, or a formula of the time `t` [s] that gives one.
#[derive(Clone, Debug, PartialEq)]
pub enum OverTime {
    /// The same at all times.
    Constant(f64),
    /// What it is at the time `t`.
    Formula(Expression),
}

impl OverTime {
    /// What a text says, a quantity of `kind` or a formula.
    ///
    /// # Errors
    /// What is wrong with it, in one line.
    pub(in crate::scene) fn parse(kinds: &[Kind], text: &str) -> Result<OverTime, text::TextError> {
        if is_quantity(text) {
            Ok(OverTime::Constant(Kind::parse_any(kinds, text)?.value))
        } else {
            Ok(OverTime::Formula(Expression::parse(text, Variable::TIME)?))
        }
    }

    /// The value at the time `t` [s].
    pub fn at(&self, t: f64) -> f64 {
        match self {
            OverTime::Constant(value) => *value,
            OverTime::Formula(formula) => formula.value([0.0; 3], t),
        }
    }

    /// The value, if it is the same at all times.
    pub fn constant(&self) -> Option<f64> {
        match self {
            OverTime::Constant(value) => Some(*value),
            OverTime::Formula(_) => None,
        }
    }

    /// Whether it is the number zero.
    pub fn is_zero(&self) -> bool {
        self.constant() == Some(0.0)
    }
}

/// As it was written: a number, or the text of the formula.
impl Serialize for OverTime {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            OverTime::Constant(value) => serializer.serialize_f64(*value),
            OverTime::Formula(formula) => serializer.serialize_str(formula.text()),
        }
    }
}

/// Reads an [`OverTime`] of this kind.
pub(crate) struct OverTimeOf<M>(PhantomData<M>);

impl<M: Measured> JsonSchema for OverTimeOf<M> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        "OverTime".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        text::over_time_schema(M::KINDS)
    }
}

impl<M: Measured> ReadAs<OverTime> for OverTimeOf<M> {
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<OverTime, D::Error> {
        deserializer.deserialize_newtype_struct(M::OVER_TIME, OverTimeVisitor::<M>(PhantomData))
    }
}

struct OverTimeVisitor<M>(PhantomData<M>);

impl<'de, M: Measured> Visitor<'de> for OverTimeVisitor<M> {
    type Value = OverTime;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(text::A_NUMBER)
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
        OverTime::parse(M::KINDS, text).map_err(E::custom)
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<OverTime, D::Error> {
        deserializer.deserialize_any(self)
    }
}
