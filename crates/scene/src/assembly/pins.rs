//! Assembly of pins: constraints of vertices.

use pliant::quantity::{Rounded, counted};
use std::collections::HashMap;

use super::body::BodyAssembly;
use crate::Body;
use crate::KeyPath;
use crate::MotionSpec;
use crate::OverTime;
use crate::Pin;
use crate::Problem;
use crate::RotationSpec;
use pliant::algebra::scene_size;
use pliant::constraint::{Hold, Interpolation, Keyframes, Motion, Rotation};
use pliant_mesh::{Mesh, select};

/// A pin with resolved vertices.
pub(crate) struct PinPlan {
    pub(super) name: String,
    /// Numbered from 0 in the body, ascending.
    pub(super) vertices: Vec<u32>,
    pub(super) spec: Pin,
}

impl PinPlan {
    /// Description of the motion, in words.
    pub(super) fn motion(&self) -> Option<String> {
        let MotionSpec { velocity, displacement, rotation, keyframes } = self.spec.motion.as_ref()?;
        let parts = [
            (rotation.is_some(), "a rotation"),
            (velocity.is_some(), "a constant velocity"),
            (displacement.is_some(), "a formula"),
            (keyframes.is_some(), "keyframes"),
        ];
        let parts: Vec<&str> = parts.into_iter().filter_map(|(has, name)| has.then_some(name)).collect();
        Some(format!("{} on prescribed motion by {}", self.counted(), parts.join(" and ")))
    }

    fn counted(&self) -> String {
        counted(self.vertices.len() as u64, "vertex", "vertices")
    }

    /// Description of the release, in words: after a number of steps for a fixed step size `h` [s],
    /// otherwise at the exact time.
    pub(super) fn release(&self, h: Option<f64>) -> Option<String> {
        let until = self.spec.until?;
        let Some(h) = h else {
            return Some(format!("{} released at t = {until} s", self.counted()));
        };
        // First step that begins at `until - h/2` or later.
        let step = ((until - 0.5 * h) / h).ceil().max(0.0);
        let steps = counted(step as u64, "step", "steps");
        Some(format!("{} released at t = {} s, after {steps}", self.counted(), step * h))
    }

    /// Constraint of the pin in a simulation: `vertices` are the numbers there, `start` and `rest` the
    /// flat initial and reference positions of all vertices.
    pub(super) fn hold(
        &self,
        body: &str,
        vertices: Vec<u32>,
        start: &[f64],
        rest: &[f64],
        dimension: usize,
    ) -> Hold {
        let mut hold = Hold::new(Pin::hold_name(body, &self.name), vertices).along(self.spec.held_axes());
        if let Some(until) = self.spec.until {
            hold = hold.until(until);
        }
        match &self.spec.motion {
            Some(spec) => hold.moving(motion(spec), start, rest, dimension),
            None => hold,
        }
    }
}

/// Resolves the pins of a body with this mesh.
pub(super) fn held(spec: &Body, mesh: &Mesh, path: &KeyPath, problems: &mut Vec<Problem>) -> Vec<PinPlan> {
    let mut held = vec![];
    for (i, pin) in spec.pin.iter().enumerate() {
        let path = path.key("pin").index(i);
        // Validation has checked that there is exactly one.
        let Some(selection) = pin.selections().pop() else { continue };
        match select(mesh, &selection) {
            Ok(vertices) => held.push(PinPlan { name: pin.name_or_default(i), vertices, spec: pin.clone() }),
            Err(error) => problems.push(Problem::semantic(path, error.to_string())),
        }
    }
    problems.extend(contradictions(&held, mesh.dimension, path));
    held
}

/// Rejects coordinates of a moving pin that another pin constrains or moves.
fn contradictions(held: &[PinPlan], dimension: usize, path: &KeyPath) -> Vec<Problem> {
    // For each constrained coordinate the first pin that constrains it, and the first that moves it.
    let mut holders: HashMap<(u32, usize), (usize, Option<usize>)> = HashMap::new();
    let mut problems = vec![];
    for (i, pin) in held.iter().enumerate() {
        let (axes, moves) = (pin.spec.held_axes(), pin.spec.motion.is_some());
        let mut others = vec![];
        for &vertex in &pin.vertices {
            for axis in (0..dimension).filter(|axis| axes[*axis]) {
                let (first, moving) = holders.entry((vertex, axis)).or_insert((i, None));
                let other = if moves { Some(*first).filter(|first| *first < i) } else { *moving };
                others.extend(other.map(|other| (other, axis, vertex)));
                if moves {
                    moving.get_or_insert(i);
                }
            }
        }
        problems.extend(others.into_iter().min().map(|(other, axis, vertex)| {
            let axis = ["x", "y", "z"][axis];
            let message = format!(
                "`{}` and `{}` both pin the {axis} of vertex {vertex}, and one of them moves it",
                held[other].name, pin.name
            );
            let problem = Problem::semantic(path.key("pin").index(i), message);
            problem.with_help("only one pin can prescribe the motion of a coordinate")
        }));
    }
    problems
}

