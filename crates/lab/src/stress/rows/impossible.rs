//! D8 and D10: invalid meshes and parameters. Each has its own error, which names the position.

use super::CaseDescription;
use crate::stress::scenes::try_assemble;
use crate::stress::{Case, CaseResult, CaseVerdict};
use pliant_scene::Scene;

/// Row, name of the mistake, the keys of the scene (`[time]`, mesh, constants of the material, mass, more),
/// required text of the error.
type Wrong = (&'static str, &'static str, [&'static str; 5], &'static str);

const STEP: &str = "step = 1e-3";
const SOUND: &str = "young = 1e5, poisson = 0.3";
const MASS: &str = "density = 1000.0";
const SQUARE: &str = "grid = { cells = [2, 2], size = [1, 1] }";

const WRONG: [Wrong; 14] = [
    (
        "D8",
        "a vertex twice",
        [
            STEP,
            "inline = { points = [[0, 0], [1, 0], [0, 1], [1, 0]], triangles = [[0, 1, 2], [1, 3, 2]] }",
            SOUND,
            MASS,
            "",
        ],
        "triangle 1 is degenerate: its area is 0 m^2",
    ),
    (
        "D8",
        "three in a line",
        [
            STEP,
            "inline = { points = [[0, 0], [1, 0], [0, 1], [0.5, 0.5]], triangles = [[0, 1, 2], [1, 3, 2]] }",
            SOUND,
            MASS,
            "",
        ],
        "triangle 1 is degenerate: its area is 0 m^2",
    ),
    (
        "D8",
        "reversed",
        [STEP, "inline = { points = [[0, 0], [1, 0], [0, 1]], triangles = [[0, 2, 1]] }", SOUND, MASS, ""],
        "triangle 0 is inverted",
    ),
    (
        "D8",
        "flat tetrahedron",
        [
            STEP,
            "inline = { points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], tetrahedra = [[0, 1, 2, 3]] }",
            SOUND,
            MASS,
            "",
        ],
        "tetrahedron 0 is degenerate: its volume is 0 m^3",
    ),
    (
        "D10",
        "a vertex that is no number",
        [STEP, "inline = { points = [[0, 0], [1, nan], [0, 1]], triangles = [[0, 1, 2]] }", SOUND, MASS, ""],
        "NaN",
    ),
    ("D10", "Poisson's ratio 0.5", [STEP, SQUARE, "young = 1e5, poisson = 0.5", MASS, ""], "poisson"),
    ("D10", "Poisson's ratio -1.01", [STEP, SQUARE, "young = 1e5, poisson = -1.01", MASS, ""], "poisson"),
    ("D10", "Young's modulus -1", [STEP, SQUARE, "young = -1.0, poisson = 0.3", MASS, ""], "young"),
    ("D10", "density 0", [STEP, SQUARE, SOUND, "density = 0.0", ""], "density"),
    ("D10", "step 0", ["step = 0.0", SQUARE, SOUND, MASS, ""], "step"),
    ("D10", "step that is no number", ["step = nan", SQUARE, SOUND, MASS, ""], "step"),
    ("D10", "no vertices", [STEP, "inline = { points = [] }", SOUND, MASS, ""], "point"),
    (
        "D10",
        "a vertex of no element",
        [
            STEP,
            "inline = { points = [[0, 0], [1, 0], [0, 1], [2, 2]], triangles = [[0, 1, 2]] }",
            SOUND,
            MASS,
            "",
        ],
        "3",
    ),
    (
        "D10",
        "everything held",
        [STEP, SQUARE, SOUND, MASS, "pin = [{ half_space = { normal = [1, 0], offset = 10 } }]"],
        "",
    ),
];

pub(super) fn add(cases: &mut Vec<Case>) {
    for (row, name, parts, says) in WRONG {
        let dimension = if parts[1].contains("tetrahedra") { 3 } else { 2 };
        let about = CaseDescription {
            row,
            name,
            dimension,
            material: "stable-neo-hookean",
            poisson: None,
            integrator: "velocity-verlet",
            quick: true,
        };
        cases.push(about.case(move || refused(dimension, parts, says)));
    }
}

fn refused(dimension: usize, [time, mesh, material, mass, keys]: [&str; 5], says: &str) -> CaseResult {
    let text = format!(
        "dimension = {dimension}\ntime = {{ integrator = 'velocity-verlet', {time}, duration = 1.0 \
         }}\n[[body]]\n\
         mesh = {{ {mesh} }}\nelastic = {{ stable-neo-hookean = {{ {material} }} }}\nmass = {{ {mass} \
         }}\n{keys}\n"
    );
    let mut findings = CaseResult::default();
    match try_assemble(&text) {
        Err(error) => {
            let message = error.to_string();
            findings.demand(message.contains(says), || format!("`{says}` is not in: {message}"));
            findings.demand(error.line().is_some() || Scene::from_toml(&text).is_ok(), || {
                format!("no place: {message}")
            });
            let first = message.lines().next().unwrap_or_default().to_owned();
            findings.note(CaseVerdict::Pass, format!("refused: {first}"));
        }
        // A scene in which nothing can move is valid.
        Ok(mut assembly) if says.is_empty() => {
            let end = assembly.simulation.step();
            findings.demand(end.is_ok(), || format!("{end:?}"));
            findings.note(CaseVerdict::Pass, "runs, and nothing moves");
        }
        Ok(_) => findings.note(CaseVerdict::Fail, "was not refused"),
    }
    findings
}
