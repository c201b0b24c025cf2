//! `/log`: messages about the run, as `foxglove.Log`. The channel exists only in files with at least one
//! message.

use std::collections::BTreeMap;

use mcap::Channel;

use super::clock::timestamp;
use super::declaration::{FRAME_ID, typed};
use super::protobuf::{self, MessageWriter};

/// Severity of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LogLevel {
    /// Information.
    Info,
    /// The result may differ from what was intended.
    Warning,
    /// The run cannot continue.
    Error,
}

/// Number of the channel.
pub(super) const NUMBER: u16 = 5;

/// Declares the channel.
pub(super) fn channel() -> Channel<'static> {
    typed(NUMBER, "/log", protobuf::LOG, BTreeMap::new())
}

/// Encodes one message.
pub(super) fn message(level: LogLevel, text: &str, log_time: u64) -> Vec<u8> {
    // Values of the enumeration `foxglove.Log.Level`.
    let level = match level {
        LogLevel::Info => 2,
        LogLevel::Warning => 3,
        LogLevel::Error => 4,
    };
    let mut buffer = Vec::new();
    let mut entry = MessageWriter::append_to(&mut buffer);
    timestamp(&mut entry, 1, log_time);
    entry.integer(2, level).string(3, text).string(4, FRAME_ID);
    buffer
}
