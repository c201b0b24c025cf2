//! `/energy`: diagnostics and work counters as one JSON object per frame, for plots.
//!
//! Numbers have as many digits as needed to read back the same double. Quantities that a scene does not
//! have (`min_j` without elements) are omitted.

use mcap::Channel;
use serde::Serialize;

use super::{ChannelEncoder, ChannelKind, Encoders, single};
use crate::Options;
use crate::declaration::{json_channel, write_json};
use pliant::diagnostics::{Balance, Diagnostics};
use pliant::observer::{Frame, Quantities, Work};
use pliant::topology::Topology;

/// Number of the channel.
pub(crate) const NUMBER: u16 = 3;
/// Topic of the channel.
pub(crate) const TOPIC: &str = "/energy";

pub(super) const KIND: ChannelKind = ChannelKind { numbers: NUMBER..=NUMBER, is_complete: true, encoders };

/// Content of a message. The time of the diagnostics is exact.
#[derive(Serialize)]
struct EnergyRow<'a> {
    step: u64,
    #[serde(flatten)]
    diagnostics: &'a Diagnostics,
    work: Work,
}

/// Encoder of `/energy`.
struct EnergyChannel;

fn encoders(options: &Options, _: &Topology) -> Encoders {
    single(options.channels.contains(&pliant_scene::Channel::Energy).then_some(EnergyChannel))
}

impl ChannelEncoder for EnergyChannel {
    fn quantities(&self) -> Quantities {
        Quantities::DIAGNOSTICS
    }

    /// The schema is derived from a row with every field, so that it stays in step with [`Diagnostics`].
    fn declaration(&self) -> Channel<'static> {
        let some = Some(0.5);
        let balance = Balance {
            motion: some,
            loads: some,
            gravity: some,
            ether_drag: some,
            damping: some,
            friction: some,
            walls: some,
        };
        let full = Diagnostics {
            load_factor: Some(0.5),
            loads: Some(0.5),
            contact: Some(0.5),
            other: Some(0.5),
            balance: Some(balance),
            min_j: Some(1.0),
            inverted: Some(0),
            ..Diagnostics::default()
        };
        let row = EnergyRow { step: 0, diagnostics: &full, work: Work::default() };
        json_channel(NUMBER, TOPIC, "pliant.Energy", &row)
    }

    fn encode(&mut self, frame: &Frame<'_>, _: u64, buffer: &mut Vec<u8>) {
        if let Some(diagnostics) = frame.diagnostics {
            write_json(&EnergyRow { step: frame.step, diagnostics, work: frame.work }, buffer);
        }
    }
}

/// Parses the number of steps from a message; `None` if it is not one of this channel.
pub(crate) fn step_of(message: &[u8]) -> Option<u64> {
    serde_json::from_slice::<serde_json::Map<String, serde_json::Value>>(message).ok()?.get("step")?.as_u64()
}
