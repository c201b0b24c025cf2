//! Error budget of a run: how far its numbers are from those of the continuous problem, by mesh, by step and
//! by solver, from coarser and finer runs of the same scene.
//!
//! With the value `Q(h, k)` on the mesh `h` with the step `k`, the truth is `Q* = Q + m + s + v`. The part of
//! the mesh is that of the ladder `Q(4h, k), Q(2h, k), Q(h, k)`, the part of the step that of three steps on
//! the mesh `2h`, and the part of the solver the difference that ten times its tolerance makes; see
//! [`convergence`](crate::convergence). The part of the contact distance `d` is `Q(d) - Q(2 d)`: the gap of
//! bodies that press each other is proportional to `d` where the pressure is a function of gap over `d`.
//! Intervals of the parts add up, because parts are biases and do not
//! average out. Eca, Vaz, Toxopeus, Hoekstra 2019, Journal of Verification, Validation and Uncertainty
//! Quantification, doi 10.1115/1.4043975, split errors by such runs.
//!
//! Formal orders in space are those of exact integration in statics, and 2 in dynamics, where masses are
//! lumped.

#[cfg(test)]
mod tests;

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use pliant::quantity::Rounded;
use pliant::run::Plan;
use pliant_scene::assembly::{Assembly, UnstableStep};
use pliant_scene::{Scene, SceneError, Source};

use crate::convergence::{LadderEstimate, LadderKind, NoEstimate, estimate, estimate_of_two};
use crate::quantity::{
    CellMeshes, CellScale, FRAMES, NoValues, QuantityOfInterest, QuantityRuns, QuantityValue,
};

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
    /// Time of the scene's own run [s].
    pub seconds: f64,
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
    /// `mesh`, `step`, `solver` or `contact`.
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
    /// The scene cannot be run for its quantities.
    #[error("{0}")]
    Refused(String),
}

/// Progress of the runs of a budget.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BudgetEvent {
    /// The scene's own run is done: this many others follow, which take about so long [s].
    Planned {
        /// Number of runs.
        runs: usize,
        /// Time of all of them [s].
        seconds: f64,
    },
    /// The run of this number begins, the scene's own being 1.
    Begun(usize),
}

/// Growth of the time of an implicit step with half the cell size, as a power of 2 for each direction.
const IMPLICIT_GROWTH: f64 = 1.3;

/// Values of all quantities of a run, or why it has none.
type RunValues = Result<Vec<QuantityValue>, NoValues>;

/// Estimates the errors of `quantities` of a scene; of all its probes at the end without any. `begun` sees
/// the plan and each run.
///
/// # Errors
/// [`BudgetError`]; a part without an estimate is no error, but says why.
pub fn error_budget(
    source: &Source,
    quantities: &[QuantityOfInterest],
    interrupt: &AtomicBool,
    begun: &mut dyn FnMut(BudgetEvent),
) -> Result<ErrorBudget, BudgetError> {
    let scene = source.scene()?;
    let assembly = scene.assemble(UnstableStep::Refuse).map_err(|problems| source.error(problems))?;
    budget_of(&scene, assembly, quantities, interrupt, begun)
}

/// Estimates as [`error_budget`] does, for a scene without a text.
pub(crate) fn budget_of_scene(
    scene: &Scene,
    quantities: &[QuantityOfInterest],
    interrupt: &AtomicBool,
    begun: &mut dyn FnMut(BudgetEvent),
) -> Result<ErrorBudget, BudgetError> {
    let assembly = scene.assemble(UnstableStep::Refuse).map_err(SceneError::new)?;
    budget_of(scene, assembly, quantities, interrupt, begun)
}

fn budget_of(
    scene: &Scene,
    assembly: Assembly,
    quantities: &[QuantityOfInterest],
    interrupt: &AtomicBool,
    begun: &mut dyn FnMut(BudgetEvent),
) -> Result<ErrorBudget, BudgetError> {
    let named = QuantityOfInterest::of_probes(&assembly.probes, scene.dimension);
    let quantities = if quantities.is_empty() { &named } else { quantities };
    if quantities.is_empty() {
        return Err(BudgetError::NoQuantity);
    }
    if let Some(missing) = quantities.iter().find(|quantity| !quantity.is_of(&assembly)) {
        return Err(BudgetError::Missing(missing.to_string()));
    }
    let mut ladder = ErrorRuns::new(scene, &assembly, quantities, interrupt, begun);
    drop(assembly);
    let started = Instant::now();
    let own = ladder.values(scene, None, 1.0);
    let own_seconds = started.elapsed().as_secs_f64();
    let own = own.map_err(|reason| match reason {
        NoValues::Refused(reason) => BudgetError::Refused(reason),
        _ => BudgetError::Unfinished,
    })?;
    let started = Instant::now();
    let parts = ladder.parts(&own, own_seconds);
    let cost = started.elapsed().as_secs_f64() / own_seconds;
    let budget = |(i, quantity): (usize, &QuantityOfInterest)| {
        let parts: Vec<ErrorPart> = parts.iter().map(|part| part[i].clone()).collect();
        let known = |of: fn(&LadderEstimate) -> f64| -> Option<f64> {
            parts.iter().map(|part| part.estimate.as_ref().map(of)).sum()
        };
        let extrapolated = known(|part| part.estimate.unwrap_or(0.0)).map(|sum| own[i].value + sum);
        QuantityBudget {
            quantity: quantity.to_string(),
            unit: quantity.unit(),
            value: own[i].value,
            interval: known(|part| part.interval),
            extrapolated,
            parts,
        }
    };
    let quantities = quantities.iter().enumerate().map(budget).collect();
    Ok(ErrorBudget { quantities, runs: ladder.runs - 1, cost, seconds: own_seconds })
}

