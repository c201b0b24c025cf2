//! Errors in the text of a quantity.

use std::ops::Range;

use super::{Dimension, Kind};

/// Error in the text of a quantity, or a wrong dimension. Positions are in bytes of the text.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum QuantityError {
    /// The text does not begin with a number.
    #[error("`{}` is not a number", text.escape_debug())]
    NotANumber {
        /// The text.
        text: String,
    },
    /// The number is beyond the range of floating point.
    #[error("`{}` is too large", text.escape_debug())]
    TooLarge {
        /// The text.
        text: String,
    },
    /// An unknown unit symbol.
    #[error("unknown unit `{}`", symbol.escape_debug())]
    UnknownUnit {
        /// The symbol.
        symbol: String,
        /// Names that may have been meant, the best first.
        suggestions: Vec<String>,
        /// Position in the text.
        place: Range<usize>,
    },
    /// The text after the number is not a unit.
    #[error("expected {expected} after the number, found {}", .found.map_or("the \
         end".to_owned(), |c| format!("`{}`", c.escape_debug())))]
    Malformed {
        /// The expected form.
        expected: &'static str,
        /// The character that is there.
        found: Option<char>,
        /// Position in the text.
        place: Range<usize>,
    },
    /// A unit to a power that no quantity has.
    #[error("powers of units are from -9 to 9")]
    LargePower {
        /// Position in the text.
        place: Range<usize>,
    },
    /// A product after a quotient, which some read as part of the denominator.
    #[error("a product after `/` can be read in two ways")]
    Ambiguous {
        /// Position of the second factor.
        place: Range<usize>,
    },
    /// A quantity of another dimension.
    #[error("`{}` is {}, not {}", text.escape_debug(), Kind::of(*found), listed(.expected))]
    WrongDimension {
        /// The text.
        text: String,
        /// Dimension of the quantity.
        found: Dimension,
        /// The expected dimensions.
        expected: Vec<Kind>,
    },
}

impl QuantityError {
    /// Position in the text; `None` for the text as a whole.
    pub fn place(&self) -> Option<Range<usize>> {
        match self {
            Self::UnknownUnit { place, .. }
            | Self::Malformed { place, .. }
            | Self::LargePower { place }
            | Self::Ambiguous { place } => Some(place.clone()),
            _ => None,
        }
    }

    /// Suggestion for a correct text, for errors other than a wrong dimension.
    pub fn help(&self) -> Option<String> {
        match self {
            Self::UnknownUnit { suggestions, .. } if !suggestions.is_empty() => {
                let names: Vec<String> = suggestions.iter().map(|symbol| format!("`{symbol}`")).collect();
                Some(format!("did you mean {}?", names.join(" or ")))
            }
            Self::Ambiguous { .. } => Some("put the denominator in parentheses: `m^3/(kg s^2)`".to_owned()),
            _ => None,
        }
    }
}

/// `a density [kg/m^3] or a mass per area [kg/m^2]`.
pub(super) fn listed(kinds: &[Kind]) -> String {
    kinds.iter().map(Kind::described).collect::<Vec<_>>().join(" or ")
}
