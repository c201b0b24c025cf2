//! `/energy`: diagnostics and work counters as one JSON object per frame, for plots.
//!
//! Numbers are written with as many digits as it takes to read back the same double. What a scene does not have
//! (`min_j` without elements) is left out.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use mcap::{Channel, Schema};
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::channel::ENERGY;
use crate::diagnostics::{Balance, Diagnostics};
use crate::observer::Work;

/// One row. The time of the diagnostics is the exact one.
#[derive(Serialize)]
struct Row<'a> {
    step: u64,
    #[serde(flatten)]
    diagnostics: &'a Diagnostics,
    work: Work,
}

/// Declares the channel.
pub(super) fn channel() -> Channel<'static> {
    let (id, topic) = ENERGY;
    let schema = Schema {
        id,
        name: "pliant.Energy".to_owned(),
        encoding: "jsonschema".to_owned(),
        data: Cow::Owned(schema().to_string().into_bytes()),
    };
    Channel {
        id,
        topic: topic.to_owned(),
        schema: Some(Arc::new(schema)),
        message_encoding: "json".to_owned(),
        metadata: BTreeMap::new(),
    }
}

/// Encodes a frame, replacing what is in the buffer.
pub(super) fn encode_frame(step: u64, diagnostics: &Diagnostics, work: Work, buffer: &mut Vec<u8>) {
    buffer.clear();
    // Numbers always have a JSON form, and a vector grows.
    let written = serde_json::to_writer(buffer, &Row { step, diagnostics, work });
    debug_assert!(written.is_ok(), "a vector grows as a row is written into it");
}

/// JSON schema of a row, taken from a row that has every field, so that it cannot fall behind [`Diagnostics`].
fn schema() -> Value {
    let balance = Balance { motion: Some(0.5), loads: Some(0.5) };
    let full = Diagnostics {
        loads: Some(0.5),
        balance: Some(balance),
        min_j: Some(1.0),
        inverted: Some(0),
        ..Diagnostics::default()
    };
    let row = Row { step: 0, diagnostics: &full, work: Work::default() };
    let mut schema = schema_of(&serde_json::to_value(row).unwrap_or_default());
    schema["title"] = json!("pliant.Energy");
    schema
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
