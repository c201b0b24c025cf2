//! `/log`: what the run has to say, as `foxglove.Log`. The channel exists only in files that have a message on it.

use std::collections::BTreeMap;

use foxglove::messages::{Log, log};
use mcap::Channel;

use super::channel::{FRAME_ID, LOG, encode, typed};
use super::clock::timestamp;

/// How serious a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Worth knowing.
    Info,
    /// The result may not be what was wanted.
    Warning,
    /// The run cannot go on.
    Error,
}

/// Declares the channel.
pub(super) fn channel() -> Channel<'static> {
    typed::<Log>(LOG, BTreeMap::new())
}

/// One message.
pub(super) fn message(level: Level, text: &str, log_time: u64) -> Vec<u8> {
    let level = match level {
        Level::Info => log::Level::Info,
        Level::Warning => log::Level::Warning,
        Level::Error => log::Level::Error,
    };
    let mut buffer = Vec::new();
    let entry = Log {
        timestamp: Some(timestamp(log_time)),
        level: level as i32,
        message: text.to_owned(),
        name: FRAME_ID.to_owned(),
        file: String::new(),
        line: 0,
    };
    encode(&entry, &mut buffer);
    buffer
}
