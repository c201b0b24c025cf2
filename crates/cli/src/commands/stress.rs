//! `pliant stress`: what breaks simulators, and what stands.

use std::sync::atomic::Ordering;

use pliant::stress::{self, Case, Choice, Findings, Verdict};
use serde_json::json;

use crate::arguments::StressArguments;
use crate::failure::{Failure, Status};
use crate::interrupt;
use crate::terminal::Terminal;
use crate::text::{number, table};

pub(crate) fn execute(arguments: &StressArguments, terminal: Terminal) -> Result<Status, Failure> {
    let interrupted = interrupt::flag()?;
    let choice = Choice {
        only: arguments.only.clone(),
        materials: arguments.materials.clone(),
        integrators: arguments.integrators.clone(),
        quick: arguments.quick,
    };
    let cases = stress::cases(&choice);
    let mut results: Vec<(Case, Findings)> = vec![];
    for case in cases {
        if interrupted.load(Ordering::Relaxed) {
            break;
        }
        let f = case.run();
        results.push((case, f));
    }
    terminal.report(&describe(&results))?;
    terminal.document(&json!({ "status": Status::Done }))?;
    let failed = results.iter().any(|(_, f)| f.verdict == Verdict::Fail);
    Ok(if failed { Status::Failed } else { Status::Done })
}

fn describe(results: &[(Case, Findings)]) -> String {
    let header = ["case", "", "material", "nu", "integrator", "solver", "verdict", "its", "bar", "min J", "energy", "error", "s"];
    let mut rows = vec![header.map(str::to_owned).to_vec()];
    for (case, f) in results {
        let n = |x: Option<f64>| x.map_or_else(String::new, number);
        let c = |x: Option<u64>| x.map_or_else(String::new, |x| x.to_string());
        rows.push(vec![
            format!("{} {}", case.row, case.name),
            format!("{}D", case.dimension),
            case.material.clone(),
            n(case.poisson),
            case.integrator.clone(),
            case.solver.name().into(),
            f.verdict.to_string(),
            c(f.iterations),
            c(f.bar),
            n(f.min_j),
            n(f.energy_ratio),
            n(f.error),
            format!("{:.2}", f.seconds),
            f.notes.join("; "),
        ]);
    }
    table(&rows, 0)
}
