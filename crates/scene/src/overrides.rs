//! `--set time.step=1e-3`: changes to the text of a scene, so that errors point at what was set and a
//! recording keeps what was run.

use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::error::{Problem, ProblemKind, SceneError, quoted};
use super::key_path::{KeyPath, KeySegment};
use super::source::Source;
use super::{document, suggest};

/// Characters of a path and of a value that notes show.
const SHOWN: usize = 80;

/// Boxed: a problem is much larger than what the functions below return when there is none.
type Fault = Box<Problem>;

impl Source {
    /// The text with values set, in order: `("body.0.elastic.corotated.young", "1e5")`.
    ///
    /// A value is TOML; a word or a path needs no quotes (`rk4`, `meshes/bunny.msh`). What exists is
    /// replaced, comments stay. Keys and tables that do not exist are made; entries of lists are not.
    ///
    /// # Errors
    /// The text is not TOML, a path leads nowhere, or a value is not one. Whether the scene knows the key
    /// and likes the value shows in [`scene`](Source::scene), whose messages then name the override.
    pub fn with_overrides(&self, overrides: &[(String, String)]) -> Result<Source, SceneError> {
        self.with_values("--set ", overrides)
    }

    /// The same, where messages name each change as `option` and `path=value`.
    pub(super) fn with_values(
        &self,
        option: &str,
        overrides: &[(String, String)],
    ) -> Result<Source, SceneError> {
        // The document below reports syntax in the words of another type: one wording is enough.
        document::parse(&self.text).map_err(|error| self.error(vec![super::source::syntax(&error)]))?;
        let mut source = self.clone();
        for (path, value) in overrides {
            let written = format!("`{option}{}={}`", abridged(path), abridged(value));
            let changed = source.clone().with_override(path, value, &written);
            source = changed.map_err(|mut problem| {
                problem.help.extend(source.meant(path).map(|meant| format!("did you mean `{meant}`?")));
                SceneError::new(vec![Problem { note: Some(format!("from {written}")), ..*problem }])
            })?;
        }
        Ok(source)
    }

    /// The path of a value that is there, where `path` leads nowhere: bodies may be called by their names, the
    /// name of a choice may be left out, keys may be mistyped.
    fn meant(&self, path: &str) -> Option<KeyPath> {
        let path: KeyPath = path.parse().ok()?;
        let document = document::parse(&self.text).ok()?;
        let meant = document::nearest_path(document.get_ref(), &path)?;
        (meant != path).then_some(meant)
    }

    fn with_override(mut self, path: &str, value: &str, written: &str) -> Result<Source, Fault> {
        let at: KeyPath = path.parse().map_err(|error: super::KeyPathError| {
            Box::new(Problem::new(ProblemKind::Override, KeyPath::root(), error.to_string()))
        })?;
        let parsed = parsed(&at, value)?;
        let mut document: DocumentMut = self.text.parse().map_err(|error: toml_edit::TomlError| {
            Box::new(Problem::new(ProblemKind::Override, at.clone(), error.message().to_owned()))
        })?;
        set(TableOrList::Table(document.as_table_mut()), &at, 0, parsed)?;
        self.text = document.to_string();
        self.overrides.push((at, written.to_owned()));
        Ok(self)
    }
}

/// A text that may be long, as notes have it.
fn abridged(text: &str) -> String {
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}

/// The value as TOML; a bare word as text.
fn parsed(at: &KeyPath, value: &str) -> Result<Value, Fault> {
    let value = value.trim();
    let error = match value.parse::<Value>() {
        Ok(mut parsed) => {
            // Comments and spaces around it would end up in the middle of the text.
            parsed.decor_mut().clear();
            return Ok(parsed);
        }
        Err(error) => error,
    };
    // A word cannot be mistaken for a number or a list with a typing mistake in it.
    let starts_as_toml = value.starts_with(['[', '{', '"', '\'']);
    let is_number_like = value.trim_start_matches(['+', '-', '.']).starts_with(|c: char| c.is_ascii_digit())
        && value.chars().all(|c| c.is_ascii_digit() || "+-._,eE ".contains(c));
    if value.is_empty() || value.contains(char::is_control) || starts_as_toml || is_number_like {
        let message = format!("{} is not a value: {}", quoted(value), error.message());
        let problem = Problem::new(ProblemKind::Override, at.clone(), message);
        return Err(Box::new(
            problem.with_help("a value is a number, a word, a text in quotes, [ ... ] or { ... }"),
        ));
    }
    Ok(Value::from(value))
}

