//! Full stability report of a scene.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::{
    Against, AmplificationCurve, Drift, Map, MeasuredLimit, amplification_curve, energy_drift, map,
    measure_limit, nominal_step,
};
use pliant::deadline::until;
use pliant::integrator::{IntegratorSpec, Scheme};
use pliant_scene::{RefusedScheme, Scene, SceneError, Source, Time};

/// Maximum number of steps of the run for the energy drift.
const DRIFT_STEPS: f64 = 2000.0;
/// Part of the budget that the first integrator may take.
const FIRST_PART: f64 = 0.5;
/// Maximum time of a later integrator, as a multiple of its share of the remaining time.
const GREED: f64 = 2.0;
/// Share of the map, in those of an integrator.
const MAP_SHARES: usize = 4;

/// Options of a survey.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurveyOptions {
    /// Names of the integrators; if empty all dynamic ones, the scene's own first. The map belongs to the
    /// first.
    pub integrators: Vec<String>,
    /// Quantity of the map in addition to the step; by default that of [`Against::chosen`].
    pub against: Option<Against>,
    /// True for a coarse map.
    pub quick: bool,
    /// True to omit the map, which takes most of the time.
    pub without_map: bool,
    /// Wall time [s]; half of it for the first integrator at most. `None` for no limit.
    pub budget: Option<f64>,
}

/// Result of a survey.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct StabilitySurvey {
    /// Integrator of the scene.
    pub own_integrator: &'static str,
    /// Step of the scene [s]; `None` with adaptive step sizes.
    pub own_step: Option<f64>,
    /// Largest step of each integrator.
    pub limits: Vec<MeasuredLimit>,
    /// Energy drift at stable steps; an integrator has none if the time was over.
    #[serde(rename = "energy_drift")]
    pub drifts: Vec<Drift>,
    /// Stability map of the first integrator.
    pub map: Option<Map>,
    /// Amplification factors of the integrators for an oscillator.
    pub amplification: Vec<AmplificationCurve>,
    /// Integrators that do not support the scene's contact; they are not surveyed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub refused: Vec<RefusedScheme>,
    /// Integrators without a limit, or `map`, because the time was over.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_reached: Vec<String>,
    /// Number of walls of the scene, which no prediction includes.
    pub walls: usize,
    /// False if the survey was interrupted.
    #[serde(skip)]
    pub complete: bool,
}

/// Error of a survey.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SurveyError {
    /// The mistakes in the scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// An unknown integrator.
    #[error("there is no dynamic integrator `{wanted}`; there are {}", known.join(", "))]
    NoIntegrator {
        /// The requested name.
        wanted: String,
        /// Known names.
        known: Vec<&'static str>,
    },
    /// The scene has no motion.
    #[error(
        "a quasi-static scene has no step that could be unstable: {remedy} to survey its motion, or write \
         `adaptive = {{}}` in [time] for load steps"
    )]
    Static {
        /// Change that gives the scene motion.
        remedy: String,
    },
    /// None of the requested integrators supports the contact of the scene.
    #[error("{}", .0.iter().map(|refused| refused.reason.as_str()).collect::<Vec<_>>().join("; "))]
    Refused(Vec<RefusedScheme>),
}

impl StabilitySurvey {
    /// Surveys a scene; `watch` receives the survey so far after each integrator. `interrupt` ends the
    /// survey, also during a solve or a search for the highest frequency; unfinished parts are omitted.
    ///
    /// # Errors
    /// [`SurveyError`].
    pub fn of(
        source: &Source,
        choice: &SurveyOptions,
        interrupt: &Arc<AtomicBool>,
        watch: &mut dyn FnMut(&StabilitySurvey),
    ) -> Result<StabilitySurvey, SurveyError> {
        let scene = source.scene()?;
        if matches!(scene.time.integrator.method().scheme, Scheme::QuasiStatic) {
            return Err(SurveyError::Static { remedy: to_motion(source) });
        }
        let mut integrators = chosen(&choice.integrators, scene.time.integrator)?;
        let refused = |spec: &IntegratorSpec| RefusedScheme::by_contact(&scene, *spec);
        let all_refused: Vec<RefusedScheme> = integrators.iter().filter_map(refused).collect();
        integrators.retain(|spec| refused(spec).is_none());
        let Some(first) = integrators.first().copied() else {
            return Err(SurveyError::Refused(all_refused));
        };
        // Contact turns walls into obstacles, and so do integrators that include walls in their solve.
        let puts_back = |spec: &IntegratorSpec| {
            let time = Time { integrator: *spec, ..scene.time.clone() };
            Scene { time, ..scene.clone() }.acting_contact().is_none()
        };
        let walls = if integrators.iter().any(puts_back) { scene.world.walls.len() } else { 0 };
        let mut found = StabilitySurvey {
            own_integrator: scene.time.integrator.method().documentation.name,
            own_step: scene.time.adaptive.is_none().then(|| nominal_step(&scene)),
            walls,
            refused: all_refused,
            ..StabilitySurvey::default()
        };
        // Each integrator has its share of the remaining time, and so has the map after all of them.
        let clock = SurveyClock { start: Instant::now(), budget: choice.budget, interrupt };
        let map_shares = if choice.without_map { 0 } else { MAP_SHARES };
        for (i, integrator) in integrators.iter().enumerate() {
            let part = match i {
                0 => FIRST_PART,
                _ => GREED / (integrators.len() - i + map_shares) as f64,
            };
            clock.run(part, |stop| found.add(&scene, *integrator, stop))?;
            if clock.is_interrupted() {
                return Ok(found);
            }
            watch(&found);
        }
        if !choice.without_map {
            let own = nominal_step(&scene);
            let limit = found.limits.first().filter(|limit| limit.measured > 0.0 && limit.above.is_some());
            let around = limit.map_or(own, |limit| 0.9 * limit.measured);
            let against = choice.against.unwrap_or_else(|| Against::chosen(&scene));
            found.map = clock.run(1.0, |stop| map(source, first, against, around, choice.quick, stop))?;
            found.not_reached.extend(found.map.is_none().then(|| "map".to_owned()));
        }
        found.complete = !clock.is_interrupted();
        Ok(found)
    }

