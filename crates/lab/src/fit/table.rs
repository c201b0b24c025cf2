//! Table of measurements in comma-separated values: a line of titles, `NAME [UNIT]` each, then numbers.

use std::collections::HashMap;

use pliant::quantity::{Kind, Quantity};

use super::FitError;

/// A parsed table.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MeasuredTable {
    /// Name in messages.
    name: String,
    pub(super) titles: Vec<ColumnTitle>,
    /// Index of each column, by name.
    columns: HashMap<String, usize>,
    rows: Vec<TableRow>,
}

/// Title of a column.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ColumnTitle {
    pub(super) name: String,
    /// Unit between the brackets.
    unit: Option<String>,
}

#[derive(Clone, Debug, PartialEq)]
struct TableRow {
    line: usize,
    /// Values by row; `None` for a missing measurement.
    cells: Vec<Option<f64>>,
}

impl MeasuredTable {
    /// Parses a table; empty lines and lines that begin with `#` are skipped.
    ///
    /// # Errors
    /// [`FitError::Data`], with line and column.
    pub(super) fn read(name: &str, text: &str) -> Result<MeasuredTable, FitError> {
        let wrong = |message: String| FitError::Data { name: name.to_owned(), message };
        let is_table = |(_, line): &(usize, &str)| !line.trim().is_empty() && !line.trim().starts_with('#');
        let mut lines = text
            .trim_start_matches('\u{feff}')
            .lines()
            .enumerate()
            .map(|(i, line)| (i + 1, line))
            .filter(is_table);
        let Some((number, header)) = lines.next() else {
            return Err(wrong("it is empty; its first line is of titles, like `time [s],tip.y [mm]`".into()));
        };
        if !header.contains(',') && header.contains([';', '\t']) {
            return Err(wrong(format!("line {number}: values are separated by commas, not by `;` or tabs")));
        }
        let titles: Vec<ColumnTitle> = header.split(',').map(title).collect();
        let mut columns = HashMap::new();
        for (i, title) in titles.iter().enumerate() {
            if title.name.parse::<f64>().is_ok() || title.name.is_empty() {
                let shown = &title.name;
                return Err(wrong(format!(
                    "line {number}, column {}: `{shown}` is no title; the first line names the columns, like \
                     `time [s],tip.y [mm]`",
                    i + 1
                )));
            }
            if columns.insert(title.name.clone(), i).is_some() {
                return Err(wrong(format!("line {number}: two columns are named `{}`", title.name)));
            }
        }
        let mut rows = vec![];
        for (line, text) in lines {
            let words: Vec<&str> = text.split(',').collect();
            if words.len() != titles.len() {
                let (found, wanted) = (words.len(), titles.len());
                return Err(wrong(format!("line {line} has {found} values; the titles are {wanted}")));
            }
            let cell = |(word, title): (&&str, &ColumnTitle)| match word.trim().trim_matches('"').trim() {
                "" => Ok(None),
                word => match word.parse::<f64>() {
                    Ok(value) if value.is_finite() => Ok(Some(value)),
                    _ => Err(wrong(format!(
                        "line {line}, column `{}`: `{word}` is no number; a cell is empty where nothing was \
                         measured",
                        title.name
                    ))),
                },
            };
            let cells = words.iter().zip(&titles).map(cell).collect::<Result<_, _>>()?;
            rows.push(TableRow { line, cells });
        }
        Ok(MeasuredTable { name: name.to_owned(), titles, columns, rows })
    }

    /// Error in this table.
    pub(super) fn wrong(&self, message: impl Into<String>) -> FitError {
        FitError::Data { name: self.name.clone(), message: message.into() }
    }

    /// Index of the column with this name.
    pub(super) fn column(&self, name: &str) -> Option<usize> {
        self.columns.get(name).copied()
    }

