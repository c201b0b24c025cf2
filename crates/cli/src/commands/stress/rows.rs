//! The table for people, and the same as comma-separated values.

use pliant_lab::stress::{CaseResult, CaseVerdict};

use super::Outcome;
use crate::output::csv_line;
use crate::text::{counted, number, table, wrap};

/// Numbers that only long cases have, as texts: steps, iterations of the worst of them, least gap.
pub(super) fn numbers_of_long(findings: &CaseResult) -> [String; 3] {
    let c = |x: Option<u64>| x.map_or_else(String::new, |x| x.to_string());
    [c(findings.steps), c(findings.worst_step), findings.least_gap.map_or_else(String::new, number)]
}

/// True if any case has these.
pub(super) fn any_is_long(results: &[Outcome]) -> bool {
    results.iter().any(|(_, f)| f.steps.is_some())
}

/// Numbers of a case, as texts.
pub(super) fn numbers(findings: &CaseResult) -> [String; 6] {
    let n = |x: Option<f64>| x.map_or_else(String::new, number);
    let c = |x: Option<u64>| x.map_or_else(String::new, |x| x.to_string());
    [
        c(findings.iterations),
        c(findings.bar),
        n(findings.min_j),
        n(findings.energy_ratio),
        n(findings.error),
        n(findings.tolerance),
    ]
}

/// The scheme of a case, and of one of a scene the size of its steps.
pub(super) fn scheme((case, findings): &Outcome) -> String {
    match findings.step_size {
        Some(step) => format!("{} at {} s", case.integrator, number(step)),
        None => case.integrator.clone(),
    }
}

/// Title of a case: its row and its name.
pub(super) fn title(result: &Outcome) -> String {
    let (case, _) = result;
    format!("{} {}", case.row, case.name)
}

/// All cases by row, then what is to be said of those that did not pass, then the sums.
pub(super) fn describe(results: &[Outcome], is_scene: bool, width: usize) -> String {
    let header = [
        "",
        "dim",
        "material",
        "nu",
        "integrator",
        "solver",
        "",
        "its",
        "bar",
        "min J",
        "energy",
        "error",
        "may be",
        "time [s]",
    ];
    let long = any_is_long(results);
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    if long {
        rows[0].extend(["steps", "worst", "least gap"].map(str::to_owned));
    }
    for result in results {
        let (case, f) = result;
        let mut row = vec![
            title(result),
            case.dimension.to_string(),
            case.material.clone(),
            case.poisson.map_or_else(String::new, |nu| nu.to_string()),
            scheme(result),
            case.solver.name().into(),
            f.verdict.to_string(),
        ];
        row.extend(numbers(f));
        row.push(format!("{:.2}", f.seconds));
        if long {
            row.extend(numbers_of_long(f));
        }
        rows.push(row);
    }
    let mut out = table(&rows, 0);
    out.push('\n');
    for result in results.iter().filter(|(_, f)| f.verdict != CaseVerdict::Pass) {
        let (case, f) = result;
        let advice = f.advice.as_ref().map_or_else(String::new, |a| format!(" What works: {a}."));
        let nu = case.poisson.map_or_else(String::new, |nu| format!(" {nu}"));
        let line = format!(
            "{}: {} {}D, {}{nu}, {}, {}: {}.{advice}",
            f.verdict,
            title(result),
            case.dimension,
            case.material,
            scheme(result),
            case.solver.name(),
            f.notes.join("; "),
        );
        out += &wrap(&line, 0, width);
    }
    out.push('\n');
    if is_scene {
        out += &survivors(results);
    }
    let of = |verdict| results.iter().filter(|(_, f)| f.verdict == verdict).count() as u64;
    out + &format!(
        "{}: {} passed, {} flagged, {} failed\n",
        counted(results.len() as u64, "case", "cases"),
        of(CaseVerdict::Pass),
        of(CaseVerdict::Flagged),
        of(CaseVerdict::Fail),
    )
}

/// Which settings went through everything that was done to a scene, and what stopped the others.
fn survivors(results: &[Outcome]) -> String {
    let mut settings: Vec<Setting<'_>> = vec![];
    for (case, f) in results {
        let name = format!("{}, {}", case.integrator, case.solver.name());
        let at = settings.iter().position(|setting| setting.name == name).unwrap_or_else(|| {
            settings.push(Setting { name, ..Setting::default() });
            settings.len() - 1
        });
        let of = match f.verdict {
            _ if f.cut_short => &mut settings[at].cut,
            CaseVerdict::Fail => &mut settings[at].failed,
            CaseVerdict::Flagged => &mut settings[at].flagged,
            _ => &mut settings[at].passed,
        };
        of.push(&case.name);
    }
    let lines: String = settings.iter().map(Setting::line).collect();
    lines + "\n"
}

/// Results of all cases of a scene with one scheme and solver, by the names of the cases.
#[derive(Default)]
struct Setting<'a> {
    name: String,
    passed: Vec<&'a str>,
    flagged: Vec<&'a str>,
    failed: Vec<&'a str>,
    /// By the budget.
    cut: Vec<&'a str>,
}

impl Setting<'_> {
    fn line(&self) -> String {
        let Setting { name, passed, flagged, failed, cut } = self;
        if [flagged, failed, cut].iter().all(|cases| cases.is_empty()) {
            return format!("{name}: survives everything\n");
        }
        let mut said = match passed.len() {
            0 => vec!["passes nothing".to_owned()],
            n => vec![format!("passes {n} of {}", n + flagged.len() + failed.len() + cut.len())],
        };
        for (what, cases) in [("fails at", failed), ("flagged at", flagged), ("cut short at", cut)] {
            said.extend((!cases.is_empty()).then(|| format!("{what} {}", cases.join(", "))));
        }
        format!("{name}: {}\n", said.join("; "))
    }
}

/// One line for each case.
pub(super) fn csv(results: &[Outcome]) -> String {
    let mut out = csv_line(&[
        "row",
        "name",
        "dimension",
        "material",
        "poisson",
        "integrator",
        "solver",
        "verdict",
        "iterations",
        "bar",
        "min_j",
        "energy_ratio",
        "error",
        "tolerance",
        "seconds",
        "notes",
        "advice",
        "cut_short",
        "steps",
        "worst_step",
        "least_gap",
        "step_size",
    ]);
    for (case, f) in results {
        let n = |x: Option<f64>| x.map_or_else(String::new, |x| format!("{x:?}"));
        let c = |x: Option<u64>| x.map_or_else(String::new, |x| x.to_string());
        out += &csv_line(&[
            case.row,
            &case.name,
            &case.dimension.to_string(),
            &case.material,
            &n(case.poisson),
            &case.integrator,
            case.solver.name(),
            &f.verdict.to_string().to_lowercase(),
            &c(f.iterations),
            &c(f.bar),
            &n(f.min_j),
            &n(f.energy_ratio),
            &n(f.error),
            &n(f.tolerance),
            &n(Some(f.seconds)),
            &f.notes.join("; "),
            f.advice.as_deref().unwrap_or_default(),
            if f.cut_short { "true" } else { "false" },
            &c(f.steps),
            &c(f.worst_step),
            &n(f.least_gap),
            &n(f.step_size),
        ]);
    }
    out
}
