//! The answer for a scene: verdicts in a grid, reasons, a conclusion.

use pliant_lab::stress::{ABOVE_LIMIT, CaseResult, CaseVerdict};

use super::Outcome;
use super::rows::{agreements, sums};
use crate::text::{entry, wrap};

/// Columns of the answer.
const WIDTH: usize = 80;
/// Columns of the names of cases.
const NAMES: usize = 20;
/// Columns of an integrator.
const COLUMN: usize = 12;
/// Number of reasons, each of two lines; `--all` has all.
const REASONS: usize = 3;
const REASON_LENGTH: usize = 148;

/// Results of one integrator with its first linear solver, by the names of the cases.
struct VerdictColumn<'a> {
    integrator: &'a str,
    cases: Vec<(&'a str, &'a CaseResult)>,
}

impl<'a> VerdictColumn<'a> {
    fn all(results: &'a [Outcome]) -> Vec<VerdictColumn<'a>> {
        let mut columns: Vec<VerdictColumn<'a>> = vec![];
        for (case, f) in results {
            let at = columns.iter().position(|c| c.integrator == case.integrator).unwrap_or_else(|| {
                columns.push(VerdictColumn { integrator: &case.integrator, cases: vec![] });
                columns.len() - 1
            });
            if columns[at].of(&case.name).is_none() {
                columns[at].cases.push((&case.name, f));
            }
        }
        columns
    }

    fn of(&self, name: &str) -> Option<&'a CaseResult> {
        self.cases.iter().find(|(other, _)| *other == name).map(|(_, f)| *f)
    }

    fn names(&self, wanted: impl Fn(&CaseResult) -> bool) -> Vec<&'a str> {
        self.cases.iter().filter(|(_, f)| wanted(f)).map(|(name, _)| *name).collect()
    }

    fn failed(&self) -> Vec<&'a str> {
        self.names(|f| f.verdict == CaseVerdict::Fail)
    }

    fn flagged(&self) -> Vec<&'a str> {
        self.names(|f| f.verdict == CaseVerdict::Flagged && !f.cut_short)
    }

    fn cut(&self) -> Vec<&'a str> {
        self.names(|f| f.cut_short)
    }

    /// Names of cases in a step that is too large by design.
    fn above_limit(&self) -> Vec<&'a str> {
        self.names(|f| f.verdict == CaseVerdict::Flagged && f.reason() == Some(ABOVE_LIMIT))
    }

    /// Less is more robust.
    fn score(&self) -> [usize; 3] {
        [self.failed().len() + self.above_limit().len(), self.cut().len(), self.flagged().len()]
    }

    /// The worst of it, as a predicate.
    fn worst(&self) -> String {
        let [failed, flagged, cut] =
            [self.failed(), self.flagged(), self.cut()].map(|names| names.join(", "));
        match () {
            () if !self.above_limit().is_empty() => "is above its stability limit".into(),
            () if !failed.is_empty() => format!("fails at {failed}"),
            () if !cut.is_empty() => "was not finished".into(),
            () if !flagged.is_empty() => format!("is flagged at {flagged}"),
            () => "survives everything".into(),
        }
    }
}

/// Verdict in a word.
fn word(f: &CaseResult) -> &'static str {
    match f.verdict {
        _ if f.cut_short => "time",
        CaseVerdict::Pass => "pass",
        CaseVerdict::Flagged if f.reason() == Some(ABOVE_LIMIT) => "limit",
        CaseVerdict::Flagged => "flag",
        CaseVerdict::Fail => "FAIL",
    }
}

/// Most robust integrator and what to do, in one or two sentences.
pub(super) fn conclusion(results: &[Outcome]) -> String {
    let columns = VerdictColumn::all(results);
    let Some((own, best)) = columns.first().zip(columns.iter().min_by_key(|column| column.score())) else {
        return "No case ran within the time budget: increase --budget.".into();
    };
    let first = match (columns.iter().all(|column| column.score() == [0; 3]), own.score() == best.score()) {
        (true, _) if columns.len() > 1 => "Every integrator survives everything.".into(),
        (true, _) => format!("{} survives everything.", own.integrator),
        (_, true) if columns.len() > 1 => {
            format!("No integrator is more robust than {}: it {}.", own.integrator, own.worst())
        }
        (_, true) => format!("{} {}.", own.integrator, own.worst()),
        (_, false) => {
            let purpose = if own.failed().is_empty() { "the most robust run" } else { "rough starts" };
            let (best, theirs) = (best.integrator, best.worst());
            format!("Use {best} for {purpose}: it {theirs}; {} {}.", own.integrator, own.worst())
        }
    };
    [first, remedy(results, own)].join(" ").trim_end().into()
}

