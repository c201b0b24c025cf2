//! Soft attachments between bodies, and to places.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BoxSelection, HalfSpace, Selection};
use pliant::value::*;

/// Vertices of a body tied to places, or to another body, by springs `E = k/2 (d - l)^2` of the distance
/// `d`. Exactly one of `box`, `half_space`, `vertices` and `group` says which vertices; `points` or `target`
/// says to what. Without them each is tied to the place where it starts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AttachmentSpec {
    /// Name, unique among the attachments; messages go by it. Default `attachment0`, `attachment1`, ...
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(regex(pattern = "^[A-Za-z0-9_-]{1,64}$"))]
    pub name: Option<String>,
    /// The body whose vertices are tied; the only one without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<String>,
    /// All vertices with `min <= X <= max` at rest (tolerance 1e-9 of the body's size).
    #[serde(default, rename = "box", skip_serializing_if = "Option::is_none")]
    pub corners: Option<BoxSelection>,
    /// All vertices with `normal . X <= offset` at rest (tolerance 1e-9 of the body's size).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub half_space: Option<HalfSpace>,
    /// These vertices, by index in the body, in this order.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1))]
    pub vertices: Option<Vec<u32>>,
    /// A named group of the mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
    /// Places in space [m], one for each vertex: in the order of `vertices`, ascending for other selections.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Vec<Length>>>>")]
    pub points: Option<Vec<Vec<f64>>>,
    /// Another body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<AttachmentTarget>,
    /// Spring constant `k` of each tie [N/m]. Either this or `total_stiffness`.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Stiffness>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub stiffness: Option<f64>,
    /// Sum of the spring constants of all ties [N/m], shared equally.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Stiffness>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub total_stiffness: Option<f64>,
    /// Rest length `l` [m] of every tie.
    #[serde(default, with = "As::<Length>")]
    #[schemars(range(min = 0.0))]
    pub rest_length: f64,
    /// Constant `c` of a dashpot beside every tie [N s/m]: a force `c` times the rate of its length.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Dashpot>>")]
    #[schemars(range(min = 0.0))]
    pub dashpot: Option<f64>,
}

/// What vertices are tied to in another body. Exactly one of `vertices`, `nearest_vertex` and
/// `nearest_point`; distances are those of the shapes at rest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AttachmentTarget {
    /// Its name.
    pub body: String,
    /// These vertices of it, one for each that is tied.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1))]
    pub vertices: Option<Vec<u32>>,
    /// Its vertex nearest to each that is tied, which must not be further away than this [m].
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Length>>")]
    #[schemars(range(min = 0.0))]
    pub nearest_vertex: Option<f64>,
    /// Its point nearest to each that is tied, which must not be further away than this [m]: anywhere in its
    /// tetrahedra, triangles or edges, of whose vertices it is a mixture.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Length>>")]
    #[schemars(range(min = 0.0))]
    pub nearest_point: Option<f64>,
}

impl AttachmentSpec {
    /// What the keys that select say: one, in a scene that is right.
    pub fn selections(&self) -> Vec<Selection> {
        let AttachmentSpec { corners, half_space, vertices, group, .. } = self;
        Selection::among(corners.as_ref(), half_space.as_ref(), vertices.as_ref(), group.as_ref())
    }

    /// The name, or `attachment0`, `attachment1`, ... by the index in the scene.
    pub fn name_or_default(&self, index: usize) -> String {
        self.name.clone().unwrap_or_else(|| format!("attachment{index}"))
    }
}
