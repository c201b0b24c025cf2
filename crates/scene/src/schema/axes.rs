//! Axes of materials with directions.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::FibreSpec;

/// Axes of the material in each element at rest, by which its directions go: `fibres = [[1, 0, 0]]` are along
/// `first`. For materials with fibres and for formulas of `C11 ..`, `E11 ..`, `I4`, `I6` without `F11 ..`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[serde(rename = "MaterialAxes")]
pub struct MaterialAxesSpec {
    /// Direction of the first axis.
    pub first: FibreSpec,
    /// In 3D a direction in the plane of the first two axes, on the side of the second, not parallel to
    /// `first`. Without it the axes are turned by the smallest rotation from x to `first`, and where `first`
    /// points against x by half a turn about z and the smallest from there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub second: Option<FibreSpec>,
}
