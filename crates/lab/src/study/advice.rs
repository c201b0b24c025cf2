//! Recommended integrators and steps: the Pareto-optimal rows of a study.

use super::reference::Reference;
use super::row::Row;
use super::sweep::ADAPTIVE;
use pliant::quantity::{Rounded, Seconds};

/// Pareto-optimal rows: no other row has both a smaller error and a shorter time; the fastest first.
pub fn front<'a>(rows: impl IntoIterator<Item = &'a Row>) -> Vec<&'a Row> {
    pareto(rows.into_iter().filter_map(|row| Some((row, row.wall_min_s, row.error()?))).collect())
}

/// Items that no other beats in both time and error, given with the two; the fastest first.
pub(crate) fn pareto<T>(mut ranked: Vec<(T, f64, f64)>) -> Vec<T> {
    ranked.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2)));
    let mut best = f64::INFINITY;
    ranked.retain(|(.., error)| {
        let better = *error < best;
        if better {
            best = *error;
        }
        better
    });
    ranked.into_iter().map(|(item, ..)| item).collect()
}

/// Fastest row whose error is at most `error`.
pub fn cheapest<'a>(rows: impl IntoIterator<Item = &'a Row>, error: f64) -> Option<&'a Row> {
    let good = rows.into_iter().filter(|row| row.error().is_some_and(|e| e <= error));
    good.min_by(|a, b| a.wall_min_s.total_cmp(&b.wall_min_s))
}

/// The Pareto front in words: the best row for each of a few errors, as far as the reference is trusted.
/// Errors that no row reaches are omitted.
pub fn words<'a>(rows: impl IntoIterator<Item = &'a Row> + Clone, reference: &Reference) -> Vec<String> {
    let mut said = vec![];
    for error in [1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8] {
        let Some(row) = cheapest(rows.clone(), error) else { break };
        if error < reference.trusted() {
            said.push(untold(error, reference));
            break;
        }
        let pace =
            row.tol.map_or_else(|| seconds(row.dt), |tolerance| format!("a tolerance of {tolerance:e}"));
        let time = seconds(row.wall_min_s);
        said.push(format!("for {} error take {} at {pace}: {time}", percent(error), row.integrator));
    }
    said
}

/// Reason for the missing advice for errors of at most `error`.
fn untold(error: f64, reference: &Reference) -> String {
    let error = percent(error);
    match reference.disagreement {
        Some(distance) => {
            let known = distance.max(reference.error);
            format!("no advice for {error} error: the reference is known to {known:.0e} only")
        }
        None => format!(
            "no advice for {error} error: no second integrator confirms the reference; increase --budget"
        ),
    }
}

/// Settings for errors of at most `error`, as TOML; a comment if no row reaches it, or if the reference
/// is not accurate enough.
pub fn toml<'a>(
    rows: impl IntoIterator<Item = &'a Row> + Clone,
    reference: &Reference,
    error: f64,
) -> String {
    if error < reference.trusted() {
        return format!("# {}\n", untold(error, reference));
    }
    let Some(row) = cheapest(rows.clone(), error) else {
        let best = rows.into_iter().filter_map(|row| Some((row, row.error()?)));
        return match best.min_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((row, least)) => format!(
                "# no setting reaches an error of {}; the best, {least:.1e}:\n{}",
                percent(error),
                settings(row)
            ),
            None => "# no setting ran to its end with an error that can be told\n".to_owned(),
        };
    };
    let reached = row.error().unwrap_or(f64::NAN);
    format!(
        "# error {reached:.1e} of at most {}, in {} on {}\n{}",
        percent(error),
        seconds(row.wall_min_s),
        row.cpu,
        settings(row)
    )
}

fn settings(row: &Row) -> String {
    let mut out = String::new();
    for change in row.variant.split("; ").filter(|change| !change.is_empty()) {
        out += &format!("# with --set {change}\n");
    }
    out += &format!("[time]\nintegrator = {}\n", scheme(row.integrator.trim_end_matches(ADAPTIVE)));
    out += &match row.tol {
        Some(tolerance) => format!("adaptive = {{ tolerance = {tolerance:?} }}\n"),
        None => format!("step = {:?}\n", row.dt),
    };
    out
}

/// Integrator as TOML: a name, or a table that is already TOML.
fn scheme(name: &str) -> String {
    if name.starts_with('{') { name.to_owned() } else { format!("{name:?}") }
}

/// Error as text: `1 %`, `0.1 %`, `1e-6`.
fn percent(error: f64) -> String {
    if error >= 1e-4 { format!("{} %", number(100.0 * error)) } else { format!("{error:e}") }
}

/// Time with three digits, in a suitable unit.
pub(super) fn seconds(t: f64) -> String {
    Seconds(t).to_string()
}

/// Number with three significant digits.
pub(super) fn number(value: f64) -> String {
    Rounded::<3>(value).to_string()
}
