//! Adaptive step size control.
//!
//! A step whose estimated error exceeds the tolerance is rejected and retried with a smaller size. A PI
//! controller derives the next size from the errors of the last two steps; Gustafsson's, as in Hairer,
//! Wanner 1996, *Solving Ordinary Differential Equations II*, section IV.2:
//!
//! ```text
//! h_(n+1) = h_n * 0.9 err_n^(-0.7/k) err_(n-1)^(0.4/k)
//! ```
//!
//! `err` is the norm of the estimate relative to the [`Tolerances`], `k` the power of the step with which
//! the estimate grows. After a rejected step, `h_(n+1) = h_n * 0.9 err^(-1/k)`.
//!
//! Static increments have no error in time; their size depends on the cost of their solves: see
//! [`increments`].

pub mod increments;

use crate::integrator::Method;
use crate::integrator::estimate::{Judgement, Tolerances};
use increments::{IncrementPace, Increments};

/// Safety factor: target step as a fraction of the largest allowed one.
const SAFETY: f64 = 0.9;
/// Exponents of the controller, in units of `1/k`: for the last error, and for the one before.
const LAST: f64 = 0.7;
const BEFORE: f64 = 0.4;
/// Smaller errors count as this one, so that an easy step does not make the next one too large.
const EASY: f64 = 1e-4;
/// Largest and smallest ratio of consecutive step sizes.
const LARGEST_FACTOR: f64 = 5.0;
const SMALLEST_FACTOR: f64 = 0.2;
/// Step reduction after a failure without an error estimate.
const AFTER_FAILURE: f64 = 0.25;
/// Smallest growth factor for which an implicit step is worth a new factorisation.
const WORTH_A_FACTORISATION: f64 = 1.2;
/// Largest stretch of a step to end at a given time; its error stays within the tolerance, as
/// `1.1 SAFETY < 1`.
const STRETCH: f64 = 1.1;
/// Largest error scale factor of a step cut short.
const LARGEST_SCALE: f64 = 1e8;
/// A method with its own criterion rejects a step larger than its own choice by more than the inverse of
/// this factor, and grows by at most the inverse; Rein, Spiegel 2015, section 3.4.
const OWN_CRITERION: f64 = 0.25;
/// Smallest step in units in the last place of the time.
const LEAST_ULPS: f64 = 16.0;

/// Options of adaptive step size control.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct StepControl {
    /// Error tolerances of a step; for methods with their own criterion, those of the first step only.
    /// Not used in statics.
    pub tolerances: Tolerances,
    /// First step to try [s]; `None`: the algorithm of Hairer, Norsett, Wanner 1993, section II.4.
    pub first: Option<f64>,
    /// Smallest step size [s]; a run that needs smaller steps ends.
    pub smallest: f64,
    /// Largest step size [s].
    pub largest: f64,
}

/// Adaptive step size controller.
#[derive(Clone, Debug)]
pub(crate) struct Controller {
    pub(crate) control: StepControl,
    /// Size to try next [s].
    next: f64,
    /// Error of the last step; `None` at the start and after a rejected step.
    last: Option<f64>,
    /// True if the last attempt was rejected.
    taken_back: bool,
    /// Power `k` of the step with which the estimate grows.
    exponent: f64,
    is_implicit: bool,
    /// Rejected steps.
    pub(crate) rejected: u64,
    /// Increments so far, in statics.
    increments: Option<IncrementPace>,
}

/// State of a [`Controller`].
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct StepHistory {
    next: f64,
    last: Option<f64>,
    taken_back: bool,
    rejected: u64,
    #[serde(default)]
    increments: Option<IncrementPace>,
}

impl Controller {
    /// Returns the state of the controller.
    pub(crate) fn pace(&self) -> StepHistory {
        let Controller { next, last, taken_back, rejected, increments, .. } = *self;
        StepHistory { next, last, taken_back, rejected, increments }
    }

    /// Restores the state of a controller of the same method.
    pub(crate) fn resume(&mut self, pace: StepHistory) {
        let StepHistory { next, last, taken_back, rejected, increments } = pace;
        self.next = next.min(self.control.largest);
        (self.last, self.taken_back, self.rejected) = (last, taken_back, rejected);
        if self.increments.is_some() {
            self.increments = Some(increments.unwrap_or_default());
        }
    }

    /// Returns the static increments so far.
    pub(crate) fn increments(&self) -> Option<Increments> {
        self.increments.map(|pace| pace.counts(self.rejected))
    }

