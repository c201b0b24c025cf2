//! Muscles and their fibres.

use super::check::Checker;
use super::pins::{formula, formulas};
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{Body, FibreSpec, MaterialAxesSpec, OverTime};
use pliant::material::MaterialSpec;

pub(super) fn muscles(check: &mut Checker, path: &KeyPath, body: &Body, duration: f64) {
    if !body.muscle.is_empty() {
        of_solid(check, path, body);
    }
    for (index, muscle) in body.muscle.iter().enumerate() {
        let path = path.index(index);
        fibre(check, &path.key("fibre"), &muscle.fibre, duration);
        formula(check, &path.key("tension"), &muscle.tension, "Pa", duration);
    }
}

/// Checks that a muscle is in a solid.
fn of_solid(check: &mut Checker, path: &KeyPath, body: &Body) {
    let refused = [
        (body.elastic.is_none(), "is in finite elements, and this body has no `elastic`", "add `elastic`"),
        (
            body.membrane.is_some(),
            "is for solids: triangles of a `membrane` have no reference direction",
            "remove it, or make a solid",
        ),
    ];
    for (_, message, help) in refused.into_iter().filter(|(is_refused, ..)| *is_refused) {
        let problem = Problem::semantic(path.clone(), format!("`muscle` {message}")).at_key();
        check.report(problem.with_help(help));
    }
}

/// Checks the axes of a material; assembly checks the number of elements.
pub(super) fn axes(check: &mut Checker, path: &KeyPath, axes: &MaterialAxesSpec, body: &Body, duration: f64) {
    let has_axes = body.elastic.as_ref().is_none_or(MaterialSpec::has_axes);
    let refused = [
        (
            body.elastic.is_none(),
            "is one of finite elements, and this body has no `elastic`",
            "add `elastic`",
        ),
        (
            !has_axes,
            "has no effect on a material without directions, and none is known on one of `F11 ..`",
            "remove it, or take `holzapfel-gasser-ogden`, or a formula of `I4`, `C11 ..` or `E11 ..`",
        ),
    ];
    for (_, message, help) in refused.into_iter().filter(|(is_refused, ..)| *is_refused) {
        let problem = Problem::semantic(path.clone(), format!("`elastic_axes` {message}")).at_key();
        check.report(problem.with_help(help));
    }
    fibre(check, &path.key("first"), &axes.first, duration);
    let Some(second) = &axes.second else { return };
    fibre(check, &path.key("second"), second, duration);
    if check.dimension == Some(2) {
        let message = "in two dimensions the second axis is across the first";
        check.report(Problem::semantic(path.key("second"), message).at_key().with_help("remove it"));
    }
}

/// Checks a direction of fibres; assembly checks the number of elements.
fn fibre(check: &mut Checker, path: &KeyPath, fibre: &FibreSpec, duration: f64) {
    match fibre {
        FibreSpec::Direction(direction) => {
            let path = path.key("direction");
            let constant: Option<Vec<f64>> = direction.iter().map(OverTime::constant).collect();
            if let Some(vector) = constant {
                check.direction(&path, &vector, "");
                return;
            }
            if check.components(&path, direction.len()) {
                formulas(check, &path, direction, "", duration);
            }
            if let Some(changing) = direction.iter().position(OverTime::depends_on_time) {
                let message = "this changes with time, and the direction is one of the body at rest";
                let problem = Problem::semantic(path.index(changing), message);
                check.report(problem.with_help("give a formula of `X`, `Y` and `Z`"));
            }
        }
        FibreSpec::PerElement(directions) => {
            let path = path.key("per_element");
            for (element, vector) in directions.iter().enumerate() {
                if !check.direction(&path.index(element), vector, "") {
                    return;
                }
            }
        }
    }
}
