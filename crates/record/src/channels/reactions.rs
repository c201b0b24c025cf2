//! `/reactions`: forces of all pins and walls as one JSON object per frame, for plots: `time` [s], and
//! for each pin not yet released, by its name `body/pin`, and each wall, `wall0`, its `force` [N], its
//! `moment` [N m], and the point `about` which the moment is taken [m].

use mcap::Channel;
use serde_json::{Map, Value, json};

use super::{ChannelEncoder, ChannelKind, Encoders, single};
use crate::Options;
use crate::declaration::{json_channel, write_json};
use pliant::observer::{Frame, Quantities};
use pliant::topology::Topology;

/// Topic of the channel.
pub(crate) const TOPIC: &str = "/reactions";
const NUMBER: u16 = 6;

pub(super) const KIND: ChannelKind = ChannelKind { numbers: NUMBER..=NUMBER, is_complete: true, encoders };

/// Encoder of `/reactions`.
struct ReactionsChannel {
    /// Names of pins and walls.
    names: Vec<String>,
}

fn encoders(options: &Options, _: &Topology) -> Encoders {
    let is_asked = options.channels.contains(&pliant_scene::Channel::Reactions);
    single(is_asked.then(|| ReactionsChannel { names: options.reactions.clone() }))
}

impl ChannelEncoder for ReactionsChannel {
    fn quantities(&self) -> Quantities {
        Quantities::REACTIONS
    }

    fn declaration(&self) -> Channel<'static> {
        let row = self.names.iter().map(|name| (name.clone(), fields([0.5; 3], [0.5; 3], [0.5; 3])));
        json_channel(NUMBER, TOPIC, "pliant.Reactions", &row_at(0.5, row))
    }

    fn encode(&mut self, frame: &Frame<'_>, _: u64, buffer: &mut Vec<u8>) {
        let forces = frame.reactions.unwrap_or_default().iter();
        let forces = forces.map(|r| (r.name.clone(), fields(r.force, r.moment, r.about)));
        write_json(&row_at(frame.time, forces), buffer);
    }
}

fn row_at(time: f64, forces: impl Iterator<Item = (String, Value)>) -> Map<String, Value> {
    std::iter::once(("time".to_owned(), json!(time))).chain(forces).collect()
}

fn fields(force: [f64; 3], moment: [f64; 3], about: [f64; 3]) -> Value {
    json!({ "force": force, "moment": moment, "about": about })
}
