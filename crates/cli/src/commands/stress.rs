//! `pliant stress`: what breaks simulators, and what stands.

mod page;
mod picture;
mod rows;

use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Duration;

use pliant_lab::stress::{self, Case, CaseFilter, CaseResult, CaseVerdict, Progress};
use serde_json::{Value, json};

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

/// A case and what came of it.
type Outcome = (Case, CaseResult);

pub(crate) fn execute(arguments: &StressArguments, terminal: Terminal) -> Result<ExitStatus, Failure> {
    let choice = CaseFilter {
        only: arguments.only.clone(),
        materials: arguments.materials.clone(),
        integrators: arguments.integrators.clone(),
        solvers: arguments.solvers.clone(),
        quick: arguments.quick,
    };
    let cases = match &arguments.scene {
        Some(scene) => stress::scene_cases(&Input::read(scene, &arguments.set, None)?.source, &choice)?,
        None => stress::cases(&choice),
    };
    if cases.is_empty() {
        return Err(Failure::usage(
            "no case is of these rows, materials, integrators and solvers; rows are torture, D1 to D13 and K18, `pliant list` has materials and integrators",
        ));
    }
    if let Some(folder) = &arguments.output {
        output::folder(folder)?;
    }
    let interrupted = interrupt::flag()?;
    let count = cases.len();
    let budget = arguments.budget.or(arguments.scene.as_ref().map(|_| SCENE_BUDGET));
    let bar = spinner(terminal);
    let results = stress::run_all(cases, budget, interrupted, &mut |progress, findings| {
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
    });
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    terminal.report(&rows::describe(&results, arguments.scene.is_some(), terminal.width()))?;
    if let Some(folder) = &arguments.output {
        write(folder, &results)?;
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
        terminal.warn(&format!("the time was over: {left_out} left out; give more by --budget"));
    }
    if interrupted {
        let (done, count) = (counted(results.len() as u64, "case", "cases"), count);
        terminal.complain(&format!("interrupted: these are {done} of {count}"));
    }
    Ok(status)
}

fn write(folder: &Path, results: &[Outcome]) -> Result<(), Failure> {
    output::file(&folder.join("stress.csv"), &rows::csv(results))?;
    output::file(&folder.join("stress.json"), &format!("{:#}\n", document(ExitStatus::Done, results)))?;
    output::file(&folder.join("stress.html"), &page::html(results))
}

fn document(status: ExitStatus, results: &[Outcome]) -> Value {
    let cases: Vec<Value> = results.iter().map(|(case, findings)| stress_case(case, findings)).collect();
    json!({ "status": status, "counts": counts(results), "cases": cases })
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

/// How many passed, were flagged, failed.
fn counts(results: &[Outcome]) -> Value {
    let of = |verdict| results.iter().filter(|(_, f)| f.verdict == verdict).count();
    json!({ "pass": of(CaseVerdict::Pass), "flagged": of(CaseVerdict::Flagged), "fail": of(CaseVerdict::Fail) })
}
