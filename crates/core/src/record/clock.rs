//! Simulated time on the clock of MCAP: unsigned nanoseconds from 0.

use foxglove::messages::Timestamp;

/// Rounded to the nearest nanosecond; negative times and NaN become 0. The exact time is in `/energy`.
pub(super) fn nanoseconds(time: f64) -> u64 {
    // `as` saturates, and maps NaN to 0.
    (time * 1e9).round() as u64
}

/// Back to seconds, within half a nanosecond of the original.
pub(super) fn seconds(nanoseconds: u64) -> f64 {
    nanoseconds as f64 * 1e-9
}

/// The same instant as messages carry it. Saturates after 136 years.
pub(super) fn timestamp(nanoseconds: u64) -> Timestamp {
    let second = u32::try_from(nanoseconds / 1_000_000_000).unwrap_or(u32::MAX);
    Timestamp::new(second, (nanoseconds % 1_000_000_000) as u32)
}
