//! Mistakes in a scene, and their places.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use serde::Serialize;

use super::key_path::KeyPath;
use super::source::Source;
use super::{json_schema, suggest};

/// Which kind of mistake a [`Problem`] is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum ProblemKind {
    /// The file cannot be read.
    Unreadable,
    /// The text is not TOML.
    Syntax,
    /// A key that the table does not have.
    UnknownField {
        /// The key.
        field: String,
        /// The keys that the table has.
        expected: Vec<String>,
    },
    /// A choice that does not exist.
    UnknownVariant {
        /// The choice.
        variant: String,
        /// The choices that exist.
        expected: Vec<String>,
    },
    /// A value of another type.
    WrongType {
        /// The value found.
        found: String,
        /// The expected value.
        expected: String,
    },
    /// A text that should be a quantity or a formula and cannot be read.
    Quantity,
    /// A key that the table needs.
    MissingField {
        /// The key.
        field: String,
    },
    /// The text says something that cannot be simulated.
    Semantic,
    /// An override (`--set`) that cannot be applied.
    Override,
    /// The scene cannot be written as TOML.
    Unwritable,
    /// More mistakes of the kind before it than are told.
    Omitted {
        /// How many more.
        count: usize,
    },
}

/// Which part of an entry `key = value` is underlined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Underline {
    #[default]
    Value,
    Key,
}

/// One mistake in a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Problem {
    /// Which kind of mistake.
    #[serde(flatten)]
    pub kind: ProblemKind,
    /// The value or, of a missing one, where it should be. The root for what concerns the text as a whole.
    pub path: KeyPath,
    /// One line: the place, the value and its unit, what it must be.
    pub message: String,
    /// Right values; a line each.
    pub help: Vec<String>,
    /// Where the value comes from, if not from the file: an override.
    pub note: Option<String>,
    /// Line in the text, from 1; `None` as long as the problem has not been located in a text.
    pub line: Option<usize>,
    /// Column in the line, in characters, from 1.
    pub column: Option<usize>,
    /// Underlined text, in bytes of [`Source::text`].
    pub span: Option<Range<usize>>,
    #[serde(skip)]
    pub(super) underline: Underline,
    /// Which bytes of the text at `path` are meant, if that is a text and not all of it.
    #[serde(skip)]
    pub(super) inside: Option<Range<usize>>,
    /// Values that it can come from; empty: that at `path`.
    #[serde(skip)]
    pub(super) causes: Vec<KeyPath>,
}

impl Problem {
    /// A mistake that has not been located in a text yet.
    pub fn new(kind: ProblemKind, path: KeyPath, message: impl Into<String>) -> Problem {
        Problem {
            kind,
            path,
            message: message.into(),
            help: Vec::new(),
            note: None,
            line: None,
            column: None,
            span: None,
            underline: Underline::Value,
            inside: None,
            causes: Vec::new(),
        }
    }

    /// A value that is well-formed but cannot be simulated. Also for what only the assembly finds out.
    pub fn semantic(path: KeyPath, message: impl Into<String>) -> Problem {
        Problem::new(ProblemKind::Semantic, path, message)
    }

    /// A parameter that a model refuses: `poisson` = 0.5: makes the bulk modulus infinite.
    ///
    /// `path` is the table of parameters, `field` the parameter in it. What follows a semicolon in `message`
    /// is advice, and shown as help.
    pub fn parameter(path: &KeyPath, field: &str, value: f64, message: &str) -> Problem {
        let (message, help) = match message.split_once("; ") {
            Some((message, help)) => (message, Some(help)),
            None => (message, None),
        };
        let problem = Problem::semantic(path.key(field), format!("`{field}` = {value:?}: {message}"));
        match help {
            Some(help) => problem.with_help(help),
            None => problem,
        }
    }

