//! `/state`: positions and velocities of all vertices, as `foxglove.PointCloud`.
//!
//! Every number is a double, as in the solver. 2D bodies lie in the plane z = 0. The points are the last
//! bytes of a message: `numpy.frombuffer(memoryview(message.data)[-48 * n:], "<f8").reshape(n, 6)`.

use mcap::Channel;

use super::{ChannelEncoder, ChannelKind, Encoders, single};
use crate::Options;
use crate::cloud::{self, Cloud};
use crate::declaration::typed;
use crate::memory::RecordingBytes;
use crate::protobuf::POINT_CLOUD;
use pliant::observer::{Frame, Quantities};
use pliant::topology::Topology;

/// Topic of the channel.
pub(crate) const TOPIC: &str = "/state";
const NUMBER: u16 = 1;

pub(super) const KIND: ChannelKind = ChannelKind { numbers: NUMBER..=NUMBER, is_complete: true, encoders };

/// Fields of a point, each a little-endian double.
const FIELDS: [&str; 6] = ["x", "y", "z", "vx", "vy", "vz"];
/// Bytes of a point.
pub(crate) const STRIDE: usize = 8 * FIELDS.len();

/// Encoder of `/state`.
struct StateChannel {
    vertex_count: usize,
    cloud: Cloud,
}

fn encoders(options: &Options, topology: &Topology) -> Encoders {
    let is_asked = options.channels.contains(&pliant_scene::Channel::State);
    let vertex_count = topology.vertex_count;
    single(is_asked.then(|| StateChannel { vertex_count, cloud: Cloud::new(&FIELDS) }))
}

impl ChannelEncoder for StateChannel {
    fn quantities(&self) -> Quantities {
        Quantities::STATE
    }

    fn declaration(&self) -> Channel<'static> {
        typed(NUMBER, TOPIC, POINT_CLOUD, cloud::describe(&FIELDS, self.vertex_count))
    }

    fn bytes(&self) -> RecordingBytes {
        RecordingBytes { held: 0, message: STRIDE * self.vertex_count }
    }

    fn encode(&mut self, frame: &Frame<'_>, log_time: u64, buffer: &mut Vec<u8>) {
        self.cloud.begin(log_time, frame.x.len() / frame.dimension, buffer);
        match frame.dimension {
            2 => push_points::<2>(frame, buffer),
            _ => push_points::<3>(frame, buffer),
        }
    }
}

fn push_points<const D: usize>(frame: &Frame<'_>, buffer: &mut Vec<u8>) {
    let (x, v) = (frame.x.as_chunks::<D>().0, frame.v.as_chunks::<D>().0);
    let start = buffer.len();
    buffer.resize(start + x.len() * STRIDE, 0);
    let points = buffer[start..].as_chunks_mut::<STRIDE>().0;
    for ((point, x), v) in points.iter_mut().zip(x).zip(v) {
        let (position, velocity) = point.as_chunks_mut::<8>().0.split_at_mut(3);
        for c in 0..D {
            position[c] = x[c].to_le_bytes();
            velocity[c] = v[c].to_le_bytes();
        }
    }
}
