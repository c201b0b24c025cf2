//! Mistakes in values that a scene writes as texts with an inner form: quantities and formulas.
//!
//! serde has no way to say where in a text a mistake is. The types of [`pliant::value`] therefore ask for
//! such values by a name that the scene's own reader knows ([`TextForm::named`]); it then checks the text
//! itself and reports with the place. Other deserializers pass the name over and get the same message without
//! the place.

use super::error::{Problem, ProblemKind, shortened};
use super::key_path::KeyPath;
use super::suggest;
use pliant::expression::{ExpressionError, Variable};
use pliant::quantity::{Kind, QuantityError};
use pliant::value::{A_NUMBER, OverTime, TextError, TextForm};

/// The mistake in `text`, which stands at `path`.
pub(super) fn problem(form: TextForm, path: &KeyPath, text: &str) -> Option<Problem> {
    let (kinds, error) = match form {
        TextForm::Quantity(kinds) | TextForm::Quantities(kinds) => {
            (kinds, Kind::parse_any(kinds, text).err()?.into())
        }
        TextForm::Formula(kinds, variables) => (kinds, OverTime::parse(kinds, variables, text).err()?),
    };
    let problem = match error {
        TextError::Quantity(error) => quantity_problem(path.clone(), text, &error),
        TextError::Expression(error) => expression_problem(path.clone(), text, &error),
    };
    let formula = match form {
        TextForm::Formula(_, Variable::TIME) => {
            ", or a formula of the time t [s] such as \"2 * sin(pi * t)\""
        }
        TextForm::Formula(..) => {
            ", or a formula of the time t [s] and the reference position X, Y, Z [m] such as \"2 * X * \
             sin(pi * t)\""
        }
        _ => "",
    };
    Some(problem.with_help(format!("{}{formula}", right(kinds))))
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

/// The mistake in a formula.
pub(super) fn expression_problem(path: KeyPath, text: &str, error: &ExpressionError) -> Problem {
    // What does not even begin as a formula is none.
    if matches!(error, ExpressionError::Unexpected { place, .. } if text[..place.start].trim().is_empty()) {
        return not_a_number(path, text);
    }
    let message = format!("{}{error}", in_key(&path));
    let mut problem = Problem::new(ProblemKind::Quantity, path, message);
    problem.inside = Some(error.place());
    match error {
        ExpressionError::UnknownName { name, known, functions, .. } => {
            let known = known.iter().map(String::as_str);
            let names: Vec<&str> = known.chain(functions.iter().copied()).collect();
            problem.help = suggest::help(name, &names, "names in a formula");
            problem
        }
        ExpressionError::Arguments { signature, .. } => problem.with_help(format!("write {signature}")),
        ExpressionError::Unavailable { available, .. } => {
            problem.with_help(format!("functions that are: {}", available.join(", ")))
        }
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
