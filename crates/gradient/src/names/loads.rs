//! Parameters of the loads of a body.

use pliant_scene::{Body, Load, OverTime};

use super::formulas;
use crate::parameter::{FormulaNumber, LoadFactor, LoadValue, Parameter};

/// Key of the factor of a load.
const FACTOR: &str = "factor";

/// Keys of the loads of a body: `load.0.force`, `load.0.factor`, `load.0.parameters.A`.
pub(super) fn keys(spec: &Body) -> impl Iterator<Item = String> {
    spec.load.iter().enumerate().flat_map(|(i, load)| {
        let named = formulas::names(&components(load)).into_iter().map(|name| formulas::key(&name));
        let keys = [load.key(), FACTOR].map(String::from).into_iter().chain(named);
        keys.map(move |key| format!("load.{i}.{key}")).collect::<Vec<_>>()
    })
}

/// Parameter of a load of the body `body` by its key, in `dimension` dimensions.
pub(super) fn parameter(spec: &Body, body: &str, dimension: usize, key: &str) -> Option<Box<dyn Parameter>> {
    let (index, key) = key.strip_prefix("load.")?.split_once('.')?;
    let index: usize = index.parse().ok()?;
    let load = spec.load.get(index)?;
    let term = load.term_name(index, body);
    if let Some(name) = formulas::name(key) {
        return Some(Box::new(FormulaNumber::new(term, components(load), name)));
    }
    Some(match key {
        FACTOR => Box::new(LoadFactor::new(term)),
        "pressure" => Box::new(LoadValue::new(term, 1)),
        _ => Box::new(LoadValue::new(term, dimension)),
    })
}

/// True if the force of the load depends on the reference shape: by areas, or by positions in a formula.
/// Forces per volume are handled with the elements.
pub(super) fn goes_by_shape(load: &Load) -> bool {
    let by_place = |vector: &[OverTime]| vector.iter().any(OverTime::depends_on_place);
    let presses_by_place = load.pressure.as_ref().is_some_and(OverTime::depends_on_place);
    if load.body_force.is_some() {
        return false;
    }
    presses_by_place
        || load.traction.is_some()
        || load.vectors().into_iter().any(|(.., vector)| by_place(vector))
}

/// Components of the value of a load.
fn components(load: &Load) -> Vec<OverTime> {
    let vector = load.vectors().first().map(|(.., vector)| vector.to_vec());
    vector.unwrap_or_else(|| load.pressure.iter().cloned().collect())
}
