//! Step sizes: fixed, adaptive, or along a path.

use super::check::Checker;
use crate::error::Problem;
use crate::key_path::KeyPath;
use crate::schema::{Adaptive, Time};
use pliant::integrator::IntegratorSpec;

/// Checks `step`, `adaptive` and `arc_length` at `path`: exactly one of them is required.
pub(super) fn steps(check: &mut Checker, path: &KeyPath, time: &Time) {
    let others = [("step", time.step.is_some()), ("adaptive", time.adaptive.is_some())];
    for (other, _) in others.into_iter().filter(|(_, given)| *given && time.arc_length.is_some()) {
        let message = format!("`{other}` and `arc_length` are both given");
        let problem = Problem::semantic(path.key(other), message).at_key();
        check.report(problem.with_help("remove one: time counts the steps along a path, 1 s each"));
    }
    match (time.step, &time.adaptive) {
        (None, None) if time.arc_length.is_some() => {}
        (None, None) => {
            let message = "[time] has neither `step` nor `adaptive`";
            let problem = Problem::semantic(path.clone(), message);
            check.report(problem.with_help("give the time step [s], `step = 1e-3`"));
        }
        (Some(_), Some(_)) => {
            let message = "`step` and `adaptive` are both given";
            let problem = Problem::semantic(path.key("step"), message).at_key();
            check.report(problem.with_help("remove one: the first step to try is `first` in `adaptive`"));
        }
        _ => {}
    }
    if let Some(adaptive) = &time.adaptive {
        self::adaptive(check, &path.key("adaptive"), adaptive, time);
    }
}

fn adaptive(check: &mut Checker, path: &KeyPath, adaptive: &Adaptive, time: &Time) {
    let method = time.integrator.method();
    if !method.is_adaptive() {
        let message = format!(
            "{} does not estimate its error, and its steps cannot follow it",
            method.documentation.name
        );
        let able = IntegratorSpec::ALL.iter().map(|spec| spec.method()).filter(|method| method.is_adaptive());
        let able: Vec<&str> = able.map(|method| method.documentation.name).collect();
        let problem = Problem::semantic(path.clone(), message).at_key();
        check.report(problem.with_help(format!("give `step`, or take one of {}", able.join(", "))));
    }
    if let Some(tolerance) = adaptive.tolerance
        && !check.number(&path.key("tolerance"), tolerance, "")
    {
        check.help(
            "it is the relative error of a step: 1e-3 is coarse, 1e-6 usual, and 1e-14 close to round-off",
        );
    }
    let Adaptive { tolerance, position, velocity, first, smallest, largest } = *adaptive;
    let errors = [
        ("tolerance", tolerance.is_some()),
        ("position", position.is_some()),
        ("velocity", velocity.is_some()),
    ];
    for (key, _) in errors.into_iter().filter(|(_, given)| *given && method.has_own_criterion()) {
        let message = format!("{} follows a criterion of its own, not `{key}`", method.documentation.name);
        let problem = Problem::semantic(path.key(key), message).at_key();
        check.report(problem.with_help(match method.is_static() {
            true => "remove it; equilibria are found to the `tolerance` of [time] solver",
            false => "remove it; accuracy is a parameter of the integrator, see `pliant list integrators`",
        }));
    }
    let values = [
        ("position", position, "m"),
        ("velocity", velocity, "m/s"),
        ("first", first, "s"),
        ("smallest", smallest, "s"),
        ("largest", largest, "s"),
    ];
    let mut good = true;
    for (key, value, unit) in values {
        if let Some(value) = value {
            good &= check.number(&path.key(key), value, unit);
        }
    }
    let ascending = [
        ("smallest", smallest, "first", first),
        ("first", first, "largest", largest),
        ("smallest", smallest, "largest", largest),
    ];
    for (low, a, high, b) in ascending {
        if let (true, Some(a), Some(b)) = (good, a, b)
            && a > b
        {
            let message = format!("`{low}` is {a:?} [s], more than `{high}`, {b:?} [s]");
            check.report(Problem::semantic(path.key(low), message));
            return;
        }
    }
}
