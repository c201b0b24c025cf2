//! Sweep over integrators and steps: chooses the next run until errors no longer fall or the budget is
//! used up.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use super::clock::Clock;
use super::errors::ErrorScales;
use super::journal::StudyJournal;
use super::machine::Provenance;
use super::measure::{VariantContext, measure};
use super::plan::{Contender, StudyPlan, TimeGrid, TimeStepping};
use super::reference::{ReferenceSearch, Store};
use super::results::{LineResult, Record, Results, StopReason, VariantResult};
use super::row::RowStatus;
use super::trajectory::Runner;
use super::{Event, Reference, StudyError, order};
use pliant::integrator::Scheme;
use pliant_scene::{RefusedScheme, Scene, Source, vary};

/// First step relative to the largest stable step: one or two runs show the failure.
const BEYOND_STABILITY: f64 = 4.0;
/// Maximum number of steps of a run.
const MOST_STEPS: f64 = 1e8;
/// Fraction of the budget for references.
const FOR_REFERENCES: f64 = 0.4;
/// Fraction of the budget for references if none has been found by then.
const AT_MOST_FOR_REFERENCES: f64 = 0.8;
/// First tolerance that is chosen, and the smallest.
const LARGEST_TOLERANCE: f64 = 1e-2;
const SMALLEST_TOLERANCE: f64 = 1e-13;
/// Suffix of an integrator's name with adaptive steps.
pub(super) const ADAPTIVE: &str = " (adaptive)";
/// Time for each reference without a budget [s].
const REFERENCE_SECONDS: f64 = 120.0;

/// A study to run.
pub struct Study<'a> {
    /// The scene.
    pub source: &'a Source,
    /// Name of the scene.
    pub name: &'a str,
    /// Plan of the study.
    pub plan: &'a StudyPlan,
    /// Folder of references and finished rows, from which a study continues; without it nothing is
    /// stored.
    pub folder: Option<&'a Path>,
    /// Provenance, written into every row.
    pub provenance: &'a Provenance,
    /// Source of time.
    pub clock: &'a dyn Clock,
    /// Set by another thread to stop.
    pub interrupt: &'a AtomicBool,
}

/// A variant of the scene.
struct Variant {
    label: String,
    scene: Scene,
    weights: ErrorScales,
    reference: Reference,
}

/// One integrator on one variant.
struct SweepLine {
    variant: usize,
    contender: Contender,
    /// True for adaptive steps.
    adaptive: bool,
    /// The steps given, or the next step; the last entry runs first.
    paces: Vec<TimeStepping>,
    /// True if the steps are given.
    given: bool,
    records: Vec<Record>,
    /// Step of the last run.
    last: Option<TimeStepping>,
    /// Time of the last row with all repeats, and of a single run [s].
    cost: Option<(f64, f64)>,
    stop: Option<StopReason>,
}

