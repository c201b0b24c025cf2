//! Largest stable step of an integrator, found by running it on oscillators.

use super::modes::{DampedMode, ModeRange};
use crate::integrator::splitting::Stage;
use crate::integrator::{Method, Scheme, amplification, coupled_radius};

/// Sample intervals between two neighbouring boundary points.
const PARTS: u32 = 8;
/// A step of this many radians, or of this decay, is far below every limit.
const SMALL: f64 = 1e-4;
/// Frequency assumed for a mode without stiffness, as a fraction of its damping rate.
const SLOW: f64 = 1e-6;
/// Fractions of the boundary damping with which modes inside the boundary are sampled: damping moves
/// roots to where explicit integrators are stable in longer steps, and not all modes of a frequency have
/// it.
const LESS_DAMPED: [f64; 4] = [0.0, 0.125, 0.25, 0.5];
/// Damping that is nonzero but has no effect [1/s].
const LEAST_DAMPING: f64 = 1e-200;
/// Radians of the highest frequency per step up to which the Gauss-Radau iteration converges in all steps
/// it may take.
const GAUSS_RADAU_RADIANS: f64 = 2.0;
/// Angles of a dashpot between a stiff mode and a free one, from the free one [rad].
const ANGLES: [f64; 6] = [0.003, 0.01, 0.03, 0.1, 0.3, 1.0];
/// Largest distance of modes on a line from it, as a fraction of the largest value.
const LINE: f64 = 1e-2;
/// Rounding of the spectral radius of a neutral mode.
const ROUNDING: f64 = 1e-13;

/// Largest stable step of an integrator.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct StabilityLimit {
    /// Highest natural frequency at the start [rad/s].
    pub frequency: f64,
    /// Largest damping rate of a mode at the start [1/s]; 0 without damping.
    pub damping: f64,
    /// Largest stable step [s]; infinite if nothing oscillates.
    pub step: f64,
    /// True for methods that gain energy at any step; `step` then doubles the amplitude of the fastest
    /// mode over the duration of the run.
    pub grows_at_any_step: bool,
}

/// Finds the largest step at which `method` amplifies none of these modes under ether drag `ether_drag`
/// [1/s]. The whole range counts, not only the fastest mode: slow, strongly damped modes have a root near
/// `-c` that a fast one lacks.
pub fn stability_limit(method: &Method, modes: &ModeRange, ether_drag: f64, duration: f64) -> StabilityLimit {
    let ModeRange { frequency, damping, ref boundary } = *modes;
    let mut limit = StabilityLimit { frequency, damping, step: f64::INFINITY, grows_at_any_step: false };
    // Stable at any step without damping implies A-stability: the whole left half-plane is stable.
    if method.documentation.stability_limit == f64::INFINITY {
        return limit;
    }
    // Sample the range of modes, also with less damping than on its boundary.
    let mut trials = sampled(boundary, ether_drag);
    if damping > 0.0 && frequency > 0.0 && !is_line(modes) {
        let less = |part: f64| move |mode: &DampedMode| DampedMode { damping: part * mode.damping, ..*mode };
        let all = trials.clone();
        LESS_DAMPED.iter().for_each(|part| trials.extend(all.iter().map(less(*part))));
    }
    // The smallest limit of all samples; most need one check only.
    for mode in trials {
        let trial = SchemeTrial { method, mode, is_damped: damping > 0.0, ether_drag, duration };
        if limit.step.is_finite() && trial.is_bounded(limit.step) {
            continue;
        }
        let (step, grows) = trial.limit();
        if step < limit.step {
            (limit.step, limit.grows_at_any_step) = (step, grows);
        }
    }
    // Further limits: coupled modes under backward kicks, convergence of the Gauss-Radau iteration.
    if damping > 0.0 && frequency > 0.0 && goes_back(method) && !is_line(modes) {
        limit.step = coupled_limit(method, modes, limit.step);
    }
    let converges = GAUSS_RADAU_RADIANS / frequency;
    if matches!(method.scheme, Scheme::GaussRadau(_)) && limit.step > converges {
        (limit.step, limit.grows_at_any_step) = (converges, false);
    }
    limit
}

/// True if a method has backward kicks: their damping is negative, and the other kicks only compensate it
/// if damping commutes with the stiffness.
fn goes_back(method: &Method) -> bool {
    match method.scheme {
        Scheme::Splitting(stages) => stages.iter().any(|stage| matches!(stage, Stage::Kick(c) if *c < 0.0)),
        _ => false,
    }
}

