//! Named points whose motion and state are written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use pliant::value::*;

/// A point of a body that is followed: its position, velocity and displacement, and where it is in a finite
/// element the strain and stress there, on `/probe/<name>` and in the table that `pliant run --probes FILE`
/// writes. Exactly one of `at` and `vertex`; with `line` a row of them.
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
    /// Makes a straight row of probes from `at` on, `NAME-0`, `NAME-1` and so on: values along a line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<ProbeLine>,
}

/// End of a row of probes, and how many there are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeLine {
    /// Position of the last probe in the reference configuration [m].
    #[serde(with = "As::<Vec<Length>>")]
    #[schemars(length(min = 2, max = 3))]
    pub to: Vec<f64>,
    /// Number of probes, evenly spaced, both ends included.
    #[schemars(range(min = 2, max = 1000))]
    pub points: u32,
}

impl ProbeSpec {
    /// Number of single probes that it stands for.
    pub fn count(&self) -> u64 {
        self.line.as_ref().map_or(1, |line| line.points.into())
    }

    /// The single probes that it stands for: itself, or those of its line.
    pub fn each(&self) -> Vec<ProbeSpec> {
        let (Some(line), Some(from)) = (&self.line, &self.at) else { return vec![self.clone()] };
        let last = f64::from(line.points.saturating_sub(1).max(1));
        let at = |i: u32| {
            let part = f64::from(i) / last;
            from.iter().zip(&line.to).map(|(from, to)| (1.0 - part) * from + part * to).collect()
        };
        let one = |i: u32| ProbeSpec {
            name: format!("{}-{i}", self.name),
            at: Some(at(i)),
            line: None,
            ..self.clone()
        };
        (0..line.points).map(one).collect()
    }
}
