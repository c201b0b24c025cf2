//! Error budget of a run: how far its numbers are from those of the continuous problem, by mesh, by step and
//! by solver, from coarser and finer runs of the same scene.
//!
//! With the value `Q(h, k)` on the mesh `h` with the step `k`, the truth is `Q* = Q + m + s + v`. The part of
//! the mesh is that of the ladder `Q(4h, k), Q(2h, k), Q(h, k)`, the part of the step that of three steps on
//! the mesh `2h`, and the part of the solver the difference that ten times its tolerance makes; see
//! [`convergence`](crate::convergence). Intervals of the parts add up, because parts are biases and do not
//! average out. Eca, Vaz, Toxopeus, Hoekstra 2019, Journal of Verification, Validation and Uncertainty
//! Quantification, doi 10.1115/1.4043975, split errors by such runs.
//!
//! Formal orders in space are those of exact integration in statics, and 2 in dynamics, where masses are
//! lumped.

mod meshes;
mod quantity;
#[cfg(test)]
mod tests;

pub use quantity::{NoQuantity, QuantityOfInterest};

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use pliant::quantity::Rounded;
use pliant::run::{Outcome, Plan, run};
use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{Scene, SceneError, Source};

use crate::convergence::{LadderEstimate, LadderKind, NoEstimate, estimate, estimate_of_two};
use meshes::CellCounts;
use quantity::QuantityObserver;

/// Largest number of frames by which maxima and means are taken.
const FRAMES: u64 = 25;
/// Part of the half range of an oscillation above which a difference at the end is a shift of phase.
const PHASE: f64 = 0.1;

/// Errors of the quantities of a run.
#[derive(Clone, Debug, serde::Serialize)]
pub struct ErrorBudget {
    /// The quantities.
    pub quantities: Vec<QuantityBudget>,
    /// Number of runs beside the one of the scene.
    pub runs: usize,
    /// Time of these runs over the time of the scene's own.
    pub cost: f64,
}

/// Errors of one quantity.
#[derive(Clone, Debug, serde::Serialize)]
pub struct QuantityBudget {
    /// Name, as it was asked for.
    pub quantity: String,
    /// Unit of all numbers.
    pub unit: &'static str,
    /// Value of the run.
    pub value: f64,
    /// Parts of the error.
    pub parts: Vec<ErrorPart>,
    /// Half-width of the interval about the value that is to hold the truth; `None` if a part is not known.
    pub interval: Option<f64>,
    /// Value plus the estimates of the parts; `None` if a part is not known.
    pub extrapolated: Option<f64>,
}

/// One part of an error.
#[derive(Clone, Debug, serde::Serialize)]
pub struct ErrorPart {
    /// `mesh`, `step` or `solver`.
    pub part: &'static str,
    /// Estimate; `None` if there is none.
    pub estimate: Option<LadderEstimate>,
    /// Formal order.
    pub expected_order: Option<f64>,
    /// Origin of the estimate, or the reason for which there is none.
    pub about: String,
}

/// Error of an error budget.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BudgetError {
    /// The scene cannot be simulated.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A quantity is of no probe and no pin of the scene.
    #[error("the scene has no `{0}`: there is no probe, or not exactly one pin, of this name")]
    Missing(String),
    /// The scene names nothing.
    #[error("the scene has no [[probe]]: name one, or a quantity as --errors=left.force.x")]
    NoQuantity,
    /// The run of the scene does not reach its end.
    #[error("the run of the scene does not reach its end")]
    Unfinished,
}

/// Values of all quantities of a run, each with half of the range of its oscillation.
type QuantityValues = Vec<[f64; 2]>;
/// Values of a run, or why it has none.
type RunValues = Result<QuantityValues, String>;

