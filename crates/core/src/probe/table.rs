//! Probe readings as a table of comma-separated values (CSV).

use std::io::{self, Write};

use super::{Probe, Reading, quantities};
use crate::observer::{Frame, Notes, Observer, ObserverError, Quantities};

const AXES: [&str; 3] = ["x", "y", "z"];
/// Component order of symmetric tensors in readings.
const SYMMETRIC: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];

/// Writes one row per frame: `time [s]`, with arc-length continuation `load_factor [1]`, then for each
/// probe `NAME.x [m]`, `NAME.vx [m/s]`, `NAME.ux [m]` for each axis of the scene and, in a finite
/// element, `NAME.Exx [1]` (Green strain), `NAME.Cxx [1]` (corotated strain), `NAME.sxx [Pa]` (Cauchy
/// stress) and `NAME.psi [J/m^3]` (energy density), and if the probe reads it, `NAME.nodal_sxx [Pa]`
/// (recovered Cauchy stress) and `NAME.nodal_von_mises [Pa]`. Numbers have as many digits as are needed to
/// read back the same double. Each row is flushed.
pub struct Table<W> {
    out: W,
    what: String,
    probes: Vec<Probe>,
    line: String,
    /// Bytes written; 0 before the header.
    written: u64,
}

/// Name of the checkpoint note: the bytes written so far, as eight bytes.
const WRITTEN: &str = "probes";

/// A column of the table, after that of time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TableColumn {
    /// Probe and component, `NAME.x`.
    pub name: String,
    /// Unit, as written between brackets.
    pub unit: &'static str,
}

/// Returns the columns of these probes in a scene of this dimension, in the order of a [`row`].
pub fn columns(probes: &[Probe], dimension: usize) -> Vec<TableColumn> {
    let mut columns = vec![];
    for probe in probes {
        let mut add = |letter: &str, of: &[&str], unit: &'static str| {
            let column = |c: &&str| TableColumn { name: format!("{}.{letter}{c}", probe.name), unit };
            columns.extend(of.iter().map(column));
        };
        let axes = &AXES[..dimension];
        add("", axes, "m");
        add("v", axes, "m/s");
        add("u", axes, "m");
        if probe.point.is_some() {
            add("E", &SYMMETRIC, "1");
            add("C", &SYMMETRIC, "1");
            add("s", &SYMMETRIC, "Pa");
            add("", &["psi"], "J/m^3");
        }
        if probe.reads_nodal_stress {
            add("nodal_s", &SYMMETRIC, "Pa");
            add("nodal_", &["von_mises"], "Pa");
        }
    }
    columns
}

/// Returns the values of these probes in a frame with their [`quantities`], in the order of their
/// [`columns`].
pub fn row(probes: &[Probe], frame: &Frame<'_>) -> Vec<f64> {
    let mut numbers = vec![];
    for probe in probes {
        let Reading {
            position,
            velocity,
            displacement,
            green_strain,
            corotated_strain,
            cauchy_stress,
            energy_density,
            nodal_stress,
            nodal_von_mises,
            ..
        } = probe.read(frame);
        for vector in [position, velocity, displacement] {
            numbers.extend(vector.into_iter().take(frame.dimension));
        }
        for tensor in [green_strain, corotated_strain, cauchy_stress].into_iter().flatten() {
            numbers.extend(tensor);
        }
        numbers.extend(energy_density);
        numbers.extend(nodal_stress.into_iter().flatten().chain(nodal_von_mises));
    }
    numbers
}

/// Returns the header line of the table; `has_factor` adds the load factor column of arc-length
/// continuation.
pub fn titles(probes: &[Probe], dimension: usize, has_factor: bool) -> String {
    let titles = columns(probes, dimension).into_iter();
    let titles = titles.map(|TableColumn { name, unit }| format!(",{name} [{unit}]"));
    let factor = if has_factor { ",load_factor [1]" } else { "" };
    format!("time [s]{factor}") + &titles.collect::<String>() + "\n"
}

impl<W: Write> Table<W> {
    /// Creates a table of these probes on `out`; `what` names it in errors, e.g. `writing probes.csv`.
    pub fn new(probes: &[Probe], out: W, what: &str) -> Self {
        Table { out, what: what.to_owned(), probes: probes.to_vec(), line: String::new(), written: 0 }
    }

    /// Continues a table after its first `written` bytes, as returned by [`written_at`].
    pub fn behind(probes: &[Probe], out: W, what: &str, written: u64) -> Self {
        Table { written, ..Self::new(probes, out, what) }
    }

    fn write(&mut self, frame: &Frame<'_>) -> io::Result<()> {
        self.line.clear();
        if self.written == 0 {
            self.line = titles(&self.probes, frame.dimension, frame.load_factor.is_some());
        }
        self.line += &format!("{:?}", frame.time);
        if let Some(factor) = frame.load_factor {
            self.line += &format!(",{factor:?}");
        }
        for number in row(&self.probes, frame) {
            self.line += &format!(",{number:?}");
        }
        self.line.push('\n');
        self.out.write_all(self.line.as_bytes())?;
        self.written += self.line.len() as u64;
        self.out.flush()
    }
}

impl<W: Write> Observer for Table<W> {
    fn quantities(&self) -> Quantities {
        quantities(&self.probes)
    }

    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        self.write(frame).map_err(|error| ObserverError { what: self.what.clone(), source: Box::new(error) })
    }

    fn note(&mut self, notes: &mut Notes) {
        notes.insert(WRITTEN.to_owned(), self.written.to_le_bytes().to_vec());
    }
}

/// Returns the bytes of the table written before the checkpoint with these notes; `None` without a table.
pub fn written_at(notes: &Notes) -> Option<u64> {
    notes.get(WRITTEN)?.as_slice().try_into().ok().map(u64::from_le_bytes)
}
