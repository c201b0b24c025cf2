//! Channels of frames. Each kind has one file with its numbers, topic, quantities, declaration and
//! encoding, and one entry in the list below.
//!
//! # How to add one
//! 1. Write a file in this folder with its `KIND` and a `ChannelEncoder`: numbers, topic, quantities of a
//!    frame, declaration, encoding. `reactions.rs` is the shortest. Numbers are never given twice.
//! 2. Add its name to `channels!` below, where its messages stand in a frame.
//! 3. Add its entry to `channels!` in `crates/scene/src/schema/channel.rs`: documentation, name, and what
//!    `pliant check` says with and without it. Print the scene format anew.
//! 4. Read it back in `read/`, and test it in `tests/` of this crate.
//!
//! A quantity of elements or vertices is no file here: `diagnostics/measures.rs` of `pliant` says how. A
//! quantity that frames do not have yet needs its bit and name in `observer/quantities.rs`, its field in
//! `Frame` and its line in `Frame::of_state` (`observer.rs`), all in `pliant`, and its copy in
//! `frame_copy.rs` here.

use std::ops::RangeInclusive;

use mcap::Channel;

use crate::Options;
use crate::memory::RecordingBytes;
use pliant::observer::{Frame, Quantities};
use pliant::topology::Topology;

/// Encoder of one channel, with one message for each frame or, depending on [`is_due`](Self::is_due), for
/// fewer.
pub(crate) trait ChannelEncoder: Send {
    /// Frame quantities that a message needs.
    fn quantities(&self) -> Quantities;

    /// Number, topic, schema and metadata.
    fn declaration(&self) -> Channel<'static>;

    /// True if a frame at this time [ns] has a message. Called once for each frame, in order; in a
    /// continued recording, for each message that already exists.
    fn is_due(&mut self, log_time: u64) -> bool {
        let _ = log_time;
        true
    }

    /// Memory for encoding [bytes]: the encoder's data, and its longest message. Only for channels that
    /// grow with the problem.
    fn bytes(&self) -> RecordingBytes {
        RecordingBytes::default()
    }

    /// Appends the message of a frame with the [`quantities`](Self::quantities) to an empty buffer.
    fn encode(&mut self, frame: &Frame<'_>, log_time: u64, buffer: &mut Vec<u8>);
}

/// Encoders of a recording.
pub(crate) type Encoders = Vec<Box<dyn ChannelEncoder>>;

/// Channels of one kind.
pub(crate) struct ChannelKind {
    /// Numbers of the channels and their schemas in a file. Readers and recovery rely on them, so they
    /// never change.
    numbers: RangeInclusive<u16>,
    /// True if every frame has a message on each of them.
    is_complete: bool,
    /// Creates the encoders that a recording needs.
    encoders: fn(&Options, &Topology) -> Encoders,
}

macro_rules! channels {
    ($($kind:ident),*) => {
        $(pub(crate) mod $kind;)*

        /// All kinds, in the order of their messages in a frame.
        const KINDS: &[ChannelKind] = &[$($kind::KIND),*];
    };
}

channels![mesh, probe, elements, vertices, contacts, reactions, energy, state];

/// Encoders of all channels of a recording, in the order of their messages in a frame.
pub(crate) fn encoders(options: &Options, topology: &Topology) -> Encoders {
    KINDS.iter().flat_map(|kind| (kind.encoders)(options, topology)).collect()
}

/// Encoder of a channel that is the only one of its kind.
fn single(encoder: Option<impl ChannelEncoder + 'static>) -> Encoders {
    encoder.into_iter().map(|encoder| Box::new(encoder) as Box<dyn ChannelEncoder>).collect()
}

fn kind_of(number: u16) -> Option<(usize, &'static ChannelKind)> {
    KINDS.iter().enumerate().find(|(_, kind)| kind.numbers.contains(&number))
}

/// Order of a channel's message within its frame, ascending. `None` for a channel that does not belong to
/// frames.
///
/// Recovery considers a frame complete when it has seen the last of its messages.
pub(crate) fn place_in_frame(number: u16) -> Option<(usize, u16)> {
    kind_of(number).map(|(place, _)| (place, number))
}

/// True if every frame has a message on this channel.
pub(crate) fn is_in_every_frame(number: u16) -> bool {
    kind_of(number).is_some_and(|(_, kind)| kind.is_complete)
}

/// Channel whose message ends a frame, among these numbers.
pub(crate) fn last_of_frame(numbers: impl Iterator<Item = u16>) -> Option<u16> {
    numbers.filter_map(place_in_frame).max().map(|(_, number)| number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{log, transform};

    #[test]
    fn no_number_is_given_twice() {
        let once = [transform::NUMBER, log::NUMBER];
        let all: Vec<_> = KINDS.iter().map(|kind| kind.numbers.clone()).chain(once.map(|n| n..=n)).collect();
        for (i, a) in all.iter().enumerate() {
            assert!(!a.is_empty() && *a.start() > 0, "{a:?}");
            for b in &all[..i] {
                assert!(a.end() < b.start() || b.end() < a.start(), "{a:?} and {b:?}");
            }
        }
    }

    #[test]
    fn messages_of_a_frame_have_their_order_in_every_version() {
        // Order in recordings of earlier versions: mesh, probes, elements and vertices, reactions, energy,
        // state.
        let order = [2, 100, 101, 65_535, 10, 18, 49, 50, 51, 6, 3, 1];
        assert!(order.is_sorted_by_key(|number| place_in_frame(*number).unwrap()));
        assert_eq!(
            (last_of_frame([3, 2, 10, 4].into_iter()), last_of_frame([4, 5].into_iter())),
            (Some(3), None)
        );
        let complete: Vec<u16> = order.into_iter().filter(|number| is_in_every_frame(*number)).collect();
        assert_eq!(complete, order[1..]);
    }
}
