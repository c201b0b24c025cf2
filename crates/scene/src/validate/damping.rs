//! Damping of a body.

use super::check::Checker;
use super::expression::formula_problem;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{Body, DampingSpec, DashpotExpressionSpec};
use pliant::dissipation::DashpotFormulaError;

/// Checks `damping` at `path` of `body`.
pub(super) fn damping(check: &mut Checker, path: &KeyPath, damping: &DampingSpec, body: &Body) {
    if *damping == DampingSpec::default() {
        let problem = Problem::semantic(path.clone(), "`damping` names no kind of damping").at_key();
        check.report(problem.with_help(
            "give `strain_rate`, `dashpot`, `expression`, `stiffness_proportional` or `mass_proportional`, \
             or remove `damping`",
        ));
    }
    if let Some(rate) = &damping.strain_rate {
        let path = path.key("strain_rate");
        check.number(&path.key("shear"), rate.shear, "Pa s");
        check.number(&path.key("second"), rate.second, "Pa s");
        needs(check, &path, body.elastic.is_some(), "`strain_rate` damps finite elements", "`elastic`");
    }
    if let Some(dashpot) = damping.dashpot {
        let path = path.key("dashpot");
        check.number(&path, dashpot, "N s/m");
        needs(check, &path, body.springs.is_some(), "`dashpot` damps springs", "`springs`");
    }
    if let Some(formula) = &damping.expression {
        let path = path.key("expression");
        needs(check, &path, body.springs.is_some(), "`expression` damps springs", "`springs`");
        // Rest lengths of the mesh are checked once it is built.
        let given = body.springs.as_ref().and_then(|springs| springs.rest_length.as_ref());
        let lengths = given.map_or(&[1.0][..], |lengths| lengths.as_slice());
        if let Some(problem) = dashpot_problem(&path, formula, lengths) {
            check.report(problem);
        }
    }
    if let Some(beta) = damping.stiffness_proportional {
        let path = path.key("stiffness_proportional");
        check.number(&path, beta, "s");
        let stiff = body.elastic.is_some() || body.springs.is_some() || body.bending.is_some();
        needs(check, &path, stiff, "`stiffness_proportional` damps elements, springs and bending", "any");
        if let Some(material) = &body.elastic
            && material.lame().is_none()
        {
            let message = format!(
                "`stiffness_proportional` needs the moduli for small strains, and `{}` is not meant to have \
                 any",
                material.name()
            );
            check.report(Problem::semantic(path, message).with_help("use `strain_rate`"));
        }
    }
    if let Some(alpha) = damping.mass_proportional {
        check.number(&path.key("mass_proportional"), alpha, "1/s");
    }
}

/// Problem of the dashpot formula at `path`, for springs with these rest lengths [m].
pub(crate) fn dashpot_problem(
    path: &KeyPath,
    spec: &DashpotExpressionSpec,
    lengths: &[f64],
) -> Option<Problem> {
    let mut positive = lengths.iter().filter(|length| length.is_finite() && **length > 0.0);
    let result = spec.formula().and_then(|formula| positive.try_for_each(|length| formula.check(*length)));
    Some(match result.err()? {
        DashpotFormulaError::Formula(error) => {
            formula_problem(path, "dissipation", &spec.dissipation, &error)
        }
        other => Problem::semantic(path.key("dissipation"), format!("`dissipation` {other}")),
    })
}

/// Rejects damping of a feature that the body does not have.
fn needs(check: &mut Checker, path: &KeyPath, has: bool, what: &str, missing: &str) {
    if !has {
        let message = format!("{what}, and this body does not have {missing}");
        check.report(Problem::semantic(path.clone(), message).at_key());
    }
}
