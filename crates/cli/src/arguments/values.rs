//! Values of options.

use pliant::quantity::Kind;

/// A positive number of seconds.
pub(super) fn positive_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds.is_finite() && seconds > 0.0 => Ok(seconds),
        Ok(_) => Err("it must be a positive number of seconds".into()),
        Err(_) => Err("it must be a number of seconds, like 0.5".into()),
    }
}

/// A time with or without its unit.
pub(super) fn time_span(text: &str) -> Result<f64, String> {
    match Kind::TIME.parse(text) {
        Ok(seconds) if seconds.is_finite() && seconds > 0.0 => Ok(seconds),
        Ok(_) => Err("it must be a positive time".into()),
        Err(_) => Err("it must be a time, like 60s or \"5 min\"".into()),
    }
}
