//! D13: a straight column under twice its buckling load: a nearly singular matrix from the first step.

use std::f64::consts::PI;

use super::CaseDescription;
use crate::stress::scenes::{self, Solid};
use crate::stress::{Case, CaseResult, CaseVerdict};
use pliant::simulation::StepError;

/// Young's modulus [Pa], width and length [m].
const YOUNG: f64 = 1e6;
const WIDTH: f64 = 0.05;
const LENGTH: f64 = 1.0;

pub(super) fn add(cases: &mut Vec<Case>) {
    for material in ["stable-neo-hookean", "neo-hookean", "fixed-corotated"] {
        for push in [0.0, 1e-4] {
            let about = CaseDescription {
                row: "D13",
                name: if push == 0.0 {
                    "column under twice its buckling load"
                } else {
                    "the same, pushed aside a little"
                },
                dimension: 2,
                material,
                poisson: Some(0.3),
                integrator: "quasi-static",
                quick: true,
            };
            cases.push(about.case(move || column(material, push)));
        }
    }
}

/// Compresses the column; `push` is the lateral fraction of the load.
fn column(material: &str, push: f64) -> CaseResult {
    // Euler's buckling load of a column with one free end, pi^2 EI / (4 L^2), in plane strain.
    let stiffness = YOUNG / (1.0 - 0.09) * WIDTH.powi(3) / 12.0;
    let load = 2.0 * PI * PI * stiffness / (4.0 * LENGTH * LENGTH);
    let keys = format!(
        "order = 2\npin = [{}]\nload = [{{ half_space = {{ normal = [0, -1], offset = {:?} }}, force = \
         [{:?}, {:?}] }}]",
        scenes::clamp(2, 1, 1.0, 0.0, ""),
        -LENGTH,
        push * load,
        -load,
    );
    let solid =
        Solid { cells: &[2, 20], size: &[WIDTH, LENGTH], material, young: YOUNG, keys: &keys, ..Solid::UNIT };
    let mut assembly = solid.assemble();
    let simulation = &mut assembly.simulation;
    let rest = simulation.state().x().to_vec();
    let mut findings = CaseResult::default();
    match simulation.step() {
        Ok(()) => {}
        Err(error @ StepError::Unsolved { .. }) if push == 0.0 => {
            findings.note_error(&error, true);
            return findings;
        }
        Err(error) => {
            findings.note(CaseVerdict::Fail, error.to_string());
            return findings;
        }
    }
    findings.count(scenes::iterations(simulation), Some(500));
    let diagnostics = simulation.diagnostics();
    findings.note_inversion(&diagnostics);
    let finite = simulation.state().x().iter().all(|x| x.is_finite());
    findings.demand(finite, || "the state is not finite".into());
    let gradient = scenes::gradient(simulation, None);
    findings.measure("gradient over E L", gradient / YOUNG, 1e-8);
    let x = simulation.state().x();
    let aside = (0..x.len()).step_by(2).fold(0.0, |m: f64, i| m.max((x[i] - rest[i]).abs()));
    findings.note(CaseVerdict::Pass, format!("moved aside by {aside:.3e} m"));
    findings.demand(push == 0.0 || aside > 0.1 * LENGTH, || "did not buckle".into());
    findings.picture = Some(scenes::picture(simulation, &assembly.topology));
    findings
}
