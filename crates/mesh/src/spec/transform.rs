//! Position and copies of the reference shape of a body.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use pliant::value::OneOrMany;
use pliant::value::*;

/// The mesh scaled along the axes, then rotated, both about `centre`, then moved:
/// `X = centre + R S (X_mesh - centre) + translate`. It is the rest shape that moves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TransformSpec {
    /// Factor, one for all axes or one for each; not 0. Negative factors mirror.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<OneOrManyOf<Number>>>")]
    pub scale: Option<OneOrMany>,
    /// Rotation, after `scale`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotate: Option<RotateSpec>,
    /// The point that `scale` and `rotate` leave where it is [m]; the origin without it.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Length>>>")]
    #[schemars(length(min = 2, max = 3))]
    pub centre: Option<Vec<f64>>,
    /// Then moved by this [m].
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Length>>>")]
    #[schemars(length(min = 2, max = 3))]
    pub translate: Option<Vec<f64>>,
}

/// A rotation, counter-clockwise seen against `axis`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotateSpec {
    /// Direction of the axis; 3D only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 3, max = 3))]
    pub axis: Option<Vec<f64>>,
    /// Angle [rad].
    #[serde(with = "As::<Angle>")]
    pub angle: f64,
}

/// Copies of the mesh in one body, after `transform`. They share no vertices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RepeatSpec {
    /// Number of copies along each axis.
    #[schemars(length(min = 2, max = 3), inner(range(min = 1)))]
    pub count: Vec<usize>,
    /// Distance from one copy to the next along each axis [m].
    #[serde(with = "As::<Vec<Length>>")]
    #[schemars(length(min = 2, max = 3))]
    pub spacing: Vec<f64>,
}

impl RepeatSpec {
    /// Number of copies; saturates.
    pub fn copies(&self) -> u64 {
        self.count.iter().fold(1, |product, &count| product.saturating_mul(count as u64))
    }
}
