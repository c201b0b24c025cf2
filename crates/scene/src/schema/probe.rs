//! Named points whose motion and state are written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use pliant::value::*;

/// A point of a body that is followed: its position, velocity and displacement, and where it is in a finite
/// element the strain and stress there, on `/probe/<name>` and in the table that `pliant run --probes FILE`
/// writes. Exactly one of `at` and `vertex`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeSpec {
    /// Name, unique among the probes.
    #[schemars(regex(pattern = "^[A-Za-z0-9_-]{1,64}$"))]
    pub name: String,
    /// The body it is on; without it, `at` is looked for in all bodies, and `vertex` is of the only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// Its place at rest [m], in a triangle (2D) or tetrahedron (3D). It moves with the vertices of that
    /// cell.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Length>>>")]
    #[schemars(length(min = 2, max = 3))]
    pub at: Option<Vec<f64>>,
    /// A vertex, by index in the body. It has no strain and stress: these belong to elements. `nodal_stress`
    /// gives it a stress.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertex: Option<u32>,
    /// Also writes the stress recovered at vertices, interpolated in its element: the Cauchy stress [Pa] and
    /// its von Mises stress `nodal_von_mises` [Pa]. `[output] recovery` says how. For bodies of finite
    /// elements.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub nodal_stress: bool,
}
