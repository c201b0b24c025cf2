//! Numbers with a dimension: in a scene a number in SI units or a text with a unit, in code an `f64`.
//!
//! A field declares its dimension by `#[serde(with = "As::<Length>")]`, or by `As::<Option<Vec<Length>>>`
//! for more than one number. [`As`] deserialises by the named type, serialises the field's own type, and
//! has the JSON schema of the named type.

use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};
use serde::ser::{Serialize, Serializer};

use super::OneOrMany;
use super::form::{self, TextForm};
use crate::expression::Variable;
use crate::quantity::{Kind, Quantity};

/// Reads a field as `A`, for `#[serde(with = ...)]`.
pub struct As<A>(PhantomData<A>);

/// A type that reads values of type `T`.
pub trait ReadAs<T>: Sized {
    /// Reads a value of type `T`.
    ///
    /// # Errors
    /// Errors of the deserializer, a value of another type, a text that is not a quantity of the kind.
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error>;
}

impl<A> As<A> {
    /// Calls [`ReadAs::read`], under the name that serde expects.
    ///
    /// # Errors
    /// Errors of [`ReadAs::read`].
    pub fn deserialize<'de, T, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error>
    where
        A: ReadAs<T>,
    {
        A::read(deserializer)
    }

    /// Writes numbers in SI units.
    pub fn serialize<T: Serialize, S: Serializer>(value: &T, serializer: S) -> Result<S::Ok, S::Error> {
        value.serialize(serializer)
    }
}

impl<A: JsonSchema> JsonSchema for As<A> {
    fn inline_schema() -> bool {
        A::inline_schema()
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        A::schema_name()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        A::json_schema(generator)
    }
}

/// Entry of a list or of an option.
struct Entry<A, T>(T, PhantomData<A>);

impl<'de, T, A: ReadAs<T>> Deserialize<'de> for Entry<A, T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Entry(A::read(deserializer)?, PhantomData))
    }
}

impl<T, A: ReadAs<T>> ReadAs<Option<T>> for Option<A> {
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<T>, D::Error> {
        Ok(Option::<Entry<A, T>>::deserialize(deserializer)?.map(|entry| entry.0))
    }
}

impl<T, A: ReadAs<T>> ReadAs<Vec<T>> for Vec<A> {
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<T>, D::Error> {
        Ok(Vec::<Entry<A, T>>::deserialize(deserializer)?.into_iter().map(|entry| entry.0).collect())
    }
}

impl<T, A: ReadAs<T>> ReadAs<BTreeMap<String, T>> for BTreeMap<String, A> {
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<BTreeMap<String, T>, D::Error> {
        let entries = BTreeMap::<String, Entry<A, T>>::deserialize(deserializer)?;
        Ok(entries.into_iter().map(|(name, entry)| (name, entry.0)).collect())
    }
}

impl<T, A: ReadAs<T>> ReadAs<[T; 2]> for [A; 2] {
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[T; 2], D::Error> {
        Ok(<[Entry<A, T>; 2]>::deserialize(deserializer)?.map(|entry| entry.0))
    }
}

/// A number with a dimension.
pub trait Measured {
    /// Accepted kinds: one, unless the kind depends on the body.
    const KINDS: &'static [Kind];
    /// Name by which the scene's reader recognises a single number.
    const ONE: &'static str;
    /// Name by which the scene's reader recognises a number or a list of numbers.
    const ONE_OR_MANY: &'static str;
    /// Name by which the scene's reader recognises a number that may be a formula of time.
    const OVER_TIME: &'static str;
    /// Name by which the scene's reader recognises a number that may be a formula of time and reference
    /// position.
    const OVER_PLACE: &'static str;
}

