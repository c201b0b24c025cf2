//! Reads plain data from a TOML document, strictly, with the path of what is wrong.
//!
//! `toml` has a deserializer of its own. It takes lists for tables, ignores what follows the last entry of a
//! list of fixed length, stops at the first mistake, and reports in prose; here each of these is a
//! [`Problem`] with a path.

mod failure;
mod onward;
mod remedy;
mod variant;

use std::cell::RefCell;

use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, Error as _, IntoDeserializer, MapAccess, SeqAccess,
    Visitor,
};
use toml::Spanned;
use toml::de::{DeArray, DeInteger, DeTable, DeValue};

use self::failure::{ReadFailure, found};
use self::variant::VariantReader;
use super::error::{Problem, ProblemKind};
use super::key_path::{KeyPath, KeySegment};
use super::text;
use pliant::value::TextForm;

/// A document, read as far as it can be.
pub(super) struct ReadDocument<T> {
    /// The document without the values that cannot be read, if it is one without them.
    pub(super) value: Option<T>,
    /// Every unknown field and every value that cannot be read.
    pub(super) problems: Vec<Problem>,
    /// True if entries of a list are left out in `value`: those behind them have other numbers there.
    pub(super) renumbered: bool,
}

/// Reads `T` from a document.
pub(super) fn read<T: DeserializeOwned>(root: &DeTable<'_>) -> ReadDocument<T> {
    let (result, problems) = read_once(root);
    match result {
        Ok(value) => ReadDocument { value: Some(value), problems, renumbered: false },
        Err(first) => onward::read(root, first, problems),
    }
}

/// Mistakes that are told at a time: a text with more is hardly a scene.
const MOST: usize = 50;

/// Keys that no table has where they stand.
#[derive(Default)]
struct UnknownKeys {
    /// The first [`MOST`].
    told: Vec<Problem>,
    /// How many more there are.
    more: usize,
}

impl UnknownKeys {
    fn note(&mut self, problem: impl FnOnce() -> Problem) {
        match self.told.len() < MOST {
            true => self.told.push(problem()),
            false => self.more += 1,
        }
    }

    /// The problems, and one that counts the rest.
    fn into_problems(self) -> Vec<Problem> {
        let UnknownKeys { mut told, more: count } = self;
        if count > 0 {
            let message = format!("{count} more keys are unknown");
            told.push(Problem::new(ProblemKind::Omitted { count }, KeyPath::root(), message));
        }
        told
    }
}

/// `T` or the first value that cannot be read; every unknown field up to there.
fn read_once<T: DeserializeOwned>(root: &DeTable<'_>) -> (Result<T, Problem>, Vec<Problem>) {
    let unknown = RefCell::new(UnknownKeys::default());
    let trail = Trail { parent: None, step: TrailStep::Root };
    let result = T::deserialize(TableReader { table: root, trail: &trail, unknown: &unknown });
    (result.map_err(ReadFailure::into_problem), unknown.into_inner().into_problems())
}

/// The path so far, on the stack: a path on the heap for each of a million numbers would cost more than
/// reading them.
#[derive(Clone, Copy)]
struct Trail<'a> {
    parent: Option<&'a Trail<'a>>,
    step: TrailStep<'a>,
}

#[derive(Clone, Copy)]
enum TrailStep<'a> {
    Root,
    Key(&'a str),
    Index(usize),
}

impl Trail<'_> {
    fn path(&self) -> KeyPath {
        let mut segments = Vec::new();
        let mut next = Some(self);
        while let Some(trail) = next {
            match trail.step {
                TrailStep::Root => {}
                TrailStep::Key(key) => segments.push(KeySegment::Key(key.to_owned())),
                TrailStep::Index(index) => segments.push(KeySegment::Index(index)),
            }
            next = trail.parent;
        }
        segments.into_iter().rev().collect()
    }
}

/// One value of the document.
#[derive(Clone, Copy)]
struct Reader<'a> {
    value: &'a DeValue<'a>,
    trail: &'a Trail<'a>,
    unknown: &'a RefCell<UnknownKeys>,
}