/// True if all modes lie on a line, as with Rayleigh damping.
fn is_line(modes: &ModeRange) -> bool {
    let ModeRange { frequency, damping, ref boundary } = *modes;
    let point = |mode: &DampedMode| [mode.stiffness / (frequency * frequency), mode.damping / damping];
    let points: Vec<[f64; 2]> = boundary.iter().map(point).collect();
    let apart = |p: [f64; 2], q: [f64; 2]| (q[0] - p[0]).hypot(q[1] - p[1]);
    let Some(&first) = points.first() else { return true };
    let far = points.iter().fold(first, |far, p| if apart(first, *p) > apart(first, far) { *p } else { far });
    let length = apart(first, far);
    let area =
        |p: &[f64; 2]| (far[0] - first[0]) * (p[1] - first[1]) - (far[1] - first[1]) * (p[0] - first[0]);
    length == 0.0 || points.iter().all(|p| area(p).abs() <= LINE * length)
}

/// Finds the largest step up to `step` [s] at which the fastest mode does not grow if the strongest
/// dashpot couples it to a free one, at any angle of [`ANGLES`].
fn coupled_limit(method: &Method, modes: &ModeRange, step: f64) -> f64 {
    let bounded = |h: f64| {
        let radius = |angle: &f64| coupled_radius(method, h * modes.frequency, h * modes.damping, *angle);
        h <= step && ANGLES.iter().all(|angle| radius(angle) <= 1.0 + ROUNDING)
    };
    if bounded(step) { step } else { last_true(0.5 * step, bounded) }
}

/// Samples the modes of a boundary and between its points. Drag also acts on the slowest mode.
fn sampled(boundary: &[DampedMode], ether_drag: f64) -> Vec<DampedMode> {
    let slowest = (ether_drag > 0.0).then(DampedMode::default);
    let corners: Vec<DampedMode> = slowest.into_iter().chain(boundary.iter().copied()).collect();
    let between = |pair: &[DampedMode], part: u32| {
        let t = f64::from(part) / f64::from(PARTS);
        let mixed = |a: f64, b: f64| (1.0 - t) * a + t * b;
        DampedMode {
            stiffness: mixed(pair[0].stiffness, pair[1].stiffness),
            damping: mixed(pair[0].damping, pair[1].damping),
        }
    };
    // Corners first: they usually limit the step.
    let inner = corners.windows(2).flat_map(|pair| (1..PARTS).map(move |part| between(pair, part)));
    corners.iter().copied().chain(inner).collect()
}

/// An integrator on `x'' = -k x - (c + drag) x'`.
struct SchemeTrial<'a> {
    method: &'a Method,
    mode: DampedMode,
    /// True if other modes are damped: an integrator then treats drag as it does their damping.
    is_damped: bool,
    ether_drag: f64,
    duration: f64,
}

impl SchemeTrial<'_> {
    /// Spectral radius of a step.
    fn radius(&self, h: f64) -> f64 {
        let least = if self.is_damped { LEAST_DAMPING } else { 0.0 };
        let damping = self.mode.damping.max(least);
        amplification(self.method, h * self.frequency(), h * damping, h * self.ether_drag).spectral_radius()
    }

    fn frequency(&self) -> f64 {
        self.mode.stiffness.sqrt().max(SLOW * (self.mode.damping + self.ether_drag))
    }

    fn is_bounded(&self, h: f64) -> bool {
        self.radius(h) <= 1.0 + ROUNDING
    }

    /// Returns the largest stable step, and whether it is the doubling limit.
    fn limit(&self) -> (f64, bool) {
        let (frequency, rate) = (self.frequency(), self.mode.damping + self.ether_drag);
        if frequency == 0.0 {
            return (f64::INFINITY, false);
        }
        let small = SMALL / frequency.max(rate);
        // Without damping the growth of such a method is below rounding at small steps, but present.
        let grows = rate == 0.0 && self.method.documentation.stability_limit == 0.0;
        if !grows && self.is_bounded(small) {
            return (last_true(small, |h| self.is_bounded(h)), false);
        }
        let doubles_later = |h: f64| self.radius(h).ln() * (self.duration / h) <= std::f64::consts::LN_2;
        let mut start = small;
        while !doubles_later(start) && start > f64::MIN_POSITIVE {
            start *= 0.5;
        }
        (last_true(start, doubles_later), true)
    }
}

/// Returns the end of the interval around `start` in which `holds` is true.
fn last_true(start: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (start, start);
    while holds(high) {
        low = high;
        high *= 1.1;
        if !high.is_finite() {
            return f64::INFINITY;
        }
    }
    while high - low > 1e-15 * high {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if holds(middle) { low = middle } else { high = middle }
    }
    low
}
