//! Mistakes in `[study]`.

use super::check::{Checker, Sign};
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::StudySpec;
use crate::vary::VariedKey;
use pliant::integrator::BadParameter;

/// States are compared at this many times at least: fewer may all be where errors happen to be small.
const FEWEST_TIMES: usize = 20;

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
        check.number(&path.key("steps").index(index), *step, Sign::Positive, "s");
    }
    for (index, tolerance) in study.tolerances.iter().enumerate() {
        let path = path.key("tolerances").index(index);
        if check.number(&path, *tolerance, Sign::Positive, "") && *tolerance >= 1.0 {
            let message = format!("`tolerances` must be below 1, got {tolerance:?}");
            check.report(Problem::semantic(path, message));
        }
    }
    for (index, axis) in study.vary.iter().enumerate() {
        if let Err(error) = axis.parse::<VariedKey>() {
            check.report(Problem::semantic(path.key("vary").index(index), error.to_string()));
        }
    }
    if let Some(times) = study.times.filter(|times| *times < FEWEST_TIMES) {
        let message = format!("`times` must be at least {FEWEST_TIMES}, got {times}");
        check.report(Problem::semantic(path.key("times"), message));
    }
    for (key, value, unit) in [("error", study.error, ""), ("smallest_step", study.smallest_step, "s")] {
        if let Some(value) = value {
            check.number(&path.key(key), value, Sign::Positive, unit);
        }
    }
}
