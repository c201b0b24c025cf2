//! Table of degenerate starts: a unit square of 6 x 6 cells, a unit cube of 3 x 3 x 3, from degenerate
//! [states](super::Start) to static equilibrium and through one step of 1/24 s of an implicit integrator.

use super::advice::nearest_step;
use super::scenes::{self, Solid};
use super::{Case, CaseFilter, CaseResult, CaseVerdict, REPORTED, Start, is_outside};
use pliant::integrator::IntegratorSpec;
use pliant::material::MaterialSpec;
use pliant::quantity::Seconds;
use pliant::simulation::StepError;
use pliant::solver::{LinearSolver, SolveFailure as Solved};

/// Iterations of an independent program (numpy: projected Newton with backtracking, sparse LU) from each
/// start.
struct Known {
    dimension: usize,
    poisson: f64,
    material: &'static str,
    /// Newton iterations to static equilibrium and in one step of implicit Euler; 0 for a failure
    /// within 400. In the order of [`Start::ALL`], then the scrambled free body.
    iterations: [[u64; 2]; 6],
}

/// Limit on iterations, as a multiple of the known ones.
const BAR: u64 = 3;
/// Iteration limit of every solve.
const CAP: u64 = 500;

#[rustfmt::skip]
const KNOWN: [Known; 18] = [
    Known { dimension: 2, poisson: 0.3, material: "fixed-corotated", iterations: [[14, 36], [5, 10], [6, 31], [44, 80], [19, 12], [14, 58]] },
    Known { dimension: 2, poisson: 0.3, material: "stable-neo-hookean", iterations: [[17, 30], [11, 12], [8, 62], [7, 31], [13, 22], [18, 40]] },
    Known { dimension: 2, poisson: 0.3, material: "stvk", iterations: [[87, 20], [9, 11], [57, 160], [0, 0], [11, 8], [46, 101]] },
    Known { dimension: 2, poisson: 0.45, material: "fixed-corotated", iterations: [[74, 56], [11, 11], [8, 24], [132, 38], [78, 37], [54, 83]] },
    Known { dimension: 2, poisson: 0.45, material: "stable-neo-hookean", iterations: [[73, 58], [12, 16], [9, 98], [9, 56], [20, 47], [62, 66]] },
    Known { dimension: 2, poisson: 0.495, material: "fixed-corotated", iterations: [[326, 284], [18, 17], [12, 24], [82, 63], [22, 73], [161, 234]] },
    Known { dimension: 2, poisson: 0.495, material: "stable-neo-hookean", iterations: [[217, 161], [13, 26], [20, 27], [14, 82], [55, 37], [115, 182]] },
    Known { dimension: 2, poisson: 0.4999, material: "fixed-corotated", iterations: [[211, 179], [38, 42], [98, 82], [34, 109], [81, 127], [141, 0]] },
    Known { dimension: 2, poisson: 0.4999, material: "stable-neo-hookean", iterations: [[258, 147], [39, 43], [153, 97], [34, 97], [70, 99], [147, 0]] },
    Known { dimension: 3, poisson: 0.3, material: "fixed-corotated", iterations: [[16, 146], [5, 11], [5, 31], [26, 201], [9, 62], [14, 198]] },
    Known { dimension: 3, poisson: 0.3, material: "stable-neo-hookean", iterations: [[13, 64], [7, 10], [8, 18], [10, 124], [22, 36], [13, 85]] },
    Known { dimension: 3, poisson: 0.3, material: "stvk", iterations: [[70, 50], [7, 9], [80, 380], [0, 0], [11, 8], [54, 78]] },
    Known { dimension: 3, poisson: 0.45, material: "fixed-corotated", iterations: [[100, 287], [7, 11], [6, 25], [56, 252], [13, 73], [86, 85]] },
    Known { dimension: 3, poisson: 0.45, material: "stable-neo-hookean", iterations: [[169, 0], [7, 11], [10, 35], [9, 27], [12, 76], [95, 84]] },
    Known { dimension: 3, poisson: 0.495, material: "fixed-corotated", iterations: [[182, 0], [16, 17], [9, 20], [17, 64], [163, 121], [0, 0]] },
    Known { dimension: 3, poisson: 0.495, material: "stable-neo-hookean", iterations: [[147, 398], [15, 14], [13, 22], [14, 64], [65, 104], [283, 313]] },
    Known { dimension: 3, poisson: 0.4999, material: "fixed-corotated", iterations: [[0, 0], [31, 30], [15, 25], [39, 249], [0, 0], [0, 0]] },
    Known { dimension: 3, poisson: 0.4999, material: "stable-neo-hookean", iterations: [[0, 0], [34, 31], [24, 28], [36, 114], [0, 0], [0, 0]] },
];

/// Young's modulus [Pa].
const YOUNG: f64 = 1e5;
/// Newton tolerance, as a fraction of the side.
const TOLERANCE: f64 = 1e-9;
/// Step of implicit integrators [s].
const STEP: f64 = 1.0 / 24.0;