/// Tolerance of a motion's start, as a fraction of the body's size.
const AT_START: f64 = 1e-9;

/// Rejects motions that do not begin at the bodies' initial positions: the pins would jump before the
/// first step, and the energy balance could not include that.
pub(super) fn jumps_at_start(bodies: &[BodyAssembly], dimension: usize) -> Vec<Problem> {
    let mut problems = vec![];
    for (b, body) in bodies.iter().enumerate() {
        let path = KeyPath::root().key("body").index(b).key("pin");
        let allowed = AT_START * scene_size(&body.position, dimension);
        for (i, held) in body.held.iter().enumerate() {
            let Some(spec) = &held.spec.motion else { continue };
            let (start, rest) = (&body.position, &body.mesh.points);
            let jump =
                held.hold(&body.name, held.vertices.clone(), start, rest, dimension).jump_at_start(dimension);
            if jump > allowed {
                let (key, right) = not_zero_at_start(spec);
                let message = format!(
                    "pin `{}` would jump by {jump} m before the first step: its motion begins where the \
                     body starts, and this is not zero at t = 0",
                    held.name,
                    jump = Rounded::<7>(jump)
                );
                problems
                    .push(Problem::semantic(path.index(i).key("motion").key(key), message).with_help(right));
            }
        }
    }
    problems
}

/// Key of the motion that is not zero at the start, and the remedy.
fn not_zero_at_start(spec: &MotionSpec) -> (&'static str, String) {
    let angle = spec.rotation.as_ref().and_then(|rotation| rotation.angle.as_ref());
    let first = spec.keyframes.as_ref().and_then(|keyframes| keyframes.displacements.first());
    if let Some(angle) = angle.map(|angle| angle.at(0.0)).filter(|angle| *angle != 0.0) {
        let right =
            format!("subtract {angle:?} from `angle`, or let it grow from 0, as by smoothstep(0, 1, t)");
        ("rotation", right)
    } else if first.is_some_and(|first| first.iter().any(|u| *u != 0.0)) {
        ("keyframes", "give the displacement 0 at the first of `times`, and go on from there".into())
    } else {
        let right = "subtract from each formula what it is at t = 0, or let it grow from 0, as by \
                     smoothstep(0, 1, t)";
        ("displacement", right.into())
    }
}

/// Results of `say` for the pins of all bodies, each with the pin's name.
pub(super) fn described(bodies: &[BodyAssembly], say: impl Fn(&PinPlan) -> Option<String>) -> Vec<String> {
    let pins = bodies.iter().flat_map(|body| body.held.iter().map(move |held| (body, held)));
    pins.filter_map(|(body, held)| Some(format!("pin `{}/{}`: {}", body.name, held.name, say(held)?)))
        .collect()
}

fn padded(vector: &[f64]) -> [f64; 3] {
    let mut padded = [0.0; 3];
    padded[..vector.len()].copy_from_slice(vector);
    padded
}

fn motion(spec: &MotionSpec) -> Motion {
    let mut motion = Motion::new();
    let angle = spec.rotation.iter().filter_map(|rotation| rotation.angle.as_ref());
    if angle.chain(spec.displacement.iter().flatten()).all(OverTime::is_continuous) {
        motion = motion.continuous();
    }
    if let Some(spec) = &spec.rotation {
        motion = motion.turning(rotation(spec));
    }
    if let Some(velocity) = spec.velocity.as_deref().map(padded) {
        motion = motion.along(move |t| (velocity.map(|v| v * t), velocity));
    }
    if let Some(spec) = &spec.keyframes {
        let displacements = spec.displacements.iter().map(|row| padded(row)).collect();
        let between = if spec.smooth { Interpolation::Smooth } else { Interpolation::Linear };
        let keyframes = Keyframes::new(spec.times.clone(), displacements, between);
        motion = motion.breaking_at(spec.times.clone()).along(move |t| keyframes.at(t));
    }
    if let Some(components) = spec.displacement.clone() {
        motion = motion.by(move |x, t| {
            let mut moved = ([0.0; 3], [0.0; 3]);
            for (c, component) in components.iter().enumerate() {
                moved.0[c] = component.value(x, t);
                moved.1[c] = component.rate(x, t);
            }
            moved
        });
    }
    motion
}

fn rotation(spec: &RotationSpec) -> Rotation {
    let point = spec.point.as_deref().map_or([0.0; 3], padded);
    let axis = spec.axis.as_deref().map_or([0.0, 0.0, 1.0], padded);
    match (spec.angle.clone(), spec.speed) {
        (Some(angle), _) => Rotation::new(point, axis, move |t| (angle.at(t), angle.rate([0.0; 3], t))),
        (None, speed) => {
            let speed = speed.unwrap_or(0.0);
            Rotation::new(point, axis, move |t| (speed * t, speed))
        }
    }
}
