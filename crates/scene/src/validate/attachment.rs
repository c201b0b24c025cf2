//! Attachments between bodies, or to fixed positions.

use std::collections::BTreeMap;

use super::body::identifier;
use super::body_names::BodyNames;
use super::check::Checker;
use super::motion;
use super::pins::one_selection;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{AttachmentSpec, AttachmentTarget, Scene};

pub(super) fn attachments(check: &mut Checker, path: &KeyPath, scene: &Scene) {
    let (mut names, bodies) = (BTreeMap::new(), BodyNames::of(scene));
    for (index, attachment) in scene.attachment.iter().enumerate() {
        let path = path.index(index);
        if let Some(name) = &attachment.name {
            identifier(check, &path.key("name"), name, "an attachment");
        }
        if let Some(first) = names.insert(attachment.name_or_default(index), index) {
            let name = attachment.name_or_default(index);
            let message = format!("attachments {first} and {index} are both named {name:?}");
            check.report(Problem::semantic(path.key("name"), message));
        }
        one(check, &path, attachment, scene, &bodies);
    }
}

fn one(check: &mut Checker, path: &KeyPath, attachment: &AttachmentSpec, scene: &Scene, bodies: &BodyNames) {
    let body = match &attachment.body {
        Some(name) => bodies.known(check, &path.key("body"), name),
        None if scene.body.len() > 1 => {
            let problem = Problem::semantic(path.clone(), "there are several bodies, and this names none");
            check.report(problem.with_help("say whose vertices are tied: `body = \"NAME\"`"));
            None
        }
        None => (!scene.body.is_empty()).then_some(0),
    };
    if let Some(selection) = one_selection(check, path, attachment.selections(), true) {
        let count = body.and_then(|index| scene.body[index].vertex_count());
        motion::selection(check, path, &selection, count);
    }
    if let Some(points) = &attachment.points {
        check.vectors(&path.key("points"), points, "m");
        if attachment.target.is_some() {
            let message = "`points` and `target` are both given";
            let problem = Problem::semantic(path.key("points"), message).at_key();
            check.report(
                problem.with_help("vertices are tied to points in space or to another body: give one"),
            );
        }
    }
    if let Some(target) = &attachment.target {
        let path = path.key("target");
        let other = bodies.known(check, &path.key("body"), &target.body);
        self::target(check, &path, target);
        if body.is_some() && body == other && target.vertices.is_none() {
            let message = "`target` must be a different body: here each vertex is nearest to itself";
            let problem = Problem::semantic(path.key("body"), message);
            check.report(problem.with_help("name another body, or list `vertices` of the same one"));
        }
    }
    let springs = [("stiffness", attachment.stiffness), ("total_stiffness", attachment.total_stiffness)];
    for (key, stiffness) in springs {
        if let Some(stiffness) = stiffness {
            check.number(&path.key(key), stiffness, "N/m");
        }
    }
    if attachment.stiffness.is_some() == attachment.total_stiffness.is_some() {
        let message =
            "an attachment takes exactly one of `stiffness` [N/m], of each tie, and `total_stiffness` [N/m]";
        check.report(Problem::semantic(path.clone(), message));
    }
    check.number(&path.key("rest_length"), attachment.rest_length, "m");
    if let Some(dashpot) = attachment.dashpot {
        check.number(&path.key("dashpot"), dashpot, "N s/m");
    }
}

fn target(check: &mut Checker, path: &KeyPath, target: &AttachmentTarget) {
    let distances = [("nearest_vertex", target.nearest_vertex), ("nearest_point", target.nearest_point)];
    for (key, distance) in distances {
        if let Some(distance) = distance {
            check.number(&path.key(key), distance, "m");
        }
    }
    let given = distances.iter().filter(|(_, distance)| distance.is_some()).count();
    if given + usize::from(target.vertices.is_some()) != 1 {
        let message = "a `target` takes exactly one of `vertices`, `nearest_vertex` and `nearest_point`";
        check.report(Problem::semantic(path.clone(), message));
    }
}
