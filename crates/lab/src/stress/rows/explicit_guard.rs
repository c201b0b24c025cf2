//! D2: an explicit integrator below and above its stability limit: below it the run stays bounded, above it
//! the run is stopped with an error that names a stable step.

use std::sync::atomic::AtomicBool;

use super::CaseDescription;
use crate::stress::scenes::{Solid, beam};
use crate::stress::{Case, CaseResult, CaseVerdict};
use pliant::quantity::Seconds;
use pliant::run::{Outcome, Plan, run};

/// Stability limit `2 / omega_max` of the beam with neo-Hookean elements [s]; from an independent code.
const LIMIT: f64 = 0.009_423_663_239_14;

pub(super) fn add(cases: &mut Vec<Case>) {
    for (name, step, stable) in
        [("0.983 of the limit, 10 s", 1.0 / 108.0, true), ("1.040 of the limit", 1.0 / 102.0, false)]
    {
        let about = CaseDescription {
            row: "D2",
            name,
            dimension: 2,
            material: "neo-hookean",
            poisson: Some(0.3),
            integrator: "velocity-verlet",
            quick: true,
        };
        cases.push(about.case(move || guard(step, stable)));
    }
}

fn guard(step: f64, stable: bool) -> CaseResult {
    let solid = Solid { integrator: "'velocity-verlet'", step, material: "neo-hookean", ..beam() };
    let mut simulation = solid.assemble().simulation;
    let mut findings = CaseResult::default();
    let limit = simulation.stability_limit(10.0).map_or(f64::NAN, |limit| limit.step);
    findings.measure("limit", (limit / LIMIT - 1.0).abs(), 1e-9);
    let rest = simulation.positions().into_owned();
    let plan = Plan { duration: 10.0, rate: 10.0 };
    let summary = run(&mut simulation, &plan, &mut [], &AtomicBool::new(false));
    findings.min_j = summary.end.min_j;
    match summary.outcome {
        Outcome::Done => {
            findings.demand(stable, || "an unstable run was not stopped".into());
            let x = simulation.positions();
            let most = x.iter().zip(&rest).fold(0.0, |m: f64, (x, rest)| m.max((x - rest).abs()));
            findings.demand(most < 5.0, || format!("moved by {most:.2} m"));
        }
        Outcome::Failed(error) => {
            let said = error.to_string();
            findings.demand(!stable, || said.clone());
            let right = said.contains(&Seconds(0.99 * limit).to_string());
            findings.demand(right, || format!("the stable step is not named: {said}"));
            findings.note(CaseVerdict::Pass, format!("stopped: {said}"));
        }
        other => findings.note(CaseVerdict::Fail, format!("{other:?}")),
    }
    findings
}