/// Most important remedy.
fn remedy(results: &[Outcome], own: &VerdictColumn<'_>) -> String {
    let advised = |(name, f): &(&str, &CaseResult)| {
        let advice = f.advice.as_deref()?;
        Some(format!("What works at \"{name}\": {advice}."))
    };
    // A wall that stops several integrators is in the wrong place.
    let wall = results.iter().filter(|(_, f)| f.verdict == CaseVerdict::Fail).find_map(|(case, f)| {
        let wall = f.notes.first()?.split('`').find(|part| part.starts_with("wall"))?;
        Some(format!("Move `{wall}`, which blocks \"{}\".", case.name))
    });
    let of_limit = own.cases.iter().find(|(_, f)| f.reason() == Some(ABOVE_LIMIT));
    let inverted = own.cases.iter().any(|(_, f)| f.reason() == Some("inverted"));
    let cut = results.iter().filter(|(_, f)| f.cut_short).count();
    let first = of_limit.and_then(advised).or(wall);
    let first = first.or_else(|| own.cases.iter().find_map(advised));
    let then = || match () {
        () if cut > 0 => {
            format!("{cut} of {} cases were cut short: give more time by --budget.", results.len())
        }
        () if inverted => "Inverted elements may recover in more steps than were tried.".into(),
        () => String::new(),
    };
    first.unwrap_or_else(then)
}

/// The grid, reasons, sums and the conclusion, in 24 lines for up to five integrators.
pub(super) fn brief(results: &[Outcome], width: usize) -> String {
    let width = width.min(WIDTH);
    let columns = VerdictColumn::all(results);
    let mut out = String::new();
    for block in columns.chunks((width.saturating_sub(NAMES) / COLUMN).max(1)) {
        out += &grid(block);
    }
    for (word, text) in reasons(results).iter().take(REASONS) {
        out += &entry(word, &shortened(text), 0, 6, width);
    }
    let all = format!("{}{}", sums(results), solvers(results));
    out += &wrap(&all, 0, width);
    out + &wrap(&conclusion(results), 0, width)
}

