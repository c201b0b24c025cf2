//! Largest stable step by bisection, and energy drift.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::{AttemptStatus, attempt, nominal_step, with_step};
use pliant::diagnostics::StabilityLimit;
use pliant::integrator::IntegratorSpec;
use pliant::run::energy_scale;
use pliant_scene::{Scene, SceneError};

/// Number of steps in a trial of an explicit integrator: one part in 4000 above the limit the amplitude
/// of the highest frequency grows by `(1 + sqrt(8/4000))^1000 = 4e18`, from rounding to divergence.
const EXPLICIT_STEPS: u64 = 1000;
/// Number of steps in a trial of an implicit integrator.
const IMPLICIT_STEPS: u64 = 100;
/// Relative accuracy of the bisection.
const ACCURACY: f64 = 1e-3;
/// Smallest step of a search, as a fraction of the largest.
const SMALLEST: f64 = 1e-6;

/// How large a step may be.
#[derive(Clone, Debug, PartialEq, serde::Serialize, schemars::JsonSchema)]
pub struct MeasuredLimit {
    /// The scheme.
    pub integrator: String,
    /// The limit of the scene linearised at its start [s]; `None`: any step. 0: none, the scheme gains energy
    /// at any step.
    pub predicted: Option<f64>,
    /// Step at which the fastest motion doubles over the duration [s], of a scheme that gains energy at any
    /// step; else `None`.
    pub doubles_at: Option<f64>,
    /// The largest step with which all steps of a trial were taken [s]; zero where none was found.
    pub measured: f64,
    /// Failure above it; `None` where the largest step tried was fine.
    pub above: Option<AttemptStatus>,
    /// Trials.
    pub trials: u32,
    /// True if the time was over before the search ended: larger steps than `measured` may work.
    pub cut_short: bool,
}

/// Finds the largest step of `integrator` on this scene: between half and twice the predicted limit, or
/// from the scene's own step to `largest` [s] if any step is predicted to be stable.
///
/// A trial takes 1000 steps, or 100 of an implicit integrator. In a nonlinear scene larger steps cover
/// more time, and may fail for later events. The search is cut short once `stop` is set; returns `None`
/// if that happens before the prediction.
///
/// # Errors
/// The mistakes in the scene.
pub fn measure_limit(
    scene: &Scene,
    integrator: IntegratorSpec,
    largest: f64,
    stop: &Arc<AtomicBool>,
) -> Result<Option<MeasuredLimit>, SceneError> {
    let about = integrator.method().documentation;
    let own = nominal_step(scene);
    let mut found = MeasuredLimit {
        integrator: about.name.into(),
        predicted: None,
        doubles_at: None,
        measured: 0.0,
        above: None,
        trials: 0,
        cut_short: false,
    };
    let (mut low, mut high) = (own.min(0.5 * largest), largest);
    if about.stability_limit.is_finite() {
        let mut simulation = with_step(scene, integrator, own, stop)?;
        let Ok(limit) = simulation.stability_limit(scene.time.duration) else { return Ok(None) };
        (found.predicted, found.doubles_at) =
            (predicted(&limit), limit.grows_at_any_step.then_some(limit.step));
        if limit.step.is_finite() {
            (low, high) = (0.5 * limit.step, 2.0 * limit.step);
        }
    }
    let steps = if about.solves > 0 { IMPLICIT_STEPS } else { EXPLICIT_STEPS };
    let trial = |step: f64| -> Result<Option<AttemptStatus>, SceneError> {
        let status = attempt(&mut with_step(scene, integrator, step, stop)?, steps);
        // A trial that was stopped has no outcome.
        Ok((!stop.load(Ordering::Relaxed)).then_some(status))
    };
    found.cut_short = !search(&mut found, low, high, trial)?;
    Ok(Some(found))
}

