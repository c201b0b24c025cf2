//! A user's scene under the perturbations of the suite.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::advice::nearest_step;
use super::limits::Limits;
use super::{ABOVE_LIMIT, Case, CaseFilter, CaseResult, CaseVerdict, REPORTED, Start, is_outside, scenes};
use pliant::deadline::until;
use pliant::integrator::IntegratorSpec;
use pliant::material::{Isotropic, MaterialSpec};
use pliant::quantity::{Rounded, Seconds};
use pliant::run::{energy_growth, energy_scale};
use pliant::simulation::StepError;
use pliant::solver::LinearSolver;
use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{KeyPath, Problem, RefusedScheme, Scene, SceneError, Solver, Source};

/// Number of steps in a run.
const IMPLICIT_STEPS: u64 = 20;
const EXPLICIT_STEPS: u64 = 200;
/// Largest growth of the energy, relative to its scale at the start.
const GROWTH: f64 = 10.0;
/// Largest step of an explicit integrator, as a fraction of its stability limit.
const PART_OF_LIMIT: f64 = 0.9;
/// Largest step from a [`Start`], whose large motion leads to stiffer states.
const PART_AFTER_START: f64 = 0.5;

/// Perturbation of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Perturbation {
    /// No perturbation.
    AsItIs,
    /// Another start.
    Start(Start),
    /// A hundred times the step size.
    Step,
    /// A million times the stiffness of the first body.
    Stiffness,
    /// A millionth of the mass for the second half of every body's vertices.
    Mass,
}

impl Perturbation {
    fn all() -> Vec<Perturbation> {
        let starts = Start::ALL.map(Perturbation::Start);
        let ratios = [Perturbation::Step, Perturbation::Stiffness, Perturbation::Mass];
        std::iter::once(Perturbation::AsItIs).chain(starts).chain(ratios).collect()
    }

    fn name(self) -> &'static str {
        match self {
            Perturbation::AsItIs => "as it is",
            Perturbation::Start(start) => start.name(),
            Perturbation::Step => "100 times the step",
            Perturbation::Stiffness => "stiffness ratio 1e6",
            Perturbation::Mass => "mass ratio 1e6",
        }
    }
}

/// Cases of a scene: all perturbations, with its own integrator and robust ones, or the chosen
/// integrators; then implicit Euler with every other linear solver. Implicit integrators use the scene's
/// step, explicit ones a step below their own stability limit if that is smaller; the results state it.
/// The scene as it is keeps its step, even above the limit.
///
/// # Errors
/// The mistakes in the scene, or an unknown integrator.
pub fn scene_cases(source: &Source, choice: &CaseFilter) -> Result<Vec<Case>, SceneError> {
    let scene = source.scene()?;
    let named =
        |name: &str| IntegratorSpec::ALL.iter().copied().find(|s| s.method().documentation.name == name);
    let mut integrators = vec![scene.time.integrator];
    let robust = ["velocity-verlet", "implicit-euler", "bdf2", "tr-bdf2"].map(str::to_owned);
    for name in if choice.integrators.is_empty() { &robust[..] } else { &choice.integrators[..] } {
        let Some(spec) = named(name) else {
            let path = KeyPath::root().key("time").key("integrator");
            return Err(
                source.error(vec![Problem::semantic(path, format!("there is no integrator `{name}`"))])
            );
        };
        if !integrators.iter().any(|i| i.method().documentation.name == name) {
            integrators.push(spec);
        }
    }
    if !choice.integrators.is_empty() {
        integrators.retain(|i| choice.integrators.iter().any(|n| n == i.method().documentation.name));
    }
    if let Some(refused) = integrators.iter().find_map(|spec| RefusedScheme::by_contact(&scene, *spec)) {
        let path = KeyPath::root().key("time").key("integrator");
        return Err(source.error(vec![Problem::semantic(path, refused.reason)]));
    }
    // A scene that cannot be assembled is reported at once.
    scene.assemble(UnstableStep::Accept).map_err(|problems| source.error(problems))?;
    // Other linear solvers come last, so that a budget reaches every integrator.
    let (mut cases, mut others) = (vec![], vec![]);
    for perturbation in Perturbation::all() {
        let Some(scene) = altered(source, perturbation)? else { continue };
        for integrator in &integrators {
            let about = integrator.method().documentation;
            let solvers: &[LinearSolver] = if !choice.solvers.is_empty() {
                if about.solves > 0 { &choice.solvers } else { &[] }
            } else if about.name == "implicit-euler" && !choice.quick {
                &[LinearSolver::Auto, LinearSolver::Cg, LinearSolver::Multigrid, LinearSolver::MatrixFree]
            } else {
                &[LinearSolver::Auto]
            };
            for (i, solver) in solvers.iter().enumerate() {
                let longer = if perturbation == Perturbation::Step { 100.0 } else { 1.0 };
                let trial = Trial {
                    step: longer * crate::stability::nominal_step(&scene),
                    scene: scene.clone(),
                    perturbation,
                    integrator: *integrator,
                    solver: *solver,
                    limit: None,
                };
                if i == 0 { cases.push(trial.case()) } else { others.push(trial.case()) }
            }
        }
    }
    cases.append(&mut others);
    Ok(cases)
}

