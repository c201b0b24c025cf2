//! The TOML schema of a scene, as plain data in SI units.
//!
//! Externally tagged tables throughout: internally tagged, flattened and untagged enums lose the position of
//! an error in the text.
//!
//! # How to add a key
//! 1. Add a field here (keys of meshes: `crates/mesh/src/spec`) with its documentation and its unit:
//!    `#[serde(with = "As::<Length>")]`, `As::<Option<Vec<Length>>>`, or `As::<OverTimeOf<..>>` if it may
//!    change with time. Units are in `kinds!` of `quantity/kind.rs` in `pliant`.
//! 2. Give its bounds: `#[schemars(range(min = 0.0))]`, `extend("exclusiveMinimum" = 0.0)`. They stand here
//!    and nowhere else: `Checker::number` and `Checker::count` in `validate/check.rs` look them up.
//! 3. Check in `validate/` what several keys say together, and build from it in `assembly/`.
//! 4. Words that users may try instead are in `SYNONYMS` and `ELSEWHERE` of `suggest.rs`.
//! 5. Print the format and the schema anew; `tests/cli/reference.rs` compares both:
//!    `cargo run -- schema --format markdown > docs/scene-format.md`,
//!    `cargo run -- schema > scenes/schema.json`.
//! 6. Name it in a scene of `scenes/`, or in `MORE` of `tests/python/test_bounds.py`, which tries every
//!    bound.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use pliant::diagnostics::recovery::Recovery;
use pliant::integrator::IntegratorSpec;

mod adaptive;
mod arc_length;
mod attachment;
mod axes;
mod bending;
mod body;
mod channel;
mod contact;
mod damping;
mod load;
mod membrane;
mod muscle;
mod pin;
mod probe;
mod solver;
mod study;

pub use adaptive::Adaptive;
pub use arc_length::ArcLengthSpec;
pub use attachment::*;
pub use axes::MaterialAxesSpec;
pub use bending::*;
pub use body::*;
pub use channel::Channel;
pub use contact::*;
pub use damping::*;
pub use load::*;
pub use membrane::*;
pub use muscle::*;
pub use pin::*;
pub use probe::*;
pub use solver::Solver;
pub use study::{AccuracySpec, StudySpec};

pub use pliant::material::Stress;
pub(crate) use pliant::value::*;
pub use pliant::value::{OneOrMany, OverTime};
pub(crate) use pliant::value::{OverPlaceOf, OverTimeOf};
pub use pliant_mesh::spec::*;

/// A scene: bodies, the world around them, how time advances, what is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// One line that says what this is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// Space dimension, 2 (plane strain) or 3.
    #[schemars(range(min = 2, max = 3))]
    pub dimension: usize,
    /// How time advances.
    pub time: Time,
    /// Gravity, walls, drag: what acts on every body.
    #[serde(default)]
    pub world: World,
    /// The bodies, at least one.
    #[serde(default)]
    #[schemars(length(min = 1))]
    pub body: Vec<Body>,
    /// Vertices tied to places or to other bodies.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub attachment: Vec<AttachmentSpec>,
    /// Contact between bodies and with obstacles; bodies pass through each other without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<ContactSpec>,
    /// Things that bodies cannot enter, where there is `[contact]`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub obstacle: Vec<ObstacleSpec>,
    /// Points that are followed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub probe: Vec<ProbeSpec>,
    /// What is written, and how often.
    #[serde(default)]
    pub output: Output,
    /// What `pliant study` compares.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub study: Option<StudySpec>,
    /// Accuracy that `pliant solve` is to reach.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<AccuracySpec>,
    /// Directory that files named in the scene are relative to: where the scene file is. No part of the text.
    #[serde(skip)]
    pub directory: PathBuf,
}

/// How time advances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Time {
    /// The scheme, by name; `pliant list integrators` shows all.
    pub integrator: IntegratorSpec,
    /// How the equations of implicit schemes are solved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solver: Option<Solver>,
    /// Time step [s]. A scene has one of this, `adaptive` and `arc_length`.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Duration>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub step: Option<f64>,
    /// Steps whose size follows the error, for schemes that estimate it (`pliant list integrators` says
    /// which do), or increments of statics that are as large as they can be solved. In place of `step`;
    /// `adaptive = {}` leaves everything to the defaults.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<Adaptive>,
    /// In statics, steps along the path of equilibria, on which the load factor may fall as well. In place
    /// of `step`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arc_length: Option<ArcLengthSpec>,
    /// Simulated time to run [s].
    #[serde(with = "As::<Duration>")]
    #[schemars(range(min = 0.0))]
    pub duration: f64,
    /// Run although the step is above the stability limit; the run then ends by itself once it has blown up.
    #[serde(default)]
    pub allow_unstable: bool,
}

