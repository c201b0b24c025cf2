//! The error of the deserializer: what serde says, turned into a [`Problem`] where it happened.

use std::fmt;

use serde::de::{self, Expected, Unexpected, Visitor};
use toml::de::DeValue;

use super::Trail;
use crate::error::{Problem, ProblemKind, shortened};
use crate::key_path::KeyPath;

/// Boxed: results of every single number carry it.
#[derive(Debug)]
pub(super) struct ReadFailure(Box<FailureKind>);

#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "it is boxed as a whole")]
enum FailureKind {
    /// Said by serde, which does not know where it is.
    Said(FailureReason),
    /// Complete.
    Located(Problem),
}

#[derive(Debug)]
enum FailureReason {
    WrongType { found: String, expected: String },
    Missing(&'static str),
    Other(String),
}

impl ReadFailure {
    pub(super) fn located(problem: Problem) -> ReadFailure {
        ReadFailure(Box::new(FailureKind::Located(problem)))
    }

    pub(super) fn unexpected<'de>(found: String, expected: &impl Visitor<'de>) -> ReadFailure {
        let expected = plain(&(expected as &dyn Expected).to_string());
        ReadFailure(Box::new(FailureKind::Said(FailureReason::WrongType { found, expected })))
    }

    /// Adds the place, unless a value further inside has done so.
    pub(super) fn at(self, trail: &Trail<'_>) -> ReadFailure {
        match *self.0 {
            FailureKind::Located(_) => self,
            FailureKind::Said(said) => ReadFailure::located(said.at(trail.path())),
        }
    }

    pub(super) fn with_help(self, help: String) -> ReadFailure {
        match *self.0 {
            FailureKind::Located(problem) => ReadFailure::located(problem.with_help(help)),
            FailureKind::Said(_) => self,
        }
    }

    /// The key that is missing after a bare word: the empty table that stood in for it is not what the user
    /// wrote.
    pub(super) fn of_bare_word(self, name: &str, trail: &Trail<'_>) -> ReadFailure {
        let help = format!("write {{ {name} = ... }}");
        match *self.0 {
            FailureKind::Located(Problem { kind: ProblemKind::WrongType { expected, .. }, path, .. })
                if path == trail.path() =>
            {
                let problem = Problem::wrong_type(path, "nothing".to_owned(), expected);
                ReadFailure::located(problem.with_help(help))
            }
            _ => self.with_help(help),
        }
    }

    pub(super) fn into_problem(self) -> Problem {
        match *self.0 {
            FailureKind::Located(problem) => problem,
            FailureKind::Said(said) => said.at(KeyPath::root()),
        }
    }
}

impl FailureReason {
    fn at(self, path: KeyPath) -> Problem {
        match self {
            FailureReason::WrongType { found, expected } => Problem::wrong_type(path, found, expected),
            FailureReason::Missing(field) => Problem::missing_field(&path, field),
            FailureReason::Other(message) => Problem::new(ProblemKind::Semantic, path, message),
        }
    }
}

impl fmt::Display for ReadFailure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &*self.0 {
            FailureKind::Located(problem) => formatter.write_str(&problem.message),
            FailureKind::Said(FailureReason::WrongType { found, expected }) => {
                write!(formatter, "expected {expected}, found {found}")
            }
            FailureKind::Said(FailureReason::Missing(field)) => write!(formatter, "missing field `{field}`"),
            FailureKind::Said(FailureReason::Other(message)) => formatter.write_str(message),
        }
    }
}

impl std::error::Error for ReadFailure {}

impl de::Error for ReadFailure {
    fn custom<T: fmt::Display>(message: T) -> ReadFailure {
        ReadFailure(Box::new(FailureKind::Said(FailureReason::Other(message.to_string()))))
    }

    fn invalid_type(unexpected: Unexpected<'_>, expected: &dyn Expected) -> ReadFailure {
        let (found, expected) = (described(unexpected), plain(&expected.to_string()));
        ReadFailure(Box::new(FailureKind::Said(FailureReason::WrongType { found, expected })))
    }

    fn invalid_value(unexpected: Unexpected<'_>, expected: &dyn Expected) -> ReadFailure {
        ReadFailure::invalid_type(unexpected, expected)
    }

    fn invalid_length(length: usize, expected: &dyn Expected) -> ReadFailure {
        let (found, expected) = (format!("{length} entries"), plain(&expected.to_string()));
        ReadFailure(Box::new(FailureKind::Said(FailureReason::WrongType { found, expected })))
    }

    fn missing_field(field: &'static str) -> ReadFailure {
        ReadFailure(Box::new(FailureKind::Said(FailureReason::Missing(field))))
    }
}

/// Names of Rust in words of the user.
fn plain(expected: &str) -> String {
    match expected {
        "f64" | "f32" => "a number",
        "u64" | "usize" => "a whole number, 0 or more",
        "u32" => "a whole number from 0 to 4294967295",
        "u8" => "a whole number from 0 to 255",
        "i64" | "i32" | "isize" => "a whole number",
        "a boolean" => "`true` or `false`",
        "path string" => "a path in quotes",
        "a string" => "a text in quotes",
        "a sequence" => "a list",
        "a map" => "a table",
        other => return other.to_owned(),
    }
    .to_owned()
}

fn described(unexpected: Unexpected<'_>) -> String {
    match unexpected {
        Unexpected::Bool(value) => format!("`{value}`"),
        Unexpected::Unsigned(value) => format!("{value}"),
        Unexpected::Signed(value) => format!("{value}"),
        Unexpected::Float(value) => format!("the number {value:?}"),
        Unexpected::Str(text) => format!("the text {}", shortened(text)),
        Unexpected::Seq => "a list".to_owned(),
        Unexpected::Map => "a table".to_owned(),
        other => other.to_string(),
    }
}

/// The value in a message.
pub(super) fn found(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => format!("the text {}", shortened(text)),
        DeValue::Integer(integer) => format!("{integer}"),
        DeValue::Float(float) => format!("the number {float}"),
        DeValue::Boolean(value) => format!("`{value}`"),
        DeValue::Datetime(date) => format!("the date {date}"),
        DeValue::Array(array) if array.len() == 1 => "a list of 1 entry".to_owned(),
        DeValue::Array(array) => format!("a list of {} entries", array.len()),
        DeValue::Table(table) if table.is_empty() => "an empty table".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
    }
}
