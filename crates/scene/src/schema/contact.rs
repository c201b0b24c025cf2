//! Contact: what touches what, by which law, and obstacles.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BoxSelection, HalfSpace, MeshSpec, MotionSpec};
use pliant::integrator::IntegratorSpec;
use pliant::value::*;

/// Contact between all bodies, of each with itself, and with obstacles; bodies pass through each other
/// without it. `contact = {}` leaves everything to the defaults.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[serde(rename = "Contact")]
pub struct ContactSpec {
    /// Gap at which surfaces begin to push each other away [m]: bodies at rest are nearly so far apart.
    /// Without it a thousandth of the size of the smallest body, at most a quarter of the shortest edge of
    /// any surface.
    #[serde(skip_serializing_if = "Option::is_none", with = "As::<Option<Length>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub distance: Option<f64>,
    /// Pressure scale of the contact force [Pa], the same for the whole run; without it Young's modulus of
    /// the softer of two bodies, in explicit schemes at most what takes three tenths of the largest stable
    /// step.
    #[serde(skip_serializing_if = "Option::is_none", with = "As::<Option<Pressure>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub stiffness: Option<f64>,
    /// Coefficient of friction of all pairs of bodies; none without it.
    #[schemars(range(min = 0.0))]
    pub friction: f64,
    /// Sliding speed below which friction grows smoothly from zero [m/s]: what sticks creeps, but no
    /// faster. Without it a thousandth of the size of all bodies at rest in a second, in explicit schemes
    /// raised where a step does not bear it.
    #[serde(skip_serializing_if = "Option::is_none", with = "As::<Option<Velocity>>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub threshold_speed: Option<f64>,
    /// How often a step may renew the normal forces that friction goes by, until both agree; 20 without it,
    /// and 1 takes those at the start of the step.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1))]
    pub friction_iterations: Option<u32>,
    /// True: in explicit schemes surfaces may pass through each other where contact does not stop them, and
    /// nobody looks; without it that ends the run. Implicit schemes let nothing through.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub allow_penetration: bool,
    /// Step that stiffness and friction of explicit schemes go by [s], where it is not that of the scene: of
    /// scenes that are run with several steps.
    #[serde(skip)]
    #[schemars(skip)]
    pub designed_step: Option<f64>,
    /// True: the energy of explicit schemes, false: that of implicit ones, whatever the scheme: of scenes
    /// that are run by several.
    #[serde(skip)]
    #[schemars(skip)]
    pub explicit_law: Option<bool>,
    /// True: a place that several pairs share counts once for each, as in references that do so; false: once.
    #[serde(skip)]
    #[schemars(skip)]
    pub counts_duplicates: bool,
    /// True: bodies touch walls alone, and these from their planes on, with the whole distance behind them:
    /// of scenes without `[contact]`.
    #[serde(skip)]
    #[schemars(skip)]
    pub of_walls: bool,
    /// Pairs of bodies, obstacles or walls (`wall0`, `wall1`, ..) with other rules. Walls have no friction
    /// but what they are given here.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pairs: Vec<ContactPairSpec>,
}

/// Rules for two bodies, a body and an obstacle or a wall, or a body and itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[serde(rename = "ContactPair")]
pub struct ContactPairSpec {
    /// Their names; the same twice for contact of a body with itself.
    #[schemars(length(min = 2, max = 2))]
    pub between: Vec<String>,
    /// Their coefficient of friction; that of the scene without it, none of a wall.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0))]
    pub friction: Option<f64>,
    /// False: they pass through each other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<bool>,
}

/// How a body touches others, where the scene has `[contact]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[serde(rename = "BodyContact")]
pub struct BodyContactSpec {
    /// Thickness around its surface that nothing enters [m]: half that of a membrane without it, 0 of all
    /// others.
    #[serde(skip_serializing_if = "Option::is_none", with = "As::<Option<Length>>")]
    #[schemars(range(min = 0.0))]
    pub radius: Option<f64>,
    /// False: it may pass through itself.
    #[serde(rename = "self", skip_serializing_if = "Option::is_none")]
    pub with_itself: Option<bool>,
    /// False: it passes through everything, itself included.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub collides: Option<bool>,
}

/// A thing that bodies cannot enter, that nothing moves but its `motion`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[serde(rename = "Obstacle")]
pub struct ObstacleSpec {
    /// Name, unique among bodies and obstacles; default `obstacle0`, `obstacle1`, ...
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(regex(pattern = "^[A-Za-z0-9_-]{1,64}$"))]
    pub name: Option<String>,
    /// What it is.
    pub shape: ObstacleShape,
    /// How it moves; it stays where it is without it. Half-spaces and balls do not turn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionSpec>,
}