    /// Factor from the unit of a column to the SI unit of one of these [`kinds`](Kind), and that kind;
    /// the first kind for a column without unit.
    ///
    /// # Errors
    /// The unit is unknown, or of another quantity.
    pub(super) fn factor<'k>(&self, column: usize, kinds: &'k [Kind]) -> Result<(f64, &'k Kind), FitError> {
        let ColumnTitle { name, unit } = &self.titles[column];
        let Some(unit) = unit.as_deref().filter(|unit| !matches!(*unit, "" | "1" | "-")) else {
            // A number without a unit is in SI units; the unit `1` requires a dimensionless kind.
            let fits = unit.as_deref() != Some("1") || kinds.contains(&Kind::NUMBER);
            let kind = kinds.first().filter(|_| fits);
            return kind.map(|kind| (1.0, kind)).ok_or_else(|| {
                self.wrong(format!("column `{name}` has the unit [1]; it must be {}", described(kinds)))
            });
        };
        if unit == "%" && kinds.contains(&Kind::NUMBER) {
            return Ok((0.01, &Kind::NUMBER));
        }
        let one: Result<Quantity, _> = Kind::parse_any(kinds, &format!("1 {unit}"));
        let found = one.map_err(|error| {
            self.wrong(format!("column `{name}`: {error}; it must be {}", described(kinds)))
        })?;
        let kind = kinds.iter().find(|kind| Some(kind.dimension) == found.dimension);
        kind.map(|kind| (found.value, kind))
            .ok_or_else(|| self.wrong(format!("column `{name}` has no unit that can be read: [{unit}]")))
    }

    /// Line and value of each number in a column.
    pub(super) fn numbers(&self, column: usize) -> impl Iterator<Item = (usize, f64)> {
        self.rows.iter().filter_map(move |row| Some((row.line, row.cells[column]?)))
    }

    /// Pairs of the values of another column and this one.
    ///
    /// # Errors
    /// A row without a value in the other column.
    pub(super) fn beside(&self, axis: usize, column: usize) -> Result<Vec<(f64, f64)>, FitError> {
        let rows = self.rows.iter().filter_map(|row| Some((row, row.cells[column]?)));
        let pair = |(row, value): (&TableRow, f64)| match row.cells[axis] {
            Some(at) => Ok((at, value)),
            None => Err(self.wrong(format!("line {} has no `{}`", row.line, self.titles[axis].name))),
        };
        rows.map(pair).collect()
    }
}

fn described(kinds: &[Kind]) -> String {
    kinds.iter().map(Kind::described).collect::<Vec<_>>().join(" or ")
}

/// Parses `NAME [UNIT]`, with or without quotes.
fn title(text: &str) -> ColumnTitle {
    let text = text.trim().trim_matches('"').trim();
    let parts = text.strip_suffix(']').and_then(|text| text.rsplit_once('['));
    match parts {
        Some((name, unit)) => {
            ColumnTitle { name: name.trim().to_owned(), unit: Some(unit.trim().to_owned()) }
        }
        None => ColumnTitle { name: text.to_owned(), unit: None },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(text: &str) -> String {
        MeasuredTable::read("data.csv", text).unwrap_err().to_string()
    }

    #[test]
    fn titles_units_comments_and_empty_cells_are_read() {
        let text = "# from the lab\n\"time [ms]\", a.x [mm] ,b.y\n\n0,1.5,\n10,,-2e-3\n";
        let table = MeasuredTable::read("data.csv", text).unwrap();
        let names: Vec<&str> = table.titles.iter().map(|title| title.name.as_str()).collect();
        assert_eq!(names, ["time", "a.x", "b.y"]);
        assert_eq!(table.factor(0, &[Kind::TIME]).unwrap().0, 1e-3);
        assert_eq!(table.factor(1, &[Kind::LENGTH]).unwrap().0, 1e-3);
        assert_eq!(table.factor(2, &[Kind::LENGTH]).unwrap().0, 1.0);
        assert_eq!(table.beside(0, 1).unwrap(), [(0.0, 1.5)]);
        assert_eq!(table.beside(0, 2).unwrap(), [(10.0, -2e-3)]);
    }

    #[test]
    fn mistakes_name_their_place() {
        assert!(message("").contains("data.csv: it is empty"));
        assert!(message("time;x\n").contains("separated by commas"));
        assert!(message("0,1\n1,2\n").contains("line 1, column 1: `0` is no title"));
        assert!(message("time,x\n0\n").contains("line 2 has 1 values; the titles are 2"));
        assert!(message("time,x\n0,abc\n").contains("line 2, column `x`: `abc` is no number"));
        assert!(message("time,x\n0,nan\n").contains("`nan` is no number"));
        assert!(message("time,x,x\n").contains("two columns are named `x`"));
        let table = MeasuredTable::read("data.csv", "time [s],x [kg]\n,1\n").unwrap();
        let wrong = table.factor(1, &[Kind::LENGTH]).unwrap_err().to_string();
        assert!(wrong.contains("column `x`") && wrong.contains("a length [m]"), "{wrong}");
        assert!(table.beside(0, 1).unwrap_err().to_string().contains("line 2 has no `time`"));
    }
}