/// Verdicts of some integrators, a line for each case.
fn grid(columns: &[VerdictColumn<'_>]) -> String {
    let headers: Vec<Vec<String>> = columns.iter().map(|column| header(column.integrator)).collect();
    let height = headers.iter().map(Vec::len).max().unwrap_or(0);
    let cell = |text: &str| format!("{text:>COLUMN$}");
    let line = |name: &str, cells: Vec<String>| {
        format!("{name:NAMES$}{}", cells.concat()).trim_end().to_owned() + "\n"
    };
    let mut out = String::new();
    for row in 0..height {
        let part = |header: &Vec<String>| {
            // Names end on the line above the verdicts.
            let at = (row + header.len()).checked_sub(height);
            cell(at.and_then(|at| header.get(at)).map_or("", String::as_str))
        };
        out += &line("", headers.iter().map(part).collect());
    }
    let mut names: Vec<&str> = vec![];
    for (name, _) in columns.iter().flat_map(|column| &column.cases) {
        if !names.contains(name) {
            names.push(name);
        }
    }
    for name in names {
        let verdict = |column: &VerdictColumn<'_>| cell(column.of(name).map_or("-", word));
        out += &line(name, columns.iter().map(verdict).collect());
    }
    out
}

/// Name of an integrator in lines of a column, broken at hyphens.
fn header(integrator: &str) -> Vec<String> {
    let mut lines: Vec<String> = vec![];
    for part in integrator.split_inclusive('-') {
        match lines.last_mut() {
            Some(last) if last.len() + part.len() < COLUMN => last.push_str(part),
            _ => lines.push(part.into()),
        }
    }
    lines
}

/// Reasons for all that did not pass, with the word of the verdict, failures first.
fn reasons(results: &[Outcome]) -> Vec<(&'static str, String)> {
    let mut found: Vec<(&'static str, Option<&str>, Vec<&str>, &Outcome)> = vec![];
    for agreement in agreements(results) {
        let result @ (case, f) = agreement.first;
        let key = (word(f), f.reason());
        match found.iter_mut().find(|(word, reason, ..)| (*word, *reason) == key) {
            Some((_, _, names, _)) if names.contains(&&case.name[..]) => {}
            Some((_, _, names, _)) => names.push(&case.name),
            None => found.push((key.0, key.1, vec![&case.name], result)),
        }
    }
    found.retain(|(word, ..)| *word != "pass");
    let order = ["FAIL", "limit", "flag", "time"];
    found.sort_by_key(|(word, ..)| order.iter().position(|other| other == word));
    let text = |names: Vec<&str>, (case, f): &Outcome| {
        // The kind of the note shows in the grid.
        let note = f.notes.first().map_or("", String::as_str);
        let note = note.split_once(": ").map_or(note, |(_, told)| told);
        format!("{}: {note} ({})", names.join(", "), case.integrator)
    };
    found.into_iter().map(|(word, _, names, result)| (word, text(names, result))).collect()
}

/// Text of at most two lines, cut between words.
fn shortened(text: &str) -> String {
    if text.chars().count() <= REASON_LENGTH {
        return text.into();
    }
    let mut out = String::new();
    for word in text.split_whitespace() {
        if out.chars().count() + word.chars().count() + 4 > REASON_LENGTH {
            break;
        }
        out += word;
        out.push(' ');
    }
    out + "..."
}

/// Agreement of the linear solvers.
fn solvers(results: &[Outcome]) -> String {
    let rows = agreements(results);
    let most = rows.iter().map(|row| row.solvers.len()).max().unwrap_or(1);
    let mut names: Vec<&str> = vec![];
    for (a, b) in rows.iter().zip(rows.iter().skip(1)) {
        let differ = a.first.0.name == b.first.0.name && a.first.0.integrator == b.first.0.integrator;
        if differ && !a.first.1.cut_short && !b.first.1.cut_short && !names.contains(&&a.first.0.name[..]) {
            names.push(&a.first.0.name);
        }
    }
    match (names.is_empty(), most) {
        (true, 1) => String::new(),
        (true, most) => format!("; {most} linear solvers agree"),
        (false, _) => format!("; linear solvers differ at {}, see --all", names.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;
    use pliant_lab::stress::{CaseFilter, run_all, scene_cases};

    /// A block of a material without inverted states, in a step that is above the limit of Verlet.
    const BLOCK: &str = "dimension = 2
        time = { integrator = 'velocity-verlet', step = 0.02, duration = 1.0, allow_unstable = true }
        world = { gravity = [0, -9.81] }
        [[body]]
        mesh = { grid = { cells = [3, 2], spacing = 0.3 } }
        elastic = { neo-hookean = { young = 1e5, poisson = 0.3 } }
        mass = { density = 1000.0 }
        pin = [{ half_space = { normal = [1, 0], offset = 0 } }]";

    fn results(budget: f64) -> Vec<Outcome> {
        let source = pliant_scene::Source::new("block", BLOCK);
        let cases = scene_cases(&source, &CaseFilter::default()).unwrap();
        run_all(cases, Some(budget), &AtomicBool::new(false), &|_| None, &mut |_, _| {})
    }

    #[test]
    fn the_answer_for_a_scene_fits_a_terminal() {
        let said = brief(&results(1e4), 200);
        assert!(said.lines().count() <= 24 && said.lines().all(|line| line.len() <= WIDTH), "{said}");
        for word in ["NaN", "inf", "e-"] {
            assert!(!said.contains(word), "{word} in\n{said}");
        }
        let row = |name: &str| {
            let line = said.lines().find(|line| line.starts_with(name)).unwrap();
            line.split_whitespace().rev().take(4).collect::<Vec<_>>().join(" ")
        };
        // Verlet, implicit Euler, BDF2, TR-BDF2, from the right.
        assert_eq!(row("as it is"), "pass pass pass limit", "{said}");
        let whole = said.split_whitespace().collect::<Vec<_>>().join(" ");
        for told in [
            "detected at step 14, as expected (velocity-verlet)",
            "; 4 linear solvers agree",
            "What works at \"as it is\": a step of ",
            "Use implicit-euler",
        ] {
            assert!(whole.contains(told), "{told} in\n{said}");
        }
    }

    #[test]
    fn without_time_there_is_no_conclusion() {
        assert!(conclusion(&results(0.0)).contains("--budget"));
    }

    #[test]
    fn long_texts_end_between_words() {
        let long = "word ".repeat(60);
        let short = shortened(&long);
        assert!(short.len() <= REASON_LENGTH && short.ends_with("word ..."), "{short}");
        assert_eq!(shortened("short"), "short");
        assert_eq!(header("linearised-implicit-euler"), ["linearised-", "implicit-", "euler"]);
        assert_eq!(header("tr-bdf2"), ["tr-bdf2"]);
    }
}
