//! Parameters of prescribed motion: pins of a body, by index, and obstacles, by name.

use pliant_scene::{Body, MotionSpec, ObstacleSpec, OverTime, Pin, Scene};

use super::formulas;
use crate::parameter::{MotionFactor, MotionNumber, MotionShape, Parameter};

/// Prefix of the parameters of obstacles.
const OBSTACLE: &str = "obstacle.";
/// Factor of a motion, after its pin or obstacle.
const FACTOR: &str = "motion.factor";
/// Prefix of the keys of formula parameters of a motion.
const OF_FORMULA: &str = "motion.";

/// Keys of a motion without rotation: `motion.factor`, `motion.parameters.A`.
fn keys_of(motion: Option<&MotionSpec>) -> Vec<String> {
    if !goes_straight(motion) {
        return vec![];
    }
    let named = formulas::names(displacement(motion)).into_iter().map(|name| formulas::key(&name));
    std::iter::once(FACTOR.to_owned()).chain(named.map(|key| format!("{OF_FORMULA}{key}"))).collect()
}

/// Parameter of a motion by its key, for the constraint named `hold`; `rest` are the reference positions
/// of all vertices, flat, in the order of the simulation [m].
fn number(motion: Option<&MotionSpec>, hold: String, key: &str, rest: &[f64]) -> Option<Box<dyn Parameter>> {
    if key == FACTOR {
        return Some(Box::new(MotionFactor::new(hold)));
    }
    let name = formulas::name(key.strip_prefix(OF_FORMULA)?)?;
    Some(Box::new(MotionNumber::new(hold, displacement(motion).to_vec(), name, rest.to_vec())))
}

/// Keys of the pins of a body with motion but no rotation: `pin.0.motion.factor`,
/// `pin.0.motion.parameters.A`.
pub(super) fn keys(spec: &Body) -> impl Iterator<Item = String> {
    let of_pin = |(i, pin): (usize, &Pin)| {
        let keys = keys_of(pin.motion.as_ref()).into_iter();
        keys.map(|key| format!("pin.{i}.{key}")).collect::<Vec<_>>()
    };
    spec.pin.iter().enumerate().flat_map(of_pin)
}

/// Parameter of a motion of the body `body` by its key; `rest` as in [`number`].
pub(super) fn parameter(spec: &Body, body: &str, key: &str, rest: &[f64]) -> Option<Box<dyn Parameter>> {
    let (index, key) = key.strip_prefix("pin.")?.split_once('.')?;
    let index: usize = index.parse().ok()?;
    let pin = spec.pin.get(index)?;
    let hold = Pin::hold_name(body, &pin.name_or_default(index));
    number(pin.motion.as_ref(), hold, key, rest)
}

/// Dependence of pin displacements on the reference positions of the body `body`; `vertices` are its
/// vertices by index in the simulation, `rest` as in [`number`].
pub(super) fn by_shape(spec: &Body, body: &str, vertices: &[u32], rest: &[f64]) -> Vec<Box<dyn Parameter>> {
    let of_pin = |(i, pin): (usize, &Pin)| -> Option<Box<dyn Parameter>> {
        let formulas = displacement(pin.motion.as_ref());
        let differs = formulas.iter().any(OverTime::depends_on_place);
        let hold = Pin::hold_name(body, &pin.name_or_default(i));
        let shape = || MotionShape::new(hold, formulas.to_vec(), vertices.to_vec(), rest.to_vec());
        differs.then(|| Box::new(shape()) as Box<dyn Parameter>)
    };
    spec.pin.iter().enumerate().filter_map(of_pin).collect()
}

/// Obstacles with their names; none without contact.
fn obstacles(scene: &Scene) -> impl Iterator<Item = (String, &ObstacleSpec)> {
    let all = scene.obstacle.iter().enumerate().filter(|_| scene.contact.is_some());
    all.map(|(i, obstacle)| (obstacle.name_or_default(i), obstacle))
}

/// Names of the parameters of obstacle motions: `obstacle.NAME.motion.factor`.
pub(super) fn names(scene: &Scene) -> impl Iterator<Item = String> {
    obstacles(scene).flat_map(|(name, obstacle)| {
        let keys = keys_of(obstacle.motion.as_ref()).into_iter();
        keys.map(|key| format!("{OBSTACLE}{name}.{key}")).collect::<Vec<_>>()
    })
}

/// Parameter of the motion of an obstacle by name; `rest` as in [`number`].
pub(super) fn of_obstacle(scene: &Scene, name: &str, rest: &[f64]) -> Option<Box<dyn Parameter>> {
    let asked = name.strip_prefix(OBSTACLE)?;
    obstacles(scene).find_map(|(name, obstacle)| {
        let key = asked.strip_prefix(&name)?.strip_prefix('.')?;
        let motion = obstacle.motion.as_ref();
        let known = keys_of(motion).iter().any(|known| known == key);
        let hold = Pin::hold_name(&name, ObstacleSpec::PIN);
        if known { number(motion, hold, key, rest) } else { None }
    })
}

/// Formulas of the components of the displacement.
fn displacement(motion: Option<&MotionSpec>) -> &[OverTime] {
    motion.and_then(|motion| motion.displacement.as_deref()).unwrap_or_default()
}

/// True if there is a motion without rotation.
fn goes_straight(motion: Option<&MotionSpec>) -> bool {
    motion.is_some_and(|motion| motion.rotation.is_none())
}
