//! D11: bars stretched tenfold and released.

use super::CaseDescription;
use crate::stress::scenes::{self, Solid};
use crate::stress::{Case, CaseResult, CaseVerdict, Start};
use pliant::quantity::Rounded;

const STEP: f64 = 1.0 / 60.0;

pub(super) fn add(cases: &mut Vec<Case>) {
    for dimension in [2, 3] {
        for material in ["stable-neo-hookean", "fixed-corotated"] {
            for integrator in ["implicit-euler", "implicit-midpoint"] {
                let about = CaseDescription {
                    row: "D11",
                    name: "stretched tenfold, let go",
                    dimension,
                    material,
                    poisson: Some(0.3),
                    integrator,
                    quick: true,
                };
                cases.push(about.case(move || release(dimension, material, integrator)));
            }
        }
    }
}

fn release(dimension: usize, material: &str, integrator: &str) -> CaseResult {
    let pin = format!("pin = [{}]", scenes::clamp(dimension, 0, 1.0, 0.0, ""));
    let scheme = scenes::scheme(integrator);
    let solid = Solid {
        cells: &[4, 2, 2][..dimension],
        size: &[1.0, 0.5, 0.5][..dimension],
        material,
        integrator: &scheme,
        step: STEP,
        keys: &pin,
        ..Solid::UNIT
    };
    let mut assembly = solid.assemble();
    let simulation = &mut assembly.simulation;
    let rest = scenes::put(simulation, Start::Stretch);
    let start = simulation.diagnostics().total;
    let is_euler = integrator == "implicit-euler";
    let mut findings = CaseResult::default();
    let (mut most, mut before, mut highest) = (0, 0, start);
    for _ in 0..if is_euler { 3000 } else { 300 } {
        if let Err(error) = simulation.step() {
            findings.note_error(&error, !is_euler);
            break;
        }
        most = most.max(scenes::iterations(simulation) - before);
        before = scenes::iterations(simulation);
        highest = highest.max(simulation.diagnostics().total);
    }
    findings.count(most, None);
    let diagnostics = simulation.diagnostics();
    findings.note_inversion(&diagnostics);
    findings.energy_ratio = Some(diagnostics.total / start);
    findings.demand(diagnostics.total.is_finite(), || "the energy is not finite".into());
    if is_euler {
        findings.demand(highest <= 1.01 * start, || {
            format!("energy rose to {:.3} of the start", highest / start)
        });
        findings.measure(
            "away from rest [m]",
            scenes::largest_difference(simulation.state().x(), &rest),
            1e-3,
        );
    } else if highest > 1.01 * start {
        let advice = "implicit-euler, bdf2 and tr-bdf2 do not gain energy at this step; or a smaller step";
        findings.advice = Some(advice.into());
        findings.note(
            CaseVerdict::Flagged,
            format!("energy grew {} times, which this integrator may do", Rounded::<3>(highest / start)),
        );
    }
    findings.picture = Some(scenes::picture(simulation, &assembly.topology));
    findings
}
