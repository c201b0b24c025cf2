//! Continuous collision detection (CCD): the fraction of a straight motion before a pair comes too near.
//!
//! Additive advancement (Li et al. 2021, *Codimensional incremental potential contact*, ACM Transactions
//! on Graphics 40(4), algorithm 1) along the separating normal. Both primitives are convex: for any
//! direction `n` they do not touch while `n . (x_i - x_j)` stays positive for all vertices `i` of the
//! first and `j` of the second. These products are linear in time. The first time at which one of them
//! falls to the target is safe; from there the closest points give a new direction. The loop may stop at
//! any time, because the time reached so far is safe.

use crate::closest::Primitives;
use crate::pair::relative;
use crate::vector::{along, difference, dot, inverse_or_zero, scaled, smaller};
use pliant::scalar::{Mask, Scalar};

/// Limit on the closest-point evaluations of one search.
pub const MAX_EVALUATIONS: usize = 100;

/// Fraction of the initial gap, or of the activation distance, that a step leaves.
const GAP_LEFT: f64 = 0.1;

/// Bound of the rounding of distances, in units of `extent + motion`: 32 units in the last place.
const ROUNDING: f64 = 32.0 * 0.5 * f64::EPSILON;

/// Parameters of the gap that a step must leave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GapLimit {
    /// `dhat`: a tenth of the activation distance is enough for pairs that are far apart [m].
    pub reach: f64,
    /// `xi`: sum of the radii [m].
    pub offset: f64,
}

/// Collision-free fraction of a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafeStep<S> {
    /// Fraction, at most the limit passed; 0 if the initial gap is below rounding, in which case the
    /// start is invalid.
    pub time: S,
    /// Number of closest-point evaluations, over all lanes.
    pub evaluations: usize,
}

/// Computes the fraction of the motion from `x` to `x + dx` [m], at most `limit`, on which a pair of
/// primitives keeps at least `g/2` of its gap, `g = 0.1 min(d_0 - xi, dhat)`.
///
/// If the fraction is below `limit`, the gap at its end lies in `[g/2, g]`, unless [`MAX_EVALUATIONS`]
/// ended the search.
#[inline(always)]
pub fn safe_step<K: Primitives<D, N>, S: Scalar, const D: usize, const N: usize>(
    x: &[[S; D]; N],
    dx: &[[S; D]; N],
    gap: &GapLimit,
    limit: S,
) -> SafeStep<S> {
    // Positions relative to the first vertex, and the gap that must be left.
    let (zero, one) = (S::zero(), S::one());
    let allowance = rounding_allowance(x, dx);
    let (x, dx) = (&relative(x), &relative(dx));
    let offset = S::splat(gap.offset);
    let start = Separation::of::<K>(x, dx);
    let gap_at_start = start.distance - offset;
    let target = smaller(gap_at_start, S::splat(gap.reach)) * S::splat(GAP_LEFT);
    let floor = offset + target * S::splat(0.5) + allowance;
    let refused = gap_at_start.lt(allowance);

    // Advance to the earliest safe time along the present normal until the gap is small or the limit reached.
    let mut time = zero;
    let mut active = S::select(refused, zero, one);
    let mut advance = start.time_to(floor);
    let mut evaluations = 1;
    loop {
        let mut moving = zero.lt(active);
        let next = time + advance;
        let arrived = moving & limit.lt(next);
        time = S::select(moving, smaller(next, limit), time);
        active = S::select(arrived, zero, active);
        moving = moving & zero.lt(active) & time.lt(limit);
        if evaluations == MAX_EVALUATIONS || !moving.any() {
            return SafeStep { time, evaluations };
        }
        let mut there = *x;
        for i in 0..N {
            there[i] = along(&x[i], time, &dx[i]);
        }
        let separation = Separation::of::<K>(&there, dx);
        evaluations += 1;
        advance = separation.time_to(floor);
        let goes_on = (offset + target).lt(separation.distance) & zero.lt(advance);
        active = S::select(moving & goes_on, one, zero);
    }
}

/// Projections of the vertices on the direction between the closest points.
struct Separation<S, const D: usize, const N: usize> {
    distance: S,
    /// `n . x_i` and, in `motions`, `n . dx_i`.
    positions: [S; N],
    motions: [S; N],
    first: usize,
}

impl<S: Scalar, const D: usize, const N: usize> Separation<S, D, N> {
    #[inline(always)]
    fn of<K: Primitives<D, N>>(x: &[[S; D]; N], dx: &[[S; D]; N]) -> Self {
        let closest = K::closest(x);
        let distance = closest.squared_distance.sqrt();
        let normal = scaled(inverse_or_zero(distance), &closest.difference);
        let (mut positions, mut motions) = ([S::zero(); N], [S::zero(); N]);
        for i in 0..N {
            positions[i] = dot(&normal, &x[i]);
            motions[i] = dot(&normal, &dx[i]);
        }
        Separation { distance, positions, motions, first: K::FIRST }
    }

    /// Time until the first pair of vertices is `floor` apart; zero if a pair is closer already.
    #[inline(always)]
    fn time_to(&self, floor: S) -> S {
        let zero = S::zero();
        let mut time = S::splat(f64::INFINITY);
        for i in 0..self.first {
            for j in self.first..N {
                let left = (self.positions[i] - self.positions[j] - floor).max(zero);
                let closing = self.motions[j] - self.motions[i];
                let approaches = zero.lt(closing);
                let until = left / S::select(approaches, closing, S::one());
                time = S::select(approaches, smaller(until, time), time);
            }
        }
        time
    }
}

/// Bound on the rounding of distances along the path [m].
#[inline(always)]
fn rounding_allowance<S: Scalar, const D: usize, const N: usize>(x: &[[S; D]; N], dx: &[[S; D]; N]) -> S {
    let mut size = S::zero();
    for i in 1..N {
        let extent = length_bound(&difference(&x[i], &x[0])) + length_bound(&difference(&dx[i], &dx[0]));
        size = size.max(extent);
    }
    // Far from the origin, positions themselves are rounded; an eighth of that is added.
    let place = length_bound(&x[0]) + length_bound(&dx[0]);
    (size + place * S::splat(0.125)) * S::splat(ROUNDING)
}

/// Sum of the absolute components.
#[inline(always)]
fn length_bound<S: Scalar, const D: usize>(a: &[S; D]) -> S {
    let mut sum = a[0].abs();
    for k in 1..D {
        sum += a[k].abs();
    }
    sum
}

/// Fraction of a motion, at most `limit`, that leaves a tenth of the gap, or of the activation distance,
/// between a vertex and a half-space. `distance` is the signed distance at the start [m], `motion` its
/// change over the whole motion [m].
///
/// Zero for a vertex within its radius or behind the plane, an invalid start.
#[inline(always)]
pub fn safe_step_to_half_space(distance: f64, motion: f64, gap: &GapLimit, limit: f64) -> f64 {
    let left = distance - gap.offset;
    if left <= ROUNDING * (distance.abs() + motion.abs()) {
        return 0.0;
    }
    if motion >= 0.0 {
        return limit;
    }
    let target = GAP_LEFT * left.min(gap.reach);
    ((left - target) / -motion).min(limit)
}