impl Scene {
    /// A scene of these bodies in `dimension` dimensions, with nothing that acts on them and the default
    /// output.
    pub fn new(dimension: usize, time: Time, body: Vec<Body>) -> Self {
        Scene {
            title: None,
            dimension,
            time,
            world: World::default(),
            body,
            attachment: vec![],
            contact: None,
            obstacle: vec![],
            probe: vec![],
            output: Output::default(),
            study: None,
            accuracy: None,
            directory: PathBuf::new(),
        }
    }
}

impl Time {
    /// Steps of `step` [s] for `duration` [s].
    pub fn fixed(integrator: IntegratorSpec, step: f64, duration: f64) -> Self {
        Time {
            integrator,
            solver: None,
            step: Some(step),
            adaptive: None,
            arc_length: None,
            duration,
            allow_unstable: false,
        }
    }
}

/// What acts on every body.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct World {
    /// Uniform gravitational acceleration [m/s^2], one number or formula of the time `t` per dimension:
    /// `["0", "-9.81 * (1 - exp(-t/0.1))"]`.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        with = "As::<Option<Vec<OverTimeOf<Acceleration>>>>"
    )]
    #[schemars(length(min = 2, max = 3))]
    pub gravity: Option<Vec<OverTime>>,
    /// Rigid half-spaces without friction that vertices cannot enter. Steps that are solved hold surfaces off
    /// by contact, from the plane on; vertices that other steps take behind one are put back.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub walls: Vec<HalfSpace>,
    /// True: vertices are put back whatever the scheme: of scenes that are run by several.
    #[serde(skip)]
    #[schemars(skip)]
    pub puts_back: bool,
    /// Newtonian attraction between all vertices of bodies without elements and springs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nbody: Option<NBodySpec>,
    /// Ether drag [1/s]: velocities decay as `exp(-ether_drag * t)`, rigid motion included.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "As::<Option<Rate>>")]
    #[schemars(range(min = 0.0))]
    pub ether_drag: Option<f64>,
}

impl World {
    /// True if gravity is given by a formula: it then does work, and energy is not conserved.
    pub fn gravity_changes(&self) -> bool {
        self.gravity.iter().flatten().any(|component| component.constant().is_none())
    }
}

/// Newtonian gravity `E = -G m_i m_j / sqrt(r^2 + softening^2)` between every pair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[serde(rename = "NBody")]
pub struct NBodySpec {
    /// Gravitational constant `G` [m^3 / (kg s^2)].
    #[serde(with = "As::<GravitationalConstant>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub constant: f64,
    /// Plummer softening length [m].
    #[serde(default, with = "As::<Length>")]
    #[schemars(range(min = 0.0))]
    pub softening: f64,
    /// By a tree, approximately, in a time that grows as `N log N`; by the sum over all pairs without it.
    /// `pliant check` shows the error of the forces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tree: Option<Tree>,
}

/// The tree of Barnes and Hut, with quadrupoles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tree {
    /// Boxes that appear smaller than this [rad] act as a whole: 0.5 is usual, smaller is more accurate and
    /// slower.
    #[serde(with = "As::<Angle>")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1.0))]
    pub opening_angle: f64,
}

/// What is written, and how often.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Frames per simulated second.
    #[serde(with = "As::<Rate>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub rate: f64,
    /// What each frame holds.
    #[schemars(extend("uniqueItems" = true))]
    pub channels: Vec<Channel>,
    /// How stress at vertices follows from the stress of the elements, for the channels `nodal-stress`,
    /// `nodal-von-mises` and `zz`, and for probes with `nodal_stress`; `"patch"` without it. A vertex has
    /// one value there, so `"element"` is for Python's `nodal_stress` alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recovery: Option<Recovery>,
}

impl Default for Output {
    fn default() -> Self {
        let channels = vec![Channel::State, Channel::Mesh, Channel::Energy];
        Output { rate: 60.0, channels, recovery: None }
    }
}

impl Scene {
    /// How stress at vertices is recovered; `None` if nothing in the scene reads it.
    pub fn recovery(&self) -> Option<Recovery> {
        let is_recorded = self.output.channels.iter().any(|channel| channel.is_recovered());
        let is_read = is_recorded || self.probe.iter().any(|probe| probe.nodal_stress);
        is_read.then(|| self.output.recovery.unwrap_or_default())
    }
}
