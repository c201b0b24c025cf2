//! `pliant stress`: what breaks simulators, and what stands.

mod conclusion;
mod page;
mod picture;
mod rows;

use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Duration;

use pliant_lab::stress::{self, Case, CaseFilter, CaseResult, CaseVerdict, Progress};
use serde_json::{Value, json};

use super::run::use_threads;
use crate::arguments::StressArguments;
use crate::failure::{ExitStatus, Failure};
use crate::input::Input;
use crate::interrupt;
use crate::output;
use crate::progress::spinner;
use crate::terminal::Terminal;
use crate::text::{counted, duration};

/// Seconds for a scene, which may be of any size.
const SCENE_BUDGET: f64 = 60.0;

/// Name of the file of results.
const DOCUMENT: &str = "stress.json";
/// State of the sources of this program.
const COMMIT: &str = env!("PLIANT_COMMIT");

/// A case and what came of it.
type Outcome = (Case, CaseResult);

pub(crate) fn execute(arguments: &StressArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    use_threads(None)?;
    let choice = CaseFilter {
        only: arguments.only.clone(),
        materials: arguments.materials.clone(),
        integrators: arguments.integrators.clone(),
        solvers: arguments.solvers.clone(),
        quick: arguments.quick,
        long: arguments.long,
    };
    let cases = match &arguments.scene {
        Some(scene) => stress::scene_cases(&Input::read(scene, &arguments.set, None)?.source, &choice)?,
        None => stress::cases(&choice),
    };
    if cases.is_empty() {
        return Err(Failure::usage(
            "no case is of these rows, materials, integrators and solvers; rows are torture, D1 to D13, K18 \
             and K18-long, `pliant list` has materials and integrators",
        ));
    }
    if let Some(folder) = &arguments.output {
        output::folder(folder)?;
    }
    let file = arguments.output.as_ref().map(|folder| folder.join(DOCUMENT));
    let earlier = match &file {
        Some(file) if arguments.resume && file.exists() => earlier_results(file)?,
        _ => vec![],
    };
    let interrupted = interrupt::flag()?;
    let count = cases.len();
    let budget = arguments.budget.or(arguments.scene.as_ref().map(|_| SCENE_BUDGET));
    let bar = spinner(terminal);
    let known = |case: &Case| find(&earlier, case);
    // Those that cost hours are not lost with those after them.
    let (mut kept, mut written) = (earlier.clone(), Ok(()));
    let results = stress::run_all(cases, budget, interrupted, &known, &mut |progress, findings| {
        let Progress { case, finished, left, .. } = progress;
        match (findings, &bar) {
            (None, Some(bar)) => {
                let left = left.map_or_else(String::new, |left| {
                    format!(", about {} left", duration(Duration::from_secs_f64(left)))
                });
                bar.set_message(format!(
                    "{}/{count} {} {}, {}{left}",
                    finished + 1,
                    case.row,
                    case.name,
                    case.integrator
                ));
            }
            (Some(findings), _) if terminal.verbose => {
                let line = format!("{}/{count} {case:?}: {}", finished + 1, findings.verdict);
                match &bar {
                    Some(bar) => bar.println(line),
                    None => terminal.note(&line),
                }
            }
            _ => {}
        }
        if let (Some(file), Some(findings)) = (&file, findings)
            && case.is_long
            && !interrupted.load(Ordering::Relaxed)
        {
            kept.retain(|earlier| !is_of(earlier, case));
            kept.push(stress_case(case, findings));
            let so_far = json!({ "status": ExitStatus::Interrupted, "commit": COMMIT, "cases": kept });
            written = keep(file, &so_far);
        }
    });
    written?;
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    let is_scene = arguments.scene.is_some();
    let said = match is_scene && terminal.is_read() && !arguments.all {
        true => conclusion::brief(&results, terminal.width()),
        false => rows::describe(&results, is_scene, terminal.width()),
    };
    terminal.report(&said)?;
    if let Some(folder) = &arguments.output {
        write(folder, &results, &earlier)?;
        terminal.note(&format!("wrote stress.html, stress.csv and stress.json to {}", folder.display()));
    }
    if let Some(file) = &arguments.markdown {
        page::write(file, &results)?;
        terminal.note(&format!("wrote {}", file.display()));
    }
    let interrupted = interrupted.load(Ordering::Relaxed);
    let failed = results.iter().any(|(_, f)| f.verdict == CaseVerdict::Fail);
    let status = match (interrupted, failed) {
        (true, _) => ExitStatus::Interrupted,
        (_, true) => ExitStatus::Failed,
        _ => ExitStatus::Done,
    };
    terminal.document(&document(status, &results))?;
    if !interrupted && results.len() < count {
        let left_out = counted((count - results.len()) as u64, "case was", "cases were");
        terminal.warn(&format!("the time budget is used up: {left_out} omitted; increase --budget"));
    }
    if interrupted {
        let (done, count) = (counted(results.len() as u64, "case", "cases"), count);
        terminal.complain(&format!("interrupted: these are {done} of {count}"));
    }
    Ok(status)
}

