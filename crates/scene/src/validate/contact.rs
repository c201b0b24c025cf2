//! Contact and obstacles.

use std::collections::BTreeMap;

use super::body::identifier;
use super::check::Checker;
use super::{mesh, motion, pins, surroundings};
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{
    BodyContactSpec, ContactPairSpec, ContactSpec, MotionSpec, ObstacleShape, ObstacleSpec, Scene,
};
use crate::suggest;

/// Checks `[contact]`, `[[obstacle]]`, and the contact keys of bodies.
pub(super) fn contact(check: &mut Checker, scene: &Scene) {
    let root = KeyPath::root();
    for (index, body) in scene.body.iter().enumerate() {
        if let Some(spec) = &body.contact {
            body_contact(check, &root.key("body").index(index).key("contact"), spec, scene.contact.is_some());
        }
    }
    obstacles(check, &root.key("obstacle"), scene);
    if let Some(contact) = &scene.contact {
        table(check, &root.key("contact"), contact, scene);
        scheme(check, scene);
    }
    if scene.acting_contact().is_some() {
        names_of_walls(check, scene);
    }
}

fn body_contact(check: &mut Checker, path: &KeyPath, spec: &BodyContactSpec, used: bool) {
    if !used {
        let message = "the scene has no `[contact]`: nothing touches";
        let problem = Problem::semantic(path.clone(), message).at_key();
        check.report(problem.with_help("add `contact = {}` to the scene, or remove this"));
    }
    if let Some(radius) = spec.radius {
        check.number(&path.key("radius"), radius, "m");
    }
}

/// Names of bodies and obstacles, in this order.
fn names(scene: &Scene) -> Vec<String> {
    let bodies = scene.body.iter().enumerate().map(|(i, body)| body.name_or_default(i));
    let obstacles = scene.obstacle.iter().enumerate().map(|(i, obstacle)| obstacle.name_or_default(i));
    bodies.chain(obstacles).collect()
}

/// Checks that the names of walls that contact turns into obstacles are unused.
fn names_of_walls(check: &mut Checker, scene: &Scene) {
    let names = names(scene);
    for (index, wall) in walls(scene).enumerate().filter(|(_, wall)| names.contains(wall)) {
        let path = KeyPath::root().key("world").key("walls").index(index);
        let message = format!("{wall:?}, the name of this wall in contact, is that of something else");
        check.report(Problem::semantic(path, message).with_help("give that another name"));
    }
}

fn walls(scene: &Scene) -> impl Iterator<Item = String> {
    (0..scene.world.walls.len()).map(ObstacleSpec::name_of_wall)
}

fn table(check: &mut Checker, path: &KeyPath, contact: &ContactSpec, scene: &Scene) {
    let ContactSpec { distance, stiffness, friction, threshold_speed, friction_iterations, pairs, .. } =
        contact;
    let positive = [
        ("distance", distance, "m"),
        ("stiffness", stiffness, "Pa"),
        ("threshold_speed", threshold_speed, "m/s"),
    ];
    for (key, value, unit) in positive {
        if let Some(value) = value {
            check.number(&path.key(key), *value, unit);
        }
    }
    check.number(&path.key("friction"), *friction, "");
    if let Some(iterations) = friction_iterations {
        check.count(&path.key("friction_iterations"), *iterations as usize);
    }
    let mut names = names(scene);
    names.extend(walls(scene));
    let bodies = scene.body.len();
    let mut seen = BTreeMap::new();
    for (index, pair) in pairs.iter().enumerate() {
        let path = path.key("pairs").index(index);
        self::pair(check, &path, pair, (&names, bodies));
        let mut between = pair.between.clone();
        between.sort_unstable();
        if let Some(first) = seen.insert(between, index) {
            let message = format!("this pair has an entry already, `pairs[{first}]`");
            check.report(Problem::semantic(path.key("between"), message).with_help("make one of both"));
        }
    }
}

/// Checks a pair of two of these names; the names of bodies come first.
fn pair(check: &mut Checker, path: &KeyPath, pair: &ContactPairSpec, (names, bodies): (&[String], usize)) {
    if pair.between.len() != 2 {
        let message = format!("`between` names the two that touch, got {}", pair.between.len());
        let problem = Problem::semantic(path.key("between"), message);
        check.report(problem.with_help("the same name twice stands for contact of a body with itself"));
    }
    for (i, name) in pair.between.iter().enumerate() {
        if !names.contains(name) {
            let known: Vec<&str> = names.iter().map(String::as_str).collect();
            let message = format!("there is no body, obstacle or wall {name:?}");
            let mut problem = Problem::semantic(path.key("between").index(i), message);
            problem.help.extend(suggest::help(name, &known, "bodies, obstacles and walls"));
            check.report(problem);
        }
    }
    let is_obstacle = |name: &String| names[bodies..].contains(name);
    if pair.between.len() == 2 && pair.between.iter().all(is_obstacle) {
        let message = "neither of these is a body, and obstacles and walls do not touch each other";
        check.report(Problem::semantic(path.key("between"), message).with_help("name a body, or remove it"));
    }
    if let Some(friction) = pair.friction {
        check.number(&path.key("friction"), friction, "");
    }
    if pair.friction.is_none() && pair.contact.is_none() {
        let problem = Problem::semantic(path.clone(), "this pair sets nothing");
        check.report(problem.with_help("give `friction`, or `contact = false`"));
    }
}