/// Runs of one scene on other meshes and with other steps.
struct ErrorRuns<'a> {
    scene: Scene,
    quantities: &'a [QuantityOfInterest],
    made: QuantityRuns<'a>,
    begun: &'a mut dyn FnMut(BudgetEvent),
    /// Number of steps of the run, or `None` if they follow the error.
    steps: Option<u64>,
    /// Step of the run [s].
    step: f64,
    /// Order of the elements, the least of all bodies.
    element_order: u32,
    is_static: bool,
    is_implicit: bool,
    order_in_time: u32,
    /// Contact distance [m], or the reason for which its part is not estimated; `None` without contact.
    contact: Option<Result<f64, &'static str>>,
    runs: usize,
}

impl<'a> ErrorRuns<'a> {
    fn new(
        scene: &Scene,
        assembly: &Assembly,
        quantities: &'a [QuantityOfInterest],
        interrupt: &'a AtomicBool,
        begun: &'a mut dyn FnMut(BudgetEvent),
    ) -> Self {
        let simulation = &assembly.simulation;
        let method = simulation.method();
        let step = simulation.step_size();
        let plan = scene.plan();
        let steps = simulation.step_control().is_none().then(|| plan.steps(step));
        let duration = steps.map_or(plan.duration, |steps| steps as f64 * step);
        let coarse = steps.map_or(FRAMES, |steps| if steps % 4 == 0 { steps / 4 } else { steps });
        let frames = (1..=FRAMES).rev().find(|frames| coarse % frames == 0).unwrap_or(1);
        let orders = scene.body.iter().map(|body| body.order.unwrap_or(1));
        let element_order = orders.map(u32::from).min().unwrap_or(1);
        let plan = Plan { duration, rate: frames as f64 / duration };
        ErrorRuns {
            quantities,
            made: QuantityRuns::new(scene, assembly, quantities, plan, interrupt),
            begun,
            steps,
            step,
            element_order,
            is_static: method.is_static(),
            is_implicit: method.documentation.solves > 0,
            order_in_time: method.documentation.order,
            contact: scene.contact.as_ref().map(|contact| {
                let is_free = method.documentation.solves > 0 || method.is_static();
                match assembly.report.contact.as_ref() {
                    Some(report) if is_free || contact.stiffness.is_some() => Ok(report.distance),
                    _ => Err("explicit contact derives its stiffness from the distance: give `stiffness`"),
                }
            }),
            runs: 0,
            scene: scene.clone(),
        }
    }

    /// Values of `scene` with `step` in place of its own [s], and `tolerance` times the tolerance of its
    /// solver.
    fn values(&mut self, scene: &Scene, step: Option<f64>, tolerance: f64) -> RunValues {
        self.runs += 1;
        (self.begun)(BudgetEvent::Begun(self.runs));
        let mut scene = scene.clone();
        if let Some(step) = step {
            scene.time.step = Some(step);
        }
        if let Some(given) = scene.time.solver.as_mut().and_then(|solver| solver.tolerance.as_mut()) {
            *given *= tolerance;
        }
        Ok(self.made.run(&scene)?.values)
    }

