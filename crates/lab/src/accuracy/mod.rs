//! Mesh, elements, scheme and step for an error that is wished for.
//!
//! The two coarsest meshes of every kind of elements say how far its error is from the wish, and what a finer
//! mesh costs: with the difference `d` of their values the error is about `d/(2^1.5 - 1)`, and it falls by
//! `2^1.5` with each mesh, the order that clamped corners leave of 2. The kind that is to be the cheapest is
//! refined until its ladder ([`convergence`](crate::convergence)) gives an interval within the wish. Then an
//! error budget ([`budget`](crate::budget)) of the chosen run has to prove it, mesh, step and solver
//! together; where it does not, the part that is too large is refined. A motion is computed by the explicit
//! scheme or the implicit one, whichever is the cheaper at the mesh that is needed.

#[cfg(test)]
mod tests;

use std::sync::atomic::AtomicBool;

use pliant::integrator::IntegratorSpec;
use pliant::quantity::{Kind, QuantityError, Rounded};
use pliant_scene::{Scene, Source};

use crate::budget::{BudgetError, BudgetEvent, QuantityBudget, budget_of_scene};
use crate::convergence::{LadderKind, LadderTier, estimate};
use crate::quantity::{CellScale, ElementFamily, NoValues, QuantityOfInterest, RunKey};
use crate::refinement::{StudiedScene, StudiedSceneError};
use crate::study::Contender;

/// Order by which errors of meshes are predicted.
const PREDICTED_ORDER: f64 = 1.5;
/// Part of the wish that the mesh may take.
const FOR_MESH: f64 = 0.8;
/// Part of the wish that half the step of an implicit scheme may change.
const FOR_STEP: f64 = 0.2;
/// Largest part of the scene's own cells that the search begins with, along every direction.
const COARSEST: usize = 8;
/// Largest number of meshes.
const LEVELS: usize = 8;
/// Largest number of halvings of an implicit step.
const HALVINGS: u32 = 12;
/// Explicit step relative to the largest stable one at rest.
const EXPLICIT_PART: f64 = 0.45;
/// Largest number of values of a ladder.
const LADDER: usize = 4;

/// Error that is wished for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WishedError {
    /// Relative to the largest magnitude of the quantity over time.
    Relative(f64),
    /// In the unit of the quantity.
    Absolute(f64),
}

impl WishedError {
    /// Reads `1 %`, `0.01`, or a text with the unit of `quantity`, such as `0.1 mm`.
    ///
    /// # Errors
    /// The text is none of these, or not above 0.
    pub fn parse(text: &str, quantity: &QuantityOfInterest) -> Result<WishedError, NoWish> {
        let no_wish = |why: String| NoWish { text: text.to_owned(), unit: quantity.unit(), why };
        let is_positive = |value: f64| match value.is_finite() && value > 0.0 {
            true => Ok(value),
            false => Err(no_wish("is not above 0".into())),
        };
        let plain = |text: &str| text.trim().parse::<f64>().ok();
        if let Some(percent) = text.trim().strip_suffix('%') {
            let percent = plain(percent).ok_or_else(|| no_wish("is no number of per cent".into()))?;
            return Ok(WishedError::Relative(0.01 * is_positive(percent)?));
        }
        if let Some(part) = plain(text) {
            return Ok(WishedError::Relative(is_positive(part)?));
        }
        let kind = match quantity.unit() {
            "m" => Kind::LENGTH,
            "N" => Kind::FORCE,
            "Pa" => Kind::PRESSURE,
            "Hz" => Kind::RATE,
            "s" => Kind::TIME,
            _ => Kind::ENERGY,
        };
        let value = kind.parse(text).map_err(|error: QuantityError| no_wish(format!("is none: {error}")))?;
        Ok(WishedError::Absolute(is_positive(value)?))
    }

    /// The error in the unit of a quantity whose largest magnitude is `largest`.
    fn of(self, largest: f64) -> f64 {
        match self {
            WishedError::Relative(part) => part * largest,
            WishedError::Absolute(error) => error,
        }
    }
}

/// Error of a text that is no wish.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{text}` {why}; an accuracy is \"1 %\", or an error in {unit} with its unit")]
pub struct NoWish {
    text: String,
    unit: &'static str,
    why: String,
}

/// A search to run.
pub struct AccuracySearch<'a> {
    /// The scene; its mesh, elements, scheme and step are what is searched.
    pub source: &'a Source,
    /// The quantity.
    pub quantity: &'a QuantityOfInterest,
    /// Largest error that it may have.
    pub wish: WishedError,
    /// Wall time of the search [s].
    pub budget: f64,
    /// Set by another thread to stop.
    pub interrupt: &'a AtomicBool,
}

