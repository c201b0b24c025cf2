//! Syntax of texts that stand for values: quantities and formulas.

use schemars::{Schema, json_schema};

use super::measured::text_form;
use crate::expression::{ExpressionError, Variable};
use crate::quantity::{Kind, QuantityError};

/// Expectation of a key with a dimension, in the words of messages.
pub const A_NUMBER: &str = "a number";

/// Expectation of a key that takes one number for all or a list.
pub(crate) const NUMBERS: &str = "a number or a list of numbers";

/// Form of a text.
#[derive(Clone, Copy, Debug)]
pub enum TextForm {
    /// A number with a unit of one of these kinds.
    Quantity(&'static [Kind]),
    /// The same, or a list.
    Quantities(&'static [Kind]),
    /// A quantity, or a formula of these variables.
    Formula(&'static [Kind], &'static [Variable]),
}

impl TextForm {
    /// The form that a type of this module asks its deserializer for by this name.
    pub fn named(name: &str) -> Option<TextForm> {
        // Almost all names are those of ordinary types.
        if name.starts_with("pliant::") { text_form(name) } else { None }
    }

    /// Expectation where the value is neither a number nor a text.
    pub fn expected(self) -> &'static str {
        match self {
            TextForm::Quantity(_) | TextForm::Formula(..) => A_NUMBER,
            TextForm::Quantities(_) => NUMBERS,
        }
    }

    /// True if a list may stand in its place.
    pub fn may_be_list(self) -> bool {
        matches!(self, TextForm::Quantities(_))
    }
}

/// Mistake in a text of one of these forms.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TextError {
    /// Of a number with a unit.
    #[error(transparent)]
    Quantity(#[from] QuantityError),
    /// Of a formula.
    #[error(transparent)]
    Expression(#[from] ExpressionError),
}

/// A number, or a text that begins with one. Editors do not know units: the pattern leaves these to the
/// reader.
pub(crate) fn quantity_schema(kinds: &[Kind]) -> Schema {
    let unit = kinds.iter().map(|kind| kind.unit).collect::<Vec<_>>().join(" or ");
    json_schema!({
        "type": ["number", "string"],
        "pattern": r"^\s*[+-]?([0-9]+(\.[0-9]+)?|\.[0-9]+)([eE][+-]?[0-9]+)?\s*([^\s0-9.].*|1\s*/.*)?$",
        "unit": unit,
    })
}

/// A number or any text: a formula has no pattern.
pub(crate) fn formula_schema(kinds: &[Kind], variables: &[Variable]) -> Schema {
    let unit = kinds.iter().map(|kind| kind.unit).collect::<Vec<_>>().join(" or ");
    let variables: Vec<&str> = variables.iter().map(|variable| variable.name()).collect();
    json_schema!({ "type": ["number", "string"], "unit": unit, "formula": variables.join(", ") })
}