macro_rules! measured {
    ($($(#[$doc:meta])* $name:ident: $($kind:ident)|+;)+) => {
        $(
            #[doc = concat!("Key whose value is read as: ", stringify!($($kind),+), ".")]
            $(#[$doc])*
            pub struct $name;

            impl Measured for $name {
                const KINDS: &'static [Kind] = &[$(Kind::$kind),+];
                const ONE: &'static str = concat!("pliant::quantity ", stringify!($name));
                const ONE_OR_MANY: &'static str = concat!("pliant::quantities ", stringify!($name));
                const OVER_TIME: &'static str = concat!("pliant::over_time ", stringify!($name));
                const OVER_PLACE: &'static str = concat!("pliant::over_place ", stringify!($name));
            }

            impl JsonSchema for $name {
                fn inline_schema() -> bool {
                    true
                }

                fn schema_name() -> std::borrow::Cow<'static, str> {
                    stringify!($name).into()
                }

                fn json_schema(_: &mut SchemaGenerator) -> Schema {
                    form::quantity_schema(Self::KINDS)
                }
            }
        )+

        /// Form of the text behind a name that [`Measured`] gives to the scene's reader.
        pub(super) fn text_form(name: &str) -> Option<TextForm> {
            match name {
                $(
                    $name::ONE => Some(TextForm::Quantity($name::KINDS)),
                    $name::ONE_OR_MANY => Some(TextForm::Quantities($name::KINDS)),
                    $name::OVER_TIME => Some(TextForm::Formula($name::KINDS, Variable::TIME)),
                    $name::OVER_PLACE => Some(TextForm::Formula($name::KINDS, Variable::AT_REST)),
                )+
                _ => None,
            }
        }
    };
}

measured! {
    Length: LENGTH;
    Mass: MASS;
    Duration: TIME;
    Angle: ANGLE;
    Velocity: VELOCITY;
    AngularVelocity: ANGULAR_VELOCITY;
    Acceleration: ACCELERATION;
    Rate: RATE;
    Pressure: PRESSURE;
    Compressibility: COMPRESSIBILITY;
    Stiffness: STIFFNESS;
    ViscosityUnit: VISCOSITY;
    Dashpot: DASHPOT;
    Force: FORCE;
    ForceDensity: FORCE_DENSITY;
    GravitationalConstant: GRAVITATIONAL_CONSTANT;
    Number: NUMBER;
    /// The dimension of the body decides among the three.
    Density: DENSITY | AREA_DENSITY | LINEAR_DENSITY;
    /// Accepts the parameters of an energy density formula.
    EnergyParameter: PRESSURE | COMPRESSIBILITY | ANGLE | NUMBER;
    /// Accepts the parameters of a spring energy formula.
    SpringParameter: STIFFNESS | FORCE | LENGTH | ENERGY | PRESSURE | NUMBER;
    /// Accepts the parameters of a spring dissipation formula.
    DashpotParameter: DASHPOT | FORCE | LENGTH | VELOCITY | NUMBER;
    /// The dimension of the body decides among the two.
    BendingStiffness: PLATE_STIFFNESS | BEAM_STIFFNESS;
}

impl<M: Measured> ReadAs<f64> for M {
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        let visitor = MeasuredVisitor::<M>(PhantomData);
        Ok(deserializer.deserialize_newtype_struct(M::ONE, visitor)?.value)
    }
}

impl<M: Measured> ReadAs<Quantity> for M {
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Quantity, D::Error> {
        deserializer.deserialize_newtype_struct(M::ONE, MeasuredVisitor::<M>(PhantomData))
    }
}

struct MeasuredVisitor<M>(PhantomData<M>);

impl<'de, M: Measured> Visitor<'de> for MeasuredVisitor<M> {
    type Value = Quantity;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(form::A_NUMBER)
    }

    fn visit_f64<E>(self, value: f64) -> Result<Quantity, E> {
        Ok(Quantity { value, dimension: None })
    }

    fn visit_i64<E>(self, value: i64) -> Result<Quantity, E> {
        Ok(Quantity { value: value as f64, dimension: None })
    }

    fn visit_u64<E>(self, value: u64) -> Result<Quantity, E> {
        Ok(Quantity { value: value as f64, dimension: None })
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Quantity, E> {
        Kind::parse_any(M::KINDS, text).map_err(E::custom)
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<Quantity, D::Error> {
        deserializer.deserialize_any(self)
    }
}

/// Reads one number for all, or a list with one for each.
pub struct OneOrManyOf<A>(PhantomData<A>);

impl<A: JsonSchema> JsonSchema for OneOrManyOf<A> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("OneOrMany{}", A::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let one = generator.subschema_for::<A>();
        let many = generator.subschema_for::<Vec<A>>();
        json_schema!({ "anyOf": [one, many] })
    }
}

impl<M: Measured> ReadAs<OneOrMany> for OneOrManyOf<M> {
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<OneOrMany, D::Error> {
        deserializer.deserialize_newtype_struct(M::ONE_OR_MANY, OneOrManyVisitor::<M>(PhantomData))
    }
}

struct OneOrManyVisitor<M>(PhantomData<M>);

impl<'de, M: Measured> Visitor<'de> for OneOrManyVisitor<M> {
    type Value = OneOrMany;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(form::NUMBERS)
    }

    fn visit_f64<E>(self, value: f64) -> Result<OneOrMany, E> {
        Ok(OneOrMany::One(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<OneOrMany, E> {
        Ok(OneOrMany::One(value as f64))
    }

    fn visit_u64<E>(self, value: u64) -> Result<OneOrMany, E> {
        Ok(OneOrMany::One(value as f64))
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<OneOrMany, E> {
        MeasuredVisitor::<M>(PhantomData).visit_str(text).map(|quantity| OneOrMany::One(quantity.value))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<OneOrMany, A::Error> {
        let mut values = Vec::new();
        while let Some(Entry(value, _)) = elements.next_element::<Entry<M, f64>>()? {
            values.push(value);
        }
        Ok(OneOrMany::Many(values))
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<OneOrMany, D::Error> {
        deserializer.deserialize_any(self)
    }
}

/// Writes a number in SI units, or with its unit if one was given.
impl Serialize for Quantity {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.dimension {
            None => serializer.serialize_f64(self.value),
            Some(dimension) => serializer.collect_str(&format_args!("{:?} {dimension}", self.value)),
        }
    }
}