impl<'a> Reader<'a> {
    fn table(self, table: &'a DeTable<'a>) -> TableReader<'a> {
        TableReader { table, trail: self.trail, unknown: self.unknown }
    }

    fn wrong_type(self, expected: &str) -> ReadFailure {
        let path = self.trail.path();
        let remedy = remedy::of(self.value, &path);
        let mut problem = Problem::wrong_type(path, found(self.value), expected.to_owned());
        problem.help.extend(remedy);
        ReadFailure::located(problem)
    }

    fn list<'de, V: Visitor<'de>>(self, array: &'a DeArray<'a>, visitor: V) -> Result<V::Value, ReadFailure> {
        let elements = ArrayReader { array, next: 0, trail: self.trail, unknown: self.unknown };
        visitor.visit_seq(elements).map_err(|failure| failure.at(self.trail))
    }

    fn integer<'de, V: Visitor<'de>>(
        self,
        integer: &DeInteger<'_>,
        visitor: V,
    ) -> Result<V::Value, ReadFailure> {
        let (digits, radix) = (integer.as_str(), integer.radix());
        if let Ok(value) = i64::from_str_radix(digits, radix) {
            visitor.visit_i64(value)
        } else if let Ok(value) = u64::from_str_radix(digits, radix) {
            visitor.visit_u64(value)
        } else {
            Err(ReadFailure::custom(format!("the whole number {integer} is too large")))
        }
    }
}

fn as_float(integer: &DeInteger<'_>) -> Option<f64> {
    match integer.radix() {
        // By way of the decimal text, so that numbers beyond 64 bits are numbers too.
        10 => integer.as_str().parse().ok(),
        radix => i64::from_str_radix(integer.as_str(), radix).ok().map(|value| value as f64),
    }
}