impl Study<'_> {
    /// Runs the study, on the plan's number of threads.
    ///
    /// # Errors
    /// [`StudyError`]. A failed run is no error, but a row of the table.
    pub fn run(&self, watch: &mut (dyn FnMut(Event<'_>) + Send)) -> Result<Results, StudyError> {
        let threads = self.plan.threads;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|source| StudyError::Threads { threads, source })?;
        pool.install(|| self.run_here(watch))
    }

    fn run_here(&self, watch: &mut dyn FnMut(Event<'_>)) -> Result<Results, StudyError> {
        let start = self.clock.now();
        let deadline = start + self.plan.budget.unwrap_or(f64::INFINITY);
        let base = self.source.scene()?;
        if base.time.duration <= 0.0 {
            return Err(StudyError::NoDuration);
        }
        let grid = TimeGrid::new(base.time.duration, self.plan.times, &self.plan.steps);
        let mut journal = StudyJournal::open(self.folder).map_err(file("cannot read the journal"))?;
        let combinations = vary::combinations(&self.plan.axes);
        let mut variants = vec![];
        for (i, changes) in combinations.iter().enumerate() {
            let left = combinations.len() - i;
            let now = self.clock.now();
            let until = [FOR_REFERENCES, AT_MOST_FOR_REFERENCES].map(|part| match self.plan.budget {
                Some(budget) => now + (start + part * budget - now).max(0.02 * budget) / left as f64,
                None => now + REFERENCE_SECONDS,
            });
            variants.push(self.variant(changes, grid, until, watch)?);
        }
        // Rounds over all lines: each active line measures one row per round.
        let mut lines = self.lines(&variants, grid)?;
        if lines.is_empty() && !self.refused(&base).is_empty() {
            return Err(StudyError::Refused(self.refused(&base)));
        }
        let mut finished = 0;
        while lines.iter().any(|line| line.stop.is_none()) {
            for i in 0..lines.len() {
                let active = lines.iter().filter(|line| line.stop.is_none()).count();
                let left = match self.plan.budget {
                    Some(_) => Some((deadline - self.clock.now()).max(0.0)),
                    None => left(&lines),
                };
                let line = &mut lines[i];
                if line.stop.is_some() {
                    continue;
                }
                if self.interrupt.load(Ordering::Relaxed) {
                    line.stop = Some(StopReason::Interrupted);
                    continue;
                }
                let variant = &variants[line.variant];
                self.one(variant, line, (active, left), deadline, &mut journal, &mut finished, watch)?;
            }
        }
        if finished == 0 {
            return Err(StudyError::Interrupted);
        }
        Ok(self.results(&base, grid, variants, lines))
    }

    /// Prepares a variant with its reference.
    fn variant(
        &self,
        changes: &[(String, String)],
        grid: TimeGrid,
        [deadline, last]: [f64; 2],
        watch: &mut dyn FnMut(Event<'_>),
    ) -> Result<Variant, StudyError> {
        let source = self.source.varied(changes)?;
        let scene = source.scene()?;
        if matches!(scene.time.integrator.method().scheme, Scheme::QuasiStatic) {
            return Err(StudyError::Static);
        }
        let runner = Runner { grid, clock: self.clock, interrupt: self.interrupt };
        let located = |problems| StudyError::Variant(source.error(problems));
        let assembly =
            runner.assemble(&scene, self.plan.contenders[0], TimeStepping::Parts(1)).map_err(located)?;
        let simulation = &assembly.simulation;
        let pinned =
            |i: usize| simulation.system().is_pinned(simulation.numbering().internal(i as u32) as usize);
        let start = simulation.positions();
        let weights = ErrorScales::new(scene.dimension, &assembly.topology.masses, pinned, &start);
        let store = Store(self.folder.map(Path::to_owned));
        let reference = match store.load(&scene, &grid) {
            Some(reference) => reference,
            None => {
                let choice = self.plan.reference;
                let watch = &mut *watch;
                let mut search = ReferenceSearch {
                    scene: &scene,
                    runner,
                    weights: &weights,
                    choice,
                    deadline,
                    last,
                    watch,
                };
                let found = search.find()?;
                store.save(&scene, &grid, &found).map_err(file("cannot keep the reference"))?;
                found
            }
        };
        watch(Event::Found(&reference));
        let label: Vec<String> = changes.iter().map(|(path, value)| format!("{path}={value}")).collect();
        Ok(Variant { label: label.join("; "), scene, weights, reference })
    }

    /// Reason for excluding an integrator that does not support the common contact energy.
    fn refusal(&self, scene: &Scene, contender: &Contender) -> Option<RefusedScheme> {
        let mut scene = scene.clone();
        scene.keep_contact(1.0);
        RefusedScheme::by_contact(&scene, contender.spec)
    }

    fn refused(&self, scene: &Scene) -> Vec<RefusedScheme> {
        self.plan.contenders.iter().filter_map(|contender| self.refusal(scene, contender)).collect()
    }

    /// First runs of every integrator.
    fn lines(&self, variants: &[Variant], grid: TimeGrid) -> Result<Vec<SweepLine>, StudyError> {
        let mut lines = vec![];
        let runner = Runner { grid, clock: self.clock, interrupt: self.interrupt };
        for (index, variant) in variants.iter().enumerate() {
            let holds = |contender: &&Contender| self.refusal(&variant.scene, contender).is_none();
            for &contender in self.plan.contenders.iter().filter(holds) {
                let line = |adaptive, paces: Vec<TimeStepping>, given| SweepLine {
                    variant: index,
                    contender,
                    adaptive,
                    paces,
                    given,
                    records: vec![],
                    last: None,
                    cost: None,
                    stop: None,
                };
                let StudyPlan { steps, tolerances, .. } = self.plan;
                let chosen = steps.is_empty() && tolerances.is_empty();
                // Fixed steps: chosen around the stability limit, or given.
                if chosen {
                    let assembly = runner
                        .assemble(&variant.scene, contender, TimeStepping::Parts(1))
                        .map_err(StudyError::Scene)?;
                    let method = assembly.simulation.method().documentation;
                    let limited = method.stability_limit.is_finite() && method.stability_limit > 0.0;
                    let limit = assembly.report.stability.filter(|_| limited).map(|s| s.step);
                    let first = limit.map_or(1, |limit| grid.parts(BEYOND_STABILITY * limit));
                    lines.push(line(false, vec![TimeStepping::Parts(first.next_power_of_two())], false));
                } else if !steps.is_empty() {
                    let mut parts: Vec<u64> = steps.iter().map(|step| grid.parts(*step)).collect();
                    parts.sort_unstable_by(|a, b| b.cmp(a));
                    parts.dedup();
                    lines.push(line(false, parts.into_iter().map(TimeStepping::Parts).collect(), true));
                }
                if !contender.method.is_adaptive() {
                    continue;
                }
                // Adaptive steps: chosen or given tolerances.
                if chosen {
                    lines.push(line(true, vec![TimeStepping::Tolerance(LARGEST_TOLERANCE)], false));
                } else if !tolerances.is_empty() {
                    let mut given = tolerances.clone();
                    given.sort_by(f64::total_cmp);
                    given.dedup();
                    lines.push(line(true, given.into_iter().map(TimeStepping::Tolerance).collect(), true));
                }
            }
        }
        Ok(lines)
    }

    /// Measures the next row of a line, or ends the line.
    #[allow(clippy::too_many_arguments, reason = "all of them change from call to call")]
    fn one(
        &self,
        variant: &Variant,
        line: &mut SweepLine,
        (active, left): (usize, Option<f64>),
        deadline: f64,
        journal: &mut StudyJournal,
        finished: &mut usize,
        watch: &mut dyn FnMut(Event<'_>),
    ) -> Result<(), StudyError> {
        let Some(pace) = line.paces.pop() else {
            line.stop = Some(StopReason::Steps);
            return Ok(());
        };
        let grid = TimeGrid::new(variant.scene.time.duration, self.plan.times, &self.plan.steps);
        let now = self.clock.now();
        // Ends the line if its next row exceeds its share of the remaining time.
        let share = (deadline - now) / active as f64;
        let expected = line.cost.map(|(_, one)| 2.0 * one);
        let key = self.key(variant, line.contender, &grid, pace);
        let known = journal.find(&key).cloned();
        if known.is_none() && (share <= 0.0 || expected.is_some_and(|expected| expected > share)) {
            line.stop = Some(StopReason::Budget);
            return Ok(());
        }
        let scheme = line.contender.name();
        watch(Event::Begun {
            scheme,
            pace: shown(pace, &grid),
            variant: &variant.label,
            finished: *finished,
            left,
        });
        // Takes the row from the journal, or measures it.
        let record = match known {
            Some(record) => record,
            None => {
                let about = VariantContext {
                    study: self,
                    scene: &variant.scene,
                    label: &variant.label,
                    weights: &variant.weights,
                    reference: &variant.reference,
                    grid,
                };
                // Half of the time left for this integrator: the next step takes twice as long.
                let slice = 0.5 * share;
                let before = self.clock.now();
                let Some(record) = measure(&about, line.contender, pace, slice, deadline)? else {
                    let interrupted = self.interrupt.load(Ordering::Relaxed);
                    line.stop = Some(if interrupted { StopReason::Interrupted } else { StopReason::Budget });
                    return Ok(());
                };
                let one = record.row.wall_median_s + record.row.setup_s;
                line.cost = Some((self.clock.now() - before, one));
                journal.keep(key, &record).map_err(file("cannot write the journal"))?;
                record
            }
        };
        if line.cost.is_none() {
            line.cost = Some((0.0, record.row.wall_median_s + record.row.setup_s));
        }
        line.last = Some(pace);
        *finished += 1;
        watch(Event::Finished(&record.row));
        line.records.push(record);
        // Chooses the next step of a line without given steps.
        if !line.given {
            let next = match pace {
                TimeStepping::Parts(parts) => TimeStepping::Parts(2 * parts),
                TimeStepping::Tolerance(tolerance) => TimeStepping::Tolerance(a_tenth(tolerance)),
            };
            line.stop = self.stop(&line.records, &grid, next);
            line.paces.push(next);
        }
        Ok(())
    }

    /// Reason for not taking a smaller step, if there is one.
    fn stop(&self, records: &[Record], grid: &TimeGrid, next: TimeStepping) -> Option<StopReason> {
        let last = records.last()?;
        if last.row.dropped {
            return Some(StopReason::Reference);
        }
        let is_last = match next {
            TimeStepping::Parts(parts) => {
                let step = grid.step(parts);
                let too_small = self.plan.smallest_step.is_some_and(|smallest| step < 0.999 * smallest);
                too_small || grid.duration / step > MOST_STEPS
            }
            TimeStepping::Tolerance(tolerance) => tolerance < SMALLEST_TOLERANCE,
        };
        if is_last {
            return Some(StopReason::Steps);
        }
        // Two refinements in a row without improvement, at small errors.
        let errors: Vec<f64> = records.iter().rev().take(3).map_while(|record| record.row.error()).collect();
        let stays = |pair: &[f64]| pair[0] > 0.8 * pair[1];
        if errors.len() == 3 && errors[0] < 1e-6 && errors.windows(2).all(stays) {
            return Some(StopReason::Floor);
        }
        None
    }

    /// Key of a row: the conditions under which it can be reused.
    fn key(&self, variant: &Variant, contender: Contender, grid: &TimeGrid, pace: TimeStepping) -> String {
        let Provenance { commit, cpu, rustc, flags, .. } = self.provenance;
        let solver = variant.scene.time.solver.clone().unwrap_or_default();
        let problem = super::reference::key(&variant.scene, grid);
        let scheme = serde_json::to_string(&contender.spec).unwrap_or_default();
        let about = (&variant.reference.id, self.plan.repeats, self.plan.threads);
        format!("{problem} {scheme} {pace:?} {solver:?} {about:?} {commit} {cpu} {rustc} {flags}")
    }

    fn results(
        &self,
        base: &Scene,
        grid: TimeGrid,
        variants: Vec<Variant>,
        lines: Vec<SweepLine>,
    ) -> Results {
        let complete = lines.iter().all(|line| line.stop != Some(StopReason::Interrupted));
        let mut found: Vec<VariantResult> = variants
            .into_iter()
            .map(|variant| VariantResult {
                variant: variant.label,
                reference: variant.reference,
                records: vec![],
                lines: vec![],
            })
            .collect();
        for mut line in lines {
            line.records.sort_by(|a, b| b.row.dt.total_cmp(&a.row.dt));
            let mut rows: Vec<_> = line.records.iter_mut().map(|record| &mut record.row).collect();
            order::observe(&mut rows);
            let variant = &mut found[line.variant];
            variant.lines.push(LineResult {
                integrator: integrator_name(line.contender, line.adaptive),
                order_nominal: line.contender.method.documentation.order,
                order_observed: order::fit(line.records.iter().map(|record| &record.row)),
                stop: line.stop.unwrap_or(StopReason::Steps),
            });
            variant.records.extend(line.records);
        }
        Results {
            name: self.name.to_owned(),
            title: base.title.clone().unwrap_or_else(|| self.name.to_owned()),
            provenance: self.provenance.clone(),
            grid,
            error: self.plan.error,
            variants: found,
            refused: self.refused(base),
            complete,
        }
    }
}

/// Name of an integrator, or TOML with its non-default parameters.
pub(super) fn integrator_name(contender: Contender, adaptive: bool) -> String {
    fixed_name(contender) + if adaptive { ADAPTIVE } else { "" }
}

fn fixed_name(contender: Contender) -> String {
    let spec = contender.spec;
    let is_usual = pliant::integrator::IntegratorSpec::ALL.contains(&spec);
    let written = (!is_usual).then(|| serde_json::to_value(spec).ok()).flatten();
    match written {
        Some(serde_json::Value::Object(table)) => {
            table.iter().fold(String::new(), |out, (name, parameters)| {
                let pairs = parameters.as_object().into_iter().flatten();
                let pairs: Vec<String> = pairs.map(|(key, value)| format!("{key} = {value}")).collect();
                out + &format!("{{ {name} = {{ {} }} }}", pairs.join(", "))
            })
        }
        _ => contender.name().to_owned(),
    }
}

/// Estimate of the seconds for all given steps, in proportion to their numbers. `None` before the first
/// run, or if steps are chosen.
fn left(lines: &[SweepLine]) -> Option<f64> {
    let steps = |pace: &TimeStepping| match pace {
        TimeStepping::Parts(parts) => *parts as f64,
        // Assumes order 5.
        TimeStepping::Tolerance(tolerance) => tolerance.powf(-0.2),
    };
    if lines.iter().any(|line| !line.given) {
        return None;
    }
    let known: Vec<f64> =
        lines.iter().filter_map(|line| Some(line.cost?.0 / steps(line.last.as_ref()?))).collect();
    if known.is_empty() {
        return None;
    }
    let usual = known.iter().sum::<f64>() / known.len() as f64;
    let active = lines.iter().filter(|line| line.stop.is_none());
    let each = active.map(|line| {
        let rate = line.cost.zip(line.last.as_ref()).map_or(usual, |((cost, _), last)| cost / steps(last));
        rate * line.paces.iter().map(steps).sum::<f64>()
    });
    Some(each.sum())
}

/// A tenth of a tolerance, rounded to what one would write: `1e-7` without an error in the last place.
fn a_tenth(tolerance: f64) -> f64 {
    format!("{:.12e}", 0.1 * tolerance).parse().unwrap_or(0.1 * tolerance)
}

/// The step [s] or the tolerance, with its name.
fn shown(pace: TimeStepping, grid: &TimeGrid) -> (&'static str, f64) {
    match pace {
        TimeStepping::Parts(parts) => ("step", grid.step(parts)),
        TimeStepping::Tolerance(tolerance) => ("tolerance", tolerance),
    }
}

fn file(what: &'static str) -> impl Fn(std::io::Error) -> StudyError {
    move |source| StudyError::File { what: what.to_owned(), source }
}

/// Status of a row for the outcome of its run.
pub(super) fn status(outcome: &pliant::run::Outcome) -> Option<(RowStatus, Option<(f64, String)>)> {
    use pliant::run::Outcome;
    use pliant::simulation::StepError;
    match outcome {
        Outcome::Done => Some((RowStatus::Ok, None)),
        Outcome::Interrupted | Outcome::ObserverFailed(_) => None,
        Outcome::Failed(error) => Some(match error {
            StepError::NotFinite { time, .. } => (RowStatus::Diverged, Some((*time, error.to_string()))),
            // Even the smallest step did not help.
            StepError::StepTooSmall { time, .. } => (RowStatus::Diverged, Some((*time, error.to_string()))),
            StepError::Unsolved { time, .. } => (RowStatus::NewtonFailed, Some((*time, error.to_string()))),
            StepError::Unstable { time, .. } => (RowStatus::EnergyBlowUp, Some((*time, error.to_string()))),
        }),
    }
}
