//! Probes: their names and positions.

use std::collections::BTreeMap;

use super::body;
use super::body_names::BodyNames;
use super::check::Checker;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{ProbeSpec, Scene};

/// Maximum number of probes: each is a channel, and channels are numbered.
const MOST_PROBES: u64 = 10_000;

pub(super) fn probes(check: &mut Checker, path: &KeyPath, scene: &Scene) {
    let count: u64 = scene.probe.iter().map(ProbeSpec::count).sum();
    if count > MOST_PROBES {
        let message = format!("{count} probes are more than the {MOST_PROBES} there can be");
        let problem = Problem::semantic(path.clone(), message);
        check.report(problem.with_help("channels such as `green-strain` have all elements"));
        return;
    }
    let bodies = BodyNames::of(scene);
    let mut names = BTreeMap::new();
    for (index, probe) in scene.probe.iter().enumerate() {
        let path = path.index(index);
        body::identifier(check, &path.key("name"), &probe.name, "a probe");
        for one in probe.each() {
            if let Some(first) = names.insert(one.name.clone(), index) {
                let message = format!("probes {first} and {index} are both named {:?}", one.name);
                check.report(Problem::semantic(path.key("name"), message));
                break;
            }
        }
        one(check, &path, probe, &bodies);
    }
}

fn one(check: &mut Checker, path: &KeyPath, probe: &ProbeSpec, bodies: &BodyNames) {
    if let Some(name) = &probe.body {
        bodies.known(check, &path.key("body"), name);
    }
    if let Some(line) = &probe.line {
        let path = path.key("line");
        check.vector(&path.key("to"), &line.to, "m");
        if !(2..=1000).contains(&line.points) {
            let message = format!("a line has 2 to 1000 `points`, not {}", line.points);
            check.report(Problem::semantic(path.key("points"), message));
        }
        if probe.vertex.is_some() {
            let problem = Problem::semantic(path, "a `line` begins at `at`, and the probe is a vertex");
            check.report(problem.with_help("give `at` in place of `vertex`"));
        }
    }
    match (&probe.at, probe.vertex) {
        (Some(at), None) => {
            check.vector(&path.key("at"), at, "m");
        }
        (None, Some(_)) if probe.body.is_none() && bodies.count() > 1 => {
            let problem = Problem::semantic(
                path.key("vertex"),
                "`vertex` is an index in a body, and there are several",
            );
            check.report(problem.with_help("say which: `body = \"NAME\"`"));
        }
        (None, Some(_)) => {}
        (both, _) => {
            let what = if both.is_some() { "both `at` and `vertex`" } else { "neither `at` nor `vertex`" };
            let problem = Problem::semantic(path.clone(), format!("the probe has {what}"));
            check.report(
                problem.with_help("give one of them: a reference position [m], or the index of a vertex"),
            );
        }
    }
}
