//! Time, world and output: everything except the bodies.

use super::check::Checker;
use super::pins::formulas;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{Channel, HalfSpace, OverTime, Scene, Time, World};
use pliant::diagnostics::recovery::Recovery;
use pliant::integrator::BadParameter;

/// Maximum number of steps: the time is `step * n`, and above 2^53 `n` is not exact.
const MOST_STEPS: f64 = 9_007_199_254_740_992.0;

/// Maximum number of frames: a larger recording fits no disk; a frame of the smallest scene has about 100
/// bytes.
const MOST_FRAMES: f64 = 1e9;

pub(super) fn time(check: &mut Checker, path: &KeyPath, time: &Time) {
    let duration = check.number(&path.key("duration"), time.duration, "s");
    if let Some(step) = time.step {
        let good = check.number(&path.key("step"), step, "s");
        let steps = time.duration / step;
        if good && duration && steps > MOST_STEPS {
            let message = format!(
                "{:?} [s] in steps of {step:?} [s] are {steps:.1e} steps, more than can be counted (2^53)",
                time.duration
            );
            let problem = Problem::semantic(path.key("step"), message);
            check.report(problem.with_help("increase `step` or reduce `duration`"));
        }
    }
    let method = time.integrator.method().documentation;
    if let Err(BadParameter { name, value, right }) = time.integrator.check() {
        let path = path.key("integrator").key(method.name).key(name);
        check.report(Problem::semantic(path, format!("`{name}` must be {right}, got {value:?}")));
    }
    if let Some(solver) = &time.solver {
        let path = path.key("solver");
        if method.solves == 0 {
            let message = format!("`solver` has no effect: {} is explicit", method.name);
            check.report(Problem::semantic(path.clone(), message).with_help("remove `solver`"));
        }
        if let Some(tolerance) = solver.tolerance {
            check.number(&path.key("tolerance"), tolerance, "m");
        }
        if let Some(iterations) = solver.iterations {
            check.count(&path.key("iterations"), iterations as usize);
        }
        if let Some(retries) = solver.retries {
            self::retries(check, &path.key("retries"), retries, time);
        }
    }
}

fn retries(check: &mut Checker, path: &KeyPath, retries: u32, time: &Time) {
    if !check.count(path, retries as usize) {
        check.help("it is how often a step is halved: with 3, parts are as small as an eighth of it");
    }
    if retries > 0 && time.adaptive.is_some() {
        let message = "`retries` are for steps of a fixed size";
        let problem = Problem::semantic(path.clone(), message).at_key();
        check.report(problem.with_help("remove it: adaptive steps are retried anyway, down to `smallest`"));
    }
}

pub(super) fn world(check: &mut Checker, path: &KeyPath, world: &World, duration: f64) {
    if let Some(gravity) = &world.gravity {
        self::gravity(check, &path.key("gravity"), gravity, duration);
    }
    for (index, half_space) in world.walls.iter().enumerate() {
        wall(check, &path.key("walls").index(index), half_space);
    }
    if let Some(nbody) = &world.nbody {
        let path = path.key("nbody");
        check.number(&path.key("constant"), nbody.constant, "m^3/(kg s^2)");
        check.number(&path.key("softening"), nbody.softening, "m");
        if let Some(tree) = &nbody.tree {
            opening_angle(check, &path.key("tree").key("opening_angle"), tree.opening_angle);
        }
    }
    if let Some(drag) = world.ether_drag {
        check.number(&path.key("ether_drag"), drag, "1/s");
    }
}

/// Checks that components are numbers, or formulas with a value at the start and at the end of the run.
fn gravity(check: &mut Checker, path: &KeyPath, gravity: &[OverTime], duration: f64) {
    check.components(path, gravity.len());
    formulas(check, path, gravity, "m/s^2", duration);
}

fn opening_angle(check: &mut Checker, path: &KeyPath, angle: f64) {
    if !check.number(path, angle, "rad") {
        check.help("0.5 is usual; above 1, the expansion of a box would be used within it");
    }
}

