//! Readings of probes as a table of comma-separated values.

use std::io::{self, Write};

use super::{Probe, Reading};
use crate::observer::{Frame, Notes, Observer, ObserverError, Quantities};

const AXES: [&str; 3] = ["x", "y", "z"];
/// In the order of the readings.
const SYMMETRIC: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];

/// Writes one row for each frame, columns `time [s]`, then of each probe `NAME.x [m]`, `NAME.vx [m/s]`,
/// `NAME.ux [m]` for each axis of the scene, and where it is in a finite element `NAME.Exx [1]` (Green
/// strain), `NAME.Cxx [1]` (corotated strain), `NAME.sxx [Pa]` (Cauchy stress) and `NAME.psi [J/m^3]` (energy
/// density). Numbers have as many digits as it takes to read back the same double. Every row is handed on at
/// once.
pub struct Table<W> {
    out: W,
    what: String,
    probes: Vec<Probe>,
    line: String,
    /// Bytes written; 0 before the header.
    written: u64,
}

/// Name of the note at a checkpoint: the bytes written until then, as eight bytes.
const WRITTEN: &str = "probes";

impl<W: Write> Table<W> {
    /// Of these probes to `out`, which `what` names in errors, e.g. `writing probes.csv`.
    pub fn new(probes: &[Probe], out: W, what: &str) -> Self {
        Table { out, what: what.to_owned(), probes: probes.to_vec(), line: String::new(), written: 0 }
    }

    /// The same behind the first `written` bytes of a table, those of [`written_at`].
    pub fn behind(probes: &[Probe], out: W, what: &str, written: u64) -> Self {
        Table { written, ..Self::new(probes, out, what) }
    }

    fn header(&self, dimension: usize) -> String {
        let mut columns = vec!["time [s]".to_owned()];
        for probe in &self.probes {
            let mut add = |letter: &str, of: &[&str], unit: &str| {
                columns.extend(of.iter().map(|c| format!("{}.{letter}{c} [{unit}]", probe.name)));
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
        }
        columns.join(",")
    }

    fn write(&mut self, frame: &Frame<'_>) -> io::Result<()> {
        self.line.clear();
        if self.written == 0 {
            self.line = self.header(frame.dimension) + "\n";
        }
        self.line += &format!("{:?}", frame.time);
        for probe in &self.probes {
            let reading = probe.read(frame);
            let Reading { position, velocity, displacement, .. } = reading;
            let vectors = [position, velocity, displacement]
                .into_iter()
                .flat_map(|v| v.into_iter().take(frame.dimension));
            let tensors = [reading.green_strain, reading.corotated_strain, reading.cauchy_stress];
            let tensors = tensors.into_iter().flatten().flatten();
            for number in vectors.chain(tensors).chain(reading.energy_density) {
                self.line += &format!(",{number:?}");
            }
        }
        self.line.push('\n');
        self.out.write_all(self.line.as_bytes())?;
        self.written += self.line.len() as u64;
        self.out.flush()
    }
}

impl<W: Write> Observer for Table<W> {
    fn quantities(&self) -> Quantities {
        Quantities::POINTS.only_if(self.probes.iter().any(|probe| probe.point.is_some()))
    }

    fn frame(&mut self, frame: &Frame<'_>) -> Result<(), ObserverError> {
        self.write(frame).map_err(|error| ObserverError { what: self.what.clone(), source: Box::new(error) })
    }

    fn checkpoint(&mut self, notes: &mut Notes) -> Result<(), ObserverError> {
        notes.insert(WRITTEN.to_owned(), self.written.to_le_bytes().to_vec());
        Ok(())
    }
}

/// Bytes of the table that had been written at a checkpoint with these notes; `None` without a table.
pub fn written_at(notes: &Notes) -> Option<u64> {
    notes.get(WRITTEN)?.as_slice().try_into().ok().map(u64::from_le_bytes)
}