    /// Adds a line of help.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Problem {
        self.help.push(help.into());
        self
    }

    /// Names the values that it can come from, where that is not all of the value at its path.
    #[must_use]
    pub(super) fn caused_by(mut self, causes: Vec<KeyPath>) -> Problem {
        self.causes = causes;
        self
    }

    /// Underlines the key rather than the value.
    #[must_use]
    pub(super) fn at_key(mut self) -> Problem {
        self.underline = Underline::Key;
        self
    }

    pub(super) fn unknown_field(path: KeyPath, field: &str, expected: &[&str]) -> Problem {
        let kind = ProblemKind::UnknownField { field: field.to_owned(), expected: owned(expected) };
        let help = suggest::field_help(path.holder_key().unwrap_or_default(), field, expected);
        let mut problem = Problem::new(kind, path, format!("unknown field {}", shortened(field))).at_key();
        problem.help = help;
        problem
    }

    /// A key beside the choice that the table at `path` makes: it belongs into that, or beside the table.
    pub(super) fn beside_choice(path: &KeyPath, choice: &str, field: &str) -> Problem {
        let of = path.last_key().unwrap_or_default();
        let kind = ProblemKind::UnknownField { field: field.to_owned(), expected: owned(&[choice]) };
        let message = format!("unknown field {}: `{of}` has its choice, `{choice}`", shortened(field));
        let problem = Problem::new(kind, path.key(field), message).at_key();
        if json_schema::has_key(&path.key(choice), field) {
            return problem
                .with_help(format!("it stands in `{choice}`: `{of} = {{ {choice} = {{ {field} = .. }} }}`"));
        }
        match path.holder() {
            Some(holder) if json_schema::has_key(&holder, field) => {
                problem.with_help(format!("it belongs next to `{of}`: `{field} = ..` on a line of its own"))
            }
            _ => problem.with_help("leave it out; `pliant schema` has all keys"),
        }
    }

    pub(super) fn unknown_variant(path: KeyPath, variant: &str, expected: &[&str]) -> Problem {
        let kind = ProblemKind::UnknownVariant { variant: variant.to_owned(), expected: owned(expected) };
        let what = path.last_key().map_or_else(String::new, |key| format!(" for `{key}`"));
        let mut problem = Problem::new(kind, path, format!("unknown choice {}{what}", shortened(variant)));
        problem.help = suggest::help(variant, expected, "choices");
        // The name of a file in the place of a choice that reads one.
        if variant.len() < MAX_SHOWN_PATH
            && expected.contains(&"file")
            && Path::new(variant).extension().is_some()
        {
            problem.help.insert(0, format!("a file is read by `{{ file = {{ path = {variant:?} }} }}`"));
        }
        problem
    }

    pub(super) fn wrong_type(path: KeyPath, found: String, expected: String) -> Problem {
        let message = match path.last_key() {
            Some(key) => format!("`{key}` takes {expected}, found {found}"),
            None => format!("expected {expected}, found {found}"),
        };
        let list = expected.starts_with("a list");
        let help = path.last_key().filter(|_| list).and_then(suggest::list_help);
        let mut problem = Problem::new(ProblemKind::WrongType { found, expected }, path, message);
        problem.help.extend(help);
        problem
    }

    /// `table` is the table that lacks `field`.
    pub(super) fn missing_field(table: &KeyPath, field: &str) -> Problem {
        let message = match table.last_key() {
            Some(key) => format!("missing field `{field}` in `{key}`"),
            None => format!("missing field `{field}`"),
        };
        Problem::new(ProblemKind::MissingField { field: field.to_owned() }, table.key(field), message)
    }
}

/// Bytes of the longest path that advice repeats.
const MAX_SHOWN_PATH: usize = 200;

fn owned(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}

/// Text of the user in a message: control characters are escaped.
pub(super) fn quoted(text: &str) -> String {
    format!("`{}`", text.escape_debug())
}

/// The same of a text that may be long.
pub(super) fn shortened(text: &str) -> String {
    match text.char_indices().nth(40) {
        Some((end, _)) => quoted(&format!("{}...", &text[..end])),
        None => quoted(text),
    }
}

/// A scene cannot be read, or says something that cannot be simulated. Holds at least one problem.
///
/// Displays as the plain rendering of [`render`](SceneError::render).
#[derive(Clone, Debug, thiserror::Error)]
#[error("{}", self.render(false))]
pub struct SceneError {
    problems: Vec<Problem>,
    /// The text in which the problems were located. Shared: an error is copied more often than made.
    text: Option<Arc<Source>>,
}

impl SceneError {
    /// Problems that have not been located in a text.
    pub fn new(problems: Vec<Problem>) -> SceneError {
        SceneError { problems, text: None }
    }

    pub(super) fn located(problems: Vec<Problem>, text: Source) -> SceneError {
        SceneError { problems, text: Some(Arc::new(text)) }
    }

    /// The same problems with their lines and columns in `source`.
    #[must_use]
    pub fn locate(self, source: &Source) -> SceneError {
        source.error(self.problems)
    }

    /// All problems, in the order of the text once they have been located in one.
    pub fn problems(&self) -> &[Problem] {
        &self.problems
    }

    /// Line of the first problem, from 1; `None` if it has not been located in a text.
    pub fn line(&self) -> Option<usize> {
        self.problems.first()?.line
    }

    /// Column of the first problem, in characters, from 1; `None` if it has not been located in a text.
    pub fn column(&self) -> Option<usize> {
        self.problems.first()?.column
    }

    /// The text in which the problems were located.
    pub fn source_text(&self) -> Option<&Source> {
        self.text.as_deref()
    }

    /// All problems as a compiler shows them: place, line of the text, what would be right. Ends without a
    /// newline. `color` adds ANSI escapes for a terminal.
    pub fn render(&self, color: bool) -> String {
        super::render::render(&self.problems, self.text.as_deref(), color)
    }
}