/// Brackets the largest step that works between `low` and `high` [s], of which the lower end is reduced
/// until a step works, and bisects. Returns false if a trial had no outcome.
fn search(
    found: &mut MeasuredLimit,
    mut low: f64,
    mut high: f64,
    trial: impl Fn(f64) -> Result<Option<AttemptStatus>, SceneError>,
) -> Result<bool, SceneError> {
    let smallest = SMALLEST * high;
    let works = |found: &mut MeasuredLimit, step: f64| -> Result<Option<bool>, SceneError> {
        found.trials += 1;
        let Some(status) = trial(step)? else { return Ok(None) };
        match status {
            AttemptStatus::Ok => found.measured = step,
            status => found.above = Some(status),
        }
        Ok(Some(status == AttemptStatus::Ok))
    };
    loop {
        match works(found, low)? {
            None => return Ok(false),
            Some(true) => break,
            Some(false) => (high, low) = (low, 0.25 * low),
        }
        if low < smallest {
            return Ok(true);
        }
    }
    if found.above.is_none() {
        match works(found, high)? {
            None => return Ok(false),
            Some(true) => return Ok(true),
            Some(false) => {}
        }
    }
    while high - low > ACCURACY * high {
        // Geometric mean while the ends are far apart.
        let middle = if high > 2.0 * low { (low * high).sqrt() } else { 0.5 * (low + high) };
        match works(found, middle)? {
            None => return Ok(false),
            Some(true) => low = middle,
            Some(false) => high = middle,
        }
    }
    Ok(true)
}

/// Predicted limit [s]; 0 for an integrator that gains energy at any step, `None` if any step is stable.
pub(super) fn predicted(limit: &StabilityLimit) -> Option<f64> {
    if limit.grows_at_any_step { Some(0.0) } else { limit.step.is_finite().then_some(limit.step) }
}

/// How energy drifts.
#[derive(Clone, Debug, PartialEq, serde::Serialize, schemars::JsonSchema)]
pub struct Drift {
    /// The scheme.
    pub integrator: String,
    /// The step [s].
    pub step: f64,
    /// How the run ended.
    pub status: AttemptStatus,
    /// Slope of the least-squares line through the energy, less what is known to have come in and gone out,
    /// over the energy there is to compare with [1/s].
    pub per_second: f64,
    /// The largest distance of the energy from that line, over the same: what oscillates.
    pub amplitude: f64,
}

/// Measures the energy drift in steps of `step` [s] over `duration` [s]; `None` if `stop` was set
/// meanwhile.
///
/// # Errors
/// The mistakes in the scene.
pub fn energy_drift(
    scene: &Scene,
    integrator: IntegratorSpec,
    step: f64,
    duration: f64,
    stop: &Arc<AtomicBool>,
) -> Result<Option<Drift>, SceneError> {
    let mut simulation = with_step(scene, integrator, step, stop)?;
    let start = simulation.diagnostics();
    let scale = energy_scale(&mut simulation, &start);
    let steps = (duration / step).round().max(1.0) as u64;
    let every = (steps / 100).max(1);
    let (mut points, mut status) = (vec![(0.0, start.conserved())], AttemptStatus::Ok);
    let mut taken = 0;
    while taken < steps && status == AttemptStatus::Ok {
        let next = every.min(steps - taken);
        status = attempt(&mut simulation, next);
        taken += next;
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        if status == AttemptStatus::Ok {
            let now = simulation.diagnostics();
            points.push((now.time, now.conserved()));
        }
    }
    let (slope, amplitude) = line(&points);
    let name = integrator.method().documentation.name.into();
    let (per_second, amplitude) = (slope / scale, amplitude / scale);
    Ok(Some(Drift { integrator: name, step, status, per_second, amplitude }))
}

/// Slope of the least-squares line, and the largest deviation from it.
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let mean = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
    let (t, e) = (mean(|p| p.0), mean(|p| p.1));
    let spread: f64 = points.iter().map(|p| (p.0 - t) * (p.0 - t)).sum();
    if spread == 0.0 {
        return (0.0, 0.0);
    }
    let slope = points.iter().map(|p| (p.0 - t) * (p.1 - e)).sum::<f64>() / spread;
    (slope, points.iter().fold(0.0, |m: f64, p| m.max((p.1 - e - slope * (p.0 - t)).abs())))
}
