//! A number for all, or a list with a number for each.

use serde::Serialize;

/// A number for all, or a list with a number for each.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum OneOrMany {
    /// One number for all.
    One(f64),
    /// One number for each, in index order.
    Many(Vec<f64>),
}

impl OneOrMany {
    /// The number or numbers.
    pub fn as_slice(&self) -> &[f64] {
        match self {
            OneOrMany::One(value) => std::slice::from_ref(value),
            OneOrMany::Many(values) => values,
        }
    }

    /// The number for element `index`: the common one, or that of the list.
    pub fn get(&self, index: usize) -> Option<f64> {
        match self {
            OneOrMany::One(value) => Some(*value),
            OneOrMany::Many(values) => values.get(index).copied(),
        }
    }
}
