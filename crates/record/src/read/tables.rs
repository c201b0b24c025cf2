//! Channels of JSON objects as columns of numbers.

use std::collections::BTreeMap;

use serde_json::Value;

/// One field of `/energy`, `/reactions` or a probe over time, named as in `info` and plots: `total`,
/// `linear_momentum[0]`, `work.steps`.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name.
    pub name: String,
    /// One value per frame; NaN where missing.
    pub values: Vec<f64>,
}

/// Columns that grow row by row.
#[derive(Debug, Default)]
pub(super) struct GrowingColumns {
    columns: BTreeMap<String, Vec<f64>>,
    rows: usize,
}

impl GrowingColumns {
    /// Appends a row: all numbers of an object by their names.
    pub(super) fn push(&mut self, row: &Value) {
        self.visit(row, &mut String::new());
        self.rows += 1;
    }

    fn visit(&mut self, value: &Value, name: &mut String) {
        let end = name.len();
        match value {
            Value::Object(fields) => {
                for (field, value) in fields {
                    if end > 0 {
                        name.push('.');
                    }
                    name.push_str(field);
                    self.visit(value, name);
                    name.truncate(end);
                }
            }
            Value::Array(items) => {
                for (i, value) in items.iter().enumerate() {
                    name.push_str(&format!("[{i}]"));
                    self.visit(value, name);
                    name.truncate(end);
                }
            }
            other => {
                let Some(number) = other.as_f64() else { return };
                if !self.columns.contains_key(name.as_str()) {
                    self.columns.insert(name.clone(), Vec::new());
                }
                if let Some(values) = self.columns.get_mut(name.as_str()) {
                    // Earlier rows lack the field; of two fields with one name the last counts.
                    values.resize(self.rows, f64::NAN);
                    values.push(number);
                }
            }
        }
    }

    /// Columns sorted by name.
    pub(super) fn into_columns(self) -> Vec<Column> {
        let rows = self.rows;
        let column = |(name, mut values): (String, Vec<f64>)| {
            values.resize(rows, f64::NAN);
            Column { name, values }
        };
        self.columns.into_iter().map(column).collect()
    }
}
