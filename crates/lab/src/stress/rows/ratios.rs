//! D4 and D5: mass and stiffness ratios of a million.

use super::CaseDescription;
use crate::stress::scenes::{self, assemble, largest_difference};
use crate::stress::{Case, CaseResult, CaseVerdict};

/// Chain fixed at one end, solved by its normal modes; errors of an independent code at t = 1 s for steps
/// of 1e-3 s and 2.5e-4 s.
struct Chain {
    row: &'static str,
    name: &'static str,
    mass: &'static [f64],
    stiffness: &'static [f64],
    /// Expected values at t = 1 s for the compared vertices [m].
    expected: &'static [(usize, f64)],
    errors: &'static [(&'static str, [f64; 2])],
}

const CHAINS: [Chain; 2] = [
    Chain {
        row: "D4",
        name: "chain, masses 1 : 1e-4 : 100",
        mass: &[1.0, 1e-4, 1.0, 1e-4, 100.0],
        stiffness: &[1e4; 5],
        // No step here resolves the motion of the light masses.
        expected: &[(0, -0.014_421_233_742_679), (2, -0.006_865_344_758_776_7), (4, -0.024_592_307_852_944)],
        errors: &[
            ("tr-bdf2", [1.67e-3, 1.04e-4]),
            ("bdf2", [1.48e-2, 8.57e-4]),
            ("implicit-midpoint", [3.48e-3, 2.14e-4]),
            ("radau-iia2", [4.67e-5, 1.89e-6]),
        ],
    },
    Chain {
        row: "D5",
        name: "chain, springs 1e2 : 1e8 : 1e2",
        mass: &[1.0; 3],
        stiffness: &[1e2, 1e8, 1e2],
        expected: &[(0, -0.008_274_872_412_942_9), (1, -0.008_274_847_213_033_1), (2, 0.076_091_357_737_221)],
        errors: &[
            ("tr-bdf2", [1.9e-6, 1.2e-7]),
            ("bdf2", [1.5e-5, 9.8e-7]),
            ("implicit-midpoint", [3.9e-6, 2.5e-7]),
            ("radau-iia2", [1.9e-8, f64::NAN]),
            ("implicit-euler", [4.0e-3, 1.0e-3]),
        ],
    },
];

pub(super) fn add(cases: &mut Vec<Case>) {
    for chain in &CHAINS {
        for (integrator, errors) in chain.errors {
            let about = CaseDescription {
                row: chain.row,
                name: chain.name,
                dimension: 2,
                material: "springs",
                poisson: None,
                integrator,
                quick: true,
            };
            cases.push(about.case(move || run_chain(chain, integrator, errors)));
        }
    }
    for ratio in [1e4, 1e6] {
        for solver in ["cholesky", "cg", "multigrid", "matrix-free"] {
            let about = CaseDescription {
                row: "D4",
                name: &format!("bar, densities 1 : {ratio:e}, {solver}"),
                dimension: 2,
                material: "stable-neo-hookean",
                poisson: Some(0.3),
                integrator: "tr-bdf2",
                quick: true,
            };
            cases.push(about.case(move || bar(ratio, solver)));
        }
    }
    for (name, material, poisson, run) in [
        ("rod, halves 1e3 : 1e9, its static tip", "springs", None, rod as fn() -> CaseResult),
        ("bar, halves 1e3 : 1e9, its static tip", "linear", Some(0.0), joined),
    ] {
        let about = CaseDescription {
            row: "D5",
            name,
            dimension: 2,
            material,
            poisson,
            integrator: "quasi-static",
            quick: true,
        };
        cases.push(about.case(run));
    }
}

/// Vertices at 0, 4, 8, ..; the first is fixed.
fn line(count: usize) -> String {
    let points: Vec<[f64; 2]> = (0..count).map(|i| [4.0 * i as f64, 0.0]).collect();
    let edges: Vec<[usize; 2]> = (1..count).map(|i| [i - 1, i]).collect();
    format!("{{ inline = {{ points = {points:?}, edges = {edges:?} }} }}")
}