/// Estimates the errors of `quantities` of a scene; of all its probes at the end without any. `begun` is
/// called with the number of each run.
///
/// # Errors
/// [`BudgetError`]; a part without an estimate is no error, but says why.
pub fn error_budget(
    source: &Source,
    quantities: &[QuantityOfInterest],
    interrupt: &AtomicBool,
    begun: &mut dyn FnMut(usize),
) -> Result<ErrorBudget, BudgetError> {
    let scene = source.scene()?;
    let assembly = scene.assemble(UnstableStep::Refuse).map_err(|problems| source.error(problems))?;
    let named = QuantityOfInterest::of_probes(&assembly.probes, scene.dimension);
    let quantities = if quantities.is_empty() { &named } else { quantities };
    if quantities.is_empty() {
        return Err(BudgetError::NoQuantity);
    }
    if let Some(missing) = quantities.iter().find(|quantity| !quantity.is_of(&assembly)) {
        return Err(BudgetError::Missing(missing.to_string()));
    }
    let mut ladder = ErrorRuns::new(source, &scene, &assembly, quantities, interrupt, begun);
    drop(assembly);
    let started = Instant::now();
    let own = ladder.values(&[], None, 1.0);
    let own_seconds = started.elapsed().as_secs_f64();
    let own = own.map_err(|_| BudgetError::Unfinished)?;
    let started = Instant::now();
    let parts = ladder.parts(&own);
    let cost = started.elapsed().as_secs_f64() / own_seconds;
    let budget = |(i, quantity): (usize, &QuantityOfInterest)| {
        let parts: Vec<ErrorPart> = parts.iter().map(|part| part[i].clone()).collect();
        let known = |of: fn(&LadderEstimate) -> f64| -> Option<f64> {
            parts.iter().map(|part| part.estimate.as_ref().map(of)).sum()
        };
        let extrapolated = known(|part| part.estimate.unwrap_or(0.0)).map(|sum| own[i][0] + sum);
        QuantityBudget {
            quantity: quantity.to_string(),
            unit: quantity.unit(),
            value: own[i][0],
            interval: known(|part| part.interval),
            extrapolated,
            parts,
        }
    };
    let quantities = quantities.iter().enumerate().map(budget).collect();
    Ok(ErrorBudget { quantities, runs: ladder.runs - 1, cost })
}

/// Runs of one scene on other meshes and with other steps.
struct ErrorRuns<'a> {
    source: &'a Source,
    scene: Scene,
    quantities: &'a [QuantityOfInterest],
    interrupt: &'a AtomicBool,
    begun: &'a mut dyn FnMut(usize),
    /// Number of steps of the run, or `None` if they follow the error.
    steps: Option<u64>,
    /// Step of the run [s].
    step: f64,
    plan: Plan,
    /// Order of the elements, the least of all bodies.
    element_order: u32,
    is_static: bool,
    is_implicit: bool,
    order_in_time: u32,
    runs: usize,
}

impl<'a> ErrorRuns<'a> {
    fn new(
        source: &'a Source,
        scene: &Scene,
        assembly: &Assembly,
        quantities: &'a [QuantityOfInterest],
        interrupt: &'a AtomicBool,
        begun: &'a mut dyn FnMut(usize),
    ) -> Self {
        let simulation = &assembly.simulation;
        let method = simulation.method();
        let mut scene = scene.clone();
        // Vertices have other numbers on other meshes; points of the bodies at rest do not.
        for (spec, probe) in scene.probe.iter_mut().zip(&assembly.probes) {
            if spec.vertex.take().is_some() {
                spec.at = Some(probe.rest[..scene.dimension].to_vec());
                spec.body = Some(probe.body.clone());
            }
        }
        let step = simulation.step_size();
        let plan = scene.plan();
        let steps = simulation.step_control().is_none().then(|| plan.steps(step));
        let duration = steps.map_or(plan.duration, |steps| steps as f64 * step);
        let coarse = steps.map_or(FRAMES, |steps| if steps % 4 == 0 { steps / 4 } else { steps });
        let frames = (1..=FRAMES).rev().find(|frames| coarse % frames == 0).unwrap_or(1);
        let orders = scene.body.iter().map(|body| body.order.unwrap_or(1));
        let element_order = orders.map(u32::from).min().unwrap_or(1);
        ErrorRuns {
            source,
            quantities,
            interrupt,
            begun,
            steps,
            step,
            plan: Plan { duration, rate: frames as f64 / duration },
            element_order,
            is_static: method.is_static(),
            is_implicit: method.documentation.solves > 0,
            order_in_time: method.documentation.order,
            runs: 0,
            scene,
        }
    }

