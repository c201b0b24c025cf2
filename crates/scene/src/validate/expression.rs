//! Energies that are formulas.

use super::check::Checker;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::Body;
use crate::text::expression_problem;
use pliant::material::{EnergyExpression, EnergyMistake, ParameterError};

/// `elastic.expression` at `path` of `body`.
pub(super) fn expression(check: &mut Checker, path: &KeyPath, energy: &EnergyExpression, body: &Body) {
    // A sheet is a plane of its own; a scene whose dimension is wrong is checked as a solid.
    let sheet = body.membrane.is_some();
    let dimension = if sheet { 2 } else { check.dimension.unwrap_or(3) };
    let of_solid = if energy.is_isotropic() { energy.check_at_rest(3) } else { Ok(()) };
    match of_solid.and_then(|()| energy.check_at_rest(dimension)) {
        Ok(()) => {}
        Err(EnergyMistake::Formula(error)) => {
            check.report(expression_problem(path.key("psi"), energy.text(), &error));
        }
        Err(EnergyMistake::Parameter(error)) => check.report(parameter(path, &error)),
        Err(other) => check.report(Problem::semantic(path.clone(), other.to_string())),
    }
    if sheet && !energy.is_isotropic() && energy.check_at_rest(2).is_ok() {
        let message = "`psi` depends on how an element is turned, and triangles of a sheet have no direction to be compared \
                       with";
        let problem = Problem::semantic(path.key("psi"), message);
        check.report(problem.with_help("write it with I1, I2 and J, or with l1, l2 and l3"));
    }
}

/// A number that is wrong, or that follows from what is wrong.
pub(super) fn parameter(path: &KeyPath, error: &ParameterError) -> Problem {
    let mut problem = Problem::parameter(path, error.field, error.value, &error.problem);
    if let Some(index) = error.index {
        problem.path = problem.path.index(index);
    }
    problem
}
