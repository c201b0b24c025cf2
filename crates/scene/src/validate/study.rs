//! `[study]` and `[accuracy]`.

use super::check::Checker;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{AccuracySpec, StudySpec};
use crate::vary::VariedKey;
use pliant::integrator::BadParameter;

pub(super) fn study(check: &mut Checker, path: &KeyPath, study: &StudySpec) {
    for (index, integrator) in study.integrators.iter().enumerate() {
        let (path, method) = (path.key("integrators").index(index), integrator.method().documentation);
        if let Err(BadParameter { name, value, right }) = integrator.check() {
            let path = path.key(method.name).key(name);
            check.report(Problem::semantic(path, format!("`{name}` must be {right}, got {value:?}")));
        } else if method.order == 0 {
            let message = format!("{} has no order: it finds equilibria, not motions", method.name);
            check.report(Problem::semantic(path, message).with_help("leave it out"));
        }
    }
    for (index, step) in study.steps.iter().flatten().enumerate() {
        check.number(&path.key("steps").index(index), *step, "s");
    }
    for (index, tolerance) in study.tolerances.iter().enumerate() {
        check.number(&path.key("tolerances").index(index), *tolerance, "");
    }
    for (index, axis) in study.vary.iter().enumerate() {
        if let Err(error) = axis.parse::<VariedKey>() {
            check.report(Problem::semantic(path.key("vary").index(index), error.to_string()));
        }
    }
    if let Some(refine) = study.refine {
        check.count(&path.key("refine"), refine);
    }
    if let Some(times) = study.times {
        check.count(&path.key("times"), times);
    }
    for (key, value, unit) in [("error", study.error, ""), ("smallest_step", study.smallest_step, "s")] {
        if let Some(value) = value {
            check.number(&path.key(key), value, unit);
        }
    }
}

pub(super) fn accuracy(check: &mut Checker, path: &KeyPath, accuracy: &AccuracySpec) {
    if let Some(budget) = accuracy.budget {
        check.number(&path.key("budget"), budget, "s");
    }
}