    /// Values of a run with these changes of meshes, `step` in place of its own [s], and `tolerance` times
    /// the tolerance of its solver.
    fn values(&mut self, meshes: &[(String, String)], step: Option<f64>, tolerance: f64) -> RunValues {
        self.runs += 1;
        (self.begun)(self.runs);
        let changed = self.source.varied(meshes).map_err(|error| error.to_string())?;
        let mut scene = changed.scene().map_err(|error| error.to_string())?;
        scene.probe.clone_from(&self.scene.probe);
        if let Some(step) = step {
            scene.time.step = Some(step);
        }
        if let Some(given) = scene.time.solver.as_mut().and_then(|solver| solver.tolerance.as_mut()) {
            *given *= tolerance;
        }
        let mut assembly = scene.assemble(UnstableStep::Refuse).map_err(|problems| {
            let first = problems.into_iter().next();
            first.map_or_else(String::new, |problem| problem.message)
        })?;
        let mut observer = QuantityObserver::new(self.quantities, &assembly.probes);
        let summary = run(&mut assembly.simulation, &self.plan, &mut [&mut observer], self.interrupt);
        match summary.outcome {
            Outcome::Done => Ok((0..self.quantities.len()).map(|i| observer.value(i)).collect()),
            _ => Err("a run beside it does not reach the end".into()),
        }
    }

    /// Parts of the errors, each for all quantities.
    fn parts(&mut self, own: &QuantityValues) -> Vec<Vec<ErrorPart>> {
        let cells = CellCounts::of(&self.scene);
        let half = cells.as_ref().ok().and_then(|cells| cells.divided(2));
        let on_half = half.as_ref().map(|half| self.values(half, None, 1.0));
        let mesh = self.mesh_part(own, &cells, on_half.as_ref());
        // Steps and tolerances are varied on the coarser mesh, where that costs less.
        let (meshes, known, cells) = match (&half, &on_half) {
            (Some(half), Some(Ok(values))) => (&half[..], values, cells.as_ref().ok()),
            _ => (&[][..], own, None),
        };
        let step = self.step_part(meshes, known, cells);
        let solver = self.solver_part(meshes, known);
        vec![mesh, step, solver]
    }

    /// Parts without an estimate, for the same reason in all quantities.
    fn without(&self, part: &'static str, about: &str) -> Vec<ErrorPart> {
        let none = ErrorPart { part, estimate: None, expected_order: None, about: about.to_owned() };
        vec![none; self.quantities.len()]
    }

    fn mesh_part(
        &mut self,
        own: &QuantityValues,
        cells: &Result<CellCounts, String>,
        on_half: Option<&RunValues>,
    ) -> Vec<ErrorPart> {
        let cells = match cells {
            Ok(cells) => cells,
            Err(reason) => return self.without("mesh", reason),
        };
        let on_half = match on_half {
            Some(Ok(values)) => values,
            Some(Err(reason)) => return self.without("mesh", reason),
            None => {
                let about = format!(
                    "{} cells have no half: numbers of cells that 2 divides give an estimate, 4 an order",
                    cells.words(1)
                );
                return self.without("mesh", &about);
            }
        };
        let quarter = cells.divided(4).and_then(|quarter| self.values(&quarter, None, 1.0).ok());
        let part = |(i, quantity): (usize, &QuantityOfInterest)| {
            let expected = match self.is_static {
                true => f64::from(quantity.order_in_space(self.element_order)),
                false => 2.0,
            };
            let shift = (own[i][0] - on_half[i][0]).abs();
            if !self.is_static && quantity.is_at_the_end() && shift > PHASE * own[i][1] {
                let about = format!(
                    "the mesh shifts the motion: half the cells change the end by {} % of its half range. \
                     Ask for \"max\", \"mean\" or \"rms\"",
                    Rounded::<2>(100.0 * shift / own[i][1])
                );
                return ErrorPart { part: "mesh", estimate: None, expected_order: Some(expected), about };
            }
            let (found, words) = match &quarter {
                Some(quarter) => {
                    let values = [quarter[i][0], on_half[i][0], own[i][0]];
                    let words = [4, 2, 1].map(|divisor| cells.words(divisor)).join(", ") + " cells";
                    (estimate(&values, expected, LadderKind::Mesh), words)
                }
                None => {
                    let words =
                        format!("{}, {} cells: two meshes show no order", cells.words(2), cells.words(1));
                    (Ok(estimate_of_two([on_half[i][0], own[i][0]], expected)), words)
                }
            };
            of_ladder("mesh", found, expected, words)
        };
        self.quantities.iter().enumerate().map(part).collect()
    }