/// Run whose error is within a wish.
#[derive(Clone, Debug, serde::Serialize)]
pub struct AccurateRun {
    /// Elements.
    pub family: ElementFamily,
    /// Elements in words.
    pub elements: &'static str,
    /// Cells, as `8x4`.
    pub cells: String,
    /// Name of the scheme.
    pub scheme: &'static str,
    /// Step [s]; `None` in statics, whose increments are the scene's.
    pub step: Option<f64>,
    /// Keys that make the scene this run.
    pub keys: Vec<RunKey>,
    /// Largest error that was wished for, in the unit of the quantity.
    pub wish: f64,
    /// The proof.
    pub proof: QuantityBudget,
    /// Time of the run [s].
    pub seconds: f64,
    /// Number of runs of the whole search, and its time [s].
    pub runs: usize,
    /// Time of the whole search [s].
    pub search_seconds: f64,
}

/// Error of a search.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AccuracyError {
    /// The scene cannot be studied.
    #[error(transparent)]
    Scene(#[from] StudiedSceneError),
    /// The wish was not proved.
    #[error("the accuracy is not reached: {0}")]
    NotReached(String),
    /// The search was interrupted.
    #[error("interrupted")]
    Interrupted,
}

impl AccuracySearch<'_> {
    /// Finds the run; `watch` sees each run before it begins.
    ///
    /// # Errors
    /// [`AccuracyError`].
    pub fn run(&self, watch: &mut dyn FnMut(&str)) -> Result<AccurateRun, AccuracyError> {
        let quantities = std::slice::from_ref(self.quantity);
        let of = StudiedScene::new(self.source, quantities, self.budget, self.interrupt)?;
        let mut search = AccuracyRuns {
            about: self,
            parts: of.cells.common_parts(COARSEST),
            of,
            made: 0,
            last_reason: "no kind of elements could be run".into(),
            watch,
        };
        search.find()
    }
}

struct AccuracyRuns<'a> {
    about: &'a AccuracySearch<'a>,
    of: StudiedScene<'a>,
    /// Part of the scene's cells on the coarsest mesh.
    parts: usize,
    made: usize,
    last_reason: String,
    watch: &'a mut dyn FnMut(&str),
}

/// Way in which a kind of elements is stepped.
#[derive(Clone, Copy, Debug, PartialEq)]
enum RunStepping {
    /// Statics, by the scene's own increments.
    Increments,
    /// The explicit scheme at a part of its stability limit.
    Explicit,
    /// The implicit scheme with this number of steps between two times of comparison.
    Implicit(u64),
}

/// One kind of elements, coarse to fine.
#[derive(Clone, Debug)]
struct Candidate {
    family: ElementFamily,
    stepping: RunStepping,
    values: Vec<f64>,
    /// Largest magnitude of the quantity on the finest mesh.
    largest: f64,
    /// Time of the run on the finest mesh [s].
    seconds: f64,
    /// Predicted time of the run that reaches the wish [s].
    predicted: f64,
}

/// Outcome of one more mesh.
enum Refined {
    /// A run is proved.
    Proved(Box<AccurateRun>),
    /// Another mesh is needed.
    NotYet,
    /// This kind of elements is given up.
    GaveUp,
}