/// Writes the reports, with `earlier` results of cases that were not asked for in that for programs.
fn write(folder: &Path, results: &[Outcome], earlier: &[Value]) -> Result<(), Failure> {
    let mut all = document(ExitStatus::Done, results);
    let others = earlier.iter().filter(|other| !results.iter().any(|(case, _)| is_of(other, case)));
    if let Some(cases) = all["cases"].as_array_mut() {
        cases.extend(others.cloned());
    }
    output::file(&folder.join("stress.csv"), &rows::csv(results))?;
    output::file(&folder.join(DOCUMENT), &format!("{all:#}\n"))?;
    output::file(&folder.join("stress.html"), &page::html(results))
}

fn document(status: ExitStatus, results: &[Outcome]) -> Value {
    let cases: Vec<Value> = results.iter().map(|(case, findings)| stress_case(case, findings)).collect();
    json!({ "status": status, "commit": COMMIT, "counts": counts(results), "cases": cases })
}

/// A case and what came of it, for programs.
pub fn stress_case(case: &Case, findings: &CaseResult) -> Value {
    let mut value = json!({
        "row": case.row,
        "name": case.name,
        "dimension": case.dimension,
        "material": case.material,
        "poisson": case.poisson,
        "integrator": case.integrator,
        "solver": case.solver.name(),
    });
    if let (Some(value), Value::Object(findings)) = (value.as_object_mut(), json!(findings)) {
        value.extend(findings);
    }
    value
}

/// Cases of an earlier run by a program of the same commit.
fn earlier_results(file: &Path) -> Result<Vec<Value>, Failure> {
    let refused = |why: String| {
        let what = format!(
            "cannot take results from {}: {why}; leave out --resume to run all cases",
            file.display()
        );
        Failure::failed("output", what)
    };
    let text = std::fs::read_to_string(file).map_err(|error| refused(error.to_string()))?;
    let document: Value = serde_json::from_str(&text).map_err(|error| refused(error.to_string()))?;
    if document["commit"] != COMMIT {
        return Err(refused(format!("they are of commit {}, not of {COMMIT}", document["commit"])));
    }
    let cases =
        document["cases"].as_array().cloned().ok_or_else(|| refused("there are no cases in it".into()))?;
    for case in &cases {
        serde_json::from_value::<CaseResult>(case.clone())
            .map_err(|error| refused(format!("of {}: {error}", case["name"])))?;
    }
    Ok(cases)
}

/// Writes results so far, the old ones or the new ones at every moment.
fn keep(file: &Path, so_far: &Value) -> Result<(), Failure> {
    pliant_files::durable_file::replace(file, format!("{so_far:#}\n").as_bytes())
        .map_err(|error| Failure::failed("output", format!("cannot write {}: {error}", file.display())))
}

/// True if results are of this case.
fn is_of(results: &Value, case: &Case) -> bool {
    let own = stress_case(case, &CaseResult::default());
    let keys = ["row", "name", "dimension", "material", "poisson", "integrator", "solver"];
    keys.iter().all(|key| own[key] == results[key])
}

/// Results of a long case; others are run again: they cost nothing, and pages draw their end states.
fn find(earlier: &[Value], case: &Case) -> Option<CaseResult> {
    let own = earlier.iter().find(|results| case.is_long && is_of(results, case))?;
    serde_json::from_value(own.clone()).ok()
}

/// How many passed, were flagged, failed.
fn counts(results: &[Outcome]) -> Value {
    let of = |verdict| results.iter().filter(|(_, f)| f.verdict == verdict).count();
    json!({
        "pass": of(CaseVerdict::Pass), "flagged": of(CaseVerdict::Flagged), "fail": of(CaseVerdict::Fail),
    })
}