fn run_chain(chain: &Chain, integrator: &str, errors: &[f64; 2]) -> CaseResult {
    let mut findings = CaseResult::default();
    for (step, known) in [1e-3f64, 2.5e-4].into_iter().zip(errors).filter(|(_, known)| known.is_finite()) {
        let n = chain.mass.len() + 1;
        let mut displaced = vec![[0.0; 2]; n];
        displaced[n - 1][0] = 0.1;
        let mass: Vec<f64> = std::iter::once(1.0).chain(chain.mass.iter().copied()).collect();
        let name = scenes::scheme(integrator);
        let mut simulation = assemble(&format!(
            "dimension = 2\ntime = {{ integrator = {name}, step = {step:?}, duration = 1.0, solver = {{ \
             tolerance = 1e-14 }} }}\n\
             [[body]]\nmesh = {}\nsprings = {{ stiffness = {:?} }}\nmass = {{ per_vertex = {mass:?} }}\n\
             position = {{ displacement = {displaced:?} }}\npin = [{{ vertices = [0] }}]\n",
            line(n),
            chain.stiffness,
        ))
        .simulation;
        for _ in 0..(1.0 / step).round() as usize {
            if let Err(error) = simulation.step() {
                findings.note(CaseVerdict::Fail, error.to_string());
                return findings;
            }
        }
        let x = simulation.positions();
        let error = chain.expected.iter().fold(0.0, |m: f64, (i, expected)| {
            m.max((x[2 * (i + 1)] - 4.0 * (i + 1) as f64 - expected).abs())
        });
        findings.measure(&format!("displacement at t = 1 s, step {step} s [m]"), error, 2.0 * known);
    }
    findings
}

/// Vertex masses of a bar of 8 x 2 cells, 4 m x 1 m, whose outer half has the density 1000 kg/m^3 divided
/// by `ratio`: a third of each triangle goes to each of its corners.
fn halves(ratio: f64) -> Vec<f64> {
    let (rows, cells) = (3, [8, 2]);
    let mut mass = vec![0.0; rows * (cells[0] + 1)];
    for i in 0..cells[0] {
        let third = 0.125 / 3.0 * if 2 * i < cells[0] { 1000.0 } else { 1000.0 / ratio };
        for j in 0..cells[1] {
            let at = |i: usize, j: usize| i * rows + j;
            // Two triangles on the diagonal from the lower left to the upper right.
            for (vertex, count) in
                [(at(i, j), 2.0), (at(i + 1, j + 1), 2.0), (at(i + 1, j), 1.0), (at(i, j + 1), 1.0)]
            {
                mass[vertex] += count * third;
            }
        }
    }
    mass
}

/// A bar with a lighter outer half: the direct solver is not affected, iterative ones report their
/// effort.
fn bar(ratio: f64, solver: &'static str) -> CaseResult {
    let run = |solver: &str, ratio: f64| {
        let mass = halves(ratio);
        let mut assembly = assemble(&format!(
            "dimension = 2\ntime = {{ integrator = 'tr-bdf2', step = 0.01, duration = 1.0, solver = {{ \
             linear = '{solver}' }} }}\n\
             world = {{ gravity = [0, -9.81] }}\n[[body]]\nmesh = {{ grid = {{ cells = [8, 2], size = [4, \
             1] }} }}\n\
             elastic = {{ stable-neo-hookean = {{ young = 1e6, poisson = 0.3 }} }}\nmass = {{ per_vertex = \
             {mass:?} }}\n\
             pin = [{}]\n",
            scenes::clamp(2, 0, 1.0, 0.0, ""),
        ));
        let end = (0..50).try_for_each(|_| assembly.simulation.step());
        (assembly, end)
    };
    let mut findings = CaseResult::default();
    let (mut assembly, end) = run(solver, ratio);
    if let Err(error) = end {
        findings.note(CaseVerdict::Fail, error.to_string());
    }
    let work = assembly.simulation.work().solver.unwrap_or_default();
    findings.count(work.newton_iterations, None);
    // Iterative solvers are compared with the direct one, the direct one with a uniform density.
    if solver != "cholesky" {
        let (per, fallbacks) = (work.cg_iterations / work.newton_iterations.max(1), work.fallbacks);
        findings.note(
            CaseVerdict::Pass,
            format!("{per} iterations of conjugate gradients for each of Newton, {fallbacks} fallbacks"),
        );
        let (direct, _) = run("cholesky", ratio);
        let apart = largest_difference(assembly.simulation.state().x(), direct.simulation.state().x());
        findings.measure("apart from the direct solver [m]", apart, 1e-6);
    } else {
        let (uniform, _) = run("cholesky", 1.0);
        let usual = uniform.simulation.work().solver.unwrap_or_default().newton_iterations;
        findings.note(CaseVerdict::Pass, format!("{usual} Newton iterations where all is of one density"));
        findings.demand(2 * work.newton_iterations <= 3 * usual, || {
            format!("{} Newton iterations, {usual} without the ratio", work.newton_iterations)
        });
    }
    findings.note_inversion(&assembly.simulation.diagnostics());
    findings.picture = Some(scenes::picture(&assembly.simulation, &assembly.topology));
    findings
}

