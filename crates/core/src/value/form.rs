//! Syntax of texts that stand for values: quantities and formulas.

use schemars::{Schema, json_schema};

use super::measured::text_form;
use crate::expression::{ExpressionError, Variable};
use crate::quantity::{Kind, QuantityError};

/// Expected value of a key with a dimension, as messages word it.
pub const A_NUMBER: &str = "a number";

/// Expected value of a key that takes one number or a list.
pub(crate) const NUMBERS: &str = "a number or a list of numbers";

/// Syntax of a text.
#[derive(Clone, Copy, Debug)]
pub enum TextForm {
    /// A number with a unit of one of these kinds.
    Quantity(&'static [Kind]),
    /// A quantity of one of these kinds, or a list of them.
    Quantities(&'static [Kind]),
    /// A quantity, or a formula of these variables.
    Formula(&'static [Kind], &'static [Variable]),
}

impl TextForm {
    /// Form of the type that asks its deserializer for this name.
    pub fn named(name: &str) -> Option<TextForm> {
        // Almost all names belong to types without a form.
        if name.starts_with("pliant::") { text_form(name) } else { None }
    }

    /// Expected form, for a value that is neither a number nor a text.
    pub fn expected(self) -> &'static str {
        match self {
            TextForm::Quantity(_) | TextForm::Formula(..) => A_NUMBER,
            TextForm::Quantities(_) => NUMBERS,
        }
    }

    /// True if a list is accepted.
    pub fn may_be_list(self) -> bool {
        matches!(self, TextForm::Quantities(_))
    }
}

/// Error in a text of one of these forms.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TextError {
    /// Error in a number with a unit.
    #[error(transparent)]
    Quantity(#[from] QuantityError),
    /// Error in a formula.
    #[error(transparent)]
    Expression(#[from] ExpressionError),
}

/// Schema of a number, or of a text that begins with one. The pattern does not check units; the reader
/// does.
pub(crate) fn quantity_schema(kinds: &[Kind]) -> Schema {
    let unit = kinds.iter().map(|kind| kind.unit).collect::<Vec<_>>().join(" or ");
    json_schema!({
        "type": ["number", "string"],
        "pattern": r"^\s*[+-]?([0-9]+(\.[0-9]+)?|\.[0-9]+)([eE][+-]?[0-9]+)?\s*([^\s0-9.].*|1\s*/.*)?$",
        "unit": unit,
    })
}

/// Schema of a number or any text: a formula has no pattern.
pub(crate) fn formula_schema(kinds: &[Kind], variables: &[Variable]) -> Schema {
    let unit = kinds.iter().map(|kind| kind.unit).collect::<Vec<_>>().join(" or ");
    let variables: Vec<&str> = variables.iter().map(|variable| variable.name()).collect();
    json_schema!({ "type": ["number", "string"], "unit": unit, "formula": variables.join(", ") })
}
