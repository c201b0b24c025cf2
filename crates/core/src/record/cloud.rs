//! Rows of doubles as `foxglove.PointCloud`, the first three of each row being where it is.
//!
//! The field `data` has the highest tag of the message and therefore comes last, so that a reader needs no protobuf:
//! `numpy.frombuffer(memoryview(message.data)[-8 * columns * rows:], "<f8").reshape(rows, columns)`.

use std::collections::BTreeMap;

use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{PackedElementField, PointCloud, Pose, Quaternion, Vector3};

use super::channel::{FRAME_ID, encode};
use super::clock::timestamp;

/// Writes the messages of a channel.
#[derive(Debug)]
pub(super) struct Cloud {
    /// What all messages have between their time and their points.
    common: Vec<u8>,
    /// Bytes of a row.
    stride: usize,
}

impl Cloud {
    /// Of rows with these columns, each a little-endian double.
    pub(super) fn new(columns: &[&str]) -> Self {
        let stride = 8 * columns.len();
        let fields = columns.iter().zip(0_u32..).map(|(name, i)| PackedElementField {
            name: (*name).to_owned(),
            offset: 8 * i,
            r#type: NumericType::Float64 as i32,
        });
        let cloud = PointCloud {
            frame_id: FRAME_ID.to_owned(),
            pose: Some(identity()),
            point_stride: stride as u32,
            fields: fields.collect(),
            ..PointCloud::default()
        };
        let mut common = Vec::new();
        encode(&cloud, &mut common);
        Cloud { common, stride }
    }

    /// Begins a message of `rows` rows in place of what is in the buffer; the rows are to be appended. Only what changes is
    /// encoded anew: messages of protobuf are joined by writing one behind the other.
    pub(super) fn begin(&self, log_time: u64, rows: usize, buffer: &mut Vec<u8>) {
        encode(&PointCloud { timestamp: Some(timestamp(log_time)), ..PointCloud::default() }, buffer);
        buffer.extend_from_slice(&self.common);
        // As a field without content would be.
        if rows > 0 {
            buffer.push(DATA_TAG);
            push_varint(rows * self.stride, buffer);
        }
    }
}

/// What a channel says of its rows.
pub(super) fn describe(columns: &[&str], rows: usize) -> BTreeMap<String, String> {
    BTreeMap::from([
        ("dtype".to_owned(), "<f8".to_owned()),
        ("fields".to_owned(), columns.join(",")),
        ("point_count".to_owned(), rows.to_string()),
        ("point_stride".to_owned(), (8 * columns.len()).to_string()),
    ])
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

/// No displacement, no rotation. A pose left out reads as a rotation by the quaternion 0, which viewers reject.
pub(super) fn identity() -> Pose {
    Pose {
        position: Some(Vector3::default()),
        orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
    }
}