/// Perturbed scene; `None` if the scene has no such value.
fn altered(source: &Source, perturbation: Perturbation) -> Result<Option<Scene>, SceneError> {
    let scene = source.scene()?;
    let changes = match perturbation {
        Perturbation::Stiffness => {
            let changes = crate::stability::stiffness_changes(&scene, 1e6);
            changes.into_iter().filter(|(path, _)| path.starts_with("body.0.")).collect()
        }
        Perturbation::Mass => {
            let topology = scene.assemble(UnstableStep::Accept).map_err(|p| source.error(p))?.topology;
            let masses = |body: usize| {
                let range = topology.bodies[body].vertices.clone();
                let (start, count) = (range.start as usize, range.len());
                let light = |i: usize| if 2 * i >= count && count > 1 { 1e-6 } else { 1.0 };
                (0..count).map(|i| topology.masses[start + i] * light(i)).collect::<Vec<f64>>()
            };
            let change = |i| (format!("body.{i}.mass"), format!("{{ per_vertex = {:?} }}", masses(i)));
            (0..scene.body.len()).map(change).collect()
        }
        _ => return Ok(Some(scene)),
    };
    if Vec::is_empty(&changes) {
        return Ok(None);
    }
    Ok(Some(source.varied(&changes)?.scene()?))
}

/// Constructor of a model with two constants.
type Model = fn(Isotropic) -> MaterialSpec;

/// One run.
#[derive(Clone, Debug)]
struct Trial {
    scene: Scene,
    perturbation: Perturbation,
    integrator: IntegratorSpec,
    solver: LinearSolver,
    /// Step size [s].
    step: f64,
    /// Stability limit, if the step is above it [s].
    limit: Option<f64>,
}

impl Trial {
    fn case(self) -> Case {
        let mut materials: Vec<&str> = vec![];
        for body in &self.scene.body {
            let elastic = body.elastic.as_ref().map(|e| e.name());
            for name in elastic.into_iter().chain(body.springs.iter().map(|_| "springs")) {
                if !materials.contains(&name) {
                    materials.push(name);
                }
            }
        }
        Case {
            row: "scene",
            name: self.perturbation.name().into(),
            dimension: self.scene.dimension,
            material: materials.join(", "),
            poisson: None,
            integrator: self.integrator.method().documentation.name.into(),
            solver: self.solver,
            quick: true,
            is_long: false,
            run: Box::new(move |limits| self.run(limits)),
        }
    }

    fn run(&self, limits: &Limits<'_>) -> CaseResult {
        let (trial, mut findings) = until(
            || limits.are_over(),
            |stop| {
                let trial = self.at_own_step(stop);
                let findings = trial.attempt(stop);
                (trial, findings)
            },
        );
        let wrong = findings.verdict == CaseVerdict::Fail || trial.limit.is_some();
        if (wrong || findings.reason() == Some(REPORTED)) && !findings.cut_short {
            findings.advice = until(|| limits.are_over(), |stop| trial.advice(self.step, stop));
            if let Some(advice) = findings.advice.as_mut().filter(|_| limits.are_over()) {
                *advice += "; the time budget was used up before all remedies were tried";
            }
        }
        findings
    }

