//! `/tf`: where the simulation is in the world, once. Viewers complain without it.

use std::collections::BTreeMap;

use foxglove::messages::{FrameTransform, Quaternion, Vector3};
use mcap::Channel;

use super::channel::{FRAME_ID, TRANSFORM, encode, typed};
use super::clock::timestamp;

/// Declares the channel.
pub(super) fn channel() -> Channel<'static> {
    typed::<FrameTransform>(TRANSFORM, BTreeMap::new())
}

/// The only message: `world` and `pliant` are the same frame.
pub(super) fn message() -> Vec<u8> {
    let mut buffer = Vec::new();
    let transform = FrameTransform {
        timestamp: Some(timestamp(0)),
        parent_frame_id: "world".to_owned(),
        child_frame_id: FRAME_ID.to_owned(),
        translation: Some(Vector3::default()),
        rotation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
    };
    encode(&transform, &mut buffer);
    buffer
}
