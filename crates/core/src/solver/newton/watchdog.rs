//! Whole steps that raise the objective at first: watched, and taken back where they lead nowhere.
//!
//! In thin and in nearly incompressible bodies the objective has narrow, curved valleys: stiff directions
//! turn with the displacement, a whole step leaves the valley by what it is long squared, and the next
//! correction leads back to it, much nearer to the minimum. A line search that asks every step for decrease
//! creeps along the valley instead. A few steps may therefore go on from a place that is kept; if none of
//! them ends below what the first one's slope promised there, the search begins anew from that place.
//! Chamberlain, Powell, Lemarechal, Pedersen 1982, "The watchdog technique for forcing convergence in
//! algorithms for constrained optimization"; Nocedal, Wright 2006, *Numerical optimization*, algorithm 15.2.

use super::Newton;
use super::search::{ARMIJO, Accepted, Slope};
use super::solve::{NewtonSolve, SolveProgress};
use crate::material::Psd;
use crate::solver::{Iterate, SolveFailure};

/// Steps that may follow the first until one has to end low enough.
const MOST_STEPS: u32 = 8;
/// Each has to be at most this part of the one before: they lead to a minimum.
const SHRINK: f64 = 0.7;
/// Iterations after the first return until the next watch; they double with every return.
const FIRST_PAUSE: u32 = 4;

/// A place to return to.
struct WatchStart {
    at: Iterate,
    /// The objective there.
    value: f64,
    /// Its slope along the first step.
    slope: f64,
    /// Largest component of the last step [m].
    correction: f64,
    /// True if the matrix was one of before: another may do better.
    old_matrix: bool,
    /// Steps that may still come.
    left: u32,
}

/// The watch of one solve.
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

    /// True if a step may raise the objective; called once an iteration.
    pub(super) fn may_begin(&mut self) -> bool {
        self.pause = self.pause.saturating_sub(1);
        self.pause == 0 && self.watch.is_none()
    }

    /// Begins with a step that ended above its promise; `from` is where it began.
    pub(super) fn begin(&mut self, from: &Iterate, along: &Slope, old_matrix: bool) {
        let &Slope { start: value, slope, correction, .. } = along;
        self.watch =
            Some(WatchStart { at: from.clone(), value, slope, correction, old_matrix, left: MOST_STEPS });
    }
}

impl<const D: usize> Newton<D> {
    /// Takes a whole step of a watch; `None` where the watch has to end with a return.
    pub(super) fn step_watched(&mut self, solve: &mut NewtonSolve<'_>) -> Option<Accepted> {
        let watch = solve.watchdog.watch.as_mut()?;
        watch.left = watch.left.checked_sub(1)?;
        let shrinks = solve.correction <= SHRINK * watch.correction;
        watch.correction = solve.correction;
        if solve.psd != Psd::Exact || !shrinks || solve.system.max_step(&solve.at.x, &self.direction) < 1.0 {
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

    /// Goes back to the place that a watch kept, and on from there.
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