/// Shape of an obstacle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ObstacleShape {
    /// Everything behind a plane, as `world.walls` have it.
    HalfSpace(HalfSpace),
    /// A ball, in the plane a disk: exactly round, however coarse it is drawn.
    Ball(ObstacleBall),
    /// A cylinder with round ends, in the plane a strip with round ends: exactly round, however coarse it is
    /// drawn.
    Capsule(ObstacleCapsule),
    /// A box along the axes, in the plane a rectangle.
    Box(BoxSelection),
    /// The surface of a mesh, in the plane its outline.
    Mesh(Box<MeshSpec>),
}

/// A capsule: all that is within the radius of a segment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObstacleCapsule {
    /// Ends of its axis, `(2, dimension)` [m].
    #[serde(with = "As::<Vec<Vec<Length>>>")]
    #[schemars(length(min = 2, max = 2))]
    pub axis: Vec<Vec<f64>>,
    /// Radius [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
}

/// A ball.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObstacleBall {
    /// Centre [m].
    #[serde(with = "As::<Vec<Length>>")]
    #[schemars(length(min = 2, max = 3))]
    pub centre: Vec<f64>,
    /// Radius [m].
    #[serde(with = "As::<Length>")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
}

impl ObstacleSpec {
    /// Name of the pin that holds an obstacle.
    pub const PIN: &str = "motion";

    /// Name of a wall of `world.walls` that contact makes an obstacle, by its index there.
    pub fn name_of_wall(index: usize) -> String {
        format!("wall{index}")
    }

    /// The name, or `obstacle0`, `obstacle1`, ... by the index in the scene.
    pub fn name_or_default(&self, index: usize) -> String {
        self.name.clone().unwrap_or_else(|| format!("obstacle{index}"))
    }
}

impl ContactSpec {
    /// The same with the energy that it has by the scheme and the step of `time`, and keeps by others; `step`
    /// [s] where that names none.
    pub fn kept(&self, time: &super::Time, step: f64) -> ContactSpec {
        ContactSpec {
            designed_step: self.designed_step.or(time.step).or(Some(step)),
            explicit_law: self.explicit_law.or(Some(is_explicit(time.integrator))),
            ..self.clone()
        }
    }

    /// True if its energy is that of explicit schemes in the steps of this one.
    pub fn has_explicit_law(&self, scheme: IntegratorSpec) -> bool {
        self.explicit_law.unwrap_or_else(|| is_explicit(scheme))
    }

    /// Why contact does not hold in the steps of a scheme; `None` where it does.
    pub fn refusal(&self, scheme: IntegratorSpec) -> Option<String> {
        let method = scheme.method();
        // Forces without a pole need no feasible steps; explicit steps that go too far by a barrier end a
        // run.
        if method.holds_contact() || is_explicit(scheme) || self.has_explicit_law(scheme) {
            return None;
        }
        Some(format!(
            "`{}` cannot hold contact: steps that end elsewhere than at a configuration that is solved for, \
             and stages that are solved all at once, without a limit on their way, may lie behind an \
             obstacle",
            method.documentation.name
        ))
    }
}

impl super::Scene {
    /// Contact that acts: that of the scene, or without it that of walls alone, where steps are solved that
    /// hold it.
    pub fn acting_contact(&self) -> Option<Cow<'_, ContactSpec>> {
        if let Some(contact) = &self.contact {
            return Some(Cow::Borrowed(contact));
        }
        let of_walls = ContactSpec { of_walls: true, ..ContactSpec::default() };
        let acts = !self.world.walls.is_empty()
            && !self.world.puts_back
            && self.time.integrator.method().holds_contact();
        acts.then_some(Cow::Owned(of_walls))
    }

    /// Keeps what acts at walls and between bodies by the scheme and the step of this scene, whatever others
    /// it is run by; `step` [s] where it names none.
    pub fn keep_contact(&mut self, step: f64) {
        match self.acting_contact() {
            Some(contact) => self.contact = Some(contact.kept(&self.time, step)),
            None => self.world.puts_back = true,
        }
    }
}

fn is_explicit(scheme: IntegratorSpec) -> bool {
    scheme.method().documentation.solves == 0
}

/// A scheme that a scene is not run by, where several are.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RefusedScheme {
    /// Its name.
    pub integrator: String,
    /// Why.
    pub reason: String,
}

impl RefusedScheme {
    /// The refusal of a scheme by the contact of a scene; `None` where it holds.
    pub fn by_contact(scene: &super::Scene, scheme: IntegratorSpec) -> Option<RefusedScheme> {
        let reason = scene.contact.as_ref()?.refusal(scheme)?;
        Some(RefusedScheme { integrator: scheme.method().documentation.name.into(), reason })
    }
}
