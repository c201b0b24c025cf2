//! Position and copies of the reference shape of a body.

use super::check::Checker;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{Body, OneOrMany, RepeatSpec, RotateSpec, TransformSpec};

/// Number of vertices that 32-bit indices can count.
const MOST_VERTICES: u64 = u32::MAX as u64;

/// Checks `transform` and `repeat` of a body at `path`.
pub(super) fn transform(check: &mut Checker, path: &KeyPath, body: &Body) {
    if let Some(spec) = &body.transform {
        move_shape(check, &path.key("transform"), spec);
    }
    if let Some(spec) = &body.repeat {
        let path = path.key("repeat");
        repeat(check, &path, spec);
        let count = body.mesh.vertex_count().map(|count| count.saturating_mul(spec.copies()));
        if count.is_some_and(|count| count > MOST_VERTICES) {
            let message = format!("the copies together have more than {MOST_VERTICES} vertices");
            check.report(Problem::semantic(path, message).at_key());
        }
    }
}

fn move_shape(check: &mut Checker, path: &KeyPath, spec: &TransformSpec) {
    if let Some(scale) = &spec.scale {
        let path = path.key("scale");
        let factors = match scale {
            OneOrMany::One(factor) => {
                check.number(&path, *factor, "").then_some(std::slice::from_ref(factor))
            }
            OneOrMany::Many(factors) => check.vector(&path, factors, "").then_some(&factors[..]),
        };
        if factors.is_some_and(|factors| factors.contains(&0.0)) {
            check.report(Problem::semantic(path, "a factor of 0 leaves nothing of the shape"));
        }
    }
    if let Some(spec) = &spec.rotate {
        rotate(check, &path.key("rotate"), spec);
    }
    for (key, vector) in [("centre", &spec.centre), ("translate", &spec.translate)] {
        if let Some(vector) = vector {
            check.vector(&path.key(key), vector, "m");
        }
    }
}

fn rotate(check: &mut Checker, path: &KeyPath, spec: &RotateSpec) {
    check.number(&path.key("angle"), spec.angle, "rad");
    axis_of_rotation(check, path, spec.axis.as_deref());
}

/// Checks the axis of the rotation at `path`: required in 3D, invalid in 2D.
pub(super) fn axis_of_rotation(check: &mut Checker, path: &KeyPath, axis: Option<&[f64]>) {
    match (axis, check.dimension) {
        (Some(_), Some(2)) => {
            let problem = Problem::semantic(path.key("axis"), "`axis` is for 3D only, and `dimension` is 2");
            check.report(problem.at_key().with_help("in 2D the rotation is counter-clockwise"));
        }
        (Some(axis), _) => {
            check.direction(&path.key("axis"), axis, "");
        }
        (None, Some(3)) => {
            let problem = Problem::semantic(path.clone(), "a rotation in 3D needs an `axis`").at_key();
            check.report(problem.with_help("for example `axis = [0.0, 0.0, 1.0]`"));
        }
        (None, _) => {}
    }
}

fn repeat(check: &mut Checker, path: &KeyPath, spec: &RepeatSpec) {
    let count = path.key("count");
    let mut right = check.components(&count, spec.count.len());
    for (axis, &copies) in spec.count.iter().enumerate() {
        right &= check.count(&count.index(axis), copies);
    }
    let spacing = path.key("spacing");
    right &= check.vector(&spacing, &spec.spacing, "m");
    let coincide = |axis: &usize| spec.count[*axis] > 1 && spec.spacing.get(*axis) == Some(&0.0);
    if let Some(axis) = (0..spec.count.len()).find(coincide).filter(|_| right) {
        let message =
            format!("the {} copies along this axis would lie at the same position", spec.count[axis]);
        check.report(Problem::semantic(spacing.index(axis), message));
    }
}
