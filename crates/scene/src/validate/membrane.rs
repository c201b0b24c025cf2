//! Membranes.

use super::check::Checker;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{Body, MembraneSpec};
use pliant::material::Plane;

/// Checks `membrane` of `body`, which is at `body_path`.
pub(super) fn membrane(check: &mut Checker, body_path: &KeyPath, membrane: &MembraneSpec, body: &Body) {
    let path = &body_path.key("membrane");
    check.number(&path.key("thickness"), membrane.thickness, "m");
    if check.dimension == Some(2) {
        let message = "`membrane` is for sheets in three dimensions, and `dimension` is 2";
        let problem = Problem::semantic(path.clone(), message).at_key();
        check.report(problem.with_help("remove `membrane`: triangles in 2D are filled by `elastic` alone"));
    }
    match &body.elastic {
        None => {
            let message = "`membrane` needs `elastic`, which this body does not have";
            let problem = Problem::semantic(path.clone(), message).at_key();
            check.report(problem.with_help("say what it is made of: `elastic`, or remove `membrane`"));
        }
        Some(material) if !material.about().frame_indifferent => {
            let message = format!(
                "`{}` depends on the rotation of an element, but triangles of a membrane have no reference \
                 direction",
                material.name()
            );
            let path = body_path.key("elastic").key(material.name());
            let problem = Problem::semantic(path, message).at_key();
            check.report(problem.with_help("use `stvk`, `corotated` or `neo-hookean`"));
        }
        Some(material)
            if !material.about().has_rest_shape && membrane.plane_or_default() == Plane::Stress =>
        {
            let message = format!(
                "`{}` has no rest shape: nothing keeps a sheet of it from becoming infinitely thin",
                material.name()
            );
            let problem = Problem::semantic(path.clone(), message).at_key();
            check.report(problem.with_help("say `plane = \"strain\"`: its thickness then stays what it is"));
        }
        Some(_) => {}
    }
    if body.is_quadratic() {
        let message = "elements of a `membrane` are linear, and this body is of `order` 2";
        let problem = Problem::semantic(body_path.key("order"), message).at_key();
        check.report(problem.with_help("use `order = 1`"));
    }
}
