//! D12: a stiff square in free rotation: changes of its angular momentum, energy and shape after one
//! second.

use super::CaseDescription;
use crate::stress::scenes::{self, Solid};
use crate::stress::{Case, CaseResult, CaseVerdict};

/// Relative changes of angular momentum and, if known, of energy, in steps of 1/100 s (1/2000 s for
/// explicit integrators); from an independent code. Zero means to rounding.
const KNOWN: [(&str, f64, Option<f64>); 10] = [
    ("velocity-verlet", 0.0, None),
    ("yoshida4", 0.0, None),
    ("implicit-midpoint", 0.0, Some(1.5e-2)),
    ("implicit-euler", -0.4217, Some(-0.665)),
    ("sdirk2", -5.51e-2, None),
    ("bdf2", -8.38e-3, None),
    ("trapezoid", -4.31e-3, None),
    ("tr-bdf2", -1.40e-3, None),
    ("radau-iia2", -2.76e-4, None),
    ("generalised-alpha", -1.28e-4, None),
];

pub(super) fn add(cases: &mut Vec<Case>) {
    for (integrator, momentum, energy) in KNOWN {
        let about = CaseDescription {
            row: "D12",
            name: "free spin",
            dimension: 2,
            material: "stable-neo-hookean",
            poisson: Some(0.3),
            integrator,
            quick: true,
        };
        cases.push(about.case(move || spin(integrator, momentum, energy)));
    }
}

fn spin(integrator: &str, momentum: f64, energy: Option<f64>) -> CaseResult {
    let is_explicit = matches!(integrator, "velocity-verlet" | "yoshida4");
    let steps = if is_explicit { 2000 } else { 100 };
    let scheme = scenes::scheme(integrator);
    let solid = Solid {
        cells: &[3, 3],
        size: &[1.0, 1.0],
        origin: &[-0.5, -0.5],
        young: 1e7,
        integrator: &scheme,
        step: 1.0 / steps as f64,
        time: if is_explicit { "" } else { ", solver = { tolerance = 1e-15 }" },
        keys: "velocity = { rigid = { angular = 10 } }",
        ..Solid::UNIT
    };
    let mut simulation = solid.assemble().simulation;
    let mut findings = CaseResult::default();
    let start = simulation.diagnostics();
    for _ in 0..steps {
        if let Err(error) = simulation.step() {
            findings.note(CaseVerdict::Fail, error.to_string());
            return findings;
        }
    }
    let end = simulation.diagnostics();
    findings.count(scenes::iterations(&simulation), None);
    findings.note_inversion(&end);
    findings.energy_ratio = Some(end.total / start.total);
    let lost = end.angular_momentum[2] / start.angular_momentum[2] - 1.0;
    findings.note(CaseVerdict::Pass, format!("angular momentum changes by {lost:.3e}"));
    if momentum == 0.0 {
        findings.measure("angular momentum", lost.abs(), 1e-12);
    } else {
        findings.measure("change of angular momentum, relative", (lost / momentum - 1.0).abs(), 0.1);
    }
    if let Some(energy) = energy {
        let changed = end.total / start.total - 1.0;
        findings.measure("change of energy, relative", (changed / energy - 1.0).abs(), 0.1);
    }
    let p = end.linear_momentum.iter().fold(0.0, |m: f64, p| m.max(p.abs()));
    findings.measure("linear momentum [kg m/s]", p, 1e-11 * 1000.0);
    findings
}