    /// Creates a controller for `method` that starts with steps of `first` [s].
    ///
    /// # Panics
    /// If the method has no error estimate and is not static.
    pub(crate) fn new(control: StepControl, method: &Method, first: f64) -> Self {
        let is_static = method.is_static();
        let exponent = if is_static { Some(1) } else { method.error_exponent() };
        let exponent = exponent.expect("the scheme estimates its error");
        Controller {
            control,
            next: first.min(control.largest),
            last: None,
            taken_back: false,
            exponent: f64::from(exponent),
            is_implicit: method.documentation.solves > 0,
            rejected: 0,
            increments: is_static.then(IncrementPace::default),
        }
    }

    /// Returns the size to try next [s], without a time to end at.
    pub(crate) fn next(&self) -> f64 {
        self.next
    }

    /// Returns the size to try [s] if a step must end `remaining` [s] from now: all of it, or half of it,
    /// so that the last step is never tiny.
    pub(crate) fn plan(&self, remaining: f64) -> f64 {
        if remaining <= STRETCH * self.next {
            remaining
        } else if remaining < 2.0 * self.next {
            0.5 * remaining
        } else {
            self.next
        }
    }

    /// Returns the smallest sensible step at `time` [s]; above 0, so that repeated rejection ends.
    pub(crate) fn floor(&self, time: f64) -> f64 {
        self.control.smallest.max(LEAST_ULPS * f64::EPSILON * time.abs()).max(f64::MIN_POSITIVE)
    }

    /// True if a step of `h` [s] is accepted.
    pub(crate) fn admits(&self, h: f64, judgement: Judgement) -> bool {
        match judgement {
            // NaN counts as too large.
            Judgement::Error(error) => error <= 1.0,
            Judgement::Step(wanted) => wanted >= OWN_CRITERION * h,
            Judgement::Matrices(_) => true,
        }
    }

    /// Records an accepted step of `h` [s].
    pub(crate) fn accept(&mut self, h: f64, judgement: Judgement) {
        if let Some(pace) = &mut self.increments {
            let matrices = if let Judgement::Matrices(matrices) = judgement { matrices } else { 0 };
            self.next = pace.accept(h, self.next, matrices).min(self.control.largest);
            return;
        }
        let wanted = match judgement {
            Judgement::Error(error) => {
                // A step cut short to end at a given time predicts the error of the full step, unless it
                // is all rounding.
                let times = (self.next / h).max(1.0);
                let scale = libm::pow(times, self.exponent);
                if scale > LARGEST_SCALE {
                    self.next.max(h * self.factor(error))
                } else {
                    let (whole, error) = (times * h, scale * error);
                    let wanted = whole * self.factor(error);
                    self.last = Some(error.max(EASY));
                    wanted
                }
            }
            Judgement::Step(wanted) => wanted.min(h / OWN_CRITERION),
            Judgement::Matrices(_) => self.next,
        };
        self.taken_back = false;
        let keeps = self.is_implicit && wanted > self.next && wanted < WORTH_A_FACTORISATION * self.next;
        if !keeps {
            self.next = wanted.min(self.control.largest);
        }
    }

    /// Returns the growth factor of the next step after a step with this error.
    fn factor(&self, error: f64) -> f64 {
        let error = error.max(EASY);
        let factor = match self.last {
            Some(before) => {
                let (last, before) =
                    (libm::pow(error, -LAST / self.exponent), libm::pow(before, BEFORE / self.exponent));
                SAFETY * last * before
            }
            None => SAFETY * libm::pow(error, -1.0 / self.exponent),
        };
        // After a rejection the step does not grow at once.
        let most = if self.taken_back { 1.0 } else { LARGEST_FACTOR };
        factor.clamp(SMALLEST_FACTOR, most)
    }

    /// Records a rejected step of `h` [s]; `None` for a failed one.
    pub(crate) fn reject(&mut self, h: f64, judgement: Option<Judgement>) {
        self.rejected += 1;
        (self.last, self.taken_back) = (None, true);
        if let Some(pace) = &mut self.increments {
            pace.reject();
        }
        let factor = match judgement {
            Some(Judgement::Error(error)) if error.is_finite() && error > 1.0 => {
                (SAFETY * libm::pow(error, -1.0 / self.exponent)).clamp(SMALLEST_FACTOR, SAFETY)
            }
            Some(Judgement::Step(wanted)) if wanted > 0.0 && wanted < OWN_CRITERION * h => wanted / h,
            _ => AFTER_FAILURE,
        };
        self.next = factor * h;
    }
}
