//! Reading on after a value that cannot be read: mistakes elsewhere in the text are told along with it.

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};

use super::{MOST, ReadDocument, read_once};
use crate::error::Problem;
use crate::key_path::{KeyPath, KeySegment};

/// Reads `T` from a document whose first unreadable value is `first`: again and again without what cannot be
/// read. What is missing only because it was left out is no mistake.
pub(super) fn read<T: DeserializeOwned>(
    root: &DeTable<'_>,
    first: Problem,
    mut problems: Vec<Problem>,
) -> ReadDocument<T> {
    let mut rest = RemainingDocument { table: root.clone(), left_out: vec![], removed: vec![] };
    let mut next = first;
    loop {
        let path = rest.original(&next.path);
        let follows = rest.left_out.iter().any(|out| out.starts_with(&path));
        let taken_out = rest.leave_out(&next.path);
        if !follows {
            problems.push(Problem { path, ..next });
        }
        let renumbered = !rest.removed.is_empty();
        if !taken_out || problems.len() >= MOST {
            return ReadDocument { value: None, problems, renumbered };
        }
        let (result, unknown) = read_once(&rest.table);
        for unknown in unknown {
            let path = rest.original(&unknown.path);
            if !problems.iter().any(|told| told.path == path) {
                problems.push(Problem { path, ..unknown });
            }
        }
        match result {
            Ok(value) => return ReadDocument { value: Some(value), problems, renumbered },
            Err(problem) => next = problem,
        }
    }
}

/// A document without what could not be read.
struct RemainingDocument<'a> {
    table: DeTable<'a>,
    /// Paths in the whole document.
    left_out: Vec<KeyPath>,
    /// Lists that lack an entry, and its number when it was removed.
    removed: Vec<(KeyPath, usize)>,
}

impl RemainingDocument<'_> {
    /// The path in the whole document of a path in this one.
    fn original(&self, path: &KeyPath) -> KeyPath {
        let mut segments = path.segments().to_vec();
        for (list, index) in self.removed.iter().rev() {
            let held = list.segments();
            if let (true, Some(KeySegment::Index(i))) =
                (segments.starts_with(held), segments.get_mut(held.len()))
                && *i >= *index
            {
                *i += 1;
            }
        }
        segments.into_iter().collect()
    }

    /// Removes the value at `path` or, where there is none or it is a number of a list, what should hold it;
    /// false where that is the whole document.
    fn leave_out(&mut self, path: &KeyPath) -> bool {
        let segments = path.segments();
        for end in (1..=segments.len()).rev() {
            let (holder, last) = (&segments[..end - 1], &segments[end - 1]);
            let place: KeyPath = segments[..end].iter().cloned().collect();
            let original = self.original(&place);
            if remove(&mut self.table, holder, last) {
                self.left_out.push(original);
                if let KeySegment::Index(index) = last {
                    self.removed.push((holder.iter().cloned().collect(), *index));
                }
                return true;
            }
        }
        false
    }
}

/// Removes an entry of a table, or a table of a list.
fn remove(root: &mut DeTable<'_>, holder: &[KeySegment], last: &KeySegment) -> bool {
    let Some((first, further)) = holder.split_first() else {
        return matches!(last, KeySegment::Key(key) if root.remove(key.as_str()).is_some());
    };
    let KeySegment::Key(first) = first else { return false };
    let Some(mut value) = root.get_mut(first.as_str()).map(toml::Spanned::get_mut) else { return false };
    for segment in further {
        let next = match (value, segment) {
            (DeValue::Table(table), KeySegment::Key(key)) => table.get_mut(key.as_str()),
            (DeValue::Array(array), KeySegment::Index(index)) => array.get_mut(*index),
            _ => None,
        };
        let Some(next) = next else { return false };
        value = next.get_mut();
    }
    match (value, last) {
        (DeValue::Table(table), KeySegment::Key(key)) => table.remove(key.as_str()).is_some(),
        (DeValue::Array(array), KeySegment::Index(index)) => {
            let is_table =
                array.get(*index).is_some_and(|entry| matches!(entry.get_ref(), DeValue::Table(_)));
            if is_table {
                let others = array.iter().enumerate().filter(|(i, _)| i != index);
                *array = others.map(|(_, entry)| entry.clone()).collect();
            }
            is_table
        }
        _ => false,
    }
}
