//! From a path of keys to the bytes that it names in a TOML text.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::Underline;
use super::key_path::{KeyPath, KeySegment};
use super::suggest::nearest;

/// Value at a path.
#[derive(Clone)]
struct DocumentNode<'d> {
    key: Option<Range<usize>>,
    value: Range<usize>,
    node: &'d DeValue<'d>,
}

/// The bytes to underline for `path`: its key or value or, if the text has no such value, the nearest table
/// or value that should hold it. The start of the text for what is missing at the top.
pub(super) fn locate(text: &str, root: &DeTable<'_>, path: &KeyPath, underline: Underline) -> Range<usize> {
    let mut place: Option<DocumentNode<'_>> = None;
    for segment in path.segments() {
        let next = match (&place, segment) {
            (None, KeySegment::Key(key)) => entry(root, key),
            (None, KeySegment::Index(_)) => None,
            (Some(place), segment) => child(place.node, segment),
        };
        match (next, place) {
            (Some(next), _) => place = Some(next),
            (None, None) => return 0..0,
            (None, Some(parent)) => return holder(text, &parent),
        }
    }
    match place {
        None => 0..0,
        Some(DocumentNode { key: Some(key), .. }) if underline == Underline::Key => key,
        Some(place) => on_one_line(text, &place),
    }
}

/// The path of a value of the document that is likely meant by `path`, which may leave out the names of
/// choices, call entries of lists by their `name`, and have mistyped keys.
pub(super) fn nearest_path<'d>(root: &'d DeTable<'d>, path: &KeyPath) -> Option<KeyPath> {
    let (mut found, mut segments) = (KeyPath::root(), path.segments().iter());
    let KeySegment::Key(first) = segments.next()? else { return None };
    let key = near_key(root, first)?;
    let mut here = root.get(key)?.get_ref();
    found = found.key(key);
    for segment in segments {
        match (here, segment) {
            (DeValue::Array(list), KeySegment::Index(index)) => {
                (found, here) = (found.index(*index), list.get(*index)?.get_ref());
            }
            (DeValue::Array(list), KeySegment::Key(name)) => {
                let is_named = |entry: &Spanned<DeValue<'_>>| {
                    let named = |table: &DeTable<'_>| {
                        let name_there = table.get("name").map(Spanned::get_ref);
                        matches!(name_there, Some(DeValue::String(there)) if there == name)
                    };
                    matches!(entry.get_ref(), DeValue::Table(table) if named(table))
                };
                // Of one alone nothing else can be meant.
                let only = (list.len() == 1).then_some(0);
                let index = list.iter().position(is_named).or(only)?;
                (found, here) = (found.index(index), list.get(index)?.get_ref());
                // Its number may be left out, too.
                if let DeValue::Table(table) = here
                    && !is_named(list.get(index)?)
                    && near_key(table, name).is_some()
                {
                    (found, here) = below(found, table, name)?;
                }
            }
            (DeValue::Table(table), KeySegment::Key(key)) => (found, here) = below(found, table, key)?,
            _ => return None,
        }
    }
    Some(found)
}

/// The value of a table at a key near `key`, and its path, where the table is at `path`: in its only entry
/// where the table has no such key itself.
fn below<'d>(path: KeyPath, table: &'d DeTable<'d>, key: &str) -> Option<(KeyPath, &'d DeValue<'d>)> {
    let (mut path, mut table) = (path, table);
    if near_key(table, key).is_none() && table.len() == 1 {
        let (choice, inner) = table.iter().next()?;
        let DeValue::Table(inner) = inner.get_ref() else { return None };
        (path, table) = (path.key(choice.get_ref()), inner);
    }
    let key = near_key(table, key)?;
    Some((path.key(key), table.get(key)?.get_ref()))
}

/// The key of a table that is, or is nearest to, `key`.
fn near_key<'d>(table: &'d DeTable<'d>, key: &str) -> Option<&'d str> {
    let keys: Vec<&str> = table.keys().map(|key| key.get_ref().as_ref()).collect();
    keys.iter().find(|there| **there == key).copied().or_else(|| nearest(key, &keys))
}

fn child<'d>(node: &'d DeValue<'d>, segment: &KeySegment) -> Option<DocumentNode<'d>> {
    match (node, segment) {
        (DeValue::Table(table), KeySegment::Key(key)) => entry(table, key),
        (DeValue::Array(array), KeySegment::Index(index)) => array.get(*index).map(|element| DocumentNode {
            key: None,
            value: element.span(),
            node: element.get_ref(),
        }),
        _ => None,
    }
}

