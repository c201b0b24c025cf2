//! Energy formulas.

use super::check::Checker;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{Body, SpringsSpec};
use crate::text::expression_problem;
use pliant::energy::spring::SpringFormulaError;
use pliant::expression::FormulaError;
use pliant::material::{EnergyExpression, EnergyMistake, MaterialSpec, ParameterError};

/// Checks `elastic.expression` at `path` of `body`.
pub(super) fn expression(check: &mut Checker, path: &KeyPath, energy: &EnergyExpression, body: &Body) {
    // A sheet is two-dimensional; a scene with a wrong dimension is checked as a solid.
    let sheet = body.membrane.is_some();
    let dimension = if sheet { 2 } else { check.dimension.unwrap_or(3) };
    let of_solid = if energy.is_isotropic() { energy.check_at_rest(3) } else { Ok(()) };
    match of_solid.and_then(|()| energy.check_at_rest(dimension)) {
        Ok(()) => {}
        Err(EnergyMistake::Formula(error)) => {
            check.report(expression_problem(path.key("psi"), energy.text(), &error));
        }
        Err(EnergyMistake::Parameter(error)) => check.report(parameter(path, &error)),
        Err(other) => {
            let message = format!("`psi` {other}");
            let (message, help) = message.split_once("; ").unwrap_or((&message, ""));
            let problem = Problem::semantic(path.key("psi"), message.to_owned());
            check.report(if help.is_empty() { problem } else { problem.with_help(help) });
        }
    }
    if sheet && !energy.is_isotropic() && energy.check_at_rest(2).is_ok() {
        let message = "`psi` depends on the rotation of an element, but triangles of a membrane have no \
                       reference direction";
        let problem = Problem::semantic(path.key("psi"), message);
        check.report(problem.with_help("write it with I1, I2 and J, or with l1, l2 and l3"));
    }
}

/// Checks a `material` other than a formula, at `path` of `body`: a sheet requires an isotropic one.
pub(super) fn directions(check: &mut Checker, path: &KeyPath, material: &MaterialSpec, body: &Body) {
    if body.membrane.is_some() && !material.is_isotropic() {
        let message = format!(
            "`{}` depends on the rotation of an element, but triangles of a membrane have no reference \
             direction",
            material.name()
        );
        check.report(Problem::semantic(path.clone(), message).with_help("use an isotropic material"));
    }
}

/// Problem of an invalid parameter, or of one derived from it.
pub(super) fn parameter(path: &KeyPath, error: &ParameterError) -> Problem {
    let mut problem = Problem::parameter(path, error.field, error.value, &error.problem);
    if let Some(index) = error.index {
        problem.path = problem.path.index(index);
    }
    problem
}

/// Checks `springs.expression` (`text`) at `path` of `springs`: at every rest length in the scene,
/// without any at a length of 1 m. Rest lengths of the mesh are checked once it is built.
pub(super) fn springs(check: &mut Checker, path: &KeyPath, springs: &SpringsSpec, text: &str) {
    let lengths = springs.rest_length.as_ref().map_or(&[1.0][..], |lengths| lengths.as_slice());
    let Some(formula) = springs.formula() else { return };
    let positive = lengths.iter().filter(|length| length.is_finite() && **length > 0.0);
    let result = formula
        .and_then(|formula| positive.into_iter().try_for_each(|length| formula.check_at_rest(*length)));
    if let Err(error) = result {
        check.report(spring_problem(path, text, &error));
    }
}

/// Problem of the spring formula `text` at `path`.
pub(crate) fn spring_problem(path: &KeyPath, text: &str, error: &SpringFormulaError) -> Problem {
    match error {
        SpringFormulaError::Formula(error) => formula_problem(path, "expression", text, error),
        other => Problem::semantic(path.key("expression"), format!("`expression` {other}")),
    }
}

/// Problem of the formula `text` at `key` of `path`, or of the `parameters` next to it.
pub(super) fn formula_problem(path: &KeyPath, key: &str, text: &str, error: &FormulaError) -> Problem {
    match error {
        FormulaError::Text(error) => expression_problem(path.key(key), text, error),
        FormulaError::Parameter { name, .. } => {
            Problem::semantic(path.key("parameters").key(name), error.to_string())
        }
        other => Problem::semantic(path.key(key), other.to_string()),
    }
}
