//! Loads: forces from outside on a body.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BoxSelection, HalfSpace, OverPlaceOf, OverTime, Selection};
use pliant::value::*;

/// A force from outside. At most one of `box`, `half_space`, `vertices` and `group` says on what, all of the
/// body without them; exactly one of `force`, `force_per_vertex`, `body_force`, `traction` and `pressure`
/// says which. Each number may be a formula of the time `t` and the place at rest `X`, `Y`, `Z`; a load that
/// begins or ends is a formula with `step`, `pulse` or `smoothstep`.
///
/// `traction` and `pressure` act on faces of the surface (edges in 2D, which is one metre thick; triangles
/// in 3D): those of a group of faces, else those with all their vertices in the selection.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// All vertices with `min <= X <= max` at rest (tolerance 1e-9 of the body's size).
    #[serde(default, rename = "box", skip_serializing_if = "Option::is_none")]
    pub corners: Option<BoxSelection>,
    /// All vertices with `normal . X <= offset` at rest (tolerance 1e-9 of the body's size).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub half_space: Option<HalfSpace>,
    /// These vertices, by index in the body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1))]
    pub vertices: Option<Vec<u32>>,
    /// A named group of the mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
    /// A force [N], shared equally between the vertices.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        with = "As::<Option<Vec<OverPlaceOf<Force>>>>"
    )]
    #[schemars(length(min = 2, max = 3))]
    pub force: Option<Vec<OverTime>>,
    /// A force on every vertex [N].
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        with = "As::<Option<Vec<OverPlaceOf<Force>>>>"
    )]
    #[schemars(length(min = 2, max = 3))]
    pub force_per_vertex: Option<Vec<OverTime>>,
    /// A force per volume of the rest shape [N/m^3], interpolated between its values at the vertices as
    /// displacements are: the force on a vertex is the integral with its shape function.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        with = "As::<Option<Vec<OverPlaceOf<ForceDensity>>>>"
    )]
    #[schemars(length(min = 2, max = 3))]
    pub body_force: Option<Vec<OverTime>>,
    /// A force per area of the rest shape [Pa]. It does not turn with the body (dead load).
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        with = "As::<Option<Vec<OverPlaceOf<Pressure>>>>"
    )]
    #[schemars(length(min = 2, max = 3))]
    pub traction: Option<Vec<OverTime>>,
    /// A force per area as it is now, against the normal as it is now [Pa] (follower load): positive presses
    /// on a solid. The normal of a cloth is that of its triangles by the right-hand rule; inside a closed
    /// surface with normals outwards, pressure is negative.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<OverPlaceOf<Pressure>>>")]
    pub pressure: Option<OverTime>,
}

impl Load {
    /// What the keys that select say: one at most, in a scene that is right.
    pub fn selections(&self) -> Vec<Selection> {
        let Load { corners, half_space, vertices, group, .. } = self;
        Selection::among(corners.as_ref(), half_space.as_ref(), vertices.as_ref(), group.as_ref())
    }

    /// The key of its value: `force`, `pressure`, ..
    pub fn key(&self) -> &'static str {
        self.vectors().first().map_or("pressure", |(key, ..)| *key)
    }

    /// Name of its term, as load `index` of a body of this name.
    pub fn term_name(&self, index: usize, body: &str) -> String {
        format!("{} {index} on `{body}`", self.key())
    }

    /// The loads of which every component is given, by their keys and units: one at most with `pressure`, in
    /// a scene that is right.
    pub fn vectors(&self) -> Vec<(&'static str, &'static str, &[OverTime])> {
        let Load { force, force_per_vertex, body_force, traction, .. } = self;
        let all = [
            ("force", "N", force),
            ("force_per_vertex", "N", force_per_vertex),
            ("body_force", "N/m^3", body_force),
            ("traction", "Pa", traction),
        ];
        all.into_iter().filter_map(|(key, unit, load)| Some((key, unit, load.as_deref()?))).collect()
    }
}
