//! `/state`: positions and velocities of all vertices, as `foxglove.PointCloud`.
//!
//! Every number is a double as the solver had it. 2D bodies lie in the plane z = 0. The field `data` has the highest
//! tag of the message and therefore comes last, so that a reader needs no protobuf:
//! `numpy.frombuffer(memoryview(message.data)[-48 * n:], "<f8").reshape(n, 6)`.

use std::collections::BTreeMap;

use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{PackedElementField, PointCloud, Pose, Quaternion, Vector3};
use mcap::Channel;

use super::channel::{FRAME_ID, STATE, encode, typed};
use super::clock::timestamp;
use crate::observer::Frame;

/// Fields of a point, each a little-endian double.
pub(super) const FIELDS: [&str; 6] = ["x", "y", "z", "vx", "vy", "vz"];
/// Bytes of a point.
pub(super) const STRIDE: usize = 8 * FIELDS.len();

/// Declares the channel.
pub(super) fn channel(vertex_count: usize) -> Channel<'static> {
    let metadata = BTreeMap::from([
        ("dtype".to_owned(), "<f8".to_owned()),
        ("fields".to_owned(), FIELDS.join(",")),
        ("point_count".to_owned(), vertex_count.to_string()),
        ("point_stride".to_owned(), STRIDE.to_string()),
    ]);
    typed::<PointCloud>(STATE, metadata)
}

/// Encodes a frame, replacing what is in the buffer.
pub(super) fn encode_frame(frame: &Frame<'_>, log_time: u64, buffer: &mut Vec<u8>) {
    let fields = FIELDS.iter().zip(0_u32..).map(|(name, i)| PackedElementField {
        name: (*name).to_owned(),
        offset: 8 * i,
        r#type: NumericType::Float64 as i32,
    });
    let cloud = PointCloud {
        timestamp: Some(timestamp(log_time)),
        frame_id: FRAME_ID.to_owned(),
        pose: Some(identity()),
        point_stride: STRIDE as u32,
        fields: fields.collect(),
        data: points(frame).into(),
    };
    encode(&cloud, buffer);
}

fn points(frame: &Frame<'_>) -> Vec<u8> {
    let dimension = frame.dimension;
    let mut data = Vec::with_capacity(frame.x.len() / dimension * STRIDE);
    for (x, v) in frame.x.chunks_exact(dimension).zip(frame.v.chunks_exact(dimension)) {
        let mut point = [0.0_f64; FIELDS.len()];
        point[..dimension].copy_from_slice(x);
        point[3..3 + dimension].copy_from_slice(v);
        for number in point {
            data.extend_from_slice(&number.to_le_bytes());
        }
    }
    data
}

/// No displacement, no rotation. A pose left out reads as a rotation by the quaternion 0, which viewers reject.
pub(super) fn identity() -> Pose {
    Pose {
        position: Some(Vector3::default()),
        orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
    }
}
