//! The line search of Newton's method.

use super::Newton;
use crate::solver::conjugate_gradients::dot;
use crate::solver::{Iterate, Objective};
use crate::system::System;

/// Sufficient decrease of the line search: a fraction of what the slope promises. Nocedal, Wright 2006,
/// *Numerical optimization*, eq. 3.4.
pub(super) const ARMIJO: f64 = 1e-4;
/// Change of the objective, relative to itself, below which it says less about a step than its slope does;
/// Hager, Zhang 2005, "A
/// new conjugate gradient method with guaranteed descent and an efficient line search", eq. 4.1.
const ROUNDING: f64 = 1e-10;
/// So does a step that moves nothing by more than this part of the size of the scene: its decrease is of
/// second order in that, and an energy that is a difference of large terms, as at rest, is only known to
/// rounding of those.
const DROWNED: f64 = 1e-5;
/// The slope at the end of such a step may be uphill by this part of that at its beginning; ibid., with
/// delta = 0.1.
const FLATTER: f64 = 0.8;
/// The part where corrections have not shrunk for many iterations: forces have a kink on the way, and whole
/// steps to and fro over it would be as good for ever.
const FLAT: f64 = 0.0;
/// A step that ends with this part of the slope at its beginning has ended too early.
const DOWNHILL: f64 = 0.5;
/// Whole steps that one direction may go, a power of two.
const MOST_LENGTH: f64 = 64.0;
/// Length of the way that is looked at, over that of the last step, a power of two: the longer the way, the
/// more lies on it.
const LOOK_LENGTH: f64 = 4.0;
/// Halvings of a step before the line search gives up: the direction is then useless to rounding.
const MAX_HALVINGS: u32 = 50;

/// Values of the objective along the direction.
pub(super) struct Slope {
    /// Its value at the iterate.
    pub(super) start: f64,
    /// Its slope there, below zero.
    pub(super) slope: f64,
    /// Largest component of the direction [m].
    pub(super) correction: f64,
    /// Corrections of so much [m] are none.
    pub(super) negligible: f64,
    /// True if a step that has to be halved is none.
    pub(super) whole: bool,
    /// True if the matrix has been projected.
    pub(super) projected: bool,
    /// True if a whole step may end above its promise.
    pub(super) may_rise: bool,
    /// True if corrections have not shrunk for many iterations.
    pub(super) stagnates: bool,
}

/// A step that is as good as its slope promises, in `trial`.
pub(super) struct Accepted {
    /// The objective there.
    pub(super) value: f64,
    /// Its part there that is the same from every iterate.
    pub(super) conservative: f64,
    /// How often it was halved.
    pub(super) halvings: u32,
    /// True if the force there is finite, where the residual is that of the trial already.
    pub(super) finite: Option<bool>,
    /// True if a term that guards ways admitted less than the whole step.
    pub(super) shortened: bool,
    /// Part of the direction that it went, above one where it went on.
    pub(super) part: f64,
    /// True if it ends above that promise, and has to be watched.
    pub(super) watched: bool,
}

impl<const D: usize> Newton<D> {
    /// Goes along the direction as far as that lowers the objective; `None` where no step does.
    pub(super) fn search(
        &mut self,
        system: &mut System,
        objective: &Objective<'_>,
        at: &Iterate,
        along: &Slope,
    ) -> Option<Accepted> {
        let Slope { start, slope, correction, negligible, whole, projected, may_rise, stagnates } = *along;
        let most_uphill = if stagnates { FLAT } else { FLATTER };
        let mut step = system.max_step(&at.x, &self.direction);
        let shortened = step < 1.0 && system.has_guards();
        let mut halvings = 0;
        loop {
            self.move_along(system, objective, at, step);
            let trial = std::mem::take(&mut self.trial);
            let there = self.value(system, objective, at, &trial);
            self.trial = trial;
            let (conservative, finite, part, watched) = (self.conservative, None, step, false);
            let accepted =
                Accepted { value: there, conservative, halvings, finite, shortened, part, watched };
            if there <= start + ARMIJO * step * slope {
                let may_go_on = projected && system.has_guards() && self.follower.is_empty();
                if may_go_on && halvings == 0 && !shortened {
                    return Some(self.lengthen(system, objective, at, slope, accepted));
                }
                return Some(accepted);
            }
            // A decrease that drowns in the rounding of the objective shows in its slope.
            let drowns = (there - start).abs() <= ROUNDING * (start.abs() + there.abs())
                || there.is_finite() && step * correction <= DROWNED * self.size;
            if drowns {
                let finite = self.residual_at_trial(system, objective);
                let end = dot(&self.direction, &self.residual);
                // Downhill at the end is as good: the way to a saddle gets steeper.
                if finite && (end <= most_uphill * slope.abs() || correction <= negligible) {
                    return Some(Accepted { finite: Some(finite), ..accepted });
                }
                // The way on, or back, is from the iterate.
                self.residual(system, objective, at);
            }
            if may_rise && !drowns && there.is_finite() && step == 1.0 {
                return Some(Accepted { watched: true, ..accepted });
            }
            if whole || halvings == MAX_HALVINGS {
                return None;
            }
            halvings += 1;
            step *= 0.5;
        }
    }

    /// Goes on along a direction whose whole step ends where it is still as steep.
    ///
    /// Projected matrices know no negative curvature: where a sheet in contact begins to buckle, their steps
    /// are too short by what the projection left out. Each doubling costs an energy, an iteration costs a
    /// matrix.
    fn lengthen(
        &mut self,
        system: &mut System,
        objective: &Objective<'_>,
        at: &Iterate,
        slope: f64,
        mut accepted: Accepted,
    ) -> Accepted {
        let finite = self.residual_at_trial(system, objective);
        accepted.finite = Some(finite);
        if !finite || dot(&self.direction, &self.residual) > DOWNHILL * slope {
            return accepted;
        }
        // The residual is that of the end of the whole step, not of where the way ends.
        accepted.finite = None;
        let mut step = 1.0;
        // Free part of the way, and how far it was looked at.
        let (mut most, mut seen) = (1.0, 1.0);
        while 2.0 * step <= MOST_LENGTH {
            let longer = 2.0 * step;
            if longer > most && most == seen {
                seen = LOOK_LENGTH * step;
                most = self.longest(system, at, seen);
            }
            if longer > most {
                break;
            }
            self.move_along(system, objective, at, longer);
            let trial = std::mem::take(&mut self.trial);
            let there = self.value(system, objective, at, &trial);
            self.trial = trial;
            if there.is_nan() || there > accepted.value {
                break;
            }
            step = longer;
            accepted = Accepted { value: there, conservative: self.conservative, part: step, ..accepted };
        }
        self.move_along(system, objective, at, step);
        accepted
    }

    /// Whole steps that the direction may go, at most so many.
    fn longest(&mut self, system: &System, at: &Iterate, most: f64) -> f64 {
        self.direction.iter_mut().for_each(|d| *d *= most);
        let part = system.max_step(&at.x, &self.direction);
        self.direction.iter_mut().for_each(|d| *d /= most);
        most * part
    }
}