    /// Parts of the errors, each for all quantities.
    fn parts(&mut self, own: &[QuantityValue], seconds: f64) -> Vec<Vec<ErrorPart>> {
        let cells = CellMeshes::of(&self.scene);
        let coarser = |parts| cells.as_ref().ok()?.scene(&self.scene, CellScale::coarser(parts), None);
        let (half, quarter) = (coarser(2), coarser(4));
        let directions = cells.as_ref().map_or(0, CellMeshes::directions);
        let costs = self.costs([half.is_some(), quarter.is_some()], directions);
        let (runs, seconds) = (costs.len(), seconds * costs.iter().sum::<f64>());
        (self.begun)(BudgetEvent::Planned { runs, seconds });
        let on_half = half.as_ref().map(|half| self.values(half, None, 1.0));
        let mesh = self.mesh_part(own, &cells, on_half.as_ref(), quarter.as_ref());
        // Steps and tolerances are varied on the coarser mesh, where that costs less.
        let own_scene = self.scene.clone();
        let (scene, known, cells) = match (&half, &on_half) {
            (Some(half), Some(Ok(values))) => (half, &values[..], cells.as_ref().ok()),
            _ => (&own_scene, own, None),
        };
        let step = self.step_part(scene, known, cells);
        let solver = self.solver_part(scene, known);
        let contact = self.contact.map(|distance| self.contact_part(own, distance));
        [mesh, step, solver].into_iter().chain(contact).collect()
    }

    /// The part of the contact distance, by a run with twice of it.
    fn contact_part(&mut self, own: &[QuantityValue], distance: Result<f64, &'static str>) -> Vec<ErrorPart> {
        let distance = match distance {
            Ok(distance) => distance,
            Err(reason) => return self.without("contact", reason),
        };
        let mut scene = self.scene.clone();
        if let Some(contact) = &mut scene.contact {
            contact.distance = Some(2.0 * distance);
        }
        match self.values(&scene, None, 1.0) {
            Ok(wider) => {
                let of = |i: usize| {
                    let found = estimate_of_two([wider[i].value, own[i].value], 1.0);
                    let words = format!(
                        "distances of {} and {} m",
                        Rounded::<3>(2.0 * distance),
                        Rounded::<3>(distance)
                    );
                    of_ladder("contact", Ok(found), 1.0, words)
                };
                (0..self.quantities.len()).map(of).collect()
            }
            Err(reason) => self.without("contact", &reason.to_string()),
        }
    }

    /// Predicted costs of the runs beside the scene's own, relative to it.
    fn costs(&self, [has_half, has_quarter]: [bool; 2], directions: usize) -> Vec<f64> {
        let is_iterated = self.is_implicit || self.is_static;
        let growth = directions as f64 * if is_iterated { IMPLICIT_GROWTH } else { 1.0 };
        let [half, quarter] = [(-growth).exp2(), (-2.0 * growth).exp2()];
        let base = if has_half { half } else { 1.0 };
        let meshes = [(has_half, half), (has_half && has_quarter, quarter)];
        let mut costs: Vec<f64> =
            meshes.into_iter().filter(|(is_run, _)| *is_run).map(|(_, cost)| cost).collect();
        if let (false, Some(steps)) = (self.is_static, self.steps) {
            costs.extend(self.factors(steps, has_half).iter().map(|factor| base / factor));
        }
        let has_tolerance = self.scene.time.solver.as_ref().is_some_and(|solver| solver.tolerance.is_some());
        costs.extend((self.is_implicit && has_tolerance).then_some(base));
        costs.extend(matches!(self.contact, Some(Ok(_))).then_some(1.0));
        costs
    }

