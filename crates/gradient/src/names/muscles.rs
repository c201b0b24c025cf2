//! Parameters of the muscles of a body.

use pliant_scene::{Body, MuscleSpec};

use super::formulas;
use crate::parameter::{FormulaNumber, LoadFactor, LoadValue, Parameter};

/// Keys of the muscles of a body: `muscle.0.tension`, `muscle.0.factor`, `muscle.0.parameters.A`.
pub(super) fn keys(spec: &Body) -> impl Iterator<Item = String> {
    spec.muscle.iter().enumerate().flat_map(|(i, muscle)| {
        let named = formulas::names([&muscle.tension]).into_iter().map(|name| formulas::key(&name));
        let keys = ["tension", "factor"].map(String::from).into_iter().chain(named);
        keys.map(move |key| format!("muscle.{i}.{key}")).collect::<Vec<_>>()
    })
}

/// Key of the fibre directions of a muscle, by its index.
pub(super) fn of_fibres(index: usize) -> String {
    format!("muscle.{index}.fibre.per_element")
}

/// Parameter of a muscle of the body `body` by its key.
pub(super) fn parameter(spec: &Body, body: &str, key: &str) -> Option<Box<dyn Parameter>> {
    let (index, key) = key.strip_prefix("muscle.")?.split_once('.')?;
    let index: usize = index.parse().ok()?;
    let muscle = spec.muscle.get(index)?;
    let term = MuscleSpec::term_name(index, body);
    Some(match key {
        "tension" => Box::new(LoadValue::new(term, 1)),
        "factor" => Box::new(LoadFactor::new(term)),
        _ => Box::new(FormulaNumber::new(term, vec![muscle.tension.clone()], formulas::name(key)?)),
    })
}