fn entry<'d>(table: &'d DeTable<'d>, key: &str) -> Option<DocumentNode<'d>> {
    let (key, value) = table.get_key_value(key)?;
    Some(DocumentNode { key: Some(key.span()), value: value.span(), node: value.get_ref() })
}

/// Text to underline when something is missing in `parent`: its header `[time]`, or the key of an inline
/// table.
fn holder(text: &str, parent: &DocumentNode<'_>) -> Range<usize> {
    match (&parent.key, parent.node) {
        (Some(key), DeValue::Table(_)) if text[parent.value.clone()].starts_with('{') => key.clone(),
        _ => on_one_line(text, parent),
    }
}

/// The value; of a value over several lines only its key or its first line, to keep the picture small.
fn on_one_line(text: &str, place: &DocumentNode<'_>) -> Range<usize> {
    let value = &text[place.value.clone()];
    match (value.find(['\r', '\n']), &place.key) {
        (None, _) => place.value.clone(),
        (Some(_), Some(key)) => key.clone(),
        (Some(newline), None) => place.value.start..place.value.start + newline,
    }
}

/// The bytes `inside` the text that the quotes at `span` hold; all of `span` where that has escapes, which
/// are longer than what they stand for.
pub(super) fn inside(text: &str, span: Range<usize>, inside: Option<Range<usize>>) -> Range<usize> {
    let value = &text[span.clone()];
    let quotes = ["\"\"\"", "'''", "\"", "'"].into_iter().find(|quotes| value.starts_with(quotes));
    let (Some(inside), Some(quotes)) = (inside, quotes) else { return span };
    let start = span.start + quotes.len();
    let whole = inside.end + 2 * quotes.len() <= value.len() && value.ends_with(quotes);
    if !whole || quotes.starts_with('"') && value.contains('\\') {
        return span;
    }
    // The end of the text is the closing quote: no other place can be underlined.
    start + inside.start..start + inside.end.max(inside.start + 1)
}

/// A place in a text. The next is found from it: many in one text are looked for in one pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cursor {
    /// In bytes.
    offset: usize,
    /// From 1.
    pub(super) line: usize,
    /// In characters, from 1.
    pub(super) column: usize,
}

impl Cursor {
    /// The beginning of a text.
    pub(super) const START: Cursor = Cursor { offset: 0, line: 1, column: 1 };

    /// The place of byte `offset` of `text`, which is not before this one.
    pub(super) fn at(self, text: &str, offset: usize) -> Cursor {
        let between = &text[self.offset..offset];
        let characters = |text: &str| text.chars().count();
        match between.rfind('\n') {
            None => Cursor { offset, line: self.line, column: self.column + characters(between) },
            Some(newline) => {
                let line = self.line + between.matches('\n').count();
                Cursor { offset, line, column: 1 + characters(&between[newline + 1..]) }
            }
        }
    }
}

/// The span with both ends inside `text` and between characters, whatever a parser reported.
pub(super) fn clamped(text: &str, span: Range<usize>) -> Range<usize> {
    let floor = |mut offset: usize| {
        offset = offset.min(text.len());
        while !text.is_char_boundary(offset) {
            offset -= 1;
        }
        offset
    };
    let start = floor(span.start);
    start..floor(span.end).max(start)
}

/// Parses TOML, keeping positions.
pub(super) fn parse(text: &str) -> Result<Spanned<DeTable<'_>>, toml::de::Error> {
    DeTable::parse(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_are_those_of_an_editor() {
        let text = "a\nbé=1\r\n\n  x";
        let places =
            [(0, 1, 1), (1, 1, 2), (2, 2, 1), (5, 2, 3), (8, 2, 6), (9, 3, 1), (12, 4, 3), (13, 4, 4)];
        let mut passing = Cursor::START;
        for (offset, line, column) in places {
            passing = passing.at(text, offset);
            assert_eq!(passing, Cursor { offset, line, column });
            assert_eq!(passing, Cursor::START.at(text, offset), "without those before");
        }
    }

    #[test]
    fn spans_are_put_between_characters_and_inside_the_text() {
        assert_eq!(clamped("é", 1..9), 0..2);
        assert_eq!(clamped("aé", 2..2), 1..1);
    }
}
