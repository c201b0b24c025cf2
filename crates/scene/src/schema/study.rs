//! What a scene may say about studies of its accuracy.

use schemars::{JsonSchema, Schema};
use serde::{Deserialize, Serialize};

use super::positive_entries;
use pliant::integrator::IntegratorSpec;
use pliant::value::*;

/// Bounds of the schema on each entry of a list: above 0 and below 1.
fn entries_below_one(schema: &mut Schema) {
    positive_entries(schema);
    if let Some(entries) = schema.get_mut("items").and_then(|items| items.as_object_mut()) {
        entries.insert("exclusiveMaximum".to_owned(), 1.0.into());
    }
}

/// What `pliant study` compares: errors in time, on this mesh, and with `--refine` total errors. A run takes
/// no notice of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StudySpec {
    /// The schemes; a usual set without it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub integrators: Vec<IntegratorSpec>,
    /// Time steps [s], each changed to the nearest that meets all times of comparison; chosen by factors of
    /// 2 without it, from coarse to where the error no longer falls.
    #[serde(skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Duration>>>")]
    #[schemars(transform = positive_entries)]
    pub steps: Option<Vec<f64>>,
    /// Tolerances of schemes whose steps can follow the error; chosen by factors of 10 where there are
    /// neither `steps` nor these.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(transform = entries_below_one)]
    pub tolerances: Vec<f64>,
    /// Values that are varied beside, for example `["body.0.elastic.neo-hookean.young = 1e5, 1e6"]`: every
    /// combination is studied.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub vary: Vec<String>,
    /// At how many times, evenly spaced up to the duration, states are compared with the reference; 20
    /// without it.
    #[serde(skip_serializing_if = "Option::is_none")]
    // Fewer may all be where errors happen to be small.
    #[schemars(range(min = 20))]
    pub times: Option<usize>,
    /// The largest error of positions, relative to the motion, that the recommendation may have; 0.01
    /// without it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub error: Option<f64>,
    /// The quantities whose total error is studied by `pliant study --refine`, for example
    /// `["tip.y max", "left.force.x mean"]`: PROBE.x, PIN.force.x, energy.elastic, energy.kinetic or
    /// energy.total, and nothing or one of end, max, min, mean, rms, or reaches and a number; displacements
    /// of all probes at the end without it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub of: Vec<String>,
    /// The number of meshes that `pliant study --refine` runs, each with twice the cells along every
    /// direction of the one before; 3 without it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 6))]
    pub refine: Option<usize>,
    /// The elements that `pliant study --refine` compares: `linear`, `quadratic`, `quadrilateral` or
    /// `hexahedron`, `quadratic-quadrilateral` or `quadratic-hexahedron`; all that the mesh has without it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub elements: Vec<String>,
    /// The smallest time step [s] that is chosen; the budget alone ends the refinement without it.
    #[serde(skip_serializing_if = "Option::is_none", with = "As::<Option<Duration>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub smallest_step: Option<f64>,
}

/// Accuracy that `pliant solve` is to reach: it chooses cells, elements, scheme and step, and proves the error.
/// A run takes no notice of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AccuracySpec {
    /// The quantity: PROBE.x, PIN.force.x, energy.elastic, energy.kinetic or energy.total, and nothing or one of
    /// end, max, min, mean, rms, for example `"tip.y max"`.
    pub of: String,
    /// Its largest error: `"1 %"` of its largest magnitude over time, or an error with its unit, `"0.1 mm"`.
    pub error: String,
    /// Wall time of the search [s]; 300 s without it.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Duration>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub budget: Option<f64>,
}