    /// The part of the step, measured on the mesh `meshes`, where the run's own step gives `own`.
    fn step_part(
        &mut self,
        meshes: &[(String, String)],
        own: &QuantityValues,
        cells: Option<&CellCounts>,
    ) -> Vec<ErrorPart> {
        if self.is_static {
            let zero = LadderEstimate::ZERO;
            let about = "equilibria of elastic bodies do not depend on increments".to_owned();
            let part = ErrorPart { part: "step", estimate: Some(zero), expected_order: None, about };
            let is_elastic = self.scene.contact.is_none();
            return if is_elastic {
                vec![part; self.quantities.len()]
            } else {
                self.without("step", "increments with contact are not estimated")
            };
        }
        let Some(steps) = self.steps else {
            return self.without("step", "steps follow the error: compare runs with other tolerances");
        };
        let where_ = cells.map_or_else(String::new, |cells| format!(" on {} cells", cells.words(2)));
        let expected = f64::from(self.order_in_time);
        // Coarser steps where they are stable and end at the same time, else finer ones.
        let is_coarse = self.is_implicit && steps % 4 == 0;
        // Finer steps on the run's own mesh would cost seven times as much as the run.
        let two_only = !is_coarse && cells.is_none();
        let factors: &[f64] = match (is_coarse, two_only) {
            (true, _) => &[4.0, 2.0],
            (_, true) => &[0.5],
            _ => &[0.5, 0.25],
        };
        let others: Vec<RunValues> =
            factors.iter().map(|factor| self.values(meshes, Some(factor * self.step), 1.0)).collect();
        let others: Result<Vec<QuantityValues>, String> = others.into_iter().collect();
        let others = match others {
            Ok(others) => others,
            Err(reason) => return self.without("step", &reason),
        };
        let part = |i: usize| {
            let words = format!("steps of {}{where_}", factors_in_words(self.step, factors));
            let found = match (is_coarse, &others[..]) {
                (true, [coarsest, coarser]) => {
                    let values = [coarsest[i][0], coarser[i][0], own[i][0]];
                    estimate(&values, expected, LadderKind::Step)
                }
                (_, [finer, finest]) => {
                    let values = [own[i][0], finer[i][0], finest[i][0]];
                    // The error of the finest, and the way to it.
                    let way = finest[i][0] - own[i][0];
                    estimate(&values, expected, LadderKind::Step).map(|found| found.moved(way))
                }
                (_, others) => {
                    let finer = others[0][i][0];
                    Ok(estimate_of_two([own[i][0], finer], expected).moved(finer - own[i][0]))
                }
            };
            of_ladder("step", found, expected, words)
        };
        (0..self.quantities.len()).map(part).collect()
    }

    /// The part of the solver, bounded on the mesh `meshes`, where the run's own tolerance gives `own`.
    fn solver_part(&mut self, meshes: &[(String, String)], own: &QuantityValues) -> Vec<ErrorPart> {
        let part = |estimate: LadderEstimate, about: &str| ErrorPart {
            part: "solver",
            estimate: Some(estimate),
            expected_order: None,
            about: about.to_owned(),
        };
        let all = |one: ErrorPart| vec![one; self.quantities.len()];
        if !self.is_implicit {
            return all(part(LadderEstimate::ZERO, "none: the scheme is explicit"));
        }
        let given = self.scene.time.solver.as_ref().and_then(|solver| solver.tolerance);
        if given.is_none() {
            let about = "its tolerance is a thousandth of the error of the step, or rounding";
            return all(part(LadderEstimate::ZERO, about));
        }
        match self.values(meshes, None, 10.0) {
            Ok(loose) => {
                let bound = |i: usize| {
                    let interval = (loose[i][0] - own[i][0]).abs();
                    part(
                        LadderEstimate { interval, ..LadderEstimate::ZERO },
                        "ten times its tolerance changes that",
                    )
                };
                (0..self.quantities.len()).map(bound).collect()
            }
            Err(reason) => self.without("solver", &reason),
        }
    }
}

/// The part that a ladder gives.
fn of_ladder(
    part: &'static str,
    found: Result<LadderEstimate, NoEstimate>,
    expected: f64,
    words: String,
) -> ErrorPart {
    let (estimate, about) = match found {
        Ok(found) => (Some(found), words),
        Err(reason) => (None, format!("{reason} ({words})")),
    };
    ErrorPart { part, estimate, expected_order: Some(expected), about }
}

/// The steps of a ladder [s].
fn factors_in_words(step: f64, factors: &[f64]) -> String {
    let steps = factors.iter().map(|factor| Rounded::<4>(factor * step).to_string());
    let steps: Vec<String> = steps.chain([Rounded::<4>(step).to_string()]).collect();
    steps.join(", ") + " s"
}