/// A place in the document that can hold others. `toml_edit` has four types where TOML has two.
enum TableOrList<'a> {
    Table(&'a mut dyn TableLike),
    List(&'a mut Array),
    Tables(&'a mut ArrayOfTables),
}

/// Puts `value` at segment `depth` of `path`, below `node`.
fn set(node: TableOrList<'_>, path: &KeyPath, depth: usize, value: Value) -> Result<(), Fault> {
    let segment = &path.segments()[depth];
    let last = depth + 1 == path.segments().len();
    match (node, segment) {
        (TableOrList::Table(table), KeySegment::Key(key)) => {
            if last {
                replace_entry(table, key, value);
                return Ok(());
            }
            if !table.contains_key(key) {
                // At the top as [table], as one would write it.
                let item = if depth == 0 {
                    Item::Table(Table::new())
                } else {
                    Item::Value(Value::InlineTable(InlineTable::new()))
                };
                table.insert(key, item);
            }
            let names: Vec<String> = table.iter().map(|(key, _)| key.to_owned()).collect();
            match table.get_mut(key) {
                Some(item) => below_item(item, path, depth, value),
                None => Err(nowhere(path, depth, &format!("no `{key}`"), &names)),
            }
        }
        (TableOrList::List(list), KeySegment::Index(index)) => {
            let length = list.len();
            match list.get_mut(*index) {
                None => Err(out_of_range(path, depth, *index, length)),
                Some(old) if last => {
                    replace_value(old, value);
                    Ok(())
                }
                Some(old) => below_value(old, path, depth, value),
            }
        }
        (TableOrList::Tables(tables), KeySegment::Index(index)) => {
            let length = tables.len();
            match tables.get_mut(*index) {
                None => Err(out_of_range(path, depth, *index, length)),
                Some(table) if last => match value {
                    Value::InlineTable(new) => {
                        let position = table.position();
                        *table = new.into_table();
                        table.set_position(position);
                        Ok(())
                    }
                    other => {
                        let message = format!("`{path}` is a table, and {} is not", other.type_name());
                        Err(Box::new(Problem::new(ProblemKind::Override, path.clone(), message)))
                    }
                },
                Some(table) => set(TableOrList::Table(table), path, depth + 1, value),
            }
        }
        (TableOrList::Table(table), KeySegment::Index(_)) => {
            let names: Vec<String> = table.iter().map(|(key, _)| key.to_owned()).collect();
            Err(nowhere(path, depth, "a table, whose keys are names", &names))
        }
        (TableOrList::List(list), KeySegment::Key(_)) => Err(not_a_key(path, depth, list.len())),
        (TableOrList::Tables(tables), KeySegment::Key(_)) => Err(not_a_key(path, depth, tables.len())),
    }
}

fn below_item(item: &mut Item, path: &KeyPath, depth: usize, value: Value) -> Result<(), Fault> {
    match item {
        Item::Table(table) => set(TableOrList::Table(table), path, depth + 1, value),
        Item::ArrayOfTables(tables) => set(TableOrList::Tables(tables), path, depth + 1, value),
        Item::Value(old) => below_value(old, path, depth, value),
        Item::None => Err(nowhere(path, depth, "nothing", &[])),
    }
}

fn below_value(old: &mut Value, path: &KeyPath, depth: usize, value: Value) -> Result<(), Fault> {
    match old {
        Value::InlineTable(table) => set(TableOrList::Table(table), path, depth + 1, value),
        Value::Array(list) => set(TableOrList::List(list), path, depth + 1, value),
        scalar => Err(nowhere(path, depth + 1, &format!("a single value ({})", scalar.type_name()), &[])),
    }
}

fn replace_entry(table: &mut dyn TableLike, key: &str, value: Value) {
    match table.get_mut(key) {
        Some(Item::Value(old)) => replace_value(old, value),
        _ => {
            // The key of a [table] carries the comments above its header: without them the new key starts
            // afresh.
            table.remove(key);
            table.insert(key, Item::Value(value));
        }
    }
}

/// Keeps the spaces and comments around the old value.
fn replace_value(old: &mut Value, mut value: Value) {
    *value.decor_mut() = old.decor().clone();
    *old = value;
}

/// The path up to and without segment `depth`.
fn holder(path: &KeyPath, depth: usize) -> KeyPath {
    path.segments()[..depth].iter().cloned().collect()
}

fn nowhere(path: &KeyPath, depth: usize, what: &str, names: &[String]) -> Fault {
    let holder = match depth {
        0 => "the scene".to_owned(),
        _ => format!("`{}`", holder(path, depth)),
    };
    let message = format!("no key `{path}`: {holder} is {what}");
    let mut problem = Problem::new(ProblemKind::Override, path.clone(), message);
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    if !names.is_empty() {
        problem.help = suggest::help("", &names, "keys here");
    }
    Box::new(problem)
}

fn out_of_range(path: &KeyPath, depth: usize, index: usize, length: usize) -> Fault {
    let list = holder(path, depth);
    let entries = if length == 1 { "entry" } else { "entries" };
    let message = format!("there is no `{list}.{index}`: `{list}` has {length} {entries}");
    let problem = Problem::new(ProblemKind::Override, path.clone(), message);
    Box::new(match length {
        0 => problem,
        _ => problem.with_help(format!("entries are counted from 0 to {}", length - 1)),
    })
}

fn not_a_key(path: &KeyPath, depth: usize, length: usize) -> Fault {
    let list = holder(path, depth);
    let message = format!("no key `{path}`: `{list}` is a list of {length}");
    Box::new(
        Problem::new(ProblemKind::Override, path.clone(), message)
            .with_help(format!("name an entry by its number, from 0: `{list}.0`")),
    )
}
