//! Recording of runs as MCAP files, which Foxglove, Lichtblick and Rerun open directly, and reading them
//! back.
//!
//! | topic | encoding | content |
//! |---|---|---|
//! | `/state` | `foxglove.PointCloud` | positions [m] and velocities [m/s] of every vertex, doubles, every frame |
//! | `/mesh` | `foxglove.SceneUpdate` | surfaces and springs to look at, at most 30 per simulated second |
//! | `/elements/<measure>` | `foxglove.PointCloud` | one row for each finite element: its centroid, and a [measure](pliant::diagnostics::MEASURES) of its deformation or stress, doubles, every frame |
//! | `/elements/zz` | `foxglove.PointCloud` | the same with the estimated [error](pliant::diagnostics::ERROR_MEASURE) of the stress |
//! | `/vertices/<measure>` | `foxglove.PointCloud` | one row for each vertex: its position, and a [measure](pliant::diagnostics::NODAL_MEASURES) of the recovered stress, doubles, every frame |
//! | `/energy` | JSON | [`Diagnostics`](pliant::diagnostics::Diagnostics) and work counters, every frame |
//! | `/reactions` | JSON | force and moment of every [pin](pliant::diagnostics::Reaction) not yet released and every wall, by name, every frame |
//! | `/probe/<name>` | JSON | a [reading](pliant::probe::Reading) of each probe, every frame |
//! | `/tf` | `foxglove.FrameTransform` | once, with `/state` or `/mesh` |
//! | `/log` | `foxglove.Log` | warnings, if there are any |
//!
//! Attachments: `scene.toml`; `rest.f64` of shape `(vertices, dimension)`; `mass.f64`; and for each body
//! those of `topology/<body>.edge.u32`, `.tri.u32`, `.tet.u32` and `.surface.u32` that apply (the surface
//! only if it is not all triangles): rows of 2, 3, 4 and 3 vertex indices, counted over all bodies.
//! Second-order elements are in `.tri6.u32` and `.tet10.u32` instead, rows of 6 and 10 in the order of
//! VTK. Everything is little-endian. Metadata: `pliant` (format version, units, dimension, counts,
//! bodies) and, at the end, `outcome`.
//!
//! The file holds simulated time in nanoseconds from 0, rounded to nearest, and no wall-clock time: the
//! same frames give the same bytes. It is written as `<output>.part` and renamed when complete. A kill
//! loses no frame that has been recorded, except, with a [largest loss](Options::max_loss) such as
//! [`MAX_LOSS`], those that took less than this time to compute. Frames of the open chunk are also in
//! `<output>.part.tail`, and [`recover`](read::recover) combines the two files.

// Loops over small fixed ranges index several arrays at once.
#![allow(clippy::needless_range_loop)]

mod attachments;
mod background_writer;
mod channels;
pub mod checkpoint;
mod chunk_journal;
mod clock;
mod cloud;
mod container;
mod continuation;
mod declaration;
mod error;
pub mod export;
mod frame_copy;
mod frame_encoder;
mod log;
mod memory;
mod outcome;
mod paths;
mod protobuf;
pub mod read;
mod recorder;
mod sink;
#[cfg(test)]
mod tests;
mod transform;

use std::time::Duration;

pub use attachments::{BlockSummary, BodySummary};
pub use channels::elements::BodyRows;
pub use channels::mesh::BODY_COLOURS;
pub use continuation::Beginning;
pub use error::RecordError;
pub use log::LogLevel;
pub use memory::predicted_bytes;
pub use outcome::{RecordedOutcome, RecordedStatus};
pub use paths::files;
pub use recorder::{McapRecorder, Options, Recorded};

/// Largest [loss](Options::max_loss) for runs: cheap to recompute, and long enough that writes cost
/// little where frames take microseconds.
pub const MAX_LOSS: Duration = Duration::from_millis(100);

/// Name of the writing program in the file header.
const LIBRARY: &str = concat!("pliant ", env!("CARGO_PKG_VERSION"));

/// Version of these conventions; readers reject a larger one.
const FORMAT_VERSION: u32 = 1;