/// One entry of the table.
#[derive(Clone, Debug)]
struct TortureCell {
    dimension: usize,
    poisson: f64,
    material: &'static str,
    start: Start,
    /// True if no vertex is constrained.
    free: bool,
    integrator: IntegratorSpec,
    solver: LinearSolver,
    /// Iterations of the independent program; `None` if it was not run.
    known: Option<u64>,
}

/// Adds the entries: those with reference iterations, by static equilibrium and implicit Euler with
/// Cholesky; some of them with other linear solvers; and other materials and integrators that are
/// requested by name.
pub(super) fn add(choice: &CaseFilter, cases: &mut Vec<Case>) {
    use IntegratorSpec::{ImplicitEuler, QuasiStatic};
    for known in &KNOWN {
        for (i, iterations) in known.iterations.iter().enumerate() {
            let cell = TortureCell {
                dimension: known.dimension,
                poisson: known.poisson,
                material: known.material,
                start: Start::ALL[i % 5],
                free: i == 5,
                integrator: QuasiStatic,
                solver: LinearSolver::Cholesky,
                known: Some(iterations[0]),
            };
            cases.push(cell.clone().case());
            cases.push(
                TortureCell { integrator: ImplicitEuler, known: Some(iterations[1]), ..cell.clone() }.case(),
            );
            let others = [LinearSolver::Cg, LinearSolver::Multigrid, LinearSolver::MatrixFree];
            let usual = known.poisson == 0.3 && known.material == "stable-neo-hookean";
            let usual = usual && matches!(cell.start, Start::Scramble | Start::Stretch) && !cell.free;
            for solver in others {
                if usual || choice.solvers.contains(&solver) {
                    for integrator in [QuasiStatic, ImplicitEuler] {
                        cases.push(TortureCell { solver, integrator, known: None, ..cell.clone() }.case());
                    }
                }
            }
            let named = |name: &str| choice.integrators.iter().any(|n| n.eq_ignore_ascii_case(name));
            for integrator in IntegratorSpec::ALL {
                let about = integrator.method().documentation;
                let more = about.solves > 0 && ![QuasiStatic, ImplicitEuler].contains(integrator);
                if more && named(about.name) {
                    cases.push(TortureCell { integrator: *integrator, known: None, ..cell.clone() }.case());
                }
            }
        }
    }
    for material in MaterialSpec::examples() {
        let named = choice.materials.iter().any(|n| n.eq_ignore_ascii_case(material.name()));
        if !named || KNOWN.iter().any(|k| k.material == material.name()) || material.lame().is_none() {
            continue;
        }
        for dimension in [2, 3] {
            for start in Start::ALL {
                for integrator in [QuasiStatic, ImplicitEuler] {
                    let cell = TortureCell {
                        dimension,
                        poisson: if material.name() == "arap" { 0.0 } else { 0.3 },
                        material: material.name(),
                        start,
                        free: false,
                        integrator,
                        solver: LinearSolver::Cholesky,
                        known: None,
                    };
                    cases.push(cell.case());
                }
            }
        }
    }
}

impl TortureCell {
    fn case(self) -> Case {
        let free = if self.free { ", free" } else { "" };
        let known = self.known.unwrap_or(0);
        Case {
            row: "torture",
            name: format!("{}{free}", self.start.name()),
            dimension: self.dimension,
            material: self.material.into(),
            poisson: Some(self.poisson),
            integrator: self.integrator.method().documentation.name.into(),
            solver: self.solver,
            quick: self.dimension == 2 || (1..20).contains(&known),
            is_long: false,
            run: Box::new(move |_| self.run()),
        }
    }

    /// True if the body must return to its reference configuration: it did with the independent program.
    fn must_rest(&self) -> bool {
        let nu = self.poisson;
        let tabled = self.known.is_some() && self.integrator == IntegratorSpec::QuasiStatic;
        let (snh, fcr) = (self.material == "stable-neo-hookean", self.material == "fixed-corotated");
        tabled
            && (snh || fcr)
            && match self.start {
                // In 3D the stable neo-Hookean solid without the logarithm has a minimum at F = 0.
                Start::Scramble => nu == 0.3 && !(self.free && snh && self.dimension == 3),
                Start::Plane => true,
                Start::Point => nu <= 0.495,
                Start::Inverted => snh || !(self.dimension == 2 && (nu == 0.45 || nu == 0.495)),
                Start::Stretch => nu == 0.3,
            }
    }

    fn run(&self) -> CaseResult {
        let mut findings = self.attempt(STEP);
        if findings.reason() == Some(REPORTED) {
            findings.advice = self.advice();
        }
        findings
    }

