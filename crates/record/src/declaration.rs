//! Declarations of channels: topics, schemas and message encodings.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use mcap::{Channel, Schema};
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::protobuf;

/// Encoding of messages that viewers display.
pub(super) const PROTOBUF: &str = "protobuf";

/// Coordinate frame of all positions.
pub(super) const FRAME_ID: &str = "pliant";

/// Channel of protobuf messages of one type. Its schema has the number of the channel.
pub(super) fn typed(
    id: u16,
    topic: &str,
    message: protobuf::MessageType,
    metadata: BTreeMap<String, String>,
) -> Channel<'static> {
    let schema = Schema {
        id,
        name: message.name.to_owned(),
        encoding: PROTOBUF.to_owned(),
        data: Cow::Borrowed(message.descriptors),
    };
    let message_encoding = PROTOBUF.to_owned();
    Channel { id, topic: topic.to_owned(), schema: Some(Arc::new(schema)), message_encoding, metadata }
}

/// Channel of JSON objects; the schema is that of `row`, an object with every possible field.
pub(super) fn json_channel(id: u16, topic: &str, title: &str, row: &impl Serialize) -> Channel<'static> {
    let mut schema = schema_of(&serde_json::to_value(row).unwrap_or_default());
    schema["title"] = json!(title);
    let schema = Schema {
        id,
        name: title.to_owned(),
        encoding: "jsonschema".to_owned(),
        data: Cow::Owned(schema.to_string().into_bytes()),
    };
    Channel {
        id,
        topic: topic.to_owned(),
        schema: Some(Arc::new(schema)),
        message_encoding: "json".to_owned(),
        metadata: BTreeMap::new(),
    }
}

/// Appends a JSON message to `buffer`.
pub(super) fn write_json(row: &impl Serialize, buffer: &mut Vec<u8>) {
    // Serialisation cannot fail: numbers always have a JSON form, and a vector grows.
    let written = serde_json::to_writer(buffer, row);
    debug_assert!(written.is_ok(), "a vector grows as a row is written into it");
}

/// Schema of one value. Single type names only, because Foxglove readers reject lists of types.
fn schema_of(value: &Value) -> Value {
    match value {
        Value::Object(fields) => {
            let properties: Map<String, Value> =
                fields.iter().map(|(name, value)| (name.clone(), schema_of(value))).collect();
            json!({ "type": "object", "properties": properties })
        }
        Value::Array(items) => json!({ "type": "array", "items": schema_of(&items[0]) }),
        Value::Number(number) if number.is_u64() => json!({ "type": "integer" }),
        Value::String(_) => json!({ "type": "string" }),
        Value::Bool(_) => json!({ "type": "boolean" }),
        _ => json!({ "type": "number" }),
    }
}