impl<'de> Deserializer<'de> for Reader<'_> {
    type Error = ReadFailure;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
        match self.value {
            DeValue::String(text) => visitor.visit_str(text),
            DeValue::Integer(integer) => self.integer(integer, visitor),
            DeValue::Float(float) => match float.as_str().parse::<f64>() {
                Ok(value) if value.is_infinite() && !float.as_str().contains("inf") => {
                    Err(ReadFailure::custom(format!("the number {float} is too large")))
                }
                Ok(value) => visitor.visit_f64(value),
                Err(_) => Err(ReadFailure::custom(format!("{float} is not a number"))),
            },
            DeValue::Boolean(value) => visitor.visit_bool(*value),
            // No field of a scene is a date; without a type of its own in serde, it passes as what it is not.
            DeValue::Datetime(_) => Err(ReadFailure::unexpected(found(self.value), &visitor)),
            DeValue::Array(array) => return self.list(array, visitor),
            DeValue::Table(table) => return self.table(table).deserialize_any(visitor),
        }
        .map_err(|failure| failure.at(self.trail))
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
        match self.value {
            DeValue::Integer(integer) => match as_float(integer) {
                Some(value) => {
                    visitor.visit_f64(value).map_err(|failure: ReadFailure| failure.at(self.trail))
                }
                None => self.deserialize_any(visitor),
            },
            DeValue::Float(_) => self.deserialize_any(visitor),
            _ => Err(self.wrong_type("a number")),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, ReadFailure> {
        let Some(form) = TextForm::named(name) else { return visitor.visit_newtype_struct(self) };
        match self.value {
            DeValue::Integer(_) | DeValue::Float(_) => self.deserialize_f64(visitor),
            DeValue::String(text) => match text::problem(form, &self.trail.path(), text) {
                Some(problem) => Err(ReadFailure::located(problem)),
                None => visitor.visit_str(text).map_err(|failure: ReadFailure| failure.at(self.trail)),
            },
            DeValue::Array(array) if form.may_be_list() => self.list(array, visitor),
            _ => Err(self.wrong_type(form.expected())),
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
        match self.value {
            DeValue::Array(array) => self.list(array, visitor),
            _ => Err(self.wrong_type("a list")),
        }
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, ReadFailure> {
        match self.value {
            DeValue::Array(array) if array.len() == length => self.list(array, visitor),
            _ => Err(self.wrong_type(&format!("a list of {length} entries"))),
        }
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadFailure> {
        match self.value {
            DeValue::Table(table) => self.table(table).deserialize_struct(name, fields, visitor),
            _ => {
                let names: Vec<String> = fields.iter().map(|field| format!("`{field}`")).collect();
                Err(self.wrong_type(&format!("a table with {}", names.join(", "))))
            }
        }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadFailure> {
        visitor.visit_enum(VariantReader { reader: self, variants })
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 char str string bytes byte_buf unit unit_struct
        tuple_struct map identifier ignored_any
    }
}

/// A table of the document, or its top.
#[derive(Clone, Copy)]
struct TableReader<'a> {
    table: &'a DeTable<'a>,
    trail: &'a Trail<'a>,
    unknown: &'a RefCell<UnknownKeys>,
}

impl<'a> TableReader<'a> {
    fn entries(self, known: Option<&'static [&'static str]>) -> EntryReader<'a, impl EntryIterator<'a>> {
        let entries = self
            .table
            .iter()
            .map(|(key, value)| (key.get_ref().as_ref(), value))
            .filter(move |(key, _)| known.is_none_or(|known| known.contains(key)));
        EntryReader { entries, value: None, trail: self.trail, unknown: self.unknown }
    }
}

impl<'de> Deserializer<'de> for TableReader<'_> {
    type Error = ReadFailure;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadFailure> {
        visitor.visit_map(self.entries(None)).map_err(|failure| failure.at(self.trail))
    }

    /// Notes unknown fields and reads on without them, so that all are reported together.
    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadFailure> {
        for key in self.table.keys().map(Spanned::get_ref) {
            if !fields.contains(&key.as_ref()) {
                let problem = || Problem::unknown_field(self.trail.path().key(key), key, fields);
                self.unknown.borrow_mut().note(problem);
            }
        }
        visitor.visit_map(self.entries(Some(fields))).map_err(|failure| failure.at(self.trail))
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}

trait EntryIterator<'a>: Iterator<Item = (&'a str, &'a Spanned<DeValue<'a>>)> {}
impl<'a, I: Iterator<Item = (&'a str, &'a Spanned<DeValue<'a>>)>> EntryIterator<'a> for I {}

struct EntryReader<'a, I> {
    entries: I,
    value: Option<(&'a str, &'a DeValue<'a>)>,
    trail: &'a Trail<'a>,
    unknown: &'a RefCell<UnknownKeys>,
}

impl<'de, 'a, I: EntryIterator<'a>> MapAccess<'de> for EntryReader<'a, I> {
    type Error = ReadFailure;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, ReadFailure> {
        let Some((key, value)) = self.entries.next() else { return Ok(None) };
        self.value = Some((key, value.get_ref()));
        seed.deserialize(key.into_deserializer()).map(Some)
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, ReadFailure> {
        let (key, value) = self.value.take().expect("serde asks for a value only after its key");
        let trail = Trail { parent: Some(self.trail), step: TrailStep::Key(key) };
        seed.deserialize(Reader { value, trail: &trail, unknown: self.unknown })
            .map_err(|failure| failure.at(&trail))
    }
}

struct ArrayReader<'a> {
    array: &'a DeArray<'a>,
    next: usize,
    trail: &'a Trail<'a>,
    unknown: &'a RefCell<UnknownKeys>,
}

impl<'de> SeqAccess<'de> for ArrayReader<'_> {
    type Error = ReadFailure;

    fn next_element_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, ReadFailure> {
        let Some(value) = self.array.get(self.next) else { return Ok(None) };
        let trail = Trail { parent: Some(self.trail), step: TrailStep::Index(self.next) };
        self.next += 1;
        seed.deserialize(Reader { value: value.get_ref(), trail: &trail, unknown: self.unknown })
            .map(Some)
            .map_err(|failure| failure.at(&trail))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.array.len() - self.next)
    }
}
