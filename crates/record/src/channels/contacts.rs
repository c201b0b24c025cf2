//! `/contacts`: surfaces in contact, as one JSON object per frame: `time` [s], and the list `contacts`
//! with the names of the two `bodies`, their closest `points` [m], the unit `normal` from the second to
//! the first, the `gap` (distance minus radii) [m], `relative_gap`, its ratio to the activation distance,
//! the normal `force` [N], and the `friction` on the first body [N].

use mcap::Channel;
use serde_json::json;

use super::{ChannelEncoder, ChannelKind, Encoders, single};
use crate::Options;
use crate::declaration::{json_channel, write_json};
use pliant::energy::SurfaceContact;
use pliant::observer::{Frame, Quantities};
use pliant::topology::Topology;

/// Topic of the channel.
pub(crate) const TOPIC: &str = "/contacts";
const NUMBER: u16 = 7;

pub(super) const KIND: ChannelKind = ChannelKind { numbers: NUMBER..=NUMBER, is_complete: true, encoders };

/// Encoder of `/contacts`.
struct ContactsChannel;

fn encoders(options: &Options, _: &Topology) -> Encoders {
    let is_asked = options.channels.contains(&pliant_scene::Channel::Contacts);
    single(is_asked.then_some(ContactsChannel))
}

impl ChannelEncoder for ContactsChannel {
    fn quantities(&self) -> Quantities {
        Quantities::CONTACTS
    }

    fn declaration(&self) -> Channel<'static> {
        let one = SurfaceContact {
            bodies: ["a".into(), "b".into()],
            points: [[0.5; 3]; 2],
            normal: [0.5; 3],
            gap: 0.5,
            relative_gap: 0.5,
            force: 0.5,
            friction: [0.5; 3],
        };
        json_channel(NUMBER, TOPIC, "pliant.Contacts", &json!({ "time": 0.5, "contacts": [one] }))
    }

    fn encode(&mut self, frame: &Frame<'_>, _: u64, buffer: &mut Vec<u8>) {
        let contacts = frame.contacts.unwrap_or_default();
        write_json(&json!({ "time": frame.time, "contacts": contacts }), buffer);
    }
}
