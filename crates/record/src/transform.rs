//! `/tf`: pose of the simulation in the world, once. Viewers require it.

use std::collections::BTreeMap;

use mcap::Channel;

use super::clock::timestamp;
use super::declaration::{FRAME_ID, typed};
use super::protobuf::{FRAME_TRANSFORM, MessageWriter};

/// Number of the channel.
pub(super) const NUMBER: u16 = 4;

/// Declares the channel.
pub(super) fn channel() -> Channel<'static> {
    typed(NUMBER, "/tf", FRAME_TRANSFORM, BTreeMap::new())
}

/// Encodes the only message: `world` and `pliant` are the same frame.
pub(super) fn message() -> Vec<u8> {
    let mut buffer = Vec::new();
    let mut transform = MessageWriter::append_to(&mut buffer);
    timestamp(&mut transform, 1, 0);
    transform.string(2, "world").string(3, FRAME_ID);
    // No translation, no rotation.
    transform.message(4, |_| ()).message(5, |rotation| {
        rotation.double(4, 1.0);
    });
    buffer
}
