//! Step sizes that follow the error.
//!
//! A step whose estimated error is more than allowed is taken back and tried again with a smaller size; the
//! size of the next one follows from the errors of the last two by a PI controller, Gustafsson's as in
//! Hairer, Wanner 1996, *Solving Ordinary Differential Equations II*, section IV.2:
//!
//! ```text
//! h_(n+1) = h_n * 0.9 err_n^(-0.7/k) err_(n-1)^(0.4/k)
//! ```
//!
//! `err` is the norm of the estimate, 1 what is allowed ([`Tolerances`]), `k` the power of the
//! step that the estimate grows with. After a step that was taken back, `h_(n+1) = h_n * 0.9 err^(-1/k)`.
//!
//! Increments of statics have no error in time, and follow the effort of their solves: see [`increments`].

pub mod increments;

use crate::integrator::Method;
use crate::integrator::estimate::{Judgement, Tolerances};
use increments::{IncrementPace, Increments};

/// Aim, as a part of the step that would just be allowed.
const SAFETY: f64 = 0.9;
/// Exponents of the controller, in units of `1/k`: of the last error, and of the one before.
const LAST: f64 = 0.7;
const BEFORE: f64 = 0.4;
/// Errors below this are taken for it: the next step is not to be bold because a step was easy.
const EASY: f64 = 1e-4;
/// A step may be so many times as large as the one before, or as small.
const LARGEST_FACTOR: f64 = 5.0;
const SMALLEST_FACTOR: f64 = 0.2;
/// The size of another try, where it is not known how wrong the last one was.
const AFTER_FAILURE: f64 = 0.25;
/// A larger step of an implicit scheme is not worth a new factorisation below this.
const WORTH_A_FACTORISATION: f64 = 1.2;
/// A step may be stretched by so much to land on a time: its error stays allowed, for `1.1 SAFETY < 1`.
const STRETCH: f64 = 1.1;
/// The error of a step cut short is scaled up by at most so much.
const LARGEST_SCALE: f64 = 1e8;
/// A scheme with a criterion of its own repeats a step that it would have taken at less than this part, and
/// grows by no more than the inverse; Rein, Spiegel 2015, section 3.4.
const OWN_CRITERION: f64 = 0.25;
/// Steps of fewer units in the last place of the time than this do not advance it as they should.
const LEAST_ULPS: f64 = 16.0;

/// How step sizes follow the error.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct StepControl {
    /// The errors that a step may make; where a scheme has a criterion of its own, those that the first step
    /// goes by. Statics has none.
    pub tolerances: Tolerances,
    /// The first step to try [s]; `None`: by the algorithm of Hairer, Norsett, Wanner 1993, section II.4.
    pub first: Option<f64>,
    /// A run that needs smaller steps [s] than this ends.
    pub smallest: f64,
    /// No step is larger [s].
    pub largest: f64,
}

/// Chooses step sizes.
#[derive(Clone, Debug)]
pub(crate) struct Controller {
    pub(crate) control: StepControl,
    /// The size that is to be tried next [s].
    next: f64,
    /// Error of the last step taken; `None` at the start, and after a step that was taken back.
    last: Option<f64>,
    /// True if the last try was taken back.
    taken_back: bool,
    /// `k`.
    exponent: f64,
    is_implicit: bool,
    /// Steps that were taken back.
    pub(crate) rejected: u64,
    /// Increments so far, in statics.
    increments: Option<IncrementPace>,
}

/// Memory of a [`Controller`].
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
    /// Its memory so far.
    pub(crate) fn pace(&self) -> StepHistory {
        let Controller { next, last, taken_back, rejected, increments, .. } = *self;
        StepHistory { next, last, taken_back, rejected, increments }
    }

    /// Goes on from what one of the same scheme has learnt.
    pub(crate) fn resume(&mut self, pace: StepHistory) {
        let StepHistory { next, last, taken_back, rejected, increments } = pace;
        self.next = next.min(self.control.largest);
        (self.last, self.taken_back, self.rejected) = (last, taken_back, rejected);
        if self.increments.is_some() {
            self.increments = Some(increments.unwrap_or_default());
        }
    }

    /// Increments of statics so far.
    pub(crate) fn increments(&self) -> Option<Increments> {
        self.increments.map(|pace| pace.counts(self.rejected))
    }

    /// A controller for `method` that begins with steps of `first` [s].
    ///
    /// # Panics
    /// If the method has no estimate of its error, and is not static.
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

    /// The size that is to be tried next [s], were there no time to land on.
    pub(crate) fn next(&self) -> f64 {
        self.next
    }

    /// The size to try [s] where a time `remaining` [s] away is to be landed on: all of it, or half of it,
    /// so that the last step is never a tiny one.
    pub(crate) fn plan(&self, remaining: f64) -> f64 {
        if remaining <= STRETCH * self.next {
            remaining
        } else if remaining < 2.0 * self.next {
            0.5 * remaining
        } else {
            self.next
        }
    }

    /// The smallest step that makes sense at `time` [s]; above 0, so that steps that are taken back again and
    /// again come to an end.
    pub(crate) fn floor(&self, time: f64) -> f64 {
        self.control.smallest.max(LEAST_ULPS * f64::EPSILON * time.abs()).max(f64::MIN_POSITIVE)
    }

    /// True if a step of `h` [s] may stand.
    pub(crate) fn admits(&self, h: f64, judgement: Judgement) -> bool {
        match judgement {
            // Not a number is too large.
            Judgement::Error(error) => error <= 1.0,
            Judgement::Step(wanted) => wanted >= OWN_CRITERION * h,
            Judgement::Matrices(_) => true,
        }
    }

    /// A step of `h` [s] stands.
    pub(crate) fn accept(&mut self, h: f64, judgement: Judgement) {
        if let Some(pace) = &mut self.increments {
            let matrices = if let Judgement::Matrices(matrices) = judgement { matrices } else { 0 };
            self.next = pace.accept(h, self.next, matrices).min(self.control.largest);
            return;
        }
        let wanted = match judgement {
            Judgement::Error(error) => {
                // A step that was cut short to land on a time says what the error of the whole one would
                // have been, unless rounding is all that there is to see.
                let times = (self.next / h).max(1.0);
                let scale = times.powf(self.exponent);
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

    /// By how much the next step may be larger than one with this error.
    fn factor(&self, error: f64) -> f64 {
        let error = error.max(EASY);
        let factor = match self.last {
            Some(before) => SAFETY * error.powf(-LAST / self.exponent) * before.powf(BEFORE / self.exponent),
            None => SAFETY * error.powf(-1.0 / self.exponent),
        };
        // After a step was taken back, the size that was found is not left at once.
        let most = if self.taken_back { 1.0 } else { LARGEST_FACTOR };
        factor.clamp(SMALLEST_FACTOR, most)
    }

    /// A step of `h` [s] was taken back, or could not be taken at all: `None`.
    pub(crate) fn reject(&mut self, h: f64, judgement: Option<Judgement>) {
        self.rejected += 1;
        (self.last, self.taken_back) = (None, true);
        if let Some(pace) = &mut self.increments {
            pace.reject();
        }
        let factor = match judgement {
            Some(Judgement::Error(error)) if error.is_finite() && error > 1.0 => {
                (SAFETY * error.powf(-1.0 / self.exponent)).clamp(SMALLEST_FACTOR, SAFETY)
            }
            Some(Judgement::Step(wanted)) if wanted > 0.0 && wanted < OWN_CRITERION * h => wanted / h,
            _ => AFTER_FAILURE,
        };
        self.next = factor * h;
    }
}