impl AccuracyRuns<'_> {
    fn words(&self, family: ElementFamily, level: usize) -> String {
        self.of.words(family, self.scale(level))
    }

    fn scale(&self, level: usize) -> CellScale {
        CellScale { times: 1 << level, parts: self.parts }
    }

    fn find(&mut self) -> Result<AccurateRun, AccuracyError> {
        let mut candidates = vec![];
        for family in ElementFamily::ALL {
            match self.pilot(family) {
                Ok(candidate) => candidates.push(candidate),
                Err(NoValues::Interrupted) => return Err(AccuracyError::Interrupted),
                Err(reason) => self.last_reason = reason.to_string(),
            }
        }
        // The kind that is to be the cheapest goes on, until another one is to be cheaper.
        loop {
            let Some(next) = (0..candidates.len())
                .min_by(|a, b| candidates[*a].predicted.total_cmp(&candidates[*b].predicted))
            else {
                return Err(AccuracyError::NotReached(self.last_reason.clone()));
            };
            match self.refine(&mut candidates[next])? {
                Refined::Proved(run) => return Ok(*run),
                Refined::GaveUp => drop(candidates.swap_remove(next)),
                Refined::NotYet => {}
            }
        }
    }

    /// Runs the two coarsest meshes.
    fn pilot(&mut self, family: ElementFamily) -> Result<Candidate, NoValues> {
        let mut candidate = self.first(family)?;
        self.next(&mut candidate)?;
        let [coarse, fine] = candidate.values[..] else { return Err(NoValues::Failed) };
        let error = (fine - coarse).abs() / (PREDICTED_ORDER.exp2() - 1.0);
        let wish = self.about.wish.of(candidate.largest);
        let levels = ((2.0 * error / wish).log2() / PREDICTED_ORDER).ceil().max(1.0);
        candidate.predicted = candidate.seconds * (levels * self.growth(candidate.stepping)).exp2();
        Ok(candidate)
    }

    /// Growth of the time of a run with half the cell size, as a power of 2.
    fn growth(&self, stepping: RunStepping) -> f64 {
        self.of.growth(stepping == RunStepping::Explicit)
    }

    /// Runs the coarsest mesh, in a motion by the cheaper of both schemes.
    fn first(&mut self, family: ElementFamily) -> Result<Candidate, NoValues> {
        let new = |stepping, value: f64, largest: f64, seconds: f64| Candidate {
            family,
            stepping,
            values: vec![value],
            largest,
            seconds,
            predicted: f64::INFINITY,
        };
        if self.of.is_static {
            let (value, largest, seconds) = self.values(family, RunStepping::Increments, 0)?;
            return Ok(new(RunStepping::Increments, value, largest, seconds));
        }
        let explicit = self.values(family, RunStepping::Explicit, 0);
        if let Err(NoValues::Refused(_)) = &explicit {
            explicit.clone()?;
        }
        let most = explicit.as_ref().map_or(f64::INFINITY, |(.., seconds)| 4.0 * seconds);
        let mut last: Option<f64> = None;
        let mut implicit = Err(NoValues::Failed);
        for halving in 0..HALVINGS {
            let stepping = RunStepping::Implicit(1 << halving);
            let (value, largest, seconds) = match self.values(family, stepping, 0) {
                Ok(found) => found,
                Err(NoValues::Failed) => continue,
                Err(reason) => return Err(reason),
            };
            let wish = FOR_STEP * self.about.wish.of(largest);
            if last.is_some_and(|last| (value - last).abs() <= wish) {
                implicit = Ok(new(stepping, value, largest, seconds));
                break;
            }
            if seconds > most || 2.0 * seconds > 0.1 * self.of.left() {
                break;
            }
            last = Some(value);
        }
        match (explicit, implicit) {
            (Ok((value, largest, seconds)), Ok(implicit)) => {
                let explicit = new(RunStepping::Explicit, value, largest, seconds);
                // At two levels beyond this one.
                let at = |of: &Candidate| of.seconds * (2.0 * self.growth(of.stepping)).exp2();
                Ok(if at(&explicit) <= at(&implicit) { explicit } else { implicit })
            }
            (Ok((value, largest, seconds)), Err(_)) => {
                Ok(new(RunStepping::Explicit, value, largest, seconds))
            }
            (Err(_), implicit) => implicit,
        }
    }

    /// Runs the next mesh.
    fn next(&mut self, candidate: &mut Candidate) -> Result<(), NoValues> {
        let level = candidate.values.len();
        let (value, largest, seconds) = self.values(candidate.family, candidate.stepping, level)?;
        candidate.values.push(value);
        (candidate.largest, candidate.seconds) = (largest, seconds);
        Ok(())
    }

    /// The scene on a mesh with its stepping; the scheme and the step of a motion.
    fn scene(
        &self,
        family: ElementFamily,
        stepping: RunStepping,
        level: usize,
    ) -> Result<(Scene, Option<(Contender, f64)>), NoValues> {
        let scene = self.of.on(family, self.scale(level))?;
        let contender = Contender::from(match stepping {
            RunStepping::Increments => return Ok((scene, None)),
            RunStepping::Explicit => IntegratorSpec::VelocityVerlet,
            RunStepping::Implicit(_) => IntegratorSpec::TrBdf2,
        });
        let parts = match stepping {
            RunStepping::Implicit(parts) => parts,
            _ => {
                let limit = self.of.explicit_limit(&scene, contender)?.ok_or(NoValues::Failed)?;
                let parts = self.of.parts_below(EXPLICIT_PART * limit.step);
                if parts as f64 * self.of.grid.times as f64 * limit.seconds > self.of.left() {
                    return Err(NoValues::Failed);
                }
                parts
            }
        };
        let step = self.of.grid.step(parts);
        Ok((self.of.paced(scene, contender, step), Some((contender, step))))
    }

    /// Value, largest magnitude and time of a run.
    fn values(
        &mut self,
        family: ElementFamily,
        stepping: RunStepping,
        level: usize,
    ) -> Result<(f64, f64, f64), NoValues> {
        if self.of.is_interrupted() {
            return Err(NoValues::Interrupted);
        }
        let (scene, _) = self.scene(family, stepping, level)?;
        let words = self.words(family, level);
        (self.watch)(&words);
        self.made += 1;
        let run = self.of.runs.run(&scene)?;
        let value = &run.values[0];
        Ok((value.value, value.largest, run.statistics.stepping_seconds))
    }

    /// Runs the next mesh of a kind of elements, and proves it if its ladder is within the wish.
    fn refine(&mut self, candidate: &mut Candidate) -> Result<Refined, AccuracyError> {
        let growth = self.growth(candidate.stepping).exp2();
        // The run itself, and what proves it.
        let next = 2.5 * candidate.seconds * growth;
        let level = candidate.values.len();
        let mesh = self.words(candidate.family, level);
        if level >= LEVELS || next > self.of.left() {
            let why = format!("{mesh} would take {} s, more than is left", Rounded::<2>(next));
            self.last_reason = format!("{why}; {}", self.last_reason);
            return Ok(Refined::GaveUp);
        }
        match self.next(candidate) {
            Ok(()) => {}
            Err(NoValues::Interrupted) => return Err(AccuracyError::Interrupted),
            Err(reason) => {
                self.last_reason = format!("{mesh}: {reason}");
                return Ok(Refined::GaveUp);
            }
        }
        let expected = self.about.quantity.order_in_space(candidate.family.order(), self.of.is_static);
        let values = &candidate.values[candidate.values.len().saturating_sub(LADDER)..];
        let wish = self.about.wish.of(candidate.largest);
        let levels = match estimate(values, expected, LadderKind::Mesh) {
            Ok(found) if found.tier != LadderTier::Scattered && found.interval <= FOR_MESH * wish => {
                if let Some(proved) = self.prove(candidate, wish)? {
                    return Ok(Refined::Proved(Box::new(proved)));
                }
                1.0
            }
            Ok(found) => {
                let (interval, unit) = (Rounded::<2>(found.interval), self.about.quantity.unit());
                self.last_reason = format!("{mesh}: the mesh is within {interval} {unit}");
                ((found.interval / (FOR_MESH * wish)).log2() / PREDICTED_ORDER).ceil().max(1.0)
            }
            Err(reason) => {
                self.last_reason = format!("{mesh}: {reason}");
                2.0
            }
        };
        candidate.predicted = candidate.seconds * growth.powf(levels);
        Ok(Refined::NotYet)
    }

    /// Proves the run on the finest mesh of a candidate, with smaller steps if these are what is missing.
    fn prove(&mut self, candidate: &mut Candidate, wish: f64) -> Result<Option<AccurateRun>, AccuracyError> {
        let level = candidate.values.len() - 1;
        loop {
            let (scene, paced) = match self.scene(candidate.family, candidate.stepping, level) {
                Ok(found) => found,
                Err(_) => return Ok(None),
            };
            let mut begun = |event| {
                if let BudgetEvent::Begun(run) = event {
                    (self.watch)(&format!("run {run} for the proof"));
                }
            };
            let quantities = std::slice::from_ref(self.about.quantity);
            let scene = self.of.runs.with_probes(scene);
            let budget = budget_of_scene(&scene, quantities, self.about.interrupt, &mut begun);
            let mut budget = budget.map_err(|error| match error {
                BudgetError::Scene(error) => AccuracyError::Scene(error.into()),
                error => AccuracyError::NotReached(error.to_string()),
            })?;
            self.made += budget.runs + 1;
            let proof = budget.quantities.remove(0);
            if proof.interval.is_some_and(|interval| interval <= wish) {
                return Ok(Some(AccurateRun {
                    family: candidate.family,
                    elements: candidate.family.words(self.of.scene.dimension),
                    cells: self.of.cells.words(self.scale(level)),
                    scheme: scene.time.integrator.method().documentation.name,
                    step: paced.map(|(_, step)| step),
                    keys: self.of.keys(candidate.family, self.scale(level), paced),
                    wish,
                    proof,
                    seconds: budget.seconds,
                    runs: self.made,
                    search_seconds: self.of.seconds(),
                }));
            }
            let interval = |part: &str| {
                let found = proof.parts.iter().find(|own| own.part == part)?;
                Some(found.estimate.as_ref()?.interval)
            };
            self.last_reason = match proof.interval {
                Some(interval) => format!(
                    "{}: the proof gives {} {}",
                    self.words(candidate.family, level),
                    Rounded::<2>(interval),
                    proof.unit
                ),
                None => {
                    let missing = proof.parts.iter().find(|part| part.estimate.is_none());
                    missing.map_or_else(String::new, |part| format!("{}: {}", part.part, part.about))
                }
            };
            // Smaller steps of the implicit scheme, if these are what is missing.
            let RunStepping::Implicit(parts) = candidate.stepping else { return Ok(None) };
            let by_step = interval("step").unwrap_or(f64::INFINITY);
            if by_step <= interval("mesh").unwrap_or(f64::INFINITY) || 4.0 * budget.seconds > self.of.left() {
                return Ok(None);
            }
            candidate.stepping = RunStepping::Implicit(2 * parts);
        }
    }
}
