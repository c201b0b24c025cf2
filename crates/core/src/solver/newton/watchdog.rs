//! Watchdog (non-monotone) line search: full steps that raise the objective are accepted provisionally.
//!
//! In thin and nearly incompressible bodies the objective has narrow, curved valleys. Stiff directions
//! turn with the displacement, so that a full step leaves the valley to second order, and the next
//! correction leads back, much nearer to the minimum. A line search that requires decrease in every step
//! creeps along the valley instead. A few steps may therefore continue from a stored iterate. If none of
//! them ends below the decrease that the first slope promised, the search restarts from that iterate.
//! Chamberlain, Powell, Lemarechal, Pedersen 1982, "The watchdog technique for forcing convergence in
//! algorithms for constrained optimization"; Nocedal, Wright 2006, *Numerical optimization*, algorithm
//! 15.2.

use super::Newton;
use super::search::{ARMIJO, Accepted, Slope};
use super::solve::{NewtonSolve, SolveProgress};
use crate::material::Psd;
use crate::solver::{Iterate, SolveFailure};

/// Most further steps until one has to end low enough.
const MOST_STEPS: u32 = 8;
/// Largest ratio of consecutive corrections: the steps must converge.
const SHRINK: f64 = 0.7;
/// Iterations after the first return until the next watch; doubled at each return.
const FIRST_PAUSE: u32 = 4;

/// Stored iterate.
struct WatchStart {
    at: Iterate,
    /// Objective there.
    value: f64,
    /// Slope along the first step.
    slope: f64,
    /// Largest component of the last step [m].
    correction: f64,
    /// True if the matrix was a reused one: another may do better.
    old_matrix: bool,
    /// Steps left.
    left: u32,
}

/// Watchdog of one solve.
pub(super) struct Watchdog {
    watch: Option<WatchStart>,
    /// Iterations until the next watch may begin.
    pause: u32,
    /// Iterations that the next return pauses for.
    next_pause: u32,
}

impl Watchdog {
    pub(super) fn new() -> Self {
        Watchdog { watch: None, pause: 0, next_pause: FIRST_PAUSE }
    }

    /// True while steps are watched.
    pub(super) fn is_watching(&self) -> bool {
        self.watch.is_some()
    }

    /// True if a step may raise the objective; call once per iteration.
    pub(super) fn may_begin(&mut self) -> bool {
        self.pause = self.pause.saturating_sub(1);
        self.pause == 0 && self.watch.is_none()
    }

    /// Starts a watch with a step from `from` that did not decrease enough.
    pub(super) fn begin(&mut self, from: &Iterate, along: &Slope, old_matrix: bool) {
        let &Slope { start: value, slope, correction, .. } = along;
        self.watch =
            Some(WatchStart { at: from.clone(), value, slope, correction, old_matrix, left: MOST_STEPS });
    }
}

impl<const D: usize> Newton<D> {
    /// Takes a full watched step; `None` if the watch has to end with a return.
    pub(super) fn step_watched(&mut self, solve: &mut NewtonSolve<'_>) -> Option<Accepted> {
        let watch = solve.watchdog.watch.as_mut()?;
        watch.left = watch.left.checked_sub(1)?;
        let shrinks = solve.convergence.correction <= SHRINK * watch.correction;
        watch.correction = solve.convergence.correction;
        if solve.matrix.psd != Psd::Exact
            || !shrinks
            || solve.system.max_step(&solve.at.x, &self.direction) < 1.0
        {
            return None;
        }
        self.move_along(solve.system, solve.objective, solve.at, 1.0);
        let trial = std::mem::take(&mut self.trial);
        let value = self.value(solve.system, solve.objective, &watch.at, &trial);
        self.trial = trial;
        if !value.is_finite() {
            return None;
        }
        if value <= watch.value + ARMIJO * watch.slope {
            solve.watchdog.watch = None;
        }
        let conservative = self.conservative;
        let (halvings, shortened) = (0, false);
        Some(Accepted { value, conservative, halvings, finite: None, shortened, part: 1.0, watched: false })
    }

    /// Returns to the stored iterate and continues there.
    pub(super) fn go_back(&mut self, solve: &mut NewtonSolve<'_>) -> Result<SolveProgress, SolveFailure> {
        let Watchdog { watch, pause, next_pause } = &mut solve.watchdog;
        let Some(watch) = watch.take() else { return Ok(SolveProgress::Continues) };
        if !watch.old_matrix {
            *pause = *next_pause;
            *next_pause *= 2;
        }
        *solve.at = watch.at;
        self.stepped_from = false;
        solve.start_anew(Some(watch.value));
        if self.residual(solve.system, solve.objective, solve.at) {
            Ok(SolveProgress::Continues)
        } else {
            Err(SolveFailure::Infeasible)
        }
    }
}
