//! Errors in the text of a formula.

use std::ops::Range;

/// A text is not a formula. Places are in bytes of the text.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExpressionError {
    /// Something else should be there.
    #[error(
        "expected {expected}, found {}",
        .found.map_or("the end".to_owned(), |c| format!("`{}`", c.escape_debug()))
    )]
    Unexpected {
        /// The expected token.
        expected: &'static str,
        /// The character that is there.
        found: Option<char>,
        /// Where.
        place: Range<usize>,
    },
    /// A name that means nothing here.
    #[error("unknown name `{name}`")]
    UnknownName {
        /// The name.
        name: String,
        /// The variables and constants there are.
        known: Vec<String>,
        /// The functions there are.
        functions: Vec<&'static str>,
        /// Where.
        place: Range<usize>,
    },
    /// A number after `where` that the formula cannot have.
    #[error("`{name}` {problem}")]
    Given {
        /// Its name.
        name: String,
        /// The mistake.
        problem: &'static str,
        /// Where.
        place: Range<usize>,
    },
    /// A function with too many or too few arguments.
    #[error("`{name}` takes {} argument{}, found \
             {found}", signature.matches(',').count() + 1, if signature.contains(',') { "s" } else { "" })]
    Arguments {
        /// The function.
        name: &'static str,
        /// How it is called.
        signature: &'static str,
        /// How many arguments there are.
        found: usize,
        /// Where.
        place: Range<usize>,
    },
    /// A function that has no value on packs of numbers, of something that is not a constant.
    #[error("`{name}` of something that changes is not available in an energy")]
    Unavailable {
        /// The function.
        name: &'static str,
        /// Functions that are.
        available: Vec<&'static str>,
        /// Where.
        place: Range<usize>,
    },
    /// More numbers at once than a program keeps.
    #[error("the formula needs {found} intermediate numbers at once, and there is room for {most}")]
    TooLong {
        /// What it needs.
        found: usize,
        /// What there is.
        most: usize,
        /// Where: all of it.
        place: Range<usize>,
    },
    /// A longer text than is read.
    #[error("the formula has {found} bytes, and {most} are read at most")]
    TooManyBytes {
        /// Its bytes.
        found: usize,
        /// How many there may be.
        most: usize,
    },
    /// A number beyond the range of floating point.
    #[error("the number is too large")]
    TooLarge {
        /// Where.
        place: Range<usize>,
    },
    /// More parentheses in parentheses than are read.
    #[error("the formula nests too deeply")]
    TooDeep {
        /// Where.
        place: Range<usize>,
    },
}

impl ExpressionError {
    /// Where in the text.
    pub fn place(&self) -> Range<usize> {
        match self {
            Self::Unexpected { place, .. }
            | Self::UnknownName { place, .. }
            | Self::Given { place, .. }
            | Self::Arguments { place, .. }
            | Self::Unavailable { place, .. }
            | Self::TooLong { place, .. }
            | Self::TooLarge { place }
            | Self::TooDeep { place } => place.clone(),
            Self::TooManyBytes { found, .. } => 0..*found,
        }
    }
}

/// A text is no formula of its variables and of parameters with values.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FormulaError {
    /// The text is none; places are in bytes of it.
    #[error(transparent)]
    Text(#[from] ExpressionError),
    /// A parameter that cannot be one.
    #[error("`{name}` {problem}")]
    Parameter {
        /// Its name.
        name: String,
        /// The mistake.
        problem: &'static str,
    },
}
