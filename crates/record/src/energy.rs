//! `/energy`: diagnostics and work counters as one JSON object per frame, for plots.
//!
//! Numbers are written with as many digits as it takes to read back the same double. What a scene does not have
//! (`min_j` without elements) is left out.

use mcap::Channel;
use serde::Serialize;

use super::channel::{ENERGY, json_channel};
use pliant::diagnostics::{Balance, Diagnostics};
use pliant::observer::Work;

/// One row. The time of the diagnostics is the exact one.
#[derive(Serialize)]
struct Row<'a> {
    step: u64,
    #[serde(flatten)]
    diagnostics: &'a Diagnostics,
    work: Work,
}

/// Declares the channel, its schema taken from a row that has every field, so that it cannot fall behind [`Diagnostics`].
pub(super) fn channel() -> Channel<'static> {
    let (id, topic) = ENERGY;
    let some = Some(0.5);
    let balance =
        Balance { motion: some, loads: some, gravity: some, ether_drag: some, damping: some, walls: some };
    let full = Diagnostics {
        loads: Some(0.5),
        balance: Some(balance),
        min_j: Some(1.0),
        inverted: Some(0),
        ..Diagnostics::default()
    };
    let row = Row { step: 0, diagnostics: &full, work: Work::default() };
    json_channel(id, topic, "pliant.Energy", &serde_json::to_value(row).unwrap_or_default())
}

/// Encodes a frame, replacing what is in the buffer.
pub(super) fn encode_frame(step: u64, diagnostics: &Diagnostics, work: Work, buffer: &mut Vec<u8>) {
    buffer.clear();
    // Numbers always have a JSON form, and a vector grows.
    let written = serde_json::to_writer(buffer, &Row { step, diagnostics, work });
    debug_assert!(written.is_ok(), "a vector grows as a row is written into it");
}
