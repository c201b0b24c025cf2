//! Pins and their motions.

use std::collections::BTreeMap;

use super::body::identifier;
use super::check::Checker;
use super::motion;
use super::transform::axis_of_rotation;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{Axis, Body, KeyframesSpec, MotionSpec, OverTime, Pin, RotationSpec, Selection};

pub(super) fn pins(check: &mut Checker, path: &KeyPath, body: &Body, duration: f64) {
    let mut names = BTreeMap::new();
    for (index, pin) in body.pin.iter().enumerate() {
        let path = path.index(index);
        if let Some(selection) = one_selection(check, &path, pin.selections(), true) {
            motion::selection(check, &path, &selection, body.vertex_count());
        }
        if let Some(name) = &pin.name {
            identifier(check, &path.key("name"), name, "a pin");
        }
        let name = pin.name_or_default(index);
        if let Some(first) = names.get(&name) {
            let message = format!("pins {first} and {index} of this body are both named {name:?}");
            check.report(Problem::semantic(path.key("name"), message));
        } else {
            names.insert(name, index);
        }
        if let Some(axes) = &pin.axes {
            self::axes(check, &path.key("axes"), axes);
        }
        if let Some(until) = pin.until {
            check.number(&path.key("until"), until, "s");
        }
        if let Some(spec) = &pin.motion {
            self::motion(check, &path.key("motion"), spec, duration);
            free_but_moved(check, &path, pin);
        }
    }
}

/// Checks that there is exactly one selection, or at most one if none is `needed`; returns it.
pub(super) fn one_selection(
    check: &mut Checker,
    path: &KeyPath,
    mut selections: Vec<Selection>,
    needed: bool,
) -> Option<Selection> {
    if selections.len() == 1 || selections.is_empty() && !needed {
        return selections.pop();
    }
    let message = if selections.is_empty() {
        "this does not select vertices".to_owned()
    } else {
        let keys: Vec<String> = selections.iter().map(|selection| format!("`{}`", selection.key())).collect();
        format!("this selects vertices by {} at once", keys.join(" and "))
    };
    let problem = Problem::semantic(path.clone(), message);
    check.report(problem.with_help("give exactly one of `box`, `half_space`, `vertices` and `group`"));
    None
}

fn axes(check: &mut Checker, path: &KeyPath, axes: &[Axis]) {
    if axes.is_empty() {
        let problem = Problem::semantic(path.clone(), "`axes` is empty: nothing is pinned");
        check.report(problem.with_help("remove `axes` to hold all coordinates"));
    }
    for (index, axis) in axes.iter().enumerate() {
        let path = path.index(index);
        if *axis == Axis::Z && check.dimension == Some(2) {
            check.report(Problem::semantic(path, "there is no z in two dimensions"));
        } else if axes[..index].contains(axis) {
            check.report(Problem::semantic(path, "this axis is listed twice"));
        }
    }
}

pub(super) fn motion(check: &mut Checker, path: &KeyPath, spec: &MotionSpec, duration: f64) {
    let MotionSpec { velocity, displacement, rotation, keyframes } = spec;
    if velocity.is_none() && displacement.is_none() && rotation.is_none() && keyframes.is_none() {
        let problem = Problem::semantic(path.clone(), "`motion` says nothing").at_key();
        check.report(problem.with_help("give `velocity`, `displacement`, `rotation` or `keyframes`"));
    }
    if let Some(velocity) = velocity {
        check.vector(&path.key("velocity"), velocity, "m/s");
    }
    if let Some(displacement) = displacement {
        let path = path.key("displacement");
        check.components(&path, displacement.len());
        formulas(check, &path, displacement, "m", duration);
    }
    if let Some(rotation) = rotation {
        self::rotation(check, &path.key("rotation"), rotation, duration);
    }
    if let Some(keyframes) = keyframes {
        self::keyframes(check, &path.key("keyframes"), keyframes);
    }
}

/// Checks each number or formula of a list; reports the first invalid one.
pub(super) fn formulas(check: &mut Checker, path: &KeyPath, values: &[OverTime], unit: &str, duration: f64) {
    for (index, value) in values.iter().enumerate() {
        if !formula(check, &path.index(index), value, unit, duration) {
            return;
        }
    }
}

