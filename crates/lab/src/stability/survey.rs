//! Full stability report of a scene.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::{
    Against, AmplificationCurve, Drift, Map, MeasuredLimit, amplification_curve, energy_drift, map,
    measure_limit, nominal_step,
};
use pliant::integrator::{IntegratorSpec, Scheme};
use pliant_scene::{RefusedScheme, Scene, SceneError, Source, Time};

/// Maximum number of steps of the run for the energy drift.
const DRIFT_STEPS: f64 = 2000.0;

/// Options of a survey.
#[derive(Clone, Debug, PartialEq)]
pub struct SurveyOptions {
    /// Names of the integrators; if empty all dynamic ones, the scene's own first. The map belongs to the
    /// first.
    pub integrators: Vec<String>,
    /// Quantity of the map in addition to the step; by default that of [`Against::chosen`].
    pub against: Option<Against>,
    /// True for a coarse map.
    pub quick: bool,
}

/// Result of a survey.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct StabilitySurvey {
    /// Largest step of each integrator.
    pub limits: Vec<MeasuredLimit>,
    /// Energy drift at stable steps.
    #[serde(rename = "energy_drift")]
    pub drifts: Vec<Drift>,
    /// Stability map of the first integrator.
    pub map: Option<Map>,
    /// Amplification factors of the integrators for an oscillator.
    pub amplification: Vec<AmplificationCurve>,
    /// Integrators that do not support the scene's contact; they are not surveyed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub refused: Vec<RefusedScheme>,
    /// Number of walls of the scene, which no prediction includes.
    pub walls: usize,
    /// True if the survey was completed.
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
    #[error("there is no integrator `{wanted}` that moves things; there are {}", known.join(", "))]
    NoIntegrator {
        /// The requested name.
        wanted: String,
        /// Known names.
        known: Vec<&'static str>,
    },
    /// The scene has no motion.
    #[error(
        "a quasi-static scene has no motion that a step could make unstable: `adaptive = {{}}` in [time] \
         finds increments that can be solved; for motion add --set time.integrator=velocity-verlet"
    )]
    Static,
    /// None of the requested integrators supports the contact of the scene.
    #[error("{}", .0.iter().map(|refused| refused.reason.as_str()).collect::<Vec<_>>().join("; "))]
    Refused(Vec<RefusedScheme>),
}

impl StabilitySurvey {
    /// Surveys a scene; `watch` receives each integrator once it is done. `interrupt` ends the survey,
    /// also during a solve or a search for the highest frequency; unfinished parts are omitted.
    ///
    /// # Errors
    /// [`SurveyError`].
    /// [`SurveyError`].
    pub fn of(
        source: &Source,
        choice: &SurveyOptions,
        interrupt: &Arc<AtomicBool>,
        watch: &mut dyn FnMut(&MeasuredLimit, &Drift),
    ) -> Result<StabilitySurvey, SurveyError> {
        let stopped = || interrupt.load(Ordering::Relaxed);
        let scene = source.scene()?;
        if matches!(scene.time.integrator.method().scheme, Scheme::QuasiStatic) {
            return Err(SurveyError::Static);
        }
        let mut integrators = chosen(&choice.integrators, scene.time.integrator)?;
        let refused = |spec: &IntegratorSpec| RefusedScheme::by_contact(&scene, *spec);
        let all_refused: Vec<RefusedScheme> = integrators.iter().filter_map(refused).collect();
        integrators.retain(|spec| refused(spec).is_none());
        if integrators.is_empty() {
            return Err(SurveyError::Refused(all_refused));
        }
        let own = nominal_step(&scene);
        let largest = scene.time.duration.max(100.0 * own);
        // Contact turns walls into obstacles, and so do integrators that include walls in their solve.
        let puts_back = |spec: &IntegratorSpec| {
            let time = Time { integrator: *spec, ..scene.time.clone() };
            Scene { time, ..scene.clone() }.acting_contact().is_none()
        };
        let walls = if integrators.iter().any(puts_back) { scene.world.walls.len() } else { 0 };
        let mut found = StabilitySurvey { walls, refused: all_refused, ..StabilitySurvey::default() };
        for integrator in &integrators {
            if stopped() {
                return Ok(found);
            }
            let Some(limit) = measure_limit(&scene, *integrator, largest, interrupt)? else {
                return Ok(found);
            };
            // A stable step: the scene's own, but at most half of the measured limit.
            let step = if limit.measured > 0.0 { own.min(0.5 * limit.measured) } else { own };
            let duration = scene.time.duration.min(DRIFT_STEPS * step);
            let Some(drift) = energy_drift(&scene, *integrator, step, duration, interrupt)? else {
                return Ok(found);
            };
            watch(&limit, &drift);
            found.limits.push(limit);
            found.drifts.push(drift);
            let z: Vec<f64> = (0..=60).map(|i| 10f64.powf(-2.0 + f64::from(i) / 12.0)).collect();
            found.amplification.extend(amplification_curve(*integrator, &z));
        }
        if let Some(limit) = found.limits.first().filter(|_| !stopped()) {
            let around =
                if limit.measured > 0.0 && limit.above.is_some() { 0.9 * limit.measured } else { own };
            let against = choice.against.unwrap_or_else(|| Against::chosen(&scene));
            found.map = map(source, integrators[0], against, around, choice.quick, interrupt)?;
        }
        found.complete = !stopped();
        Ok(found)
    }
}

/// Integrators of these names; without names all dynamic ones, the scene's own first.
fn chosen(names: &[String], own: IntegratorSpec) -> Result<Vec<IntegratorSpec>, SurveyError> {
    let name = |spec: &IntegratorSpec| spec.method().documentation.name;
    let moves =
        |spec: &&IntegratorSpec| !matches!(spec.method().scheme, Scheme::QuasiStatic | Scheme::GaussRadau(_));
    let all: Vec<IntegratorSpec> = IntegratorSpec::ALL.iter().filter(moves).copied().collect();
    // With the parameters of the scene.
    let as_written = |spec: &IntegratorSpec| if name(spec) == name(&own) { own } else { *spec };
    if names.is_empty() {
        let others = all.iter().filter(|spec| name(spec) != name(&own)).copied();
        return Ok(Some(own).filter(|own| moves(&own)).into_iter().chain(others).collect());
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