/// Ten springs in a row, five soft and five stiff, pulled at the end: `u = F sum 1/k`.
fn rod() -> CaseResult {
    let stiffness: Vec<f64> = (0..10).map(|i| if i < 5 { 1e3 } else { 1e9 }).collect();
    let mut simulation = assemble(&format!(
        "dimension = 2\ntime = {{ integrator = 'quasi-static', step = 1.0, duration = 1.0, solver = {{ \
         tolerance = 1e-14 }} }}\n[[body]]\n\
         mesh = {}\nsprings = {{ stiffness = {stiffness:?} }}\nmass = {{ per_vertex = 1.0 }}\npin = [{{ \
         vertices = [0] }}]\n\
         load = [{{ vertices = [10], force = [100.0, 0.0] }}]\n",
        line(11),
    ))
    .simulation;
    let mut findings = CaseResult::default();
    if let Err(error) = simulation.step() {
        findings.note(CaseVerdict::Fail, error.to_string());
        return findings;
    }
    findings.count(scenes::iterations(&simulation), None);
    let x = simulation.positions();
    let expected: f64 = stiffness.iter().map(|k| 100.0 / k).sum();
    findings.measure("tip, relative", ((x[20] - 40.0) / expected - 1.0).abs(), 1e-8);
    let strain = (x[20] - x[10] - 20.0) / 20.0;
    findings.demand(strain.abs() < 1e-5, || format!("strain {strain:e} in the stiff half"));
    findings
}

/// Young's moduli of the halves of a bar of 4 m x 1 m [Pa], and stiffness of the ties of its two vertex
/// pairs [N/m].
const YOUNG: [f64; 2] = [1e3, 1e9];
const JOINT: f64 = 1e9;

/// Two halves of triangles, tied at their faces by stiff springs and pulled at the end: for a Poisson's
/// ratio of 0 the stress is uniform, and `u = F (L_1/E_1 + L_2/E_2 + 1/(2 k))` over a unit area.
fn joined() -> CaseResult {
    let half = |name: &str, origin: f64, young: f64, keys: &str| {
        format!(
            "[[body]]\nname = '{name}'\nmesh = {{ grid = {{ cells = [4, 1], size = [2, 1], origin = \
             [{origin:?}, 0] }} }}\n\
             elastic = {{ linear = {{ young = {young:?}, poisson = 0.0 }} }}\nmass = {{ density = 1000.0 \
             }}\n{keys}\n"
        )
    };
    let force = 10.0;
    let mut assembly = assemble(&format!(
        "dimension = 2\ntime = {{ integrator = 'quasi-static', step = 1.0, duration = 1.0, solver = {{ \
         tolerance = 1e-14 }} }}\n{}{}\
         [[attachment]]\nbody = 'soft'\nhalf_space = {{ normal = [-1, 0], offset = -2 }}\n\
         target = {{ body = 'stiff', nearest_vertex = 1e-6 }}\nstiffness = {JOINT:?}\n",
        half("soft", 0.0, YOUNG[0], "pin = [{ half_space = { normal = [1, 0], offset = 0 } }]"),
        half(
            "stiff",
            2.0,
            YOUNG[1],
            &format!(
                "load = [{{ half_space = {{ normal = [-1, 0], offset = -4 }}, traction = [{force:?}, 0] }}]"
            )
        ),
    ));
    let mut findings = CaseResult::default();
    let rest = assembly.simulation.positions().into_owned();
    if let Err(error) = assembly.simulation.step() {
        findings.note(CaseVerdict::Fail, error.to_string());
        return findings;
    }
    findings.count(scenes::iterations(&assembly.simulation), None);
    findings.note_inversion(&assembly.simulation.diagnostics());
    let x = assembly.simulation.positions();
    let moved: Vec<f64> = x.iter().zip(&rest).map(|(x, rest)| x - rest).collect();
    let n = moved.len();
    let expected = force * (2.0 / YOUNG[0] + 2.0 / YOUNG[1] + 0.5 / JOINT);
    let tip = [moved[n - 4], moved[n - 2]]
        .into_iter()
        .fold(0.0, |worst: f64, u| worst.max((u / expected - 1.0).abs()));
    findings.measure("tip, relative", tip, 1e-8);
    // The second half begins with the vertices at its face.
    let strain = (moved[n - 2] - moved[n / 2]) / 2.0;
    findings.demand(strain.abs() < 1e-5, || format!("strain {strain:e} in the stiff half"));
    findings.picture = Some(scenes::picture(&assembly.simulation, &assembly.topology));
    findings
}