    /// Assembles the scene with the trial's integrator, step, solver and start.
    fn assemble(&self, stop: &Arc<AtomicBool>) -> Result<Assembly, Vec<Problem>> {
        let mut scene = self.scene.clone();
        scene.time.integrator = self.integrator;
        scene.time.allow_unstable = true;
        let own = scene.time.solver.take().unwrap_or_default();
        if self.is_implicit() {
            let linear = if self.solver == LinearSolver::Auto { own.linear } else { self.solver };
            scene.time.solver = Some(Solver { linear, ..own });
        }
        (scene.time.step, scene.time.adaptive, scene.time.arc_length) = (Some(self.step), None, None);
        let mut assembly = scene.assemble(UnstableStep::Refuse)?;
        if let Perturbation::Start(start) = self.perturbation {
            scenes::put(&mut assembly.simulation, start);
        }
        assembly.simulation.system_mut().set_stop(Some(Arc::clone(stop)));
        Ok(assembly)
    }

    fn is_implicit(&self) -> bool {
        self.integrator.method().documentation.solves > 0
    }

    /// Trial with a step that its integrator can take: an explicit integrator uses a fraction of its
    /// stability limit, if that is smaller. The scene as it is keeps its step, which is then compared with
    /// the limit.
    fn at_own_step(&self, stop: &Arc<AtomicBool>) -> Trial {
        let mut trial = self.clone();
        if self.is_implicit() {
            return trial;
        }
        let limit = |trial: &Trial| {
            let mut assembly = trial.assemble(stop).ok()?;
            let limit = assembly.simulation.stability_limit(self.scene.time.duration).ok()?.step;
            Some(limit).filter(|limit| limit.is_finite() && *limit > 0.0)
        };
        // A body that starts out of shape goes through its usual, stiffer shape.
        let limits = match self.perturbation {
            Perturbation::Start(_) => {
                let usual = Trial { perturbation: Perturbation::AsItIs, ..self.clone() };
                [limit(self), limit(&usual)]
            }
            _ => [limit(self), None],
        };
        let Some(limit) = limits.into_iter().flatten().reduce(f64::min) else { return trial };
        let part = match self.perturbation {
            Perturbation::Start(_) => PART_AFTER_START,
            _ => PART_OF_LIMIT,
        };
        if self.integrator == self.scene.time.integrator && self.perturbation == Perturbation::AsItIs {
            trial.limit = Some(limit).filter(|limit| self.step > *limit);
        } else {
            trial.step = self.step.min(part * limit);
        }
        trial
    }

    fn attempt(&self, stop: &Arc<AtomicBool>) -> CaseResult {
        let mut findings = CaseResult { step_size: Some(self.step), ..CaseResult::default() };
        let mut assembly = match self.assemble(stop) {
            Ok(assembly) => assembly,
            Err(problems) => {
                findings.note(CaseVerdict::Fail, SceneError::new(problems).to_string());
                return findings;
            }
        };
        let simulation = &mut assembly.simulation;
        simulation.count_losses(false);
        let start = simulation.diagnostics();
        let scale = energy_scale(simulation, &start);
        let steps = if self.is_implicit() { IMPLICIT_STEPS } else { EXPLICIT_STEPS };
        let (mut most, mut before) = (0, 0);
        for step in 1..=steps {
            let taken = if stop.load(Ordering::Relaxed) { None } else { Some(simulation.step()) };
            // A stopped solve fails without meaning.
            if stop.load(Ordering::Relaxed) && !matches!(taken, Some(Ok(()))) {
                findings.cut_short = true;
                findings.note(
                    CaseVerdict::Flagged,
                    format!("cut short: sound for {} of {steps} steps within the time budget", step - 1),
                );
                break;
            }
            if let Some(Err(error)) = taken {
                match self.limit {
                    Some(limit) => self.note_above(&mut findings, limit, step),
                    None => {
                        let is_start = matches!(self.perturbation, Perturbation::Start(_));
                        findings.note_error(&cause(&error), is_start && is_outside(&error));
                    }
                }
                break;
            }
            most = most.max(scenes::iterations(simulation) - before);
            before = scenes::iterations(simulation);
            let now = simulation.diagnostics();
            let grown = energy_growth(simulation, &start, &now, scale);
            if grown.is_nan() || grown > GROWTH {
                match self.limit {
                    Some(limit) => self.note_above(&mut findings, limit, step),
                    None => findings.note(CaseVerdict::Fail, unstable(step, grown)),
                }
                break;
            }
        }
        if let Some(limit) = self.limit.filter(|_| findings.notes.is_empty()) {
            let told = format!("the largest stable step is {}; not noticed in {steps} steps", Seconds(limit));
            findings.note(CaseVerdict::Flagged, format!("{ABOVE_LIMIT}: {told}"));
        }
        if self.is_implicit() {
            findings.count(most, None);
        }
        let end = simulation.diagnostics();
        if findings.cut_short {
            findings.min_j = end.min_j;
        } else {
            findings.note_inversion(&end);
        }
        if start.total > 0.0 {
            findings.energy_ratio = Some(end.total / start.total);
        }
        findings.picture = Some(scenes::picture(simulation, &assembly.topology));
        findings
    }