    /// Adds the limit, the energy drift and the amplification of an integrator, as far as there is time.
    fn add(
        &mut self,
        scene: &Scene,
        integrator: IntegratorSpec,
        stop: &Arc<AtomicBool>,
    ) -> Result<(), SceneError> {
        let own = nominal_step(scene);
        let largest = scene.time.duration.max(100.0 * own);
        let is_over = stop.load(Ordering::Relaxed);
        let limit = if is_over { None } else { measure_limit(scene, integrator, largest, stop)? };
        let Some(limit) = limit else {
            self.not_reached.push(integrator.method().documentation.name.into());
            return Ok(());
        };
        // A stable step: the scene's own, but at most half of the measured limit.
        let step = if limit.measured > 0.0 { own.min(0.5 * limit.measured) } else { own };
        let duration = scene.time.duration.min(DRIFT_STEPS * step);
        self.limits.push(limit);
        self.drifts.extend(energy_drift(scene, integrator, step, duration, stop)?);
        let z: Vec<f64> = (0..=60).map(|i| 10f64.powf(-2.0 + f64::from(i) / 12.0)).collect();
        self.amplification.extend(amplification_curve(integrator, &z));
        Ok(())
    }

    /// Energy drift of an integrator, if there was time for it.
    pub fn drift_of(&self, integrator: &str) -> Option<&Drift> {
        self.drifts.iter().find(|drift| drift.integrator == integrator)
    }
}

/// Change that gives a quasi-static scene motion: an integrator that accepts its other keys.
fn to_motion(source: &Source) -> String {
    use IntegratorSpec::{ImplicitEuler, TrBdf2, VelocityVerlet};
    let names = [VelocityVerlet, ImplicitEuler, TrBdf2].map(|spec| spec.method().documentation.name);
    let accepts = |name: &&&str| {
        let change = [("time.integrator".to_owned(), format!("{name:?}"))];
        source.varied(&change).and_then(|varied| varied.scene()).is_ok()
    };
    match names.iter().find(accepts) {
        Some(name) => format!("add `--set time.integrator={name}`"),
        None => "remove `arc_length` from [time] and choose a dynamic integrator".into(),
    }
}

/// Time that is left.
struct SurveyClock<'a> {
    start: Instant,
    budget: Option<f64>,
    interrupt: &'a Arc<AtomicBool>,
}

impl SurveyClock<'_> {
    fn is_interrupted(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed)
    }

    /// Runs `work` with a flag that is set after this part of the remaining time, and by an interrupt.
    fn run<T>(&self, part: f64, work: impl FnOnce(&Arc<AtomicBool>) -> T) -> T {
        let Some(budget) = self.budget else { return work(self.interrupt) };
        let left = (budget - self.start.elapsed().as_secs_f64()).max(0.0);
        let end = Instant::now() + Duration::from_secs_f64(part.min(1.0) * left);
        until(|| self.is_interrupted() || Instant::now() >= end, work)
    }
}

/// Integrators of these names; without names all dynamic ones, the scene's own first if it is one.
fn chosen(names: &[String], own: IntegratorSpec) -> Result<Vec<IntegratorSpec>, SurveyError> {
    let name = |spec: &IntegratorSpec| spec.method().documentation.name;
    let moves =
        |spec: &&IntegratorSpec| !matches!(spec.method().scheme, Scheme::QuasiStatic | Scheme::GaussRadau(_));
    let all: Vec<IntegratorSpec> = IntegratorSpec::ALL.iter().filter(moves).copied().collect();
    // With the parameters of the scene.
    let as_written = |spec: &IntegratorSpec| if name(spec) == name(&own) { own } else { *spec };
    if names.is_empty() {
        // In place of an integrator that chooses its steps itself.
        let first = if moves(&&own) { own } else { IntegratorSpec::VelocityVerlet };
        let others = all.iter().filter(|spec| name(spec) != name(&first)).copied();
        return Ok(std::iter::once(first).chain(others).collect());
    }
    let find = |wanted: &String| {
        let found = all.iter().find(|spec| name(spec) == wanted.as_str()).map(as_written);
        found.ok_or_else(|| SurveyError::NoIntegrator {
            wanted: wanted.clone(),
            known: all.iter().map(name).collect(),
        })
    };
    names.iter().map(find).collect()
}
