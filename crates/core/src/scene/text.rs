//! Values that a scene writes as texts with an inner form: quantities and formulas.
//!
//! serde has no way to say where in a text a mistake is. The types of the schema therefore ask for such values by a name that
//! the scene's own reader knows ([`TextForm::named`]); it then checks the text itself and reports with the place. Other
//! deserializers pass the name over and get the same message without the place.

use schemars::{Schema, json_schema};

use super::error::{Problem, ProblemKind, shortened};
use super::key_path::KeyPath;
use super::schema::{OverTime, text_form};
use super::suggest;
use crate::expression::{ExpressionError, Variable};
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
    /// A quantity, or a formula of these variables.
    Formula(&'static [Kind], &'static [Variable]),
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
            TextForm::Quantity(_) | TextForm::Formula(..) => A_NUMBER,
            TextForm::Quantities(_) => NUMBERS,
        }
    }

    /// Whether a list may stand in its place.
    pub(super) fn may_be_list(self) -> bool {
        matches!(self, TextForm::Quantities(_))
    }

    /// The mistake in `text`, which stands at `path`.
    pub(super) fn problem(self, path: &KeyPath, text: &str) -> Option<Problem> {
        let (kinds, error) = match self {
            TextForm::Quantity(kinds) | TextForm::Quantities(kinds) => {
                (kinds, Kind::parse_any(kinds, text).err()?.into())
            }
            TextForm::Formula(kinds, variables) => (kinds, OverTime::parse(kinds, variables, text).err()?),
        };
        let problem = match error {
            TextError::Quantity(error) => quantity_problem(path.clone(), text, &error),
            TextError::Expression(error) => expression_problem(path.clone(), text, &error),
        };
        let formula = match self {
            TextForm::Formula(_, Variable::TIME) => {
                ", or a formula of the time t [s] such as \"2 * sin(pi * t)\""
            }
            TextForm::Formula(..) => {
                ", or a formula of the time t [s] and the place at rest X, Y, Z [m] such as \"2 * X * sin(pi * t)\""
            }
            _ => "",
        };
        Some(problem.with_help(format!("{}{formula}", right(kinds))))
    }
}

/// A text of one of these forms cannot be read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(super) enum TextError {
    #[error(transparent)]
    Quantity(#[from] QuantityError),
    #[error(transparent)]
    Expression(#[from] ExpressionError),
}

fn in_key(path: &KeyPath) -> String {
    path.last_key().map_or_else(String::new, |key| format!("`{key}`: "))
}

fn quantity_problem(path: KeyPath, text: &str, error: &QuantityError) -> Problem {
    let mut problem = match error {
        QuantityError::NotANumber { .. } => not_a_number(path, text),
        QuantityError::WrongDimension { expected, .. } => {
            let expected: Vec<String> = expected.iter().map(Kind::described).collect();
            let kind = ProblemKind::WrongType { found: text.to_owned(), expected: expected.join(" or ") };
            let message = format!("{}{error}", in_key(&path));
            Problem::new(kind, path, message)
        }
        error => {
            let message = format!("{}{error}", in_key(&path));
            Problem::new(ProblemKind::Quantity, path, message)
        }
    };
    problem.inside = error.place();
    match error.help() {
        Some(help) => problem.with_help(help),
        None => problem,
    }
}

fn expression_problem(path: KeyPath, text: &str, error: &ExpressionError) -> Problem {
    // What does not even begin as a formula is none.
    if matches!(error, ExpressionError::Unexpected { place, .. } if text[..place.start].trim().is_empty()) {
        return not_a_number(path, text);
    }
    let message = format!("{}{error}", in_key(&path));
    let mut problem = Problem::new(ProblemKind::Quantity, path, message);
    problem.inside = Some(error.place());
    match error {
        ExpressionError::UnknownName { name, known, functions, .. } => {
            let names: Vec<&str> = known.iter().chain(functions).copied().collect();
            problem.help = suggest::help(name, &names, "names in a formula");
            problem
        }
        ExpressionError::Arguments { signature, .. } => problem.with_help(format!("write {signature}")),
        _ => problem,
    }
}

fn not_a_number(path: KeyPath, text: &str) -> Problem {
    Problem::wrong_type(path, format!("the text {}", shortened(text)), A_NUMBER.to_owned())
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

/// A number or any text: a formula has no pattern.
pub(super) fn formula_schema(kinds: &[Kind], variables: &[Variable]) -> Schema {
    let unit = kinds.iter().map(|kind| kind.unit).collect::<Vec<_>>().join(" or ");
    let variables: Vec<&str> = variables.iter().map(|variable| variable.name()).collect();
    json_schema!({ "type": ["number", "string"], "unit": unit, "formula": variables.join(", ") })
}
