//! Choices: `"symplectic-euler"`, or `{ corotated = { young = 1e5, poisson = 0.3 } }`.

use serde::de::{DeserializeSeed, Deserializer, EnumAccess, IntoDeserializer, VariantAccess, Visitor};
use toml::de::{DeTable, DeValue};

use super::failure::ReadFailure;
use super::{Reader, TableReader, Trail, TrailStep};
use crate::error::Problem;

/// A value that names one of several variants.
pub(super) struct VariantReader<'a> {
    pub(super) reader: Reader<'a>,
    pub(super) variants: &'static [&'static str],
}

/// Value after the name of the variant: nothing for a bare word.
pub(super) struct Content<'a> {
    reader: Reader<'a>,
    name: &'a str,
    value: Option<&'a DeValue<'a>>,
}

impl<'de, 'a> EnumAccess<'de> for VariantReader<'a> {
    type Error = ReadFailure;
    type Variant = Content<'a>;

    fn variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<(S::Value, Content<'a>), ReadFailure> {
        let reader = self.reader;
        let (name, value) = match reader.value {
            DeValue::String(name) => (name.as_ref(), None),
            DeValue::Table(table) if table.len() == 1 => {
                let (key, value) = table.iter().next().expect("its length is 1");
                (key.get_ref().as_ref(), Some(value.get_ref()))
            }
            DeValue::Table(table) => match self.only_choice(table) {
                Some((name, value)) => (name, Some(value)),
                None => return Err(self.not_one_choice()),
            },
            _ => return Err(self.not_one_choice()),
        };
        if !self.variants.contains(&name) {
            let path = reader.trail.path();
            let mut problem = Problem::unknown_variant(path, name, self.variants);
            if value.is_some() {
                problem.path = problem.path.key(name);
                problem = problem.at_key();
            }
            return Err(ReadFailure::located(problem));
        }
        let variant = seed.deserialize(name.into_deserializer())?;
        Ok((variant, Content { reader, name, value }))
    }
}

impl<'a> VariantReader<'a> {
    /// The only key of a table of several that is a choice; the others are noted, with where they belong.
    fn only_choice(&self, table: &'a DeTable<'a>) -> Option<(&'a str, &'a DeValue<'a>)> {
        let is_choice = |key: &str| self.variants.contains(&key);
        let mut choices = table.iter().filter(|(key, _)| is_choice(key.get_ref()));
        let (choice, value) = choices.next().filter(|_| choices.next().is_none())?;
        let choice = choice.get_ref().as_ref();
        let path = self.reader.trail.path();
        for key in table.keys().map(|key| key.get_ref().as_ref()).filter(|key| !is_choice(key)) {
            let problem = || Problem::beside_choice(&path, choice, key);
            self.reader.unknown.borrow_mut().note(problem);
        }
        Some((choice, value.get_ref()))
    }

    fn not_one_choice(&self) -> ReadFailure {
        let names: Vec<String> = self.variants.iter().map(|name| format!("`{name}`")).collect();
        let expected = format!("exactly one of {}", names.join(", "));
        match self.reader.value {
            DeValue::Table(table) if table.len() > 1 => {
                let found: Vec<String> = table.keys().map(|key| format!("`{}`", key.get_ref())).collect();
                let path = self.reader.trail.path();
                ReadFailure::located(Problem::wrong_type(path, found.join(" and "), expected))
            }
            _ => self.reader.wrong_type(&expected),
        }
    }
}

impl<'de> VariantAccess<'de> for Content<'_> {
    type Error = ReadFailure;

    fn unit_variant(self) -> Result<(), ReadFailure> {
        match self.value {
            None => Ok(()),
            Some(DeValue::Table(table)) if table.is_empty() => Ok(()),
            Some(value) => {
                let trail = Trail { parent: Some(self.reader.trail), step: TrailStep::Key(self.name) };
                let failure = Reader { value, trail: &trail, ..self.reader }.wrong_type("no parameters");
                Err(failure.with_help(format!("write \"{}\"", self.name)))
            }
        }
    }

    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, ReadFailure> {
        let trail = Trail { parent: Some(self.reader.trail), step: TrailStep::Key(self.name) };
        let reader = self.reader;
        match self.value {
            Some(value) => seed
                .deserialize(Reader { value, trail: &trail, ..reader })
                .map_err(|failure| failure.at(&trail)),
            // A bare word stands for a table without parameters: enough where all have defaults, and where
            // they have not, the message names the first that is missing.
            None => seed
                .deserialize(Reader { value: &DeValue::Table(DeTable::new()), trail: &trail, ..reader })
                .map_err(|failure| failure.at(&trail).of_bare_word(self.name, &trail)),
        }
    }

    fn tuple_variant<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, ReadFailure> {
        let trail = Trail { parent: Some(self.reader.trail), step: TrailStep::Key(self.name) };
        let value = self.value.unwrap_or(self.reader.value);
        Reader { value, trail: &trail, ..self.reader }.deserialize_tuple(length, visitor)
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadFailure> {
        let trail = Trail { parent: Some(self.reader.trail), step: TrailStep::Key(self.name) };
        match self.value {
            Some(value) => {
                Reader { value, trail: &trail, ..self.reader }.deserialize_struct("", fields, visitor)
            }
            None => TableReader { table: &DeTable::new(), trail: &trail, unknown: self.reader.unknown }
                .deserialize_struct("", fields, visitor),
        }
    }
}
