//! Shapes that are generated with named groups of their boundary.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{WholeCell, positive_entries};
use pliant::value::*;

/// A ball of `20 cells^3` tetrahedra. Group: `surface`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BallSpec {
    /// Radius [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
    /// Number of cells from the centre to the surface.
    #[schemars(range(min = 1))]
    pub cells: usize,
    /// Centre [m]; the origin without it.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Length>>>")]
    #[schemars(length(min = 3, max = 3))]
    pub centre: Option<Vec<f64>>,
}

/// The surface of a ball: `20 cells^2` triangles in space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereSpec {
    /// Radius [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
    /// Number of cells along each side of the 20 faces of an icosahedron.
    #[schemars(range(min = 1))]
    pub cells: usize,
    /// Centre [m]; the origin without it.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Length>>>")]
    #[schemars(length(min = 3, max = 3))]
    pub centre: Option<Vec<f64>>,
}

/// A cylinder along z. Groups: `side`, `bottom`, `top`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylinderSpec {
    /// Radius [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
    /// Height [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub height: f64,
    /// Number of cells from the axis outwards, and along it.
    #[schemars(inner(range(min = 1)))]
    pub cells: [usize; 2],
    /// Centre of the bottom [m]; the origin without it.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Length>>>")]
    #[schemars(length(min = 3, max = 3))]
    pub origin: Option<Vec<f64>>,
}

/// A hollow cylinder along z. Groups: `inner`, `outer`, `bottom`, `top`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TubeSpec {
    /// Inner radius [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub inner_radius: f64,
    /// Outer radius [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub outer_radius: f64,
    /// Height [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub height: f64,
    /// Number of cells through the wall, around (at least 3), and along the axis.
    #[schemars(inner(range(min = 1)))]
    pub cells: [usize; 3],
    /// Centre of the bottom [m]; the origin without it.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Length>>>")]
    #[schemars(length(min = 3, max = 3))]
    pub origin: Option<Vec<f64>>,
}

/// A ring in 2D. Groups: `inner`, `outer`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AnnulusSpec {
    /// Inner radius [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub inner_radius: f64,
    /// Outer radius [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub outer_radius: f64,
    /// Number of cells across the ring, and around it (at least 3).
    #[schemars(inner(range(min = 1)))]
    pub cells: [usize; 2],
    /// Centre [m]; the origin without it.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Length>>>")]
    #[schemars(length(min = 2, max = 2))]
    pub centre: Option<Vec<f64>>,
    /// Element that cells are made into: 2 triangles each without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub element: Option<WholeCell>,
}

/// Cook's membrane in 2D, corners (0, 0), (48, 44), (48, 60), (0, 44) [m]; `transform` makes it smaller.
/// Groups: `left`, `right`, `bottom`, `top`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CooksMembraneSpec {
    /// Number of cells along x, and across.
    #[schemars(inner(range(min = 1)))]
    pub cells: [usize; 2],
    /// Element that cells are made into: 2 triangles each without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub element: Option<WholeCell>,
}

/// A beam in 2D along x, symmetric about `y = 0`, with a height that changes linearly. Without `length` and
/// `heights` the membrane of NAFEMS FV32. Groups: `left`, `right`, `bottom`, `top`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TaperedBeamSpec {
    /// Number of cells along x, and across.
    #[schemars(inner(range(min = 1)))]
    pub cells: [usize; 2],
    /// Length [m].
    #[serde(default = "fv32_length", with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub length: f64,
    /// Height at `x = 0` and at `x = length` [m].
    #[serde(default = "fv32_heights", with = "As::<[Length; 2]>")]
    #[schemars(transform = positive_entries)]
    pub heights: [f64; 2],
    /// Element that cells are made into: 2 triangles each without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub element: Option<WholeCell>,
}

fn fv32_length() -> f64 {
    10.0
}

fn fv32_heights() -> [f64; 2] {
    [5.0, 1.0]
}

/// A beam in 2D from the origin along x, with a V-shaped notch in the middle of its upper side. Groups:
/// `left`, `right`, `bottom`, `top`, `notch`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NotchedBeamSpec {
    /// Length [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub length: f64,
    /// Height [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub height: f64,
    /// Depth of the notch [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub depth: f64,
    /// Width of its mouth [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub width: f64,
    /// Number of cells along x on either side of the notch, in either half of it, and across.
    #[schemars(inner(range(min = 1)))]
    pub cells: [usize; 3],
    /// Element that cells are made into: 2 triangles each without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub element: Option<WholeCell>,
}

/// A quarter of an elliptic ring in 2D, about the origin. Without `inner` and `outer` the membrane of NAFEMS
/// LE1. Groups: `inner`, `outer`, `bottom` (on the x-axis), `left` (on the y-axis).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EllipticMembraneSpec {
    /// Number of cells outwards, and around.
    #[schemars(inner(range(min = 1)))]
    pub cells: [usize; 2],
    /// Semi-axes of the inner ellipse along x and y [m].
    #[serde(default = "le1_inner", with = "As::<[Length; 2]>")]
    #[schemars(transform = positive_entries)]
    pub inner: [f64; 2],
    /// Semi-axes of the outer ellipse along x and y [m].
    #[serde(default = "le1_outer", with = "As::<[Length; 2]>")]
    #[schemars(transform = positive_entries)]
    pub outer: [f64; 2],
    /// Element that cells are made into: 2 triangles each without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub element: Option<WholeCell>,
}

fn le1_inner() -> [f64; 2] {
    [2.0, 1.0]
}

fn le1_outer() -> [f64; 2] {
    [3.25, 2.75]
}