/// Checks a number, or that a formula has a value at the start and at the end of the run. Formulas of
/// position are checked when the body is built.
pub(super) fn formula(
    check: &mut Checker,
    path: &KeyPath,
    value: &OverTime,
    unit: &str,
    duration: f64,
) -> bool {
    if let OverTime::Constant(value) = value {
        return check.number(path, *value, unit);
    }
    let bad = [0.0, duration].into_iter().find(|&t| !value.at(t).is_finite());
    let Some(t) = bad.filter(|_| !value.depends_on_place()) else { return true };
    let key = path.last_key().unwrap_or_default();
    let message = format!("`{key}` is {} [{unit}] at t = {t:?} s", value.at(t));
    check.report(Problem::semantic(path.clone(), message));
    false
}

fn rotation(check: &mut Checker, path: &KeyPath, spec: &RotationSpec, duration: f64) {
    axis_of_rotation(check, path, spec.axis.as_deref());
    if let Some(point) = &spec.point {
        check.vector(&path.key("point"), point, "m");
    }
    match (&spec.speed, &spec.angle) {
        (Some(speed), None) => {
            check.number(&path.key("speed"), *speed, "rad/s");
        }
        (None, Some(angle)) => {
            formula(check, &path.key("angle"), angle, "rad", duration);
        }
        (both, _) => {
            let message = match both {
                Some(_) => "a rotation has `speed` or `angle`, not both",
                None => "a rotation needs `speed` or `angle`",
            };
            let problem = Problem::semantic(path.clone(), message).at_key();
            check.report(
                problem.with_help(
                    "for example `speed = \"90 deg/s\"`, or `angle = \"pi * smoothstep(0, 2, t)\"`",
                ),
            );
        }
    }
}

fn keyframes(check: &mut Checker, path: &KeyPath, spec: &KeyframesSpec) {
    let KeyframesSpec { times, displacements, .. } = spec;
    let times_path = path.key("times");
    if check.numbers(&times_path, times, "s") {
        if times.len() < 2 {
            let message = format!("`times` needs two times or more, got {}", times.len());
            check.report(Problem::semantic(times_path.clone(), message));
        }
        if let Some(index) = (1..times.len()).find(|&i| times[i] <= times[i - 1]) {
            let message =
                format!("`times` must ascend, got {:?} after {:?} [s]", times[index], times[index - 1]);
            check.report(Problem::semantic(times_path.index(index), message));
        }
    }
    let path = path.key("displacements");
    check.vectors(&path, displacements, "m");
    if displacements.len() != times.len() {
        let message =
            format!("`displacements` lists {}, but there are {} times", displacements.len(), times.len());
        check.report(Problem::semantic(path, message));
    }
}

/// Rejects a motion along a coordinate that `axes` leaves free, where it would have no effect.
fn free_but_moved(check: &mut Checker, path: &KeyPath, pin: &Pin) {
    let (held, Some(motion)) = (pin.held_axes(), &pin.motion) else { return };
    let path = path.key("motion");
    let mut moved: Vec<(KeyPath, usize)> = vec![];
    let along = |moves: &dyn Fn(usize) -> bool| (0..3).find(|&c| !held[c] && moves(c));
    if let Some(velocity) = &motion.velocity
        && let Some(c) = along(&|c| velocity.get(c).is_some_and(|v| *v != 0.0))
    {
        moved.push((path.key("velocity").index(c), c));
    }
    if let Some(displacement) = &motion.displacement
        && let Some(c) = along(&|c| displacement.get(c).is_some_and(|u| !u.is_zero()))
    {
        moved.push((path.key("displacement").index(c), c));
    }
    if let Some(keyframes) = &motion.keyframes {
        let rows = keyframes.displacements.iter().enumerate();
        let moves = |row: &[f64]| along(&|c| row.get(c).is_some_and(|u| *u != 0.0));
        if let Some((i, c)) = rows.filter_map(|(i, row)| Some((i, moves(row)?))).next() {
            moved.push((path.key("keyframes").key("displacements").index(i).index(c), c));
        }
    }
    for (path, c) in moved {
        let axis = ["x", "y", "z"][c];
        let problem = Problem::semantic(path, format!("this moves along {axis}, which `axes` leaves free"));
        check.report(problem.with_help(format!("add \"{axis}\" to `axes`, or write 0")));
    }
}
