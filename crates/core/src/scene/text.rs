//! Values that a scene writes as texts with an inner form: quantities.
//!
//! serde has no way to say where in a text a mistake is. The types of the schema therefore ask for such values by a name that
//! the scene's own reader knows ([`TextForm::named`]); it then checks the text itself and reports with the place. Other
//! deserializers pass the name over and get the same message without the place.

use schemars::{Schema, json_schema};

use super::error::{Problem, ProblemKind, shortened};
use super::key_path::KeyPath;
use super::schema::text_form;
use crate::quantity::{Kind, QuantityError};

/// What a key with a dimension takes, in the words of messages.
pub(super) const A_NUMBER: &str = "a number";
/// What a key takes that has one number for all or a list.
pub(super) const NUMBERS: &str = "a number or a list of numbers";

/// A form that a text has.
#[derive(Clone, Copy, Debug)]
pub(super) enum TextForm {
    /// A number with a unit of one of these kinds.
    Quantity(&'static [Kind]),
    /// The same, or a list.
    Quantities(&'static [Kind]),
}

impl TextForm {
    /// The form that the schema asks for by this name.
    pub(super) fn named(name: &str) -> Option<TextForm> {
        // Almost all names are those of ordinary types.
        if name.starts_with("pliant::") { text_form(name) } else { None }
    }

    /// What is expected where there is neither a number nor a text.
    pub(super) fn expected(self) -> &'static str {
        match self {
            TextForm::Quantity(_) => A_NUMBER,
            TextForm::Quantities(_) => NUMBERS,
        }
    }

    /// Whether a list may stand in its place.
    pub(super) fn may_be_list(self) -> bool {
        matches!(self, TextForm::Quantities(_))
    }

    /// The mistake in `text`, which stands at `path`.
    pub(super) fn problem(self, path: &KeyPath, text: &str) -> Option<Problem> {
        let (TextForm::Quantity(kinds) | TextForm::Quantities(kinds)) = self;
        Kind::parse_any(kinds, text).err().map(|error| quantity_problem(path.clone(), text, kinds, &error))
    }
}

fn quantity_problem(path: KeyPath, text: &str, kinds: &[Kind], error: &QuantityError) -> Problem {
    let mut problem = match error {
        QuantityError::NotANumber { .. } => {
            Problem::wrong_type(path, format!("the text {}", shortened(text)), A_NUMBER.to_owned())
        }
        QuantityError::WrongDimension { expected, .. } => {
            let expected: Vec<String> = expected.iter().map(Kind::described).collect();
            let key = path.last_key().map_or_else(String::new, |key| format!("`{key}`: "));
            let kind = ProblemKind::WrongType { found: text.to_owned(), expected: expected.join(" or ") };
            Problem::new(kind, path, format!("{key}{error}"))
        }
        error => {
            let key = path.last_key().map_or_else(String::new, |key| format!("`{key}`: "));
            Problem::new(ProblemKind::Quantity, path, format!("{key}{error}"))
        }
    };
    problem.inside = error.place();
    if let Some(help) = error.help() {
        problem = problem.with_help(help);
    }
    problem.with_help(right(kinds))
}

/// An example of each kind.
fn right(kinds: &[Kind]) -> String {
    let examples: Vec<String> = kinds.iter().map(|kind| format!("\"{}\"", kind.example)).collect();
    let units: Vec<String> = kinds.iter().map(|kind| format!("[{}]", kind.unit)).collect();
    format!(
        "write a quantity, for example {}, or a plain number in {}",
        examples.join(" or "),
        units.join(" or ")
    )
}

/// A number, or a text that begins with one. Editors do not know units: the pattern leaves these to the reader.
pub(super) fn quantity_schema(kinds: &[Kind]) -> Schema {
    let unit = kinds.iter().map(|kind| kind.unit).collect::<Vec<_>>().join(" or ");
    json_schema!({
        "type": ["number", "string"],
        "pattern": r"^\s*[+-]?([0-9]+(\.[0-9]+)?|\.[0-9]+)([eE][+-]?[0-9]+)?\s*([^\s0-9.].*|1\s*/.*)?$",
        "unit": unit,
    })
}
