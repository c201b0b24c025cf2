//! Arc-length paths of equilibria, and the features that they do not support.

use super::check::Checker;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{ArcLengthSpec, Scene};

/// Checks `[time] arc_length` of a scene.
pub(super) fn arc_length(check: &mut Checker, path: &KeyPath, scene: &Scene) {
    let Some(spec) = &scene.time.arc_length else { return };
    let method = scene.time.integrator.method();
    if !method.is_static() {
        let name = method.documentation.name;
        let message = format!("arc length follows equilibria, but {name} integrates motion in time");
        let problem = Problem::semantic(path.clone(), message).at_key();
        check.report(problem.with_help("use `integrator = \"quasi-static\"`, or give `step`"));
        return;
    }
    numbers(check, path, spec);
    solver(check, scene);
    refuse(check, scene);
    loads(check, path, scene);
}

fn numbers(check: &mut Checker, path: &KeyPath, spec: &ArcLengthSpec) {
    if let Some(first) = spec.first {
        check.number(&path.key("first"), first, "");
    }
    if let Some(largest) = spec.largest {
        check.number(&path.key("largest"), largest, "m");
    }
    let Some(until) = &spec.until else { return };
    if !(1..=2).contains(&until.len()) || until.iter().any(|factor| !factor.is_finite()) {
        let message = format!("`until` is one load factor or two, got {until:?}");
        check.report(Problem::semantic(path.key("until"), message).with_help("as `until = [-1.0, 1.0]`"));
    }
}

/// Rejects solver keys without meaning for arc-length paths.
fn solver(check: &mut Checker, scene: &Scene) {
    let Some(solver) = &scene.time.solver else { return };
    let path = KeyPath::root().key("time").key("solver");
    let given = [
        ("iterations", solver.iterations.is_some()),
        ("linear", solver.linear != Default::default()),
        ("retries", solver.retries.is_some_and(|retries| retries > 0)),
    ];
    for (key, _) in given.into_iter().filter(|(_, given)| *given) {
        let message = format!("`{key}` is not for steps along a path");
        let problem = Problem::semantic(path.key(key), message).at_key();
        check.report(problem.with_help(
            "remove it: they are solved by sparse LU in 20 iterations at most, or tried with a smaller \
             radius",
        ));
    }
}

/// Rejects features that an arc-length path does not support, each with the reason.
fn refuse(check: &mut Checker, scene: &Scene) {
    let root = KeyPath::root();
    let mut no = |path: KeyPath, message: &str, help: &str| {
        check.report(Problem::semantic(path, message).at_key().with_help(help));
    };
    let by_increments = "use `adaptive = {}` instead of `arc_length`";
    if scene.contact.is_some() {
        let message = "arc length does not support contact: the path has kinks where surfaces meet, and \
                       corrections at a fixed arc length may cross them";
        no(root.key("contact"), message, by_increments);
    }
    if !scene.world.walls.is_empty() {
        let message =
            "arc length does not support walls: the path of equilibria has kinks where they are met";
        no(root.key("world").key("walls"), message, by_increments);
    }
    if scene.world.ether_drag.is_some() {
        no(root.key("world").key("ether_drag"), "a path of equilibria has no velocity to drag", "remove it");
    }
    for (b, body) in scene.body.iter().enumerate() {
        let path = root.key("body").index(b);
        if body.damping.is_some() {
            no(path.key("damping"), "a path of equilibria has no rates to damp", "remove it");
        }
        for (p, pin) in body.pin.iter().enumerate() {
            let path = path.key("pin").index(p);
            if pin.until.is_some() {
                let message = "a pin is released at a time, but a path of equilibria has no time";
                no(path.key("until"), message, "remove it");
            }
            if pin.motion.as_ref().is_some_and(|motion| motion.keyframes.is_some()) {
                let message = "keyframes have kinks and ends, and along a path of equilibria the motion \
                               goes on with the load factor";
                no(
                    path.key("motion").key("keyframes"),
                    message,
                    "give a `displacement` in proportion to `t`",
                );
            }
        }
    }
    for (a, attachment) in scene.attachment.iter().enumerate() {
        if attachment.dashpot.is_some() {
            let path = root.key("attachment").index(a).key("dashpot");
            no(path, "a path of equilibria has no rates to damp", "remove it");
        }
    }
}

/// Checks the formulas that change with the load factor: at least one is required, and none may jump.
fn loads(check: &mut Checker, path: &KeyPath, scene: &Scene) {
    let formulas = scene.formulas();
    let mut motions = scene.body.iter().flat_map(|body| &body.pin).filter_map(|pin| pin.motion.as_ref());
    let moves = motions.any(|motion| {
        let turns = motion.rotation.as_ref().and_then(|rotation| rotation.speed);
        turns.is_some_and(|speed| speed != 0.0) || motion.velocity.iter().flatten().any(|v| *v != 0.0)
    });
    if !moves && !formulas.iter().any(|(_, formula)| formula.depends_on_time()) {
        let message = "nothing in the scene grows with the load factor";
        let problem = Problem::semantic(path.clone(), message).at_key();
        check.report(problem.with_help(
            "multiply the load or the prescribed motion that is to grow by `t`: `force = [\"0\", \"-10*t\"]`",
        ));
    }
    for (path, formula) in formulas {
        if formula.depends_on_time() && !formula.is_continuous() {
            let message =
                "this jumps with `t`, which is the load factor: no path of equilibria leads over a jump";
            let problem = Problem::semantic(path, message).at_key();
            check.report(problem.with_help("give a load in proportion to `t`, or one that is smooth"));
        }
    }
}
