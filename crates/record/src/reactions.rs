//! `/reactions`: the forces of all pins and walls as one JSON object per frame, for plots: `time` [s], and
//! for each pin that has not let go, by its name `body/pin`, and each wall, `wall0`, `force` [N], `moment`
//! [N m] and the point `about` which it is [m].

use mcap::Channel;
use serde_json::{Map, Value, json};

use super::channel::{REACTIONS, json_channel};
use pliant::diagnostics::Reaction;

/// Declares the channel, with these pins and walls.
pub(super) fn channel(names: &[String]) -> Channel<'static> {
    let row = names.iter().map(|name| (name.clone(), fields([0.5; 3], [0.5; 3], [0.5; 3])));
    let row: Map<String, Value> = std::iter::once(("time".to_owned(), json!(0.5))).chain(row).collect();
    let (id, topic) = REACTIONS;
    json_channel(id, topic, "pliant.Reactions", &Value::Object(row))
}

/// Encodes a frame, replacing what is in the buffer.
pub(super) fn encode_frame(time: f64, reactions: &[Reaction], buffer: &mut Vec<u8>) {
    let forces = reactions.iter().map(|r| (r.name.clone(), fields(r.force, r.moment, r.about)));
    let row: Map<String, Value> = std::iter::once(("time".to_owned(), json!(time))).chain(forces).collect();
    buffer.clear();
    // Numbers always have a JSON form, and a vector grows.
    let written = serde_json::to_writer(buffer, &row);
    debug_assert!(written.is_ok(), "a vector grows as a row is written into it");
}

fn fields(force: [f64; 3], moment: [f64; 3], about: [f64; 3]) -> Value {
    json!({ "force": force, "moment": moment, "about": about })
}
