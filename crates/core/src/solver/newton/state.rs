//! What one Newton solve carries from iteration to iteration, by what it decides.
//!
//! [`Convergence`] when it ends, [`MatrixPolicy`] which matrix comes next, [`Forcing`] how accurate linear
//! solves are, [`LaggedUpdates`] when lagged quantities are updated, [`KnownValue`] what need not be
//! evaluated again.

use super::{FORCING, FORCING_PART, GUARDED_ENERGY, GUARDED_FORCING};
use crate::material::Psd;
use crate::solver::conjugate_gradients::CgTolerance;
use crate::solver::iterative::CG_TOLERANCE;

/// After an indefinite exact Hessian under terms that limit steps, the exact one is tried again below
/// this fraction of the last correction.
///
/// Cloth that buckles against a body has indefinite Hessians until shortly before the minimum, and each
/// vain try costs as much as the projected one after it.
const EXACT_AGAIN: f64 = 0.2;
/// Full steps with projected Hessians after which an exact one is tried in any case, doubled after each
/// indefinite one: projected ones may converge ever more slowly.
const FIRST_WAIT: u32 = 4;
/// Corrections below this many tolerances update lagged quantities; larger ones do so only after two full
/// steps in a row.
const NEAR_END: f64 = 100.0;

/// Sizes of corrections: largest components [m].
pub(super) struct Convergence {
    /// The last correction, and the one before.
    pub(super) correction: f64,
    pub(super) before: f64,
    /// The smallest correction so far, and iterations since then.
    least: f64,
    pub(super) stagnant: u32,
}

impl Convergence {
    pub(super) const NEW: Self =
        Convergence { correction: f64::INFINITY, before: f64::INFINITY, least: f64::INFINITY, stagnant: 0 };

    /// Counts iterations without a smaller correction.
    pub(super) fn count(&mut self) {
        self.stagnant = if self.correction < self.least { 0 } else { self.stagnant + 1 };
        self.least = self.least.min(self.correction);
    }

    /// Ratio of the last two corrections; `None` without two.
    pub(super) fn shrink(&self) -> Option<f64> {
        self.before.is_finite().then(|| self.correction / self.before)
    }
}

/// Choice of the next matrix.
pub(super) struct MatrixPolicy {
    /// Treatment of element Hessians.
    pub(super) psd: Psd,
    /// True if the current matrix may be reused.
    pub(super) keep: bool,
    /// Corrections up to which exact element Hessians may be tried again [m].
    exact_below: f64,
    /// Full steps with projected Hessians until exact ones are tried in any case, and their number so far.
    wait: u32,
    waited: u32,
}

impl MatrixPolicy {
    pub(super) fn new(keep: bool) -> Self {
        MatrixPolicy { psd: Psd::Exact, keep, exact_below: f64::INFINITY, wait: 0, waited: 0 }
    }

    /// Projects element Hessians after an indefinite exact one; `guarded` says whether terms limit steps,
    /// `before` is the last correction [m].
    pub(super) fn project(&mut self, guarded: bool, before: f64) {
        self.psd = Psd::Projected;
        if guarded {
            self.exact_below = EXACT_AGAIN * before;
            (self.wait, self.waited) = (FIRST_WAIT.max(2 * self.wait), 0);
        }
    }

    /// Decides after a step, `full` if its line search did not shorten it, by its correction [m]. `near` is
    /// the correction up to which the exact Hessian is expected to be positive definite [m].
    pub(super) fn after_step(&mut self, full: bool, correction: f64, near: f64) {
        self.keep = full;
        self.waited += u32::from(full);
        let may_be_exact = correction <= self.exact_below || self.waited >= self.wait;
        if full && correction <= near && may_be_exact {
            // Near a minimum the exact Hessian is positive definite and converges quadratically.
            self.psd = Psd::Exact;
        }
    }
}

