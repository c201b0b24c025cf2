//! Export of recorded frames to other programs' formats: `.vtu` with a `.pvd` for ParaView, PyVista and
//! meshio, `.obj` for surface viewers; all frames in one file as `.glb`, `.npz` and `.csv`.
//!
//! [`Export`] knows the bodies of a recording and writes one frame at a time to any stream; the caller
//! chooses frames and files.

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
use crate::read::{RecordedBodies, Trajectory, in_space, info};
use pliant::algebra::Mat;
use pliant::diagnostics::SymmetricTensor;
use pliant::diagnostics::recovery::PrincipalStress;

/// Recording whose frames are exported.
#[derive(Debug)]
pub struct Export {
    trajectory: Trajectory,
    bodies: RecordedBodies,
    /// Reference positions, flat `(vertex_count, 3)` [m]; `None` if not recorded.
    rest: Option<Vec<f64>>,
}

/// Error of an export.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The frame could not be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The stream could not be written.
    #[error(transparent)]
    Write(#[from] io::Error),
    /// More frames than the format should hold.
    #[error(
        "a .glb holds {most} frames, not {count}; choose some with `--frames`, like ..:{}",
        count.div_ceil(*most)
    )]
    TooManyFrames {
        /// Number requested.
        count: usize,
        /// Maximum number.
        most: usize,
    },
    /// More bytes than the format can hold.
    #[error("{size} bytes are more than the {most} of a {format}; choose fewer frames with `--frames`")]
    TooLarge {
        /// File extension.
        format: &'static str,
        /// Number of bytes needed.
        size: u64,
        /// Maximum number.
        most: u64,
    },
}

/// Principal values [Pa] of rows of symmetric tensors, xx, yy, zz, xy, yz, xz, in descending order.
pub fn principal_stresses(rows: &[f64]) -> Vec<[f64; 3]> {
    let tensors = rows.as_chunks::<6>().0.iter();
    let principal = |[xx, yy, zz, xy, yz, xz]: &SymmetricTensor| {
        PrincipalStress::of(&Mat([[*xx, *xy, *xz], [*xy, *yy, *yz], [*xz, *yz, *zz]])).values
    };
    tensors.map(principal).collect()
}

/// Frame, padded to three dimensions.
struct ExportFrame {
    /// Simulated time [s].
    time: f64,
    /// Positions, flat `(vertex_count, 3)` [m], followed by those of embedded surfaces.
    x: Vec<f64>,
    /// Velocities, flat `(vertex_count, 3)` [m/s].
    v: Vec<f64>,
}

impl Export {
    /// Opens a complete recording and reads its bodies.
    ///
    /// # Errors
    /// The errors of [`Trajectory::open`]; [`RecordError::Unexpected`] if the elements do not fit the
    /// vertices; [`RecordError::NoChannel`] without the channel `/state`.
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

    /// Writes a frame as VTK unstructured grid, arrays in base 64: points in 3D (2D: `z = 0`), the
    /// bodies' tetrahedra, triangles, lines and vertices, `displacement` [m] (if reference positions were
    /// recorded), `velocity` [m/s] and the recorded measures of vertices (channels `/vertices/..`) of the
    /// points, NaN for points of no element, and for each cell the index of its `body` and the recorded
    /// measures of elements (channels `/elements/..`), NaN for cells that are not elements. With
    /// `nodal-stress`, points also have its principal values `principal-1`, `principal-2`, `principal-3`
    /// [Pa], in descending order.
    ///
    /// # Errors
    /// A frame that cannot be read, or a write error of the stream.
    pub fn write_vtu(&mut self, frame: usize, out: &mut dyn Write) -> Result<(), ExportError> {
        let fields = self.trajectory.fields(frame)?;
        let frame = self.frame(frame)?;
        Ok(vtu::write(&self.bodies, self.rest.as_deref(), &frame, &fields, out)?)
    }

    /// Writes the surfaces of a frame as Wavefront OBJ: one object per body, faces counter-clockwise seen
    /// from outside, lines of strands, points of particles. Interior vertices of solids are omitted; the
    /// others keep their order, the same in every frame.
    ///
    /// # Errors
    /// The errors of [`write_vtu`](Self::write_vtu).
    pub fn write_obj(&mut self, frame: usize, out: &mut dyn Write) -> Result<(), ExportError> {
        let frame = self.frame(frame)?;
        Ok(obj::write(&self.bodies, &frame, out)?)
    }

    fn frame(&mut self, frame: usize) -> Result<ExportFrame, RecordError> {
        let dimension = self.trajectory.dimension();
        let x = self.bodies.with_skins::<3>(in_space(&self.trajectory.positions(frame)?, dimension));
        let v = in_space(&self.trajectory.velocities(frame)?, dimension);
        // A frame that can be read has a time.
        let time = self.trajectory.times().get(frame).copied().unwrap_or(0.0);
        Ok(ExportFrame { time, x, v })
    }
}
