//! Prescribed motion of the pins of a body, by their numbers, and of obstacles, by their names.

use pliant_scene::{Body, MotionSpec, ObstacleSpec, Pin, Scene};

use crate::parameter::{MotionFactor, Parameter};

/// Keys of the pins of a body that move without turning: `pin.0.motion.factor`.
pub(super) fn keys(spec: &Body) -> impl Iterator<Item = String> {
    let moving = spec.pin.iter().enumerate().filter(|(_, pin)| goes_straight(pin.motion.as_ref()));
    moving.map(|(i, _)| format!("pin.{i}.motion.factor"))
}

/// The factor of a motion of the body of this name by its key.
pub(super) fn parameter(spec: &Body, body: &str, key: &str) -> Option<Box<dyn Parameter>> {
    let index: usize = key.strip_prefix("pin.")?.strip_suffix(".motion.factor")?.parse().ok()?;
    let pin = spec.pin.get(index)?.name_or_default(index);
    Some(Box::new(MotionFactor::new(Pin::hold_name(body, &pin))))
}

/// Names of the obstacles that move without turning, `obstacle.NAME.motion.factor`, and their holds.
fn of_obstacles(scene: &Scene) -> impl Iterator<Item = (String, String)> {
    // Without contact they are not there.
    let obstacles = scene.obstacle.iter().enumerate().filter(|_| scene.contact.is_some());
    let moving = obstacles.filter(|(_, obstacle)| goes_straight(obstacle.motion.as_ref()));
    moving.map(|(i, obstacle)| {
        let name = obstacle.name_or_default(i);
        (format!("obstacle.{name}.motion.factor"), Pin::hold_name(&name, ObstacleSpec::PIN))
    })
}

/// Names of the motions of obstacles.
pub(super) fn names(scene: &Scene) -> impl Iterator<Item = String> {
    of_obstacles(scene).map(|(name, _)| name)
}

/// The factor of the motion of an obstacle of this name.
pub(super) fn of_obstacle(scene: &Scene, name: &str) -> Option<Box<dyn Parameter>> {
    let (_, hold) = of_obstacles(scene).find(|(known, _)| known == name)?;
    Some(Box::new(MotionFactor::new(hold)))
}

/// True if there is a motion, and no rotation in it.
fn goes_straight(motion: Option<&MotionSpec>) -> bool {
    motion.is_some_and(|motion| motion.rotation.is_none())
}