/// Accuracy of linear solves by conjugate gradients.
pub(super) struct Forcing {
    /// Relative residual required of the next solve.
    pub(super) residual: f64,
    /// True if it follows the convergence.
    pub(super) follows: bool,
    /// True if a Hessian was indefinite or a step was shortened.
    curved: bool,
    /// True if terms limit steps.
    guarded: bool,
}

impl Forcing {
    pub(super) fn new(guarded: bool) -> Self {
        Forcing { residual: CG_TOLERANCE, follows: false, curved: false, guarded }
    }

    /// Lets the residual follow the convergence. `accurate` asks for an accurate first solve.
    pub(super) fn follow(&mut self, accurate: bool) {
        self.follows = true;
        self.residual = if accurate { self.least() } else { FORCING[0] };
    }

    /// Returns the smallest relative residual required.
    pub(super) fn least(&self) -> f64 {
        if self.guarded { GUARDED_FORCING } else { CG_TOLERANCE }
    }

    /// Returns the tolerance of the next linear solve. A solve repeated because its direction failed
    /// stops on the residual alone.
    pub(super) fn tolerance(&self) -> CgTolerance {
        let last = self.guarded && self.residual == GUARDED_FORCING;
        CgTolerance { residual: self.residual, energy: if last { GUARDED_ENERGY } else { 0.0 } }
    }

    /// Sets the relative residual of the next linear solve. Corrections shrink by the linear residual or
    /// by the change of the matrix: the former need not be much smaller. Negative curvature, though, only
    /// shows in accurate solves.
    ///
    /// Under terms that limit steps, shortened steps and projected elements far from the minimum come
    /// from contact and say nothing about curvature.
    pub(super) fn set(
        &mut self,
        convergence: &Convergence,
        matrix: &MatrixPolicy,
        truncated: bool,
        negligible: f64,
    ) {
        let (guarded, least) = (self.guarded, self.least());
        self.curved |= !guarded && (matrix.psd == Psd::Projected || truncated || !matrix.keep);
        let shrink = convergence.shrink().filter(|_| matrix.keep || !guarded).unwrap_or(FORCING[0]);
        let is_last = convergence.correction * shrink.min(1.0) <= negligible && (matrix.keep || !guarded);
        self.residual = if self.curved || is_last || guarded && truncated {
            least
        } else {
            (FORCING_PART * shrink).clamp(least, FORCING[1])
        };
    }
}

/// Updates of lagged quantities along the way.
pub(super) struct LaggedUpdates {
    /// Updates left.
    pub(super) left: u32,
    /// Consecutive iterations that started with updated quantities.
    pub(super) fresh: u32,
    /// True if the last step was full.
    went_whole: bool,
    /// True if the quantities are converged to the tolerance.
    pub(super) settled: bool,
}

impl LaggedUpdates {
    pub(super) fn new(left: u32) -> Self {
        LaggedUpdates { left, fresh: 0, went_whole: false, settled: false }
    }

    /// Returns whether quantities are updated after a step; `whole` if nothing shortened it.
    ///
    /// Far from the minimum an update is wasted, as each moves the minimum and the solve starts over.
    /// Shortened steps are far from it, and so are full steps with large corrections.
    pub(super) fn renews(&mut self, whole: bool, correction: f64, negligible: f64) -> bool {
        let soon = correction <= NEAR_END * negligible || self.went_whole;
        let renews = self.left > 0 && whole && soon;
        self.went_whole = whole;
        self.left -= u32::from(renews);
        self.fresh = if renews { self.fresh + 1 } else { 0 };
        renews
    }
}

/// Objective at the iterate, as far as the line search computed it.
#[derive(Clone, Copy)]
pub(super) struct KnownValue {
    pub(super) value: Option<f64>,
    /// Part of it that does not depend on the last iterate.
    pub(super) conservative: Option<f64>,
    /// True if the objective changes in each iteration: with dissipation or non-conservative forces.
    pub(super) changes: bool,
}
