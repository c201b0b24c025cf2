//! Loads of a body, by their numbers.

use pliant_scene::{Body, Load};

use crate::parameter::{LoadFactor, LoadValue, Parameter};

/// The factor of a load, whatever its value.
const FACTOR: &str = "factor";

/// Keys of the loads of a body: `load.0.force`, `load.0.factor`.
pub(super) fn keys(spec: &Body) -> impl Iterator<Item = String> {
    let of_load = |(i, load): (usize, &Load)| [load.key(), FACTOR].map(|key| format!("load.{i}.{key}"));
    spec.load.iter().enumerate().flat_map(of_load)
}

/// The number of a load of the body of this name by its key, in `dimension` dimensions.
pub(super) fn parameter(spec: &Body, body: &str, dimension: usize, key: &str) -> Option<Box<dyn Parameter>> {
    let (index, key) = key.strip_prefix("load.")?.split_once('.')?;
    let index: usize = index.parse().ok()?;
    let load = spec.load.get(index)?;
    let term = load.term_name(index, body);
    Some(match key {
        FACTOR => Box::new(LoadFactor::new(term)),
        "pressure" => Box::new(LoadValue::new(term, 1)),
        _ => Box::new(LoadValue::new(term, dimension)),
    })
}