pub(super) fn wall(check: &mut Checker, path: &KeyPath, wall: &HalfSpace) {
    check.direction(&path.key("normal"), &wall.normal, "");
    check.number(&path.key("offset"), wall.offset, "m");
}

pub(super) fn output(check: &mut Checker, path: &KeyPath, scene: &Scene) {
    let output = &scene.output;
    let rate = path.key("rate");
    if check.number(&rate, output.rate, "frames/s") {
        let frames = output.rate * scene.time.duration;
        if scene.time.duration.is_finite() && frames > MOST_FRAMES {
            let message = format!(
                "{:?} [frames/s] for {:?} [s] are {frames:.1e} frames",
                output.rate, scene.time.duration
            );
            let problem = Problem::semantic(rate, message);
            check.report(problem.with_help(format!("at most {MOST_FRAMES:.0e}: reduce `rate`")));
        }
    }
    for (index, channel) in output.channels.iter().enumerate() {
        if output.channels[..index].contains(channel) {
            let message = format!("channel `{}` is listed twice", channel.name());
            check.report(Problem::semantic(path.key("channels").index(index), message));
        }
        let nothing_holds = scene.world.walls.is_empty()
            && scene.obstacle.is_empty()
            && scene.body.iter().all(|body| body.pin.is_empty());
        if *channel == Channel::Reactions && nothing_holds {
            let message = "channel `reactions` is about pins, obstacles and walls, and the scene has none";
            let problem = Problem::semantic(path.key("channels").index(index), message);
            check.report(problem.with_help(
                "leave it out, or give a body a `pin`, the scene an `[[obstacle]]` or the world a wall",
            ));
        }
        if channel.is_of_contact() && scene.acting_contact().is_none() {
            let message = format!(
                "channel `{}` is about surfaces that touch, and the scene has no `[contact]`",
                channel.name()
            );
            let problem = Problem::semantic(path.key("channels").index(index), message);
            check.report(problem.with_help("leave it out, or add `contact = {}` to the scene"));
        }
        let is_of_elements = channel.field().is_some() && !channel.is_of_contact();
        if is_of_elements && !scene.body.iter().any(|body| body.elastic.is_some()) {
            let message =
                format!("channel `{}` is about finite elements, and no body is `elastic`", channel.name());
            let problem = Problem::semantic(path.key("channels").index(index), message);
            check.report(problem.with_help("leave it out, or give a body `elastic`"));
        }
        let sheet = scene.body.iter().position(|body| body.membrane.is_some());
        if let Some(sheet) = sheet.filter(|_| *channel == Channel::Zz) {
            let name = scene.body[sheet].name.clone().unwrap_or_else(|| format!("body{sheet}"));
            let message =
                format!("channel `zz` divides by the stiffness of solids, and `{name}` is a membrane");
            let problem = Problem::semantic(path.key("channels").index(index), message);
            check.report(problem.with_help("leave it out; `nodal-stress` has the stress of membranes, too"));
        }
    }
    recovery(check, &path.key("recovery"), scene);
}

fn recovery(check: &mut Checker, path: &KeyPath, scene: &Scene) {
    match (scene.output.recovery, scene.recovery()) {
        (Some(_), None) => {
            let problem =
                Problem::semantic(path.clone(), "`recovery` has no effect: nothing reads its stress");
            check.report(problem.with_help(
                "leave it out, or name a channel `nodal-stress`, `nodal-von-mises` or `zz`, or give a probe \
                 `nodal_stress = true`",
            ));
        }
        (Some(Recovery::Element), Some(_)) => {
            let message = "`element` gives each element its own stress at a vertex, and channels and probes \
                           have one stress at a vertex";
            check.report(Problem::semantic(path.clone(), message).with_help(
                "use \"patch\" or \"average\", or in Python `simulation.nodal_stress(recovery=\"element\")`",
            ));
        }
        _ => {}
    }
}
