//! Vectors on the stack. Products round before they are summed: a processor without fused products is as
//! fast.

use pliant::scalar::Scalar;

#[inline(always)]
pub(crate) fn dot<S: Scalar, const D: usize>(a: &[S; D], b: &[S; D]) -> S {
    let mut sum = a[0] * b[0];
    for k in 1..D {
        sum += a[k] * b[k];
    }
    sum
}

#[inline(always)]
pub(crate) fn difference<S: Scalar, const D: usize>(a: &[S; D], b: &[S; D]) -> [S; D] {
    let mut r = *a;
    for k in 0..D {
        r[k] -= b[k];
    }
    r
}

/// `a + s b`.
#[inline(always)]
pub(crate) fn along<S: Scalar, const D: usize>(a: &[S; D], s: S, b: &[S; D]) -> [S; D] {
    let mut r = *a;
    for k in 0..D {
        r[k] += s * b[k];
    }
    r
}

#[inline(always)]
pub(crate) fn scaled<S: Scalar, const D: usize>(s: S, a: &[S; D]) -> [S; D] {
    let mut r = *a;
    for k in 0..D {
        r[k] *= s;
    }
    r
}

/// `mask ? a : b`, lane by lane.
#[inline(always)]
pub(crate) fn select<S: Scalar, const D: usize>(mask: S::Mask, a: &[S; D], b: &[S; D]) -> [S; D] {
    let mut r = *a;
    for k in 0..D {
        r[k] = S::select(mask, a[k], b[k]);
    }
    r
}

/// `sum_i c_i x_i`.
#[inline(always)]
pub(crate) fn mixture<S: Scalar, const D: usize, const N: usize>(c: &[S; N], x: &[[S; D]; N]) -> [S; D] {
    let mut r = scaled(c[0], &x[0]);
    for i in 1..N {
        r = along(&r, c[i], &x[i]);
    }
    r
}

/// The smaller of the two; `b` where `a` is NaN.
#[inline(always)]
pub(crate) fn smaller<S: Scalar>(a: S, b: S) -> S {
    S::select(a.lt(b), a, b)
}

/// `1 / a`, and zero where `a` is no positive normal number.
#[inline(always)]
pub(crate) fn inverse_or_zero<S: Scalar>(a: S) -> S {
    S::select(S::splat(f64::MIN_POSITIVE).lt(a), S::one() / a, S::zero())
}

#[inline(always)]
pub(crate) fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// True if the boxes around the first `first` and the other positions are farther than `reach` [m] apart
/// along an axis: what lies in them is.
#[inline(always)]
pub(crate) fn are_apart<const D: usize, const N: usize>(x: &[[f64; D]; N], first: usize, reach: f64) -> bool {
    let spans = |i: usize, k: usize| [x[i][k]; 2];
    are_spans_apart::<D, N>(spans, first, reach)
}

/// True if the first `first` and the other positions are farther than `reach` [m] apart along the direction
/// between their means.
#[inline(always)]
pub(crate) fn are_apart_across<const D: usize, const N: usize>(
    x: &[[f64; D]; N],
    first: usize,
    reach: f64,
) -> bool {
    let axis = between_means(x, first);
    are_projections_apart::<D, N>(|i| [dot(&x[i], &axis); 2], first, reach, &axis)
}

/// The same on the ways from `x` to `x + dx`.
#[inline(always)]
pub(crate) fn stay_apart_across<const D: usize, const N: usize>(
    x: &[[f64; D]; N],
    dx: &[[f64; D]; N],
    first: usize,
    reach: f64,
) -> bool {
    let axis = between_means(x, first);
    let mean = mean(dx);
    let span = |i: usize| {
        let (from, motion) = (dot(&x[i], &axis), dot(&difference(&dx[i], &mean), &axis));
        [from + motion.min(0.0), from + motion.max(0.0)]
    };
    are_projections_apart::<D, N>(span, first, reach, &axis)
}

/// Mean of the first `first` rows less that of the others.
#[inline(always)]
fn between_means<const D: usize, const N: usize>(x: &[[f64; D]; N], first: usize) -> [f64; D] {
    let mut axis = [0.0; D];
    for k in 0..D {
        let sum = |rows: &[[f64; D]]| rows.iter().map(|row| row[k]).sum::<f64>() / rows.len() as f64;
        axis[k] = sum(&x[..first]) - sum(&x[first..]);
    }
    axis
}

#[inline(always)]
fn mean<const D: usize, const N: usize>(rows: &[[f64; D]; N]) -> [f64; D] {
    std::array::from_fn(|k| rows.iter().map(|row| row[k]).sum::<f64>() / N as f64)
}

/// True if the spans of products with an axis, which need not be of unit length, are farther than `reach` [m]
/// apart, those of the first above the others.
#[inline(always)]
fn are_projections_apart<const D: usize, const N: usize>(
    span: impl Fn(usize) -> [f64; 2],
    first: usize,
    reach: f64,
    axis: &[f64; D],
) -> bool {
    let low = (0..first).map(|i| span(i)[0]).fold(f64::INFINITY, f64::min);
    let high = (first..N).map(|i| span(i)[1]).fold(f64::NEG_INFINITY, f64::max);
    let apart = low - high;
    // Products are rounded beside the positions, which may be large beside their differences.
    let rounding = 16.0 * f64::EPSILON * (low.abs() + high.abs());
    apart > rounding && (apart - rounding) * (apart - rounding) > reach * reach * dot(axis, axis)
}

/// The same of the boxes around the ways from `x` to `x + dx`, seen from the mean of the motions.
pub(crate) fn stay_apart<const D: usize, const N: usize>(
    x: &[[f64; D]; N],
    dx: &[[f64; D]; N],
    first: usize,
    reach: f64,
) -> bool {
    let mean = mean(dx);
    let spans = |i: usize, k: usize| {
        let motion = dx[i][k] - mean[k];
        [x[i][k] + motion.min(0.0), x[i][k] + motion.max(0.0)]
    };
    are_spans_apart::<D, N>(spans, first, reach)
}

/// True if the unions of the spans of the first `first` vertices and of the others are farther than `reach`
/// [m] apart along an axis; `span(i, k)` is that of vertex `i` along axis `k`, lower end first.
#[inline(always)]
fn are_spans_apart<const D: usize, const N: usize>(
    span: impl Fn(usize, usize) -> [f64; 2],
    first: usize,
    reach: f64,
) -> bool {
    (0..D).any(|k| {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for i in 0..N {
            let (side, [from, to]) = (usize::from(i >= first), span(i, k));
            low[side] = low[side].min(from);
            high[side] = high[side].max(to);
        }
        low[1] - high[0] > reach || low[0] - high[1] > reach
    })
}
