//! Line search of Newton's method: backtracking with sufficient decrease, and lengthening of projected
//! steps.

use super::Newton;
use crate::solver::conjugate_gradients::dot;
use crate::solver::{Iterate, Objective};
use crate::system::System;

/// Sufficient decrease, as a fraction of the decrease predicted by the slope. Nocedal, Wright 2006,
/// *Numerical optimization*, eq. 3.4.
pub(super) const ARMIJO: f64 = 1e-4;
/// Relative change of the objective below which its slope says more about a step than its value; Hager,
/// Zhang 2005, "A new conjugate gradient method with guaranteed descent and an efficient line search",
/// eq. 4.1.
const ROUNDING: f64 = 1e-10;
/// Largest displacement, as a fraction of the scene size, of a step judged by its slope as well: its
/// decrease is of second order, and an energy that is a difference of large terms is only known to their
/// rounding.
const DROWNED: f64 = 1e-5;
/// Largest uphill slope at the end of such a step, as a fraction of the slope at its start; ibid., with
/// delta = 0.1.
const FLATTER: f64 = 0.8;
/// The same limit after many iterations without smaller corrections: forces have a kink, and full steps
/// could go back and forth over it for ever.
const FLAT: f64 = 0.0;
/// A step whose final slope is this fraction of the initial one has ended too early.
const DOWNHILL: f64 = 0.5;
/// Longest step along one direction, in full steps; a power of two.
const MOST_LENGTH: f64 = 64.0;
/// Length of the trajectory checked by the step limiter at a time, in steps taken; a power of two. A
/// longer one meets more obstacles.
const LOOK_LENGTH: f64 = 4.0;
/// Halvings before the line search fails: the direction is then useless to rounding.
const MAX_HALVINGS: u32 = 50;

/// The objective along the direction.
pub(super) struct Slope {
    /// Value at the iterate.
    pub(super) start: f64,
    /// Slope at the iterate, below zero.
    pub(super) slope: f64,
    /// Largest component of the direction [m].
    pub(super) correction: f64,
    /// Newton tolerance: corrections up to this size [m] are negligible.
    pub(super) negligible: f64,
    /// True if only a full step is accepted.
    pub(super) whole: bool,
    /// True if the matrix was projected.
    pub(super) projected: bool,
    /// True if a full step may be accepted although it does not decrease enough.
    pub(super) may_rise: bool,
    /// True if corrections have not shrunk for many iterations.
    pub(super) stagnates: bool,
}

/// An accepted step, in `trial`.
pub(super) struct Accepted {
    /// Objective at the trial.
    pub(super) value: f64,
    /// Part of it that does not depend on the last iterate.
    pub(super) conservative: f64,
    /// Number of halvings.
    pub(super) halvings: u32,
    /// True if the force there is finite; set if the residual is already that of the trial.
    pub(super) finite: Option<bool>,
    /// True if a term limited the step.
    pub(super) shortened: bool,
    /// Fraction of the direction; above one for a lengthened step.
    pub(super) part: f64,
    /// True if the step did not decrease enough and must be watched.
    pub(super) watched: bool,
}

impl<const D: usize> Newton<D> {
    /// Searches along the direction for a lower objective; `None` if no step lowers it.
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
            // Evaluate the objective at the trial.
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
            // If the decrease is below rounding, judge by the slope.
            let drowns = (there - start).abs() <= ROUNDING * (start.abs() + there.abs())
                || there.is_finite() && step * correction <= DROWNED * self.size;
            if drowns {
                let finite = self.residual_at_trial(system, objective);
                let end = dot(&self.direction, &self.residual);
                // Downhill at the end is as good: the slope steepens towards a saddle.
                if finite && (end <= most_uphill * slope.abs() || correction <= negligible) {
                    return Some(Accepted { finite: Some(finite), ..accepted });
                }
                // The next step starts from the iterate again.
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

    /// Lengthens a step whose end is still as steep as its start.
    ///
    /// Projected matrices have no negative curvature: if a sheet in contact starts to buckle, their steps
    /// are too short by what the projection removed. A doubling costs one energy, an iteration costs a
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
        // The residual is that of the full step, not of the end of the lengthened one.
        accepted.finite = None;
        let mut step = 1.0;
        // Collision-free length, and the length checked so far.
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

    /// Returns how many full steps the direction may go, at most `most`.
    fn longest(&mut self, system: &System, at: &Iterate, most: f64) -> f64 {
        self.direction.iter_mut().for_each(|d| *d *= most);
        let part = system.max_step(&at.x, &self.direction);
        self.direction.iter_mut().for_each(|d| *d /= most);
        most * part
    }
}
