//! D7: nearly flat elements (slivers) inside a patch.

use super::CaseDescription;
use crate::stress::scenes::{self, assemble};
use crate::stress::{Case, CaseResult, CaseVerdict};
use pliant_scene::assembly::Assembly;

/// Displacement gradient of the patch.
const GRADIENT: [[f64; 3]; 3] = [[0.01, 0.02, 0.005], [-0.015, 0.03, -0.01], [0.02, -0.005, 0.015]];
/// Rounding error of `F` in an element of height epsilon, times epsilon, due to rounded positions; from
/// an independent code.
const ROUNDING: f64 = 2e-17;

pub(super) fn add(cases: &mut Vec<Case>) {
    for dimension in [2, 3] {
        for height in [1e-3, 1e-6, 1e-9] {
            let about = |name: &str, material, integrator| {
                CaseDescription {
                    row: "D7",
                    name: &format!("{name}, height {height:e}"),
                    dimension,
                    material,
                    poisson: Some(0.3),
                    integrator,
                    quick: true,
                }
                .case(move || match integrator {
                    "quasi-static" => patch(dimension, height),
                    _ => falling(dimension, height),
                })
            };
            cases.push(about("patch of a sliver", "linear", "quasi-static"));
            cases.push(about("falling sliver", "stable-neo-hookean", "implicit-euler"));
        }
    }
}

/// A square or tetrahedron with an inner vertex close to one side, and the number of its corners.
fn scene(
    dimension: usize,
    height: f64,
    material: &str,
    time: &str,
    keys: &str,
) -> (String, Vec<Vec<f64>>, usize) {
    let (points, cells, corners) = if dimension == 2 {
        let points = vec![
            vec![0.0, 0.0],
            vec![1.0, 0.0],
            vec![1.0, 1.0],
            vec![0.0, 1.0],
            vec![0.5, height],
            vec![0.5, 0.5],
        ];
        (points, "triangles = [[0, 1, 4], [4, 1, 5], [1, 2, 5], [2, 3, 5], [3, 0, 5], [0, 4, 5]]", 4)
    } else {
        let points = vec![
            vec![0.0, 0.0, 0.0],
            vec![1.0, 0.0, 0.0],
            vec![0.0, 1.0, 0.0],
            vec![0.0, 0.0, 1.0],
            vec![0.25, 0.25, height],
        ];
        (points, "tetrahedra = [[0, 1, 2, 4], [0, 3, 1, 4], [0, 2, 3, 4], [1, 3, 2, 4]]", 4)
    };
    let text = format!(
        "dimension = {dimension}\n{time}\n[[body]]\nmesh = {{ inline = {{ points = {points:?}, {cells} }} \
         }}\n\
         elastic = {{ {material} = {{ young = 1e7, poisson = 0.3 }} }}\nmass = {{ density = 1000.0 \
         }}\n{keys}\n"
    );
    (text, points, corners)
}

fn moved(point: &[f64]) -> Vec<f64> {
    let d = point.len();
    (0..d).map(|i| point[i] + (0..d).map(|j| GRADIENT[i][j] * point[j]).sum::<f64>()).collect()
}

fn patch(dimension: usize, height: f64) -> CaseResult {
    let time =
        "time = { integrator = 'quasi-static', step = 1.0, duration = 1.0, solver = { tolerance = 1e-16 } }";
    let (_, points, corners) = scene(dimension, height, "linear", time, "");
    // Constrained vertices are displaced; free ones keep their initial positions.
    let start: Vec<Vec<f64>> =
        points.iter().enumerate().map(|(i, p)| if i < corners { moved(p) } else { p.clone() }).collect();
    let held: Vec<usize> = (0..corners).collect();
    let keys = format!("position = {{ per_vertex = {start:?} }}\npin = [{{ vertices = {held:?} }}]");
    let (text, ..) = scene(dimension, height, "linear", time, &keys);
    let Assembly { mut simulation, topology, .. } = assemble(&text);
    let mut findings = CaseResult::default();
    if let Err(error) = simulation.step() {
        findings.note(CaseVerdict::Fail, error.to_string());
        return findings;
    }
    findings.count(scenes::iterations(&simulation), None);
    let x = simulation.positions();
    let nodal = points.iter().zip(x.chunks_exact(dimension)).fold(0.0, |worst: f64, (p, x)| {
        moved(p).iter().zip(x).fold(worst, |worst, (p, x)| worst.max((p - x).abs()))
    });
    findings.measure("nodes [m]", nodal, 1e-14);
    let mut gradient: f64 = 0.0;
    for state in simulation.element_states() {
        for i in 0..dimension {
            for j in 0..dimension {
                let expected = GRADIENT[i][j] + f64::from(u8::from(i == j));
                gradient = gradient.max((state.deformation_gradient[i][j] - expected).abs());
            }
        }
    }
    findings.measure("deformation gradient", gradient, (10.0 * ROUNDING / height).max(1e-14));
    let residual = scenes::gradient(&mut simulation, None);
    findings.measure("force left over, relative", residual / (1e7 * 0.01), 1e-10 / height * 1e-3);
    findings.picture = Some(scenes::picture(&simulation, &topology));
    findings
}

/// A hundred steps of implicit Euler under gravity.
fn falling(dimension: usize, height: f64) -> CaseResult {
    let gravity = if dimension == 2 { "[0, -9.81]" } else { "[0, 0, -9.81]" };
    let time = format!(
        "time = {{ integrator = 'implicit-euler', step = 0.01, duration = 1.0 }}\nworld = {{ gravity = \
         {gravity} }}"
    );
    let (text, ..) = scene(dimension, height, "stable-neo-hookean", &time, "pin = [{ vertices = [2, 3] }]");
    let Assembly { mut simulation, topology, .. } = assemble(&text);
    let mut findings = CaseResult::default();
    let (mut most, mut before) = (0, 0);
    for _ in 0..100 {
        if let Err(error) = simulation.step() {
            findings.note(CaseVerdict::Fail, error.to_string());
            break;
        }
        most = most.max(scenes::iterations(&simulation) - before);
        before = scenes::iterations(&simulation);
    }
    findings.count(most, Some(50));
    let diagnostics = simulation.diagnostics();
    findings.note_inversion(&diagnostics);
    findings.demand(diagnostics.total.is_finite(), || "the energy is not finite".into());
    findings.picture = Some(scenes::picture(&simulation, &topology));
    findings
}
