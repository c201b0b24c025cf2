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

/// Writes the messages.
#[derive(Debug)]
pub(super) struct Encoder {
    /// What all messages have between their time and their points.
    common: Vec<u8>,
}

impl Encoder {
    pub(super) fn new() -> Self {
        let fields = FIELDS.iter().zip(0_u32..).map(|(name, i)| PackedElementField {
            name: (*name).to_owned(),
            offset: 8 * i,
            r#type: NumericType::Float64 as i32,
        });
        let cloud = PointCloud {
            frame_id: FRAME_ID.to_owned(),
            pose: Some(identity()),
            point_stride: STRIDE as u32,
            fields: fields.collect(),
            ..PointCloud::default()
        };
        let mut common = Vec::new();
        encode(&cloud, &mut common);
        Encoder { common }
    }

    /// Encodes a frame, replacing what is in the buffer. Only what changes is encoded anew: messages of protobuf are joined by
    /// writing one behind the other.
    pub(super) fn encode_frame(&self, frame: &Frame<'_>, log_time: u64, buffer: &mut Vec<u8>) {
        encode(&PointCloud { timestamp: Some(timestamp(log_time)), ..PointCloud::default() }, buffer);
        buffer.extend_from_slice(&self.common);
        let length = frame.x.len() / frame.dimension * STRIDE;
        // As a field without content would be.
        if length > 0 {
            buffer.push(DATA_TAG);
            push_varint(length, buffer);
            match frame.dimension {
                2 => push_points::<2>(frame, buffer),
                _ => push_points::<3>(frame, buffer),
            }
        }
    }
}

/// The field `data`, number 6, of which the length follows.
const DATA_TAG: u8 = 6 << 3 | 2;

/// Seven bits a byte, the lowest first.
fn push_varint(mut number: usize, buffer: &mut Vec<u8>) {
    while number >= 0x80 {
        buffer.push(number as u8 | 0x80);
        number >>= 7;
    }
    buffer.push(number as u8);
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

/// No displacement, no rotation. A pose left out reads as a rotation by the quaternion 0, which viewers reject.
pub(super) fn identity() -> Pose {
    Pose {
        position: Some(Vector3::default()),
        orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
    }
}