fn obstacles(check: &mut Checker, path: &KeyPath, scene: &Scene) {
    let bodies: Vec<String> = scene.body.iter().enumerate().map(|(i, b)| b.name_or_default(i)).collect();
    let mut seen = BTreeMap::new();
    for (index, obstacle) in scene.obstacle.iter().enumerate() {
        let path = path.index(index);
        let name = obstacle.name_or_default(index);
        if scene.contact.is_none() {
            let problem = Problem::semantic(
                path.clone(),
                "an obstacle acts by contact, and the scene has no `[contact]`",
            );
            check.report(
                problem.with_help("add `contact = {}`, or a wall of `[world]` for an explicit integrator"),
            );
        }
        if obstacle.name.is_some() {
            identifier(check, &path.key("name"), &name, "an obstacle");
        }
        if bodies.contains(&name) || seen.insert(name.clone(), index).is_some() {
            let message =
                format!("{name:?} is the name of something else: names of bodies and obstacles must differ");
            check.report(Problem::semantic(path.key("name"), message));
        }
        shape(check, &path.key("shape"), obstacle);
        if let Some(motion) = &obstacle.motion {
            pins::motion(check, &path.key("motion"), motion, scene.time.duration);
            turning(check, &path.key("motion"), obstacle, motion);
        }
    }
}

fn shape(check: &mut Checker, path: &KeyPath, obstacle: &ObstacleSpec) {
    match &obstacle.shape {
        ObstacleShape::HalfSpace(half_space) => {
            surroundings::wall(check, &path.key("half_space"), half_space);
        }
        ObstacleShape::Ball(ball) => {
            let path = path.key("ball");
            check.vector(&path.key("centre"), &ball.centre, "m");
            check.number(&path.key("radius"), ball.radius, "m");
        }
        ObstacleShape::Capsule(capsule) => {
            let path = path.key("capsule");
            check.number(&path.key("radius"), capsule.radius, "m");
            check.vectors(&path.key("axis"), &capsule.axis, "m");
            let message = match &capsule.axis[..] {
                [a, b] if a == b => "both ends of the axis are one point: that is a `ball`".into(),
                [_, _] => return,
                ends => format!("the axis has two ends, got {}", ends.len()),
            };
            check.report(Problem::semantic(path.key("axis"), message));
        }
        ObstacleShape::Box(corners) => {
            let path = path.key("box");
            motion::corners_of_box(check, &path, corners);
            for (key, corner) in [("min", &corners.min), ("max", &corners.max)] {
                check.vector(&path.key(key), corner, "m");
            }
        }
        ObstacleShape::Mesh(spec) => mesh::mesh(check, &path.key("mesh"), spec),
    }
}

/// Rejects rotations of half-spaces and balls: each is represented by one vertex, which has no
/// orientation.
fn turning(check: &mut Checker, path: &KeyPath, obstacle: &ObstacleSpec, motion: &MotionSpec) {
    if motion.rotation.is_some() && matches!(obstacle.shape, ObstacleShape::HalfSpace(_)) {
        let problem = Problem::semantic(path.key("rotation"), "a half-space does not turn").at_key();
        check.report(problem.with_help("take a `box` that is large enough, which does"));
    }
    if motion.rotation.is_some() && matches!(obstacle.shape, ObstacleShape::Ball(_)) {
        let problem = Problem::semantic(path.key("rotation"), "a ball does not turn").at_key();
        check.report(problem.with_help("take a `mesh` of a `sphere`, which does"));
    }
}

/// Rejects integrators whose steps do not end at a solution of contact: they could end in
/// interpenetration.
fn scheme(check: &mut Checker, scene: &Scene) {
    let refused = scene.contact.as_ref().and_then(|contact| contact.refusal(scene.time.integrator));
    let Some(message) = refused else { return };
    let problem = Problem::semantic(KeyPath::root().key("time").key("integrator"), message);
    check.report(problem.with_help(
        "contact holds with implicit-euler, bdf2, tr-bdf2, sdirk2, sdirk3, sdirk4, trapezoid, newmark, \
         generalised-alpha with `rho = 0`, quasi-static, and with explicit integrators",
    ));
}
