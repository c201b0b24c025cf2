//! Simulated time on MCAP's clock: unsigned nanoseconds from 0.

use super::protobuf::MessageWriter;

/// Nanoseconds, rounded to nearest; negative times and NaN become 0. The exact time is in `/energy`.
pub(super) fn nanoseconds(time: f64) -> u64 {
    // `as` saturates, and maps NaN to 0.
    (time * 1e9).round() as u64
}

/// Converts to seconds, within half a nanosecond of the original.
pub(super) fn seconds(nanoseconds: u64) -> f64 {
    nanoseconds as f64 * 1e-9
}

/// Writes the time as a `google.protobuf.Timestamp` field of a message. Saturates after 136 years.
pub(super) fn timestamp(message: &mut MessageWriter<'_>, field: u8, nanoseconds: u64) {
    let second = (nanoseconds / 1_000_000_000).min(u32::MAX.into());
    message.message(field, |time| {
        time.integer(1, second).integer(2, nanoseconds % 1_000_000_000);
    });
}
