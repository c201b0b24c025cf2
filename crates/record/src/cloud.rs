//! Rows of doubles as `foxglove.PointCloud`; the first three of each row are its position.
//!
//! The field `data` has the highest tag of the message and so comes last: readers need no protobuf,
//! `numpy.frombuffer(memoryview(message.data)[-8 * columns * rows:], "<f8").reshape(rows, columns)`.

use std::collections::BTreeMap;

use super::clock::timestamp;
use super::declaration::FRAME_ID;
use super::protobuf::MessageWriter;

/// Writer of the messages of a channel.
#[derive(Debug)]
pub(super) struct Cloud {
    /// Bytes common to all messages, between their time and their points.
    common: Vec<u8>,
    /// Bytes per row.
    stride: usize,
}

impl Cloud {
    /// Writer of rows with these columns, each a little-endian double.
    pub(super) fn new(columns: &[&str]) -> Self {
        let stride = 8 * columns.len();
        let mut common = Vec::new();
        let mut cloud = MessageWriter::append_to(&mut common);
        cloud.string(2, FRAME_ID).message(3, identity).fixed32(4, stride as u32);
        for (name, offset) in columns.iter().zip((0..).step_by(8)) {
            cloud.message(5, |field| {
                field.string(1, name).fixed32(2, offset).integer(3, FLOAT_64);
            });
        }
        Cloud { common, stride }
    }

    /// Begins a message of `rows` rows in an empty buffer; the rows are to be appended. Only the changing
    /// parts are encoded again: protobuf messages are merged by concatenation.
    pub(super) fn begin(&self, log_time: u64, rows: usize, buffer: &mut Vec<u8>) {
        // Otherwise a buffer that lacks a few bytes would double: messages at time zero are shorter.
        buffer.reserve_exact(self.common.len() + rows * self.stride + HEAD_BYTES);
        timestamp(&mut MessageWriter::append_to(buffer), 1, log_time);
        buffer.extend_from_slice(&self.common);
        // Omitted without content, as protobuf does.
        if rows > 0 {
            MessageWriter::append_to(buffer).length_delimited(DATA, rows * self.stride);
        }
    }
}

/// Metadata of a channel that describe its rows.
pub(super) fn describe(columns: &[&str], rows: usize) -> BTreeMap<String, String> {
    BTreeMap::from([
        ("dtype".to_owned(), "<f8".to_owned()),
        ("fields".to_owned(), columns.join(",")),
        ("point_count".to_owned(), rows.to_string()),
        ("point_stride".to_owned(), (8 * columns.len()).to_string()),
    ])
}

/// Upper bound of the bytes for the time of a message and the length of its points.
const HEAD_BYTES: usize = 48;

/// Tag of the field `data` of `foxglove.PointCloud`.
const DATA: u8 = 6;

/// Value for doubles in the enumeration `foxglove.PackedElementField.NumericType`.
const FLOAT_64: u64 = 8;

/// Writes a `foxglove.Pose` without displacement and rotation. An omitted pose reads as a rotation by the
/// quaternion 0, which viewers reject.
pub(super) fn identity(pose: &mut MessageWriter<'_>) {
    pose.message(1, |_| ()).message(2, |rotation| {
        rotation.double(4, 1.0);
    });
}
