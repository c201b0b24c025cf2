//! Prediction of the memory that recording takes.

use std::iter::Sum;

use super::background_writer::{self, LARGE_BYTES};
use super::channels;
use super::container::CHUNK_BYTES;
use super::{Options, channels::elements};
use pliant::diagnostics::{ContactTraction, ElementState, SymmetricTensor};
use pliant::observer::Quantities;
use pliant::topology::Topology;

/// Memory of encoders [bytes].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct RecordingBytes {
    /// Data that they hold.
    pub(crate) held: usize,
    /// Their longest messages.
    pub(crate) message: usize,
}

impl Sum for RecordingBytes {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(RecordingBytes::default(), |sum, bytes| RecordingBytes {
            held: sum.held + bytes.held,
            message: sum.message + bytes.message,
        })
    }
}

/// Memory of the compressor and of small buffers: file buffers, chunk indices [bytes].
const COMPRESSOR_BYTES: usize = 1_500_000;

/// Estimates the maximum memory of a [recorder](super::McapRecorder) of `frames` frames [bytes]: encoders
/// and their messages, the journal of the open chunk, frames waiting to be encoded, the compressor.
pub fn predicted_bytes(options: &Options, topology: &Topology, frames: u64) -> usize {
    let encoders = channels::encoders(options, topology);
    let of_encoders: RecordingBytes = encoders.iter().map(|encoder| encoder.bytes()).sum();
    let frames = usize::try_from(frames).unwrap_or(usize::MAX);
    // A frame that fills a chunk never reaches the journal; without a pause many frames are written at
    // once.
    let is_journaled = of_encoders.message < CHUNK_BYTES as usize;
    let journal = if is_journaled { of_encoders.message } else { 0 };
    let quantities: Quantities = encoders.iter().map(|encoder| encoder.quantities()).collect();
    let frame = frame_bytes(quantities, topology);
    let waiting = if frame < LARGE_BYTES { background_writer::waiting_bytes(frame, frames) } else { 0 };
    of_encoders.held + of_encoders.message + journal + waiting + COMPRESSOR_BYTES
}

/// Size of a frame copy [bytes]: positions and velocities, element states and recovered stress if needed.
fn frame_bytes(quantities: Quantities, topology: &Topology) -> usize {
    let if_needed = |quantity, bytes| if quantities.contains(quantity) { bytes } else { 0 };
    let of_element = if_needed(Quantities::ELEMENTS, size_of::<ElementState>())
        + if_needed(Quantities::STRESS_ERROR, size_of::<f64>());
    let of_vertex = 16 * topology.dimension
        + if_needed(Quantities::NODAL_STRESS, size_of::<SymmetricTensor>())
        + if_needed(Quantities::CONTACT_TRACTIONS, size_of::<ContactTraction>());
    let elements = if of_element > 0 { elements::count(topology) } else { 0 };
    of_vertex * topology.vertex_count + of_element * elements
}
