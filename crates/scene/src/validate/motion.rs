//! Selections, initial positions and initial velocities.

use super::check::Checker;
use super::mesh::no_such_vertex;
use super::surroundings::wall;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{
    AffinePosition, BoxSelection, OneOrMany, PositionSpec, RigidVelocity, Selection, TangentialVelocity,
    VelocitySpec,
};
use pliant::quantity::counted;

pub(super) fn selection(
    check: &mut Checker,
    path: &KeyPath,
    selection: &Selection,
    vertex_count: Option<u64>,
) {
    match selection {
        Selection::Box(corners) => corners_of_box(check, &path.key("box"), corners),
        Selection::HalfSpace(half_space) => wall(check, &path.key("half_space"), half_space),
        Selection::Vertices(vertices) => {
            let path = path.key("vertices");
            if vertices.is_empty() {
                let problem = Problem::semantic(path.clone(), "`vertices` is empty: it selects nothing");
                check.report(problem.with_help("remove this entry"));
            }
            let Some(count) = vertex_count else { return };
            let bad = vertices.iter().enumerate().find(|&(_, &vertex)| u64::from(vertex) >= count);
            if let Some((index, &vertex)) = bad {
                check.report(no_such_vertex(path.index(index), vertex, count));
            }
        }
        Selection::Group(name) => {
            if name.is_empty() {
                check.report(Problem::semantic(
                    path.key("group"),
                    "`group` is empty: name a group of the mesh",
                ));
            }
        }
    }
}

/// Checks the corners of a box. Infinite coordinates are valid: they leave a side open.
pub(super) fn corners_of_box(check: &mut Checker, path: &KeyPath, corners: &BoxSelection) {
    let mut right = true;
    for (key, corner) in [("min", &corners.min), ("max", &corners.max)] {
        let path = path.key(key);
        right &= check.components(&path, corner.len());
        if let Some(axis) = corner.iter().position(|component| component.is_nan()) {
            let message = format!("`{key}` must be a number or infinite, got NaN [m]");
            check.report(Problem::semantic(path.index(axis), message));
            right = false;
        }
    }
    let reversed = corners.min.iter().zip(&corners.max).position(|(min, max)| min > max);
    if let (true, Some(axis)) = (right, reversed) {
        let (min, max) = (corners.min[axis], corners.max[axis]);
        let message = format!("`min` must not exceed `max`, got {min:?} and {max:?} [m]: the box is empty");
        check.report(Problem::semantic(path.key("min").index(axis), message));
    }
}

pub(super) fn position(
    check: &mut Checker,
    path: &KeyPath,
    position: &PositionSpec,
    vertex_count: Option<u64>,
) {
    match position {
        PositionSpec::Affine(map) => affine(check, &path.key("affine"), map),
        PositionSpec::PerVertex(rows) => {
            one_per_vertex(check, &path.key("per_vertex"), rows, "positions", "m", vertex_count);
        }
        PositionSpec::Displacement(rows) => {
            one_per_vertex(check, &path.key("displacement"), rows, "displacements", "m", vertex_count);
        }
    }
}

fn affine(check: &mut Checker, path: &KeyPath, map: &AffinePosition) {
    if let Some(rows) = &map.matrix {
        let path = path.key("matrix");
        check.components(&path, rows.len());
        check.vectors(&path, rows, "");
    }
    for (key, vector) in [("centre", &map.centre), ("translation", &map.translation)] {
        if let Some(vector) = vector {
            check.vector(&path.key(key), vector, "m");
        }
    }
}

/// Checks a list with a vector for each vertex.
fn one_per_vertex(
    check: &mut Checker,
    path: &KeyPath,
    rows: &[Vec<f64>],
    what: &str,
    unit: &str,
    vertex_count: Option<u64>,
) {
    check.vectors(path, rows, unit);
    let listed = rows.len() as u64;
    if let Some(count) = vertex_count.filter(|&count| count != listed) {
        let key = path.last_key().unwrap_or_default();
        let message = format!(
            "`{key}` lists {listed} {what}, but the body has {}",
            counted(count, "vertex", "vertices")
        );
        check.report(Problem::semantic(path.clone(), message));
    }
}

pub(super) fn velocity(
    check: &mut Checker,
    path: &KeyPath,
    velocity: &VelocitySpec,
    vertex_count: Option<u64>,
) {
    match velocity {
        VelocitySpec::Rigid(rigid) => self::rigid(check, &path.key("rigid"), rigid),
        VelocitySpec::PerVertex(velocities) => {
            one_per_vertex(check, &path.key("per_vertex"), velocities, "velocities", "m/s", vertex_count);
        }
        VelocitySpec::Tangential(TangentialVelocity { speed, centre }) => {
            let path = path.key("tangential");
            check.number(&path.key("speed"), *speed, "m/s");
            if let Some(centre) = centre {
                check.vector(&path.key("centre"), centre, "m");
            }
        }
    }
}

fn rigid(check: &mut Checker, path: &KeyPath, rigid: &RigidVelocity) {
    if rigid.linear.is_none() && rigid.angular.is_none() {
        let problem = Problem::semantic(path.clone(), "`rigid` says nothing").at_key();
        check.report(problem.with_help("give `linear` [m/s], `angular` [rad/s] or both"));
    }
    if let Some(linear) = &rigid.linear {
        check.vector(&path.key("linear"), linear, "m/s");
    }
    let Some(angular) = &rigid.angular else { return };
    let path = path.key("angular");
    let numbers = angular.as_slice();
    match angular {
        OneOrMany::One(value) => check.number(&path, *value, "rad/s"),
        OneOrMany::Many(values) => check.numbers(&path, values, "rad/s"),
    };
    let (needed, words) = match check.dimension {
        Some(2) => (1, "one number in 2D, counter-clockwise positive"),
        Some(_) => (3, "three numbers in 3D"),
        None => return,
    };
    if numbers.len() != needed {
        check.report(Problem::semantic(path, format!("`angular` takes {words}, got {}", numbers.len())));
    }
}
