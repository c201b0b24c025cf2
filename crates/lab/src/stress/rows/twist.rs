//! D3: a bar whose end is turned by ten degrees in each step and then released.

use std::f64::consts::PI;

use super::CaseDescription;
use crate::stress::scenes::{self, Solid, clamp};
use crate::stress::{Case, CaseResult, CaseVerdict};
use pliant::simulation::Simulation;

/// Limit on Newton iterations of one step: three times those of an independent code at the worst angle.
const BAR: u64 = 3 * 49;
/// Torques [N m] by angle [degrees].
type Torques = &'static [(u64, f64)];

/// Relative tolerance of torques, compared with those of an independent code.
const TOLERANCE: f64 = 1e-4;
const STABLE: Torques = &[(30, 1654.38), (90, 4967.04), (180, 9925.39), (270, 14668.8), (330, 17277.9)];
const BARRIER: Torques = &[
    (30, 1654.47),
    (90, 4971.5),
    (180, 10019.4),
    (270, 15299.3),
    (330, 18944.5),
    (360, 20619.7),
    (420, 22656.1),
];

pub(super) fn add(cases: &mut Vec<Case>) {
    let rows: [(&str, f64, u64, Torques, bool); 4] = [
        ("stable-neo-hookean", 0.3, 330, STABLE, true),
        ("neo-hookean", 0.3, 420, BARRIER, true),
        ("stable-neo-hookean", 0.45, 1440, &[(360, 21687.8)], false),
        ("neo-hookean", 0.45, 1440, &[(360, 22181.7)], false),
    ];
    for (material, poisson, degrees, torques, quick) in rows {
        let about = CaseDescription {
            row: "D3",
            name: &format!("twisted by {degrees} degrees, let go"),
            dimension: 3,
            material,
            poisson: Some(poisson),
            integrator: "quasi-static",
            quick,
        };
        cases.push(about.case(move || twist(material, poisson, degrees, torques)));
    }
}

fn twist(material: &str, poisson: f64, degrees: u64, torques: Torques) -> CaseResult {
    let steps = degrees / 10;
    let motion = ", name = 'head', motion = { rotation = { axis = [0, 0, 1], angle = '10 * pi/180 * t' } }";
    let until = format!("{motion}, until = {:?}", steps as f64 + 0.2);
    let keys = format!("pin = [{}, {}]", clamp(3, 2, 1.0, 0.0, ""), clamp(3, 2, -1.0, 4.0, &until));
    let solid = Solid {
        cells: &[2, 2, 8],
        size: &[1.0, 1.0, 4.0],
        origin: &[-0.5, -0.5, 0.0],
        material,
        poisson,
        keys: &keys,
        ..Solid::UNIT
    };
    let mut assembly = solid.assemble();
    let simulation = &mut assembly.simulation;
    let rest = simulation.state().x().to_vec();
    let mut findings = CaseResult::default();
    let (mut most, mut least_j, mut before) = (0, f64::INFINITY, 0);
    // Steps of ten degrees, with their iterations, volume ratios and torques.
    for step in 1..=steps {
        turn(simulation, &rest);
        if let Err(error) = simulation.step() {
            findings.note(CaseVerdict::Flagged, format!("at {} degrees: {error}", 10 * step));
            break;
        }
        most = most.max(scenes::iterations(simulation) - before);
        before = scenes::iterations(simulation);
        let diagnostics = simulation.diagnostics();
        least_j = least_j.min(diagnostics.min_j.unwrap_or(f64::NAN));
        if let Some((angle, torque)) = torques.iter().find(|(angle, _)| *angle == 10 * step) {
            let held = simulation.reactions().into_iter().find(|r| r.name.ends_with("head"));
            let moment = held.map_or(f64::NAN, |r| r.moment[2]);
            findings.measure(&format!("torque at {angle} degrees"), (moment / torque - 1.0).abs(), TOLERANCE);
        }
        if step + 1 == steps {
            findings.picture = Some(scenes::picture(simulation, &assembly.topology));
        }
    }
    findings.count(most, torques.last().filter(|(angle, _)| *angle >= degrees).map(|_| BAR));
    findings.min_j = Some(least_j);
    let barrier = material == "neo-hookean";
    findings.demand(!barrier || least_j > 0.0, || format!("J = {least_j:.3} in a material with a barrier"));
    // The released bar returns to its reference configuration.
    match simulation.step() {
        Ok(()) => {
            let away = scenes::largest_difference(simulation.state().x(), &rest);
            findings.measure("back at rest [m]", away, 1e-8);
        }
        Err(error) => findings.note(CaseVerdict::Fail, format!("let go: {error}")),
    }
    findings
}

/// Rotates free vertices by ten degrees times their relative height: an initial guess without inverted
/// elements.
fn turn(simulation: &mut Simulation, rest: &[f64]) {
    let free: Vec<bool> = simulation.system().inverse_mass().iter().map(|w| *w > 0.0).collect();
    let x = simulation.state_mut().x_mut();
    for i in (0..x.len()).step_by(3).filter(|i| free[*i]) {
        let (sin, cos) = (10.0 * PI / 180.0 * rest[i + 2] / 4.0).sin_cos();
        (x[i], x[i + 1]) = (cos * x[i] - sin * x[i + 1], sin * x[i] + cos * x[i + 1]);
    }
}
