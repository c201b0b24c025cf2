//! Sheets of finite elements in space.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use pliant::material::Plane;
use pliant::value::*;

/// Makes a membrane of a mesh of triangles in 3D: the material of `elastic` fills them to this thickness. A
/// density is then a mass per volume. Only stretching and shearing in the plane of each triangle are
/// resisted; add `bending` to resist folds. A sheet that is pressed resists as much as one that is pulled
/// until it gives way sideways: wrinkles are those that the mesh can show.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MembraneSpec {
    /// Thickness at rest [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub thickness: f64,
    /// Without it, or with `stress`, the faces of the sheet are free: it gets thinner where it is stretched,
    /// as far as leaves no stress across it. With `strain` its thickness cannot change, as in a body in 2D:
    /// stiffer, and several times as fast to compute.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plane: Option<Plane>,
}

impl MembraneSpec {
    /// Plane stress, unless something else is said.
    pub fn plane_or_default(&self) -> Plane {
        self.plane.unwrap_or(Plane::Stress)
    }
}
