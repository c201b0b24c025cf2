//! Probes: their names and positions.

use std::collections::BTreeMap;

use super::body;
use super::body_names::BodyNames;
use super::check::Checker;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{ProbeSpec, Scene};

/// Maximum number of probes: each is a channel, and channels are numbered.
const MOST_PROBES: usize = 10_000;

pub(super) fn probes(check: &mut Checker, path: &KeyPath, scene: &Scene) {
    if scene.probe.len() > MOST_PROBES {
        let message = format!("{} probes are more than the {MOST_PROBES} there can be", scene.probe.len());
        let problem = Problem::semantic(path.clone(), message);
        check.report(problem.with_help("channels such as `green-strain` have all elements"));
    }
    let bodies = BodyNames::of(scene);
    let mut names = BTreeMap::new();
    for (index, probe) in scene.probe.iter().enumerate() {
        let path = path.index(index);
        body::identifier(check, &path.key("name"), &probe.name, "a probe");
        if let Some(first) = names.insert(probe.name.as_str(), index) {
            let message = format!("probes {first} and {index} are both named {:?}", probe.name);
            check.report(Problem::semantic(path.key("name"), message));
        }
        one(check, &path, probe, &bodies);
    }
}

fn one(check: &mut Checker, path: &KeyPath, probe: &ProbeSpec, bodies: &BodyNames) {
    if let Some(name) = &probe.body {
        bodies.known(check, &path.key("body"), name);
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
