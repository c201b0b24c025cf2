//! Errors in the text of a formula.

use std::ops::Range;

/// Error in the text of a formula. Positions are in bytes of the text.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExpressionError {
    /// A different token was expected.
    #[error(
        "expected {expected}, found {}",
        .found.map_or("the end".to_owned(), |c| format!("`{}`", c.escape_debug()))
    )]
    Unexpected {
        /// The expected token.
        expected: &'static str,
        /// The character found.
        found: Option<char>,
        /// Position in the text.
        place: Range<usize>,
    },
    /// A name is not known here.
    #[error("unknown name `{name}`")]
    UnknownName {
        /// The name.
        name: String,
        /// The known variables and constants.
        known: Vec<String>,
        /// The known functions.
        functions: Vec<&'static str>,
        /// Position in the text.
        place: Range<usize>,
    },
    /// An invalid parameter after `where`.
    #[error("`{name}` {problem}")]
    Given {
        /// Name of the parameter.
        name: String,
        /// The mistake.
        problem: &'static str,
        /// Position in the text.
        place: Range<usize>,
    },
    /// A function with too many or too few arguments.
    #[error("`{name}` takes {} argument{}, found \
             {found}", signature.matches(',').count() + 1, if signature.contains(',') { "s" } else { "" })]
    Arguments {
        /// The function.
        name: &'static str,
        /// Signature of the function.
        signature: &'static str,
        /// Number of arguments found.
        found: usize,
        /// Position in the text.
        place: Range<usize>,
    },
    /// A function of a non-constant argument that cannot be evaluated on packs of numbers.
    #[error("`{name}` of something that changes is not available in an energy")]
    Unavailable {
        /// The function.
        name: &'static str,
        /// The available functions.
        available: Vec<&'static str>,
        /// Position in the text.
        place: Range<usize>,
    },
    /// A formula that needs more registers than a program has.
    #[error("the formula needs {found} intermediate numbers at once, and there is room for {most}")]
    TooLong {
        /// Number of registers needed.
        found: usize,
        /// Number of registers available.
        most: usize,
        /// Position in the text: all of it.
        place: Range<usize>,
    },
    /// A text beyond the length limit.
    #[error("the formula has {found} bytes, and {most} are read at most")]
    TooManyBytes {
        /// Length of the text [bytes].
        found: usize,
        /// Maximum length [bytes].
        most: usize,
    },
    /// A number beyond the range of floating point.
    #[error("the number is too large")]
    TooLarge {
        /// Position in the text.
        place: Range<usize>,
    },
    /// Parentheses nested beyond the limit.
    #[error("the formula nests too deeply")]
    TooDeep {
        /// Position in the text.
        place: Range<usize>,
    },
}

impl ExpressionError {
    /// Position of the error in the text.
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

/// Error in a formula or in one of its parameters.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FormulaError {
    /// The text is not a formula; positions are in bytes of it.
    #[error(transparent)]
    Text(#[from] ExpressionError),
    /// An invalid parameter.
    #[error("`{name}` {problem}")]
    Parameter {
        /// Name of the parameter.
        name: String,
        /// The mistake.
        problem: &'static str,
    },
}
