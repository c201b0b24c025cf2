//! Frames of a recording as files of other programs: `.vtu` with a `.pvd` beside them for ParaView, PyVista
//! and meshio, `.obj` for whatever draws surfaces; all frames in one file as `.glb`, `.npz` and `.csv`.
//!
//! [`Export`] knows the bodies of a recording and writes one frame at a time to any stream; which frames go
//! to which files is for its user to say.

mod csv;
mod glb;
mod npz;
mod obj;
mod pvd;
#[cfg(test)]
mod tests;
mod vtu;

use std::io::{self, Write};
use std::path::Path;

pub use pvd::write_pvd;

use crate::RecordError;
use crate::read::{ElementRows, RecordedBodies, Trajectory, in_space, info};
use pliant::diagnostics::{MEASURES, Measure};

/// A recording from which frames are written.
#[derive(Debug)]
pub struct Export {
    trajectory: Trajectory,
    bodies: RecordedBodies,
    /// Rest positions, flat `(vertex_count, 3)` [m]; `None` if the recording does not hold them.
    rest: Option<Vec<f64>>,
}

/// A frame could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The frame could not be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The stream refused it.
    #[error(transparent)]
    Write(#[from] io::Error),
    /// More frames than the format should hold.
    #[error(
        "a .glb holds {most} frames, not {count}; choose some with `--frames`, like ..:{}",
        count.div_ceil(*most)
    )]
    TooManyFrames {
        /// How many were asked for.
        count: usize,
        /// How many there may be.
        most: usize,
    },
    /// More bytes than the format can hold.
    #[error("{size} bytes are more than the {most} of a {format}; choose fewer frames with `--frames`")]
    TooLarge {
        /// Ending of its files.
        format: &'static str,
        /// How many there would be.
        size: u64,
        /// How many there may be.
        most: u64,
    },
}

/// One frame, in three dimensions.
struct ExportFrame {
    /// Simulated time [s].
    time: f64,
    /// Positions, flat `(vertex_count, 3)` [m], and after them those of skins.
    x: Vec<f64>,
    /// Velocities, flat `(vertex_count, 3)` [m/s].
    v: Vec<f64>,
}

impl Export {
    /// Opens a complete recording and reads which bodies it holds.
    ///
    /// # Errors
    /// Errors of [`Trajectory::open`]; [`RecordError::Unexpected`] if the cells do not fit the vertices;
    /// [`RecordError::NoChannel`] without the channel `/state`.
    pub fn open(path: &Path) -> Result<Export, RecordError> {
        let mut trajectory = Trajectory::open(path)?;
        let info = info(path)?;
        if !info.topics.iter().any(|topic| topic.topic == "/state") {
            return Err(RecordError::NoChannel { path: path.to_owned(), topic: "/state".to_owned() });
        }
        let bodies = RecordedBodies::read(&mut trajectory, &info)?;
        let dimension = trajectory.dimension();
        let rest = trajectory.rest_positions()?.map(|rest| in_space(&rest, dimension));
        Ok(Export { trajectory, bodies, rest })
    }

    /// Simulated time of each frame [s].
    pub fn times(&self) -> &[f64] {
        self.trajectory.times()
    }

    /// Writes a frame as VTK unstructured grid, arrays in base 64: points in space (2D: `z = 0`),
    /// tetrahedra, triangles, lines and vertices as the bodies have them, `displacement` [m] (where the
    /// recording holds rest positions) and `velocity` [m/s] of the points, and for each cell the number of
    /// its `body` and what the recording has of the elements (channels `/elements/..`), NaN for cells that
    /// are none.
    ///
    /// # Errors
    /// The frame cannot be read, or the stream not be written.
    pub fn write_vtu(&mut self, frame: usize, out: &mut dyn Write) -> Result<(), ExportError> {
        let elements = self.elements(frame)?;
        let frame = self.frame(frame)?;
        Ok(vtu::write(&self.bodies, self.rest.as_deref(), &frame, &elements, out)?)
    }

    /// Writes the surfaces of a frame as Wavefront OBJ: one object per body, faces that are
    /// counter-clockwise seen from outside, lines of strands, points of particles. Vertices inside of solids
    /// are left out; the others keep their order, the same in every frame.
    ///
    /// # Errors
    /// As [`write_vtu`](Self::write_vtu).
    pub fn write_obj(&mut self, frame: usize, out: &mut dyn Write) -> Result<(), ExportError> {
        let frame = self.frame(frame)?;
        Ok(obj::write(&self.bodies, &frame, out)?)
    }

    /// Measures of the elements that were recorded.
    fn elements(&mut self, frame: usize) -> Result<Vec<(&'static Measure, ElementRows)>, RecordError> {
        let mut found = Vec::new();
        for measure in &MEASURES {
            match self.trajectory.elements(measure, frame) {
                Ok(rows) => found.push((measure, rows)),
                Err(RecordError::NoChannel { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(found)
    }

    fn frame(&mut self, frame: usize) -> Result<ExportFrame, RecordError> {
        let dimension = self.trajectory.dimension();
        let x = self.bodies.with_skins(in_space(&self.trajectory.positions(frame)?, dimension));
        let v = in_space(&self.trajectory.velocities(frame)?, dimension);
        // A frame that can be read has a time.
        let time = self.trajectory.times().get(frame).copied().unwrap_or(0.0);
        Ok(ExportFrame { time, x, v })
    }
}
