//! Muscles and their fibres.

use super::check::Checker;
use super::pins::{formula, formulas};
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{Body, FibreSpec, OverTime};

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

/// Muscles are in the elements of solids.
fn of_solid(check: &mut Checker, path: &KeyPath, body: &Body) {
    let refused = [
        (body.elastic.is_none(), "is in finite elements, and this body has no `elastic`", "add `elastic`"),
        (
            body.membrane.is_some(),
            "is for solids, and triangles of a `membrane` have no direction to be compared with",
            "remove it, or make a solid",
        ),
    ];
    for (_, message, help) in refused.into_iter().filter(|(is_refused, ..)| *is_refused) {
        let problem = Problem::semantic(path.clone(), format!("`muscle` {message}")).at_key();
        check.report(problem.with_help(help));
    }
}

/// Checks a direction of fibres, but for the number of elements, which the assembly knows.
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
                let message = "this changes with time, and the fibres are those of the body at rest";
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
