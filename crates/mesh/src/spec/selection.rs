//! Sets of vertices, as a user writes them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use pliant::value::{As, Length};

/// A set of vertices of a body, by their rest positions.
#[derive(Clone, Debug, PartialEq)]
pub enum Selection {
    /// All vertices with `min <= X <= max` (tolerance 1e-9 of the body's size).
    Box(BoxSelection),
    /// All vertices with `normal . X <= offset` (tolerance 1e-9 of the body's size).
    HalfSpace(HalfSpace),
    /// These vertices, by index in the body.
    Vertices(Vec<u32>),
    /// A named group of the mesh.
    Group(String),
}

impl Selection {
    /// The selections that these keys of a table make.
    pub fn among(
        corners: Option<&BoxSelection>,
        half_space: Option<&HalfSpace>,
        vertices: Option<&Vec<u32>>,
        group: Option<&String>,
    ) -> Vec<Selection> {
        let all = [
            corners.cloned().map(Selection::Box),
            half_space.cloned().map(Selection::HalfSpace),
            vertices.cloned().map(Selection::Vertices),
            group.cloned().map(Selection::Group),
        ];
        all.into_iter().flatten().collect()
    }

    /// The key that says it.
    pub fn key(&self) -> &'static str {
        match self {
            Selection::Box(_) => "box",
            Selection::HalfSpace(_) => "half_space",
            Selection::Vertices(_) => "vertices",
            Selection::Group(_) => "group",
        }
    }
}

/// An axis-aligned box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxSelection {
    /// Lower corner [m].
    #[serde(with = "As::<Vec<Length>>")]
    #[schemars(length(min = 2, max = 3))]
    pub min: Vec<f64>,
    /// Upper corner [m].
    #[serde(with = "As::<Vec<Length>>")]
    #[schemars(length(min = 2, max = 3))]
    pub max: Vec<f64>,
}

/// A rigid half-space: a vertex with `normal . x < offset` is put back on the plane, its normal velocity
/// zeroed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[serde(rename = "Wall")]
pub struct HalfSpace {
    /// Points out of the wall; need not be of unit length.
    #[schemars(length(min = 2, max = 3))]
    pub normal: Vec<f64>,
    /// `normal . x` on the plane [m, after the normal is scaled to unit length].
    #[serde(with = "As::<Length>")]
    pub offset: f64,
}
