//! Columns over time as comma-separated values; RFC 4180.

use std::io::Write;

use super::{Export, ExportError};
use crate::RecordError;
use crate::read::Column;

impl Export {
    /// Writes everything that `/energy` and `/reactions` hold, one row per frame, `time` [s] first.
    /// Numbers are as short as they read back to the same double; a number that a frame does not have is
    /// empty.
    ///
    /// # Errors
    /// [`RecordError::NoChannel`] with neither channel; those of
    /// [`Trajectory::energy`](crate::read::Trajectory::energy); the stream cannot be written.
    pub fn write_csv(&mut self, out: &mut dyn Write) -> Result<(), ExportError> {
        let mut columns = self.trajectory.energy();
        match (self.trajectory.reactions(), &mut columns) {
            // The times are those of the energies.
            (Ok(reactions), Ok(columns)) => {
                columns.extend(reactions.into_iter().filter(|column| column.name != "time"));
            }
            (Ok(reactions), Err(RecordError::NoChannel { .. })) => columns = Ok(reactions),
            (Err(RecordError::NoChannel { .. }), _) => {}
            (Err(error), _) => return Err(error.into()),
            (Ok(_), Err(_)) => {}
        }
        let mut columns = columns?;
        columns.sort_by_key(|column| column.name != "time");
        let names: Vec<String> = columns.iter().map(|column| quoted(&column.name)).collect();
        writeln!(out, "{}", names.join(","))?;
        for row in 0..columns.iter().map(|column| column.values.len()).max().unwrap_or(0) {
            let cells: Vec<String> = columns.iter().map(|column| cell(column, row)).collect();
            writeln!(out, "{}", cells.join(","))?;
        }
        Ok(())
    }
}

fn cell(column: &Column, row: usize) -> String {
    match column.values.get(row) {
        Some(value) if value.is_finite() => format!("{value:?}"),
        _ => String::new(),
    }
}

fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}
