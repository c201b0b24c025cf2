//! Pins: what is held, and how it moves.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BoxSelection, HalfSpace, OverPlaceOf, OverTime, OverTimeOf, Selection};
use pliant::value::*;

/// Vertices that are held. Exactly one of `box`, `half_space`, `vertices` and `group` says which. Without
/// the other keys, all of their coordinates stay where they are.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pin {
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
    /// Name, unique in the body; reactions go by it. Default `pin0`, `pin1`, ...
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(regex(pattern = "^[A-Za-z0-9_-]{1,64}$"))]
    pub name: Option<String>,
    /// The coordinates that are held; all of them without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1), extend("uniqueItems" = true))]
    pub axes: Option<Vec<Axis>>,
    /// When it lets go [s]: at the beginning of the step nearest to this time. Never without it.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Duration>>")]
    #[schemars(range(min = 0.0))]
    pub until: Option<f64>,
    /// How it moves; it stays where it is without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionSpec>,
}

/// An axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Axis {
    /// The first coordinate.
    X,
    /// The second coordinate.
    Y,
    /// The third coordinate.
    Z,
}

/// A prescribed motion: what is held turns about a point by `rotation`, and is moved by the sum of
/// `velocity * t`, `keyframes` and `displacement`. At least one of them. All start from where the body
/// starts: at `t = 0` they are zero. A jump later on, as by `step`, is taken in one step, counted as work
/// and warned of. A motion that is changed while a simulation runs goes on from where the pin is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotionSpec {
    /// Constant velocity [m/s].
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Velocity>>>")]
    #[schemars(length(min = 2, max = 3))]
    pub velocity: Option<Vec<f64>>,
    /// Displacement [m], one number or formula of the time `t` and the place at rest `X`, `Y`, `Z` per
    /// dimension: `["0", "0.01 * X * sin(2*pi*t)"]`. Velocities are its exact derivatives.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        with = "As::<Option<Vec<OverPlaceOf<Length>>>>"
    )]
    #[schemars(length(min = 2, max = 3))]
    pub displacement: Option<Vec<OverTime>>,
    /// Rotation about an axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<RotationSpec>,
    /// Displacements at some times, and between them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub keyframes: Option<KeyframesSpec>,
}

/// A rotation, counter-clockwise seen against the axis. Exactly one of `speed` and `angle`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotationSpec {
    /// Direction of the axis; 3D only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 3, max = 3))]
    pub axis: Option<Vec<f64>>,
    /// A point of the axis [m]; the origin without it.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Vec<Length>>>")]
    #[schemars(length(min = 2, max = 3))]
    pub point: Option<Vec<f64>>,
    /// Constant angular velocity [rad/s].
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<AngularVelocity>>")]
    pub speed: Option<f64>,
    /// Angle from the start [rad], a number or a formula of the time `t`: `"pi * smoothstep(0, 2, t)"`.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<OverTimeOf<Angle>>>")]
    pub angle: Option<OverTime>,
}

/// Displacements from the start at some times; before the first and after the last, nothing moves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeyframesSpec {
    /// The times, ascending [s].
    #[serde(with = "As::<Vec<Duration>>")]
    #[schemars(length(min = 2), inner(range(min = 0.0)))]
    pub times: Vec<f64>,
    /// The displacement at each time [m].
    #[serde(with = "As::<Vec<Vec<Length>>>")]
    #[schemars(length(min = 2))]
    pub displacements: Vec<Vec<f64>>,
    /// Cubics with continuous velocity between the times, which never overshoot and rest at both ends;
    /// straight lines, at whose ends velocities jump, without it.
    #[serde(default)]
    pub smooth: bool,
}

impl Pin {
    /// What the keys that select say: one, in a scene that is right.
    pub fn selections(&self) -> Vec<Selection> {
        let Pin { corners, half_space, vertices, group, .. } = self;
        Selection::among(corners.as_ref(), half_space.as_ref(), vertices.as_ref(), group.as_ref())
    }

    /// The name, or `pin0`, `pin1`, ... by the index in the body.
    pub fn name_or_default(&self, index: usize) -> String {
        self.name.clone().unwrap_or_else(|| format!("pin{index}"))
    }

    /// Name of the hold of a pin of this name, of a body of that one: of the body alone without a name of the
    /// pin, as walls hold.
    pub fn hold_name(body: &str, pin: &str) -> String {
        if pin.is_empty() { body.to_owned() } else { format!("{body}/{pin}") }
    }

    /// Which of x, y, z are held.
    pub fn held_axes(&self) -> [bool; 3] {
        let Some(axes) = &self.axes else { return [true; 3] };
        [Axis::X, Axis::Y, Axis::Z].map(|axis| axes.contains(&axis))
    }
}

impl From<Selection> for Pin {
    fn from(selection: Selection) -> Pin {
        let pin = Pin::default();
        match selection {
            Selection::Box(corners) => Pin { corners: Some(corners), ..pin },
            Selection::HalfSpace(half_space) => Pin { half_space: Some(half_space), ..pin },
            Selection::Vertices(vertices) => Pin { vertices: Some(vertices), ..pin },
            Selection::Group(group) => Pin { group: Some(group), ..pin },
        }
    }
}