    /// Notes that a step above the limit was detected: physics where the scene allows such steps.
    fn note_above(&self, findings: &mut CaseResult, limit: f64, step: u64) {
        let allowed = self.scene.time.allow_unstable;
        let verdict = if allowed { CaseVerdict::Flagged } else { CaseVerdict::Fail };
        let expected = if allowed { ", as expected" } else { "" };
        let told =
            format!("the largest stable step is {}; detected at step {step}{expected}", Seconds(limit));
        findings.note(verdict, format!("{ABOVE_LIMIT}: {told}"));
    }

    /// Changes that would have worked, one at a time: the nearest step, a material, a solver, implicit
    /// Euler with the scene's step `scene_step` [s].
    fn advice(&self, scene_step: f64, stop: &Arc<AtomicBool>) -> Option<String> {
        let works = |trial: &Trial| {
            let findings = Trial { limit: None, ..trial.clone() }.attempt(stop);
            let stood = findings.reason() != Some(REPORTED);
            !findings.cut_short && findings.verdict != CaseVerdict::Fail && stood
        };
        let mut advice = vec![];
        if let Some(step) = nearest_step(self.step, |step| works(&Trial { step, ..self.clone() })) {
            advice.push(format!("a step of {}", Seconds(step)));
        }
        let models: [(&str, Model); 2] = [
            ("stable-neo-hookean", MaterialSpec::StableNeoHookean),
            ("fixed-corotated", MaterialSpec::FixedCorotated),
        ];
        let survives = |model: &(&str, Model)| self.of_material(model.1).is_some_and(|t| works(&t));
        if let Some((name, _)) = models.into_iter().find(survives) {
            advice.push(format!("the material {name}"));
        }
        if self.is_implicit() {
            use LinearSolver::{Cg, Cholesky, MatrixFree, Multigrid};
            let mut others = [Cholesky, Multigrid, Cg, MatrixFree].into_iter().filter(|s| *s != self.solver);
            if let Some(solver) = others.find(|solver| works(&Trial { solver: *solver, ..self.clone() })) {
                advice.push(format!("the linear solver {}", solver.name()));
            }
        }
        if self.integrator != IntegratorSpec::ImplicitEuler {
            let robust = Trial {
                integrator: IntegratorSpec::ImplicitEuler,
                solver: LinearSolver::Auto,
                step: scene_step,
                ..self.clone()
            };
            if works(&robust) {
                advice.push("implicit-euler".into());
            }
        }
        (!advice.is_empty()).then(|| advice.join(", or "))
    }

    /// Trial with all bodies of this model, with their constants; `None` if they already are.
    fn of_material(&self, model: Model) -> Option<Trial> {
        let mut other = self.clone();
        let mut replaced = false;
        for elastic in other.scene.body.iter_mut().filter_map(|body| body.elastic.as_mut()) {
            let Some((young, poisson)) = constants(elastic) else { continue };
            let new = model(Isotropic { young, poisson, preset: None });
            replaced |= new.name() != elastic.name();
            *elastic = new;
        }
        replaced.then_some(other)
    }
}

/// Cause of a failed step without the advice of the error, which is tried and given separately.
fn cause(error: &StepError) -> String {
    let fault = error.fault().map_or_else(String::new, |fault| format!(", {fault}"));
    match error {
        StepError::Unsolved { step, verdict, .. } => format!("step {step} was not solved: {verdict}{fault}"),
        StepError::NotFinite { step, .. } => format!("step {step} has no finite force or position{fault}"),
        error => error.to_string(),
    }
}

/// Note on energy that grew beyond any physical cause.
fn unstable(step: u64, grown: f64) -> String {
    let told = match grown.is_finite() {
        true => format!("has grown {} times", Rounded::<3>(grown)),
        false => "is not finite".into(),
    };
    format!("unstable: the energy {told} at step {step}")
}

/// Young's modulus and Poisson's ratio at small strains.
fn constants(elastic: &MaterialSpec) -> Option<(f64, f64)> {
    let lame = elastic.lame()?;
    let (lambda, mu) = (lame.lambda, lame.mu);
    Some((mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu), 0.5 * lambda / (lambda + mu)))
}
