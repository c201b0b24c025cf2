//! The table for people, and the same as comma-separated values.

use pliant::quantity::Seconds;
use pliant_lab::stress::{Case, CaseResult, CaseVerdict};

use super::Outcome;
use super::conclusion::conclusion;
use crate::output::csv_line;
use crate::text::{counted, number, table, wrap};

/// Results of one case that differ in the linear solver only, and have one verdict for one reason.
pub(super) struct Agreement<'a> {
    /// Result with the first of the solvers.
    pub(super) first: &'a Outcome,
    /// Names of the linear solvers.
    pub(super) solvers: Vec<&'static str>,
}

impl Agreement<'_> {
    /// Name of the linear solver, or the number of those that agree.
    fn solver(&self) -> String {
        match self.solvers[..] {
            [solver] => solver.into(),
            _ => format!("{} agree", self.solvers.len()),
        }
    }
}

/// True if two cases differ in the linear solver at most.
fn is_same(a: &Case, b: &Case) -> bool {
    (a.row, &a.name, a.dimension, &a.material, &a.integrator)
        == (b.row, &b.name, b.dimension, &b.material, &b.integrator)
        && a.poisson == b.poisson
}

/// Results with the linear solvers that agree in one row, next to those that do not.
pub(super) fn agreements(results: &[Outcome]) -> Vec<Agreement<'_>> {
    let mut rows: Vec<Agreement<'_>> = vec![];
    for result in results {
        let (case, f) = result;
        let same = |row: &Agreement<'_>| is_same(&row.first.0, case);
        let outcome = |f: &CaseResult| (f.verdict, f.cut_short, f.reason().map(str::to_owned));
        let solver = case.solver.name();
        match rows.iter_mut().find(|row| same(row) && outcome(&row.first.1) == outcome(f)) {
            Some(row) => row.solvers.push(solver),
            None => {
                let at = rows.iter().rposition(same).map_or(rows.len(), |last| last + 1);
                rows.insert(at, Agreement { first: result, solvers: vec![solver] });
            }
        }
    }
    rows
}

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

/// Integrator of a case, with the size of its steps in a case of a scene.
pub(super) fn scheme((case, findings): &Outcome) -> String {
    match findings.step_size {
        Some(step) => format!("{} at {}", case.integrator, Seconds(step)),
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
        "iter",
        "limit",
        "min J",
        "energy",
        "error",
        "tol",
        "time [s]",
    ];
    let long = any_is_long(results);
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    if long {
        rows[0].extend(["steps", "worst", "least gap"].map(str::to_owned));
    }
    let agreements = agreements(results);
    for agreement in &agreements {
        let result @ (case, f) = agreement.first;
        let mut row = vec![
            title(result),
            case.dimension.to_string(),
            case.material.clone(),
            case.poisson.map_or_else(String::new, |nu| nu.to_string()),
            scheme(result),
            agreement.solver(),
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
    for agreement in agreements.iter().filter(|agreement| agreement.first.1.verdict != CaseVerdict::Pass) {
        let result @ (case, f) = agreement.first;
        let advice = f.advice.as_ref().map_or_else(String::new, |a| format!(" What works: {a}."));
        let nu = case.poisson.map_or_else(String::new, |nu| format!(" {nu}"));
        let material = if case.material.is_empty() { "" } else { &format!("{}{nu}, ", case.material) };
        let line = format!(
            "{}: {} {}D, {material}{}, {}: {}.{advice}",
            f.verdict,
            title(result),
            case.dimension,
            scheme(result),
            agreement.solver(),
            f.notes.join("; "),
        );
        out += &wrap(&line, 0, width);
    }
    out.push('\n');
    if is_scene {
        out += &survivors(results, width);
    }
    out += &format!("{}\n", sums(results));
    if is_scene {
        out += &wrap(&conclusion(results), 0, width);
    }
    out
}

/// Numbers of cases by verdict.
pub(super) fn sums(results: &[Outcome]) -> String {
    let of = |verdict| results.iter().filter(|(_, f)| f.verdict == verdict).count();
    let cut = results.iter().filter(|(_, f)| f.cut_short).count();
    let cut = if cut == 0 { String::new() } else { format!(" ({cut} cut short)") };
    format!(
        "{}: {} passed, {} flagged{cut}, {} failed",
        counted(results.len() as u64, "case", "cases"),
        of(CaseVerdict::Pass),
        of(CaseVerdict::Flagged),
        of(CaseVerdict::Fail),
    )
}

/// Settings that went through everything that was done to a scene, and what stopped the others.
fn survivors(results: &[Outcome], width: usize) -> String {
    let mut settings: Vec<Setting<'_>> = vec![];
    for (case, f) in results {
        let (integrator, solver) = (&case.integrator[..], case.solver.name());
        let is_own = |setting: &Setting<'_>| setting.integrator == integrator && setting.solvers == [solver];
        let at = settings.iter().position(is_own).unwrap_or_else(|| {
            settings.push(Setting { integrator, solvers: vec![solver], ..Setting::default() });
            settings.len() - 1
        });
        let of = match f.verdict {
            _ if f.cut_short => &mut settings[at].cut,
            CaseVerdict::Fail => &mut settings[at].failed,
            CaseVerdict::Flagged => &mut settings[at].flagged,
            CaseVerdict::Pass => &mut settings[at].passed,
        };
        of.push(&case.name);
    }
    let mut agreeing: Vec<Setting<'_>> = vec![];
    for setting in settings {
        match agreeing.iter_mut().find(|other| other.agrees_with(&setting)) {
            Some(other) => other.solvers.extend(setting.solvers),
            None => agreeing.push(setting),
        }
    }
    let lines: String = agreeing.iter().map(|setting| wrap(&setting.line(), 0, width)).collect();
    lines + "\n"
}

/// Results of all cases of a scene with one integrator, by the names of the cases.
#[derive(Default)]
struct Setting<'a> {
    integrator: &'a str,
    /// Linear solvers that agree.
    solvers: Vec<&'a str>,
    passed: Vec<&'a str>,
    flagged: Vec<&'a str>,
    failed: Vec<&'a str>,
    /// By the budget.
    cut: Vec<&'a str>,
}

impl Setting<'_> {
    fn agrees_with(&self, other: &Setting<'_>) -> bool {
        self.integrator == other.integrator
            && (&self.passed, &self.flagged, &self.failed, &self.cut)
                == (&other.passed, &other.flagged, &other.failed, &other.cut)
    }

    fn line(&self) -> String {
        let Setting { integrator, solvers, passed, flagged, failed, cut } = self;
        let name = match solvers[..] {
            [solver] => format!("{integrator}, {solver}"),
            _ => format!("{integrator}, {} linear solvers agree", solvers.len()),
        };
        if [flagged, failed, cut].iter().all(|cases| cases.is_empty()) {
            return format!("{name}: survives everything");
        }
        let mut said = match passed.len() {
            0 => vec!["passes nothing".to_owned()],
            n => vec![format!("passes {n} of {}", n + flagged.len() + failed.len() + cut.len())],
        };
        for (what, cases) in [("fails at", failed), ("flagged at", flagged), ("cut short at", cut)] {
            said.extend((!cases.is_empty()).then(|| format!("{what} {}", cases.join(", "))));
        }
        format!("{name}: {}", said.join("; "))
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
