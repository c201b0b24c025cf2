//! Prescribed motion of the pins of a body, by their numbers.

use pliant_scene::{Body, Pin};

use crate::parameter::{MotionFactor, Parameter};

/// Keys of the pins of a body that move without turning: `pin.0.motion.factor`.
pub(super) fn keys(spec: &Body) -> impl Iterator<Item = String> {
    let moves = |pin: &Pin| pin.motion.as_ref().is_some_and(|motion| motion.rotation.is_none());
    let moving = spec.pin.iter().enumerate().filter(move |(_, pin)| moves(pin));
    moving.map(|(i, _)| format!("pin.{i}.motion.factor"))
}

/// The factor of a motion of the body of this name by its key.
pub(super) fn parameter(spec: &Body, body: &str, key: &str) -> Option<Box<dyn Parameter>> {
    let index: usize = key.strip_prefix("pin.")?.strip_suffix(".motion.factor")?.parse().ok()?;
    let pin = spec.pin.get(index)?.name_or_default(index);
    Some(Box::new(MotionFactor::new(Pin::hold_name(body, &pin))))
}
