//! Scenes that need what the build for the lecture leaves out.

use super::body::BodyAssembly;
use crate::Problem;
use crate::Scene;
use crate::key_path::KeyPath;
use pliant_contact::terms::IS_LEFT_OUT;
use pliant_terms::{IS_FOR_LECTURE, has_material};

/// Refuses them; every scene passes elsewhere.
pub(super) fn check(scene: &Scene, bodies: &[BodyAssembly]) -> Result<(), Vec<Problem>> {
    let problems = needs(scene, bodies, IS_FOR_LECTURE, IS_LEFT_OUT);
    if problems.is_empty() { Ok(()) } else { Err(problems) }
}

/// A problem for each part that a build without elements of higher order, or without contact, cannot have.
fn needs(scene: &Scene, bodies: &[BodyAssembly], for_lecture: bool, without_contact: bool) -> Vec<Problem> {
    let root = KeyPath::root();
    let mut problems = vec![];
    let mut need = |path: KeyPath, what: String| {
        let problem = Problem::semantic(path, format!("the build for the lecture has no {what}"));
        problems.push(problem.with_help("open the scene with the complete build"));
    };
    if without_contact && scene.acting_contact().is_some() {
        need(root.key("contact"), "contact".to_owned());
    }
    for (i, (body, spec)) in bodies.iter().zip(&scene.body).enumerate() {
        let path = root.key("body").index(i);
        if let Some(material) = spec.elastic.as_ref().filter(|material| !has_material(material)) {
            need(path.key("elastic").key(material.name()), format!("material `{}`", material.name()));
        }
        if !for_lecture {
            continue;
        }
        if spec.membrane.is_some() {
            need(path.key("membrane"), "membranes".to_owned());
        }
        if !spec.muscle.is_empty() {
            need(path.key("muscle"), "muscles".to_owned());
        }
        if spec.elastic.is_some() && (body.mesh.block().is_some() || body.mesh.order() != 1) {
            need(path.key("mesh"), "elements but triangles and tetrahedra of first order".to_owned());
        }
    }
    problems
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_out_is_named_at_its_key() {
        let text = r#"
            dimension = 2
            [time]
            integrator = "implicit-euler"
            step = 1e-4
            duration = 1.0
            [contact]
            [[body]]
            mesh = { grid = { cells = [2, 2], size = [1.0, 1.0] } }
            order = 2
            elastic = { stvk = { young = 1e5, poisson = 0.3 } }
            mass = { density = 1000.0 }
        "#;
        let scene = Scene::from_toml(text).unwrap();
        let bodies = super::super::build_bodies(&scene, &scene.directory).unwrap();
        let found = |lecture, contact| -> Vec<String> {
            let problems = needs(&scene, &bodies, lecture, contact);
            problems.iter().map(|problem| problem.path.to_string()).collect()
        };
        assert_eq!(found(false, false), Vec::<String>::new());
        assert_eq!(found(false, true), ["contact"]);
        assert_eq!(found(true, false), ["body.0.mesh"]);
    }
}
