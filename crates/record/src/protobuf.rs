//! Encoder of protobuf messages, field by field.
//!
//! Wire format of protocol buffers, version 3: a field is a tag, `number << 3 | type`, and its content; a
//! field with its default value is omitted. <https://protobuf.dev/programming-guides/encoding/>. Schemas
//! are stored ([`MessageType`]), so that no code is generated from them.

/// Message type: its name, and the descriptors that readers need.
#[derive(Clone, Copy, Debug)]
pub(super) struct MessageType {
    pub(super) name: &'static str,
    /// Encoded `google.protobuf.FileDescriptorSet`.
    pub(super) descriptors: &'static [u8],
}

macro_rules! schemas {
    ($($(#[$doc:meta])* $constant:ident: $name:literal;)+) => {
        $(
            $(#[$doc])*
            pub(super) const $constant: MessageType = MessageType {
                name: concat!("foxglove.", $name),
                descriptors: include_bytes!(concat!("schemas/", $name, ".bin")),
            };
        )+
    };
}

schemas! {
    /// Rows of numbers at points.
    POINT_CLOUD: "PointCloud";
    /// Surfaces and lines.
    SCENE_UPDATE: "SceneUpdate";
    /// Pose of one coordinate frame in another.
    FRAME_TRANSFORM: "FrameTransform";
    /// Log message.
    LOG: "Log";
}

const VARINT: u8 = 0;
const FIXED_64: u8 = 1;
const LENGTH_DELIMITED: u8 = 2;
const FIXED_32: u8 = 5;

/// Message being written.
pub(super) struct MessageWriter<'a> {
    buffer: &'a mut Vec<u8>,
}

impl<'a> MessageWriter<'a> {
    /// Message whose fields are appended to `buffer`.
    pub(super) fn append_to(buffer: &'a mut Vec<u8>) -> Self {
        MessageWriter { buffer }
    }

    fn tag(&mut self, field: u8, wire_type: u8) {
        debug_assert!(field < 16, "tags of one byte");
        self.buffer.push(field << 3 | wire_type);
    }

    /// Writes a nonnegative number of type `int32`, `int64`, `bool` or of an enumeration.
    pub(super) fn integer(&mut self, field: u8, value: u64) -> &mut Self {
        if value != 0 {
            self.tag(field, VARINT);
            push_varint(value, self.buffer);
        }
        self
    }

    /// Writes a number of type `fixed32`.
    pub(super) fn fixed32(&mut self, field: u8, value: u32) -> &mut Self {
        if value != 0 {
            self.tag(field, FIXED_32);
            self.buffer.extend_from_slice(&value.to_le_bytes());
        }
        self
    }

    /// Writes a number of type `double`.
    pub(super) fn double(&mut self, field: u8, value: f64) -> &mut Self {
        if value != 0.0 {
            self.tag(field, FIXED_64);
            self.buffer.extend_from_slice(&value.to_le_bytes());
        }
        self
    }

    /// Writes numbers of type `double` to the fields from `first` on.
    pub(super) fn doubles(&mut self, first: u8, values: &[f64]) -> &mut Self {
        for (field, value) in (first..).zip(values) {
            self.double(field, *value);
        }
        self
    }

    /// Writes a string.
    pub(super) fn string(&mut self, field: u8, text: &str) -> &mut Self {
        if !text.is_empty() {
            self.length_delimited(field, text.len());
            self.buffer.extend_from_slice(text.as_bytes());
        }
        self
    }

    /// Writes a packed list of `fixed32`.
    pub(super) fn fixed32_list(&mut self, field: u8, values: &[u32]) -> &mut Self {
        if !values.is_empty() {
            self.length_delimited(field, 4 * values.len());
            self.buffer.reserve_exact(4 * values.len());
            self.buffer.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        }
        self
    }

    /// Writes a message, or an entry of a list of messages; present even if empty.
    pub(super) fn message(&mut self, field: u8, write: impl FnOnce(&mut MessageWriter<'_>)) -> &mut Self {
        self.tag(field, LENGTH_DELIMITED);
        let start = self.buffer.len();
        // Reserves a one-byte length, which nearly always suffices.
        self.buffer.push(0);
        write(&mut MessageWriter { buffer: self.buffer });
        let length = self.buffer.len() - start - 1;
        if let Ok(length @ ..0x80) = u8::try_from(length) {
            self.buffer[start] = length;
        } else {
            let mut prefix = vec![];
            push_varint(length as u64, &mut prefix);
            self.buffer.splice(start..=start, prefix);
        }
        self
    }

    /// Writes tag and length of a field whose content is to be appended.
    pub(super) fn length_delimited(&mut self, field: u8, length: usize) {
        self.tag(field, LENGTH_DELIMITED);
        push_varint(length as u64, self.buffer);
    }
}

/// Appends seven bits a byte, the lowest first.
fn push_varint(mut number: u64, buffer: &mut Vec<u8>) {
    while number >= 0x80 {
        buffer.push(number as u8 | 0x80);
        number >>= 7;
    }
    buffer.push(number as u8);
}

#[cfg(test)]
mod tests {
    use super::*;

    // Examples of the wire format's specification.
    #[test]
    fn fields_are_written_as_the_specification_has_them() {
        let mut buffer = vec![];
        MessageWriter::append_to(&mut buffer)
            .integer(1, 150)
            .string(2, "testing")
            .message(3, |message| {
                message.integer(1, 150);
            })
            .fixed32_list(4, &[1, 0x0203]);
        let mut expected = vec![0x08, 0x96, 0x01, 0x12, 0x07];
        expected.extend(b"testing");
        expected.extend([0x1a, 0x03, 0x08, 0x96, 0x01, 0x22, 0x08, 1, 0, 0, 0, 3, 2, 0, 0]);
        assert_eq!(buffer, expected);
    }

    #[test]
    fn defaults_are_left_out_and_empty_messages_are_not() {
        let mut buffer = vec![];
        MessageWriter::append_to(&mut buffer)
            .integer(1, 0)
            .double(2, 0.0)
            .string(3, "")
            .fixed32(4, 0)
            .fixed32_list(5, &[])
            .message(6, |_| ());
        assert_eq!(buffer, [0x32, 0]);
        buffer.clear();
        MessageWriter::append_to(&mut buffer).doubles(1, &[1.0, 0.0, -2.0]);
        assert_eq!(buffer[..9], [9, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f]);
        assert_eq!((buffer[9], buffer.len()), (0x19, 18));
    }

    #[test]
    fn long_messages_have_long_lengths() {
        let mut buffer = vec![];
        MessageWriter::append_to(&mut buffer).message(1, |outer| {
            outer.message(2, |inner| {
                inner.string(1, &"x".repeat(300));
            });
        });
        assert_eq!(buffer[..3], [0x0a, 0xb2, 0x02], "306 bytes");
        assert_eq!(buffer[3..6], [0x12, 0xaf, 0x02], "303 bytes");
        assert_eq!(buffer[6..9], [0x0a, 0xac, 0x02], "300 bytes");
        assert_eq!(buffer.len(), 309);
    }
}
