//! `/state`: positions and velocities of all vertices, as `foxglove.PointCloud`.
//!
//! Every number is a double as the solver had it. 2D bodies lie in the plane z = 0. The points are the last bytes of a
//! message: `numpy.frombuffer(memoryview(message.data)[-48 * n:], "<f8").reshape(n, 6)`.

use mcap::Channel;

use super::channel::{STATE, typed};
use super::cloud::{self, Cloud};
use super::protobuf::POINT_CLOUD;
use pliant::observer::Frame;

/// Fields of a point, each a little-endian double.
pub(super) const FIELDS: [&str; 6] = ["x", "y", "z", "vx", "vy", "vz"];
/// Bytes of a point.
pub(crate) const STRIDE: usize = 8 * FIELDS.len();

/// Declares the channel.
pub(super) fn channel(vertex_count: usize) -> Channel<'static> {
    typed(STATE, POINT_CLOUD, cloud::describe(&FIELDS, vertex_count))
}

/// What writes its messages.
pub(super) fn cloud() -> Cloud {
    Cloud::new(&FIELDS)
}

/// Encodes a frame, replacing what is in the buffer.
pub(super) fn encode_frame(cloud: &Cloud, frame: &Frame<'_>, log_time: u64, buffer: &mut Vec<u8>) {
    cloud.begin(log_time, frame.x.len() / frame.dimension, buffer);
    match frame.dimension {
        2 => push_points::<2>(frame, buffer),
        _ => push_points::<3>(frame, buffer),
    }
}

fn push_points<const D: usize>(frame: &Frame<'_>, buffer: &mut Vec<u8>) {
    let (x, v) = (frame.x.as_chunks::<D>().0, frame.v.as_chunks::<D>().0);
    let start = buffer.len();
    buffer.resize(start + x.len() * STRIDE, 0);
    let points = buffer[start..].as_chunks_mut::<STRIDE>().0;
    for ((point, x), v) in points.iter_mut().zip(x).zip(v) {
        let (position, velocity) = point.as_chunks_mut::<8>().0.split_at_mut(3);
        for c in 0..D {
            position[c] = x[c].to_le_bytes();
            velocity[c] = v[c].to_le_bytes();
        }
    }
}
