//! Reference solutions kept in `tests/data`.

use serde::Deserialize;

/// The state of a body at the end, and its energies.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Case {
    pub(crate) material: String,
    /// Displacements, flat [m].
    pub(crate) u: Vec<f64>,
    /// Velocities, flat [m/s].
    pub(crate) v: Vec<f64>,
    /// [J].
    pub(crate) kinetic: f64,
    /// [J].
    pub(crate) elastic: f64,
}

/// A file of `tests/data`.
#[derive(Debug, Deserialize)]
pub(crate) struct References {
    #[allow(dead_code, reason = "tells readers of the file how it was computed")]
    how: String,
    cases: Vec<Case>,
}

/// The case C13 W1, one material after the other.
pub(crate) fn beam() -> Vec<Case> {
    serde_json::from_str::<References>(include_str!("../data/beam.json")).unwrap().cases
}

/// The case C13 W2.
pub(crate) fn bar() -> Vec<Case> {
    serde_json::from_str::<References>(include_str!("../data/bar.json")).unwrap().cases
}
