//! Resistance to bending.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use pliant::quantity::Quantity;
use pliant::value::OneOrMany;
use pliant::value::*;

/// Bending: either `stiffness`, or what it follows from, `young` and `thickness`.
///
/// A sheet: `E = sum D/2 |e|^2 / (A_1 + A_2) (theta - theta_0)^2` over the edges `e` between two triangles
/// of rest areas `A`, `theta` the angle between them. Bent along the sides of a grid, or of equilateral
/// triangles any way, that is the energy of a plate of stiffness `D`; it depends on the triangles, and along
/// the diagonal of a grid it is three times that. A strand: `E = sum B / (l_1 + l_2) (kappa - kappa_0)^2` at
/// the vertices between two edges, `kappa = 2 tan(phi/2)` of the angle `phi` there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BendingSpec {
    /// Moment per curvature: of a sheet `D` [N m], of a strand `B` [N m^2], in 2D for one metre of width [N
    /// m].
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<BendingStiffness>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub stiffness: Option<Quantity>,
    /// Young's modulus `E` [Pa].
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Pressure>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub young: Option<f64>,
    /// Poisson's ratio, 0 without it; sheets only.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Number>>")]
    #[schemars(extend("exclusiveMinimum" = -1.0), range(max = 0.5))]
    pub poisson: Option<f64>,
    /// Thickness `h` [m]: of a sheet, `D = E h^3 / (12 (1 - nu^2))`; of a strand in 2D, `B = E h^3 / 12`; in
    /// 3D the diameter, `B = E pi h^4 / 64`.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Length>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub thickness: Option<f64>,
    /// Which shape is free of moments; that of the mesh without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rest: Option<BendingRest>,
}

/// The shape without moments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BendingRest {
    /// That of the mesh.
    Mesh,
    /// Flat, straight.
    Flat,
    /// These angles [rad], one for all or one for each hinge (edges between two triangles, in ascending order
    /// of their vertices) or joint (vertices between two edges, ascending). A sheet folds by a positive angle
    /// to the side that the normals of its triangles point to. A strand in 2D turns by a positive angle
    /// counter-clockwise along its way; in 3D the direction of its bend is free, since nothing resists twist:
    /// a straight strand bends wherever it is pushed first.
    Angle(#[serde(with = "As::<OneOrManyOf<Angle>>")] OneOrMany),
}