    /// Factors of the step in the runs that measure its part.
    fn factors(&self, steps: u64, has_half: bool) -> &'static [f64] {
        match self.is_implicit && steps.is_multiple_of(4) {
            // Coarser steps where they are stable and end at the same time, else finer ones.
            true => &[4.0, 2.0],
            // Finer steps on the run's own mesh would cost seven times as much as the run.
            false if !has_half => &[0.5],
            false => &[0.5, 0.25],
        }
    }

    /// Parts without an estimate, for the same reason in all quantities.
    fn without(&self, part: &'static str, about: &str) -> Vec<ErrorPart> {
        let none = ErrorPart { part, estimate: None, expected_order: None, about: about.to_owned() };
        vec![none; self.quantities.len()]
    }

    fn mesh_part(
        &mut self,
        own: &[QuantityValue],
        cells: &Result<CellMeshes, String>,
        on_half: Option<&RunValues>,
        quarter: Option<&Scene>,
    ) -> Vec<ErrorPart> {
        let cells = match cells {
            Ok(cells) => cells,
            Err(reason) => return self.without("mesh", reason),
        };
        let on_half = match on_half {
            Some(Ok(values)) => values,
            Some(Err(reason)) => return self.without("mesh", &reason.to_string()),
            None => {
                let about = format!(
                    "{} cells have no half: numbers of cells that 2 divides give an estimate, 4 an order; of a \
                     file, `refine = 1` and `refine = 2`",
                    cells.words(CellScale::ONE)
                );
                return self.without("mesh", &about);
            }
        };
        let quarter = quarter.and_then(|quarter| self.values(quarter, None, 1.0).ok());
        let part = |(i, quantity): (usize, &QuantityOfInterest)| {
            let expected = quantity.order_in_space(self.element_order, self.is_static);
            let shift = (own[i].value - on_half[i].value).abs();
            if !self.is_static && quantity.is_at_the_end() && shift > PHASE * own[i].half_range {
                let about = format!(
                    "the mesh shifts the motion: half the cells change the end by {} % of its half range. \
                     Ask for \"max\", \"mean\" or \"rms\"",
                    Rounded::<2>(100.0 * shift / own[i].half_range)
                );
                return ErrorPart { part: "mesh", estimate: None, expected_order: Some(expected), about };
            }
            let (found, words) = match &quarter {
                Some(quarter) => {
                    let values = [quarter[i].value, on_half[i].value, own[i].value];
                    if let Some(about) = quantity.without_limit(&values) {
                        return ErrorPart {
                            part: "mesh",
                            estimate: None,
                            expected_order: Some(expected),
                            about,
                        };
                    }
                    let words = [4, 2, 1].map(|divisor| cells.words(CellScale::coarser(divisor))).join(", ")
                        + " cells";
                    (estimate(&values, expected, LadderKind::Mesh), words)
                }
                None => {
                    let words = format!(
                        "{}, {} cells: two meshes show no order",
                        cells.words(CellScale::coarser(2)),
                        cells.words(CellScale::ONE)
                    );
                    (Ok(estimate_of_two([on_half[i].value, own[i].value], expected)), words)
                }
            };
            of_ladder("mesh", found, expected, words)
        };
        self.quantities.iter().enumerate().map(part).collect()
    }

    /// The part of the step, measured on `scene`, where the run's own step gives `own`.
    fn step_part(
        &mut self,
        scene: &Scene,
        own: &[QuantityValue],
        cells: Option<&CellMeshes>,
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
            return self.without("step", "the step size is adaptive: compare runs with other tolerances");
        };
        let where_ = cells
            .map_or_else(String::new, |cells| format!(" on {} cells", cells.words(CellScale::coarser(2))));
        let expected = f64::from(self.order_in_time);
        let factors = self.factors(steps, cells.is_some());
        let is_coarse = factors[0] > 1.0;
        let others: Vec<RunValues> =
            factors.iter().map(|factor| self.values(scene, Some(factor * self.step), 1.0)).collect();
        let others: Result<Vec<Vec<QuantityValue>>, NoValues> = others.into_iter().collect();
        let others = match others {
            Ok(others) => others,
            Err(reason) => return self.without("step", &reason.to_string()),
        };
        let part = |i: usize| {
            let words = format!("steps of {}{where_}", factors_in_words(self.step, factors));
            let found = match (is_coarse, &others[..]) {
                (true, [coarsest, coarser]) => {
                    let values = [coarsest[i].value, coarser[i].value, own[i].value];
                    estimate(&values, expected, LadderKind::Step)
                }
                (_, [finer, finest]) => {
                    let values = [own[i].value, finer[i].value, finest[i].value];
                    // The error of the finest, and the way to it.
                    let way = finest[i].value - own[i].value;
                    estimate(&values, expected, LadderKind::Step).map(|found| found.moved(way))
                }
                (_, others) => {
                    let finer = others[0][i].value;
                    Ok(estimate_of_two([own[i].value, finer], expected).moved(finer - own[i].value))
                }
            };
            of_ladder("step", found, expected, words)
        };
        (0..self.quantities.len()).map(part).collect()
    }

    /// The part of the solver, bounded on `scene`, where the run's own tolerance gives `own`.
    fn solver_part(&mut self, scene: &Scene, own: &[QuantityValue]) -> Vec<ErrorPart> {
        let part = |estimate: LadderEstimate, about: &str| ErrorPart {
            part: "solver",
            estimate: Some(estimate),
            expected_order: None,
            about: about.to_owned(),
        };
        let all = |one: ErrorPart| vec![one; self.quantities.len()];
        if !self.is_implicit {
            return all(part(LadderEstimate::ZERO, "none: the integrator is explicit"));
        }
        let given = self.scene.time.solver.as_ref().and_then(|solver| solver.tolerance);
        if given.is_none() {
            let about = "its tolerance is a thousandth of the error of the step, or round-off";
            return all(part(LadderEstimate::ZERO, about));
        }
        match self.values(scene, None, 10.0) {
            Ok(loose) => {
                let bound = |i: usize| {
                    let interval = (loose[i].value - own[i].value).abs();
                    part(
                        LadderEstimate { interval, ..LadderEstimate::ZERO },
                        "ten times its tolerance changes that",
                    )
                };
                (0..self.quantities.len()).map(bound).collect()
            }
            Err(reason) => self.without("solver", &reason.to_string()),
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
