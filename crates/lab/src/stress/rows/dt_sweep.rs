//! D1: steps from far below to far above the time scale of a body's motion.

use super::CaseDescription;
use crate::stress::scenes::{self, Solid, beam, pinned_bar};
use crate::stress::{Case, CaseResult};

const INTEGRATORS: [&str; 4] = ["implicit-euler", "bdf2", "tr-bdf2", "generalised-alpha"];
const STEPS: [f64; 5] = [1e-4, 1e-3, 1e-2, 0.1, 1.0];
/// Limit on the Newton iterations of one solve.
const BAR: u64 = 50;

/// Tip of the beam in static equilibrium under its weight, relative to the reference configuration [m];
/// from an independent code.
const STATIC_TIP: [(&str, [f64; 2]); 4] = [
    ("neo-hookean", [-0.158_125_211_285, -1.900_663_540_57]),
    ("stable-neo-hookean", [-0.169_116_128_2, -1.905_800_605_5]),
    ("fixed-corotated", [-0.162_785_870_113, -1.873_119_779_89]),
    ("stvk", [-0.173_098_852_093, -1.779_916_283_52]),
];

pub(super) fn add(cases: &mut Vec<Case>) {
    for integrator in INTEGRATORS {
        for step in STEPS {
            for dimension in [2, 3] {
                let name = if dimension == 2 { "falling beam" } else { "twisting bar" };
                let material = "stable-neo-hookean";
                let about = CaseDescription {
                    row: "D1",
                    name: &format!("{name}, step {step} s"),
                    dimension,
                    material,
                    poisson: Some(if dimension == 2 { 0.3 } else { 0.45 }),
                    integrator,
                    quick: step >= 1e-2,
                };
                cases.push(about.case(move || sweep(dimension, integrator, step)));
            }
        }
    }
    for (material, tip) in STATIC_TIP {
        let about = CaseDescription {
            row: "D1",
            name: "20 steps of 1 s to static equilibrium",
            dimension: 2,
            material,
            poisson: Some(0.3),
            integrator: "implicit-euler",
            quick: true,
        };
        cases.push(about.case(move || to_rest(material, tip)));
    }
}

fn sweep(dimension: usize, integrator: &str, step: f64) -> CaseResult {
    let integrator = scenes::scheme(integrator);
    let solid = Solid { integrator: &integrator, step, ..if dimension == 2 { beam() } else { pinned_bar() } };
    let mut assembly = solid.assemble();
    let simulation = &mut assembly.simulation;
    if dimension == 3 {
        scenes::twist(simulation);
    }
    let solves = u64::from(simulation.method().documentation.solves.max(1));
    let mut findings = CaseResult::default();
    let steps = (1.0f64.max(20.0 * step) / step).round() as u64;
    let mut most = 0;
    for _ in 0..steps {
        let before = scenes::iterations(simulation);
        if let Err(error) = simulation.step() {
            findings.note(crate::stress::CaseVerdict::Fail, error.to_string());
            break;
        }
        most = most.max((scenes::iterations(simulation) - before).div_ceil(solves));
    }
    findings.count(most, Some(BAR));
    let diagnostics = simulation.diagnostics();
    findings.demand(diagnostics.total.is_finite(), || "the energy is not finite".into());
    findings.note_inversion(&diagnostics);
    findings.picture = Some(scenes::picture(simulation, &assembly.topology));
    findings
}

fn to_rest(material: &str, tip: [f64; 2]) -> CaseResult {
    let solid = Solid { integrator: "'implicit-euler'", step: 1.0, material, ..beam() };
    let mut assembly = solid.assemble();
    let simulation = &mut assembly.simulation;
    let rest = simulation.positions().into_owned();
    let mut findings = CaseResult::default();
    let (mut most, mut before) = (0, 0);
    for _ in 0..20 {
        if let Err(error) = simulation.step() {
            findings.note(crate::stress::CaseVerdict::Fail, error.to_string());
            return findings;
        }
        most = most.max(scenes::iterations(simulation) - before);
        before = scenes::iterations(simulation);
    }
    findings.count(most, Some(BAR));
    findings.note_inversion(&simulation.diagnostics());
    let x = simulation.positions();
    let n = x.len();
    let error = (x[n - 2] - rest[n - 2] - tip[0]).abs().max((x[n - 1] - rest[n - 1] - tip[1]).abs());
    findings.measure("tip [m]", error, 1e-8);
    findings.picture = Some(scenes::picture(simulation, &assembly.topology));
    findings
}
