//! Validation of a scene: errors that can be found without building meshes.
//!
//! Validation continues after an error and reports all of them. A list reports its first bad entry only: a
//! mesh of a million invalid points is one error.

mod adaptive;
mod arc_length;
mod attachment;
mod bending;
mod body;
mod body_names;
mod check;
mod contact;
mod damping;
mod expression;
mod loads;
mod membrane;
mod mesh;
mod motion;
mod muscles;
mod pins;
mod probe;
mod shapes;
mod study;
mod surroundings;
mod transform;

pub(crate) use damping::dashpot_problem;
pub(crate) use expression::spring_problem;

use std::collections::BTreeMap;

use self::check::Checker;
use super::error::Problem;
use super::key_path::KeyPath;
use super::schema::Scene;

/// Problems of `scene`, from the top down.
pub(super) fn problems(scene: &Scene) -> Vec<Problem> {
    let root = KeyPath::root();
    let mut check = Checker::new(scene.dimension);
    if !matches!(scene.dimension, 2 | 3) {
        let message = format!("`dimension` must be 2 or 3, got {}", scene.dimension);
        check.report(Problem::semantic(root.key("dimension"), message));
    }
    adaptive::steps(&mut check, &root.key("time"), &scene.time);
    arc_length::arc_length(&mut check, &root.key("time").key("arc_length"), scene);
    surroundings::time(&mut check, &root.key("time"), &scene.time);
    surroundings::world(&mut check, &root.key("world"), &scene.world, scene.time.duration);
    bodies(&mut check, &root.key("body"), scene);
    attachment::attachments(&mut check, &root.key("attachment"), scene);
    contact::contact(&mut check, scene);
    probe::probes(&mut check, &root.key("probe"), scene);
    surroundings::output(&mut check, &root.key("output"), scene);
    if let Some(study) = &scene.study {
        study::study(&mut check, &root.key("study"), study);
    }
    if let Some(accuracy) = &scene.accuracy {
        study::accuracy(&mut check, &root.key("accuracy"), accuracy);
    }
    check.into_problems()
}

fn bodies(check: &mut Checker, path: &KeyPath, scene: &Scene) {
    if scene.body.is_empty() {
        let problem = Problem::semantic(path.clone(), "the scene has no body");
        check.report(problem.with_help("add one: [[body]] with `mesh` and `mass`"));
    }
    let mut names = BTreeMap::new();
    for (index, body) in scene.body.iter().enumerate() {
        let path = path.index(index);
        body::name(check, &path, body);
        if let Some(first) = names.insert(body.name_or_default(index), index) {
            let problem = Problem::semantic(
                path.key("name"),
                format!("bodies {first} and {index} are both named {:?}", body.name_or_default(index)),
            );
            check
                .report(problem.with_help("names must differ; without a name, body 0 is `body0`, and so on"));
        }
        body::body(check, &path, body, scene.world.nbody.is_some(), scene.time.duration);
    }
    if scene.world.nbody.is_some() && !scene.body.is_empty() && !scene.body.iter().any(|b| b.is_particles()) {
        let problem = Problem::semantic(KeyPath::root().key("world").key("nbody"), "`nbody` acts on nothing");
        check.report(problem.with_help(
            "it attracts the vertices of bodies that have neither `elastic` nor `springs`, and there is no \
             such body",
        ));
    }
}
