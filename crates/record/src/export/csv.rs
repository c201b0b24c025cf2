//! Export of columns over time as comma-separated values; RFC 4180.

use std::io::Write;

use super::{Export, ExportError};
use crate::RecordError;
use crate::channels::{energy, probe, reactions};
use crate::read::Column;

impl Export {
    /// Writes everything in `/energy`, `/reactions` and probes, one row per frame, `time` [s] first;
    /// probes as `probe/tip.position[0]`. For each recorded measure of elements or vertices, writes the
    /// minimum and maximum over each body: `beam.von-mises.min`, `beam.cauchy-stress.xx.max`. Numbers have
    /// the shortest form that reads back to the same double; missing ones are empty.
    ///
    /// # Errors
    /// [`RecordError::NoChannel`] if none of these channels was recorded; those of
    /// [`Trajectory::tables`](crate::read::Trajectory::tables); a write error of the stream.
    pub fn write_csv(&mut self, out: &mut dyn Write) -> Result<(), ExportError> {
        let probes: Vec<String> = self.trajectory.probes();
        let topics = probes.iter().map(|name| probe::topic(name));
        let topics: Vec<String> =
            [energy::TOPIC, reactions::TOPIC].map(str::to_owned).into_iter().chain(topics).collect();
        let topics: Vec<&str> = topics.iter().map(String::as_str).collect();
        let mut tables = self.trajectory.tables(&topics)?;
        for (table, name) in tables[2..].iter_mut().zip(&probes) {
            let of_probe = table.iter_mut().filter(|column| column.name != TIME);
            of_probe.for_each(|column| column.name = format!("probe/{name}.{}", column.name));
        }
        tables.push(self.extremes()?);
        // All have the same times, those of the energies exactly.
        let times = tables.iter().flatten().find(|column| column.name == TIME).cloned();
        let mut columns: Vec<Column> =
            tables.into_iter().flatten().filter(|column| column.name != TIME).collect();
        if columns.is_empty() {
            let (path, topic) = (self.trajectory.path().to_owned(), energy::TOPIC.to_owned());
            return Err(RecordError::NoChannel { path, topic }.into());
        }
        let times = times.unwrap_or_else(|| Column { name: TIME.to_owned(), values: self.times().to_vec() });
        columns.insert(0, times);
        let names: Vec<String> = columns.iter().map(|column| quoted(&column.name)).collect();
        writeln!(out, "{}", names.join(","))?;
        for row in 0..columns.iter().map(|column| column.values.len()).max().unwrap_or(0) {
            let cells: Vec<String> = columns.iter().map(|column| cell(column, row)).collect();
            writeln!(out, "{}", cells.join(","))?;
        }
        Ok(())
    }

    /// Minimum and maximum of each measure in each body, over time.
    fn extremes(&mut self) -> Result<Vec<Column>, RecordError> {
        let mut columns: Vec<Column> = Vec::new();
        for frame in 0..self.times().len() {
            let mut next = 0;
            for (measure, rows) in self.trajectory.fields(frame)? {
                let width = rows.fields.len();
                for body in &rows.bodies {
                    let of_body = &rows.values[width * body.first..width * (body.first + body.count)];
                    for (i, field) in rows.fields.iter().enumerate() {
                        let values = || of_body.iter().skip(i).step_by(width).copied();
                        let extremes = [
                            ("min", values().fold(f64::NAN, f64::min)),
                            ("max", values().fold(f64::NAN, f64::max)),
                        ];
                        for (extreme, value) in extremes {
                            if frame == 0 {
                                let field = if width > 1 { format!(".{field}") } else { String::new() };
                                let name = format!("{}.{}{field}.{extreme}", body.name, measure.name);
                                columns.push(Column { name, values: Vec::new() });
                            }
                            columns[next].values.push(value);
                            next += 1;
                        }
                    }
                }
            }
        }
        Ok(columns)
    }
}

/// Name of the first column.
const TIME: &str = "time";

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
