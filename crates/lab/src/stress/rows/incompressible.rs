//! D6: near incompressibility: a cantilever under a unit shear at its end. Linear elements lock,
//! quadratic elements do not.

use super::CaseDescription;
use crate::stress::scenes::{self, Solid};
use crate::stress::{Case, CaseResult, CaseVerdict};

/// Deflection at the middle of the end [1e-3 m], from an independent code:
/// `(nu, order, cells along and across, displacement)`.
const KNOWN: [(f64, u8, [usize; 2], f64); 10] = [
    (0.3, 1, [20, 2], 1.898),
    (0.3, 1, [40, 4], 2.961),
    (0.49, 1, [20, 2], 0.315),
    (0.49, 1, [40, 4], 0.892),
    (0.49, 1, [80, 8], 1.856),
    (0.4999, 1, [20, 2], 0.0399),
    (0.4999, 1, [40, 4], 0.0494),
    (0.4999, 1, [80, 8], 0.0864),
    (0.4999, 2, [20, 2], 2.866),
    (0.4999, 2, [40, 4], 2.950),
];
/// Mesh-converged deflections [1e-3 m] by Poisson's ratio.
const CONVERGED: [(f64, f64); 3] = [(0.3, 3.659_284), (0.49, 3.031_588), (0.4999, 2.989_947)];

pub(super) fn add(cases: &mut Vec<Case>) {
    for (poisson, order, cells, known) in KNOWN {
        let kind = if order == 1 { "linear" } else { "quadratic" };
        let about = CaseDescription {
            row: "D6",
            name: &format!("cantilever, {kind} {} x {}", cells[0], cells[1]),
            dimension: 2,
            material: "linear",
            poisson: Some(poisson),
            integrator: "quasi-static",
            quick: true,
        };
        cases.push(about.case(move || cantilever(poisson, order, cells, known)));
    }
}

fn cantilever(poisson: f64, order: u8, cells: [usize; 2], known: f64) -> CaseResult {
    let keys = format!(
        "order = {order}\npin = [{}]\nload = [{{ half_space = {{ normal = [-1, 0], offset = -10 }}, \
         traction = [0, -1] }}]",
        scenes::clamp(2, 0, 1.0, 0.0, ""),
    );
    let solid = Solid {
        cells: &cells,
        size: &[10.0, 1.0],
        material: "linear",
        young: 1e6,
        poisson,
        keys: &keys,
        ..Solid::UNIT
    };
    let mut assembly = solid.assemble();
    let mut findings = CaseResult::default();
    let rest = assembly.simulation.positions().into_owned();
    if let Err(error) = assembly.simulation.step() {
        findings.note(CaseVerdict::Fail, error.to_string());
        return findings;
    }
    findings.count(scenes::iterations(&assembly.simulation), None);
    let x = assembly.simulation.positions();
    let middle = rest.chunks_exact(2).position(|p| (p[0] - 10.0).abs() < 1e-9 && (p[1] - 0.5).abs() < 1e-9);
    let down = middle.map_or(f64::NAN, |i| rest[2 * i + 1] - x[2 * i + 1]);
    // References have three or four digits; the last depends on the directions of the diagonals of locked
    // meshes.
    let tolerance = if order == 1 && poisson > 0.49 { 2e-2 } else { 2e-3 };
    findings.measure("tip, relative", (down / (1e-3 * known) - 1.0).abs(), tolerance);
    let share = CONVERGED.iter().find(|(nu, _)| *nu == poisson).map_or(f64::NAN, |(_, u)| down / (1e-3 * u));
    let verdict = if share < 0.5 { CaseVerdict::Flagged } else { CaseVerdict::Pass };
    let locks = if share < 0.5 { "locks: " } else { "" };
    findings.note(verdict, format!("{locks}{:.1} % of the converged displacement", 100.0 * share));
    if share < 0.5 {
        findings.advice = Some("order = 2: quadratic elements reach 96 % and more with the same mesh".into());
    }
    findings.picture = Some(scenes::picture(&assembly.simulation, &assembly.topology));
    findings
}
