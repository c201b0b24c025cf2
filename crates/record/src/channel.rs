//! Numbers, topics and schemas of the channels.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use mcap::{Channel, Schema};
use serde_json::{Map, Value, json};

use super::protobuf;
use pliant::diagnostics::MEASURES;

/// Positions and velocities.
pub(super) const STATE: (u16, &str) = (1, "/state");
/// What a viewer draws.
pub(super) const MESH: (u16, &str) = (2, "/mesh");
/// Energies, momenta, work.
pub(super) const ENERGY: (u16, &str) = (3, "/energy");
/// The coordinate frame.
pub(super) const TRANSFORM: (u16, &str) = (4, "/tf");
/// Warnings.
pub(super) const LOG: (u16, &str) = (5, "/log");
/// Forces of pins.
pub(super) const REACTIONS: (u16, &str) = (6, "/reactions");

/// Number of the first channel about elements; one for each [measure](pliant::diagnostics::MEASURES), recorded or not.
pub(super) const ELEMENTS: u16 = 10;
/// Number of the channel of the first probe.
pub(super) const PROBES: u16 = 100;
/// Number of the first channel that is not about elements again.
const AFTER_ELEMENTS: u16 = ELEMENTS + MEASURES.len() as u16;

/// Where the message of a channel stands in its frame, counted from the end; `None` for a channel that is not about frames.
///
/// Recovery takes a frame for complete when it has seen the last of its messages.
pub(super) fn place_from_end(id: u16) -> Option<u16> {
    match id {
        _ if id == STATE.0 => Some(0),
        _ if id == ENERGY.0 => Some(1),
        _ if id == REACTIONS.0 => Some(2),
        ELEMENTS..AFTER_ELEMENTS => Some(2 + AFTER_ELEMENTS - id),
        PROBES.. => Some(u16::MAX - id + AFTER_ELEMENTS),
        // Not in every frame, and therefore the first.
        _ if id == MESH.0 => Some(u16::MAX),
        _ => None,
    }
}

/// The channel whose message ends a frame, of those that there are.
pub(super) fn last_of_frame(ids: impl Iterator<Item = u16>) -> Option<u16> {
    ids.filter(|id| place_from_end(*id).is_some()).min_by_key(|id| place_from_end(*id))
}

/// Coordinate frame of all positions.
pub(super) const FRAME_ID: &str = "pliant";

/// A channel of protobuf messages of one type. Its schema has the same number as the channel.
pub(super) fn typed(
    (id, topic): (u16, &str),
    message: protobuf::MessageType,
    metadata: BTreeMap<String, String>,
) -> Channel<'static> {
    let schema = Schema {
        id,
        name: message.name.to_owned(),
        encoding: "protobuf".to_owned(),
        data: Cow::Borrowed(message.descriptors),
    };
    let message_encoding = "protobuf".to_owned();
    Channel { id, topic: topic.to_owned(), schema: Some(Arc::new(schema)), message_encoding, metadata }
}

/// A channel of JSON objects, with the schema of `row`, an object that has every field there can be.
pub(super) fn json_channel(id: u16, topic: &str, title: &str, row: &Value) -> Channel<'static> {
    let mut schema = schema_of(row);
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

/// Schema of one value. Single type names only: readers of Foxglove refuse lists of types.
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