    /// Changes that work from the same start: the nearest step, a material, a solver, and dynamics if
    /// statics fails.
    fn advice(&self) -> Option<String> {
        let works = |cell: &TortureCell, step| cell.attempt(step).iterations.is_some_and(|n| n < CAP);
        let is_static = self.integrator == IntegratorSpec::QuasiStatic;
        let step = if is_static { None } else { nearest_step(STEP, |step| works(self, step)) };
        let mut advice: Vec<String> =
            step.map(|step| format!("a step of {}", Seconds(step))).into_iter().collect();
        let material = "stable-neo-hookean";
        if self.material != material && works(&TortureCell { material, ..self.clone() }, STEP) {
            advice.push(format!("the material {material}"));
        }
        let solver = LinearSolver::Cholesky;
        if self.solver != solver && works(&TortureCell { solver, ..self.clone() }, STEP) {
            advice.push(format!("the linear solver {}", solver.name()));
        }
        let dynamics = TortureCell { integrator: IntegratorSpec::ImplicitEuler, ..self.clone() };
        if is_static && works(&dynamics, STEP) {
            advice.push("implicit-euler, step by step: inertia holds what statics cannot".into());
        }
        (!advice.is_empty()).then(|| advice.join(", or "))
    }

    fn attempt(&self, step: f64) -> CaseResult {
        let d = self.dimension;
        // The scene, with vertices moved to the start.
        let integrator = scenes::scheme(self.integrator.method().documentation.name);
        let time = format!(", solver = {{ linear = '{}', tolerance = {TOLERANCE:?} }}", self.solver.name());
        let pin =
            if self.free { String::new() } else { format!("pin = [{}]", scenes::clamp(d, 0, 1.0, 0.0, "")) };
        let is_static = self.integrator == IntegratorSpec::QuasiStatic;
        let solid = Solid {
            cells: if d == 2 { &[6, 6] } else { &[3, 3, 3] },
            size: &[1.0; 3][..d],
            material: self.material,
            young: YOUNG,
            poisson: self.poisson,
            integrator: &integrator,
            step: if is_static { 1.0 } else { step },
            time: &time,
            keys: &pin,
            ..Solid::UNIT
        };
        let mut assembly = solid.assemble();
        let simulation = &mut assembly.simulation;
        let rest = scenes::put(simulation, self.start);
        let mut findings = CaseResult::default();
        let start = simulation.diagnostics().total;
        // One step, and its failure.
        let end = simulation.step();
        findings.picture = Some(scenes::picture(simulation, &assembly.topology));
        if let Err(error) = end {
            self.failed(&mut findings, &error);
            return findings;
        }
        // Iterations and energy.
        let bar = self.known.map(|known| if known == 0 { CAP } else { (BAR * known).min(CAP) });
        findings.count(scenes::iterations(simulation), bar);
        let diagnostics = simulation.diagnostics();
        let finite = diagnostics.total.is_finite() && simulation.state().x().iter().all(|x| x.is_finite());
        findings.demand(finite, || "the state is not finite".into());
        // A mirrored St. Venant-Kirchhoff solid has an energy of rounding errors only.
        let ratio = diagnostics.total / start;
        if start > 1e-12 * YOUNG && ratio.is_finite() {
            findings.energy_ratio = Some(ratio);
            if is_static || self.integrator == IntegratorSpec::ImplicitEuler {
                findings.demand(ratio <= 1.01, || format!("energy grew {ratio:.3} times"));
            } else if ratio > 1.01 {
                findings.note(
                    CaseVerdict::Flagged,
                    format!("energy grew {ratio:.3} times, which this integrator may do"),
                );
            }
        }
        // The gradient at the solution.
        let zero = vec![0.0; rest.len()];
        let gradient = match self.integrator {
            IntegratorSpec::QuasiStatic => Some(scenes::gradient(simulation, None)),
            IntegratorSpec::ImplicitEuler => Some(scenes::gradient(simulation, Some((&zero, step)))),
            _ => None,
        };
        if let Some(gradient) = gradient {
            findings.measure("gradient over E L^(d-1)", gradient / YOUNG, 1e-8);
        }
        if !is_static {
            findings.note_inversion(&diagnostics);
            return findings;
        }
        // Kind of the equilibrium, and the return to the reference configuration.
        scenes::name_end(&mut findings, simulation, diagnostics.elastic / YOUNG);
        if self.must_rest() {
            let away = if self.free {
                scenes::strain(simulation)
            } else {
                scenes::largest_difference(simulation.state().x(), &rest)
            };
            findings.demand(away < 1e-6, || format!("did not come back to rest: {away:.2e} away"));
        }
        findings
    }

    /// Reports a failed step. It is flagged instead of failed if no program succeeded, or if the material
    /// has no such state.
    fn failed(&self, findings: &mut CaseResult, error: &StepError) {
        let nobody = self.known.is_none_or(|known| known == 0);
        let capped = matches!(error, StepError::Unsolved { verdict: Solved::IterationCap, .. });
        if let StepError::Unsolved { iterations, .. } = error {
            findings.iterations = Some(u64::from(*iterations));
        }
        findings.note_error(error, is_outside(error) || nobody && capped);
    }
}
