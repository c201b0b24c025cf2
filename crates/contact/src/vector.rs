//! Small vectors on the stack. Products round before summation: processors without fused multiply-add are as
//! fast.

use pliant::scalar::Scalar;

/// Rows of `x`, flat `(n, D)`, of the vertices given.
#[inline]
pub(crate) fn rows<const D: usize, const N: usize>(x: &[f64], vertices: &[u32; N]) -> [[f64; D]; N] {
    let mut rows = [[0.0; D]; N];
    for i in 0..N {
        rows[i].copy_from_slice(&x[vertices[i] as usize * D..][..D]);
    }
    rows
}

/// Dot product of a 3D normal with a vector of `D` components.
#[inline]
pub(crate) fn along_normal<const D: usize>(normal: &[f64; 3], r: &[f64; D]) -> f64 {
    (0..D).map(|k| normal[k] * r[k]).sum()
}

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

/// `1 / a`, or zero unless `a` is a positive normal number.
#[inline(always)]
pub(crate) fn inverse_or_zero<S: Scalar>(a: S) -> S {
    S::select(S::splat(f64::MIN_POSITIVE).lt(a), S::one() / a, S::zero())
}

#[inline(always)]
pub(crate) fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// True where the boxes of the first `first` and of the other positions are farther than `reach` [m]
/// apart along an axis, and so the positions are.
#[inline(always)]
pub(crate) fn are_apart<S: Scalar, const D: usize, const N: usize>(
    x: &[[S; D]; N],
    first: usize,
    reach: S,
) -> S::Mask {
    are_boxes_apart(x, x, first, reach)
}

/// True where the boxes of the paths from `x` to `x + dx` are farther than `reach` [m] apart along an
/// axis; the mean motion is subtracted.
#[inline(always)]
pub(crate) fn stay_apart<S: Scalar, const D: usize, const N: usize>(
    x: &[[S; D]; N],
    dx: &[[S; D]; N],
    first: usize,
    reach: S,
) -> S::Mask {
    let mean = mean(dx);
    let (mut low, mut high) = (*x, *x);
    for i in 0..N {
        for k in 0..D {
            let motion = dx[i][k] - mean[k];
            low[i][k] += smaller(motion, S::zero());
            high[i][k] += motion.max(S::zero());
        }
    }
    are_boxes_apart(&low, &high, first, reach)
}

/// True where the first `first` and the other positions are farther than `reach` [m] apart along the
/// direction between their means.
#[inline(always)]
pub(crate) fn are_apart_across<S: Scalar, const D: usize, const N: usize>(
    x: &[[S; D]; N],
    first: usize,
    reach: S,
) -> S::Mask {
    let axis = between_means(x, first);
    let mut along = [S::zero(); N];
    for i in 0..N {
        along[i] = dot(&x[i], &axis);
    }
    are_projections_apart(&along, &along, first, reach, &axis)
}

/// True where the paths from `x` to `x + dx` are farther apart than `reach` [m] along that direction; the
/// mean motion is subtracted.
#[inline(always)]
pub(crate) fn stay_apart_across<S: Scalar, const D: usize, const N: usize>(
    x: &[[S; D]; N],
    dx: &[[S; D]; N],
    first: usize,
    reach: S,
) -> S::Mask {
    let axis = between_means(x, first);
    let mean = mean(dx);
    let (mut low, mut high) = ([S::zero(); N], [S::zero(); N]);
    for i in 0..N {
        let (from, motion) = (dot(&x[i], &axis), dot(&difference(&dx[i], &mean), &axis));
        (low[i], high[i]) = (from + smaller(motion, S::zero()), from + motion.max(S::zero()));
    }
    are_projections_apart(&low, &high, first, reach, &axis)
}

/// Mean of the first `first` rows minus that of the others.
#[inline(always)]
fn between_means<S: Scalar, const D: usize, const N: usize>(x: &[[S; D]; N], first: usize) -> [S; D] {
    let mut axis = [S::zero(); D];
    for k in 0..D {
        let (mut of_first, mut of_others) = (S::zero(), S::zero());
        for row in &x[..first] {
            of_first += row[k];
        }
        for row in &x[first..] {
            of_others += row[k];
        }
        axis[k] = of_first / S::splat(first as f64) - of_others / S::splat((N - first) as f64);
    }
    axis
}

#[inline(always)]
fn mean<S: Scalar, const D: usize, const N: usize>(rows: &[[S; D]; N]) -> [S; D] {
    let mut mean = [S::zero(); D];
    for k in 0..D {
        for row in rows {
            mean[k] += row[k];
        }
        mean[k] *= S::splat(1.0 / N as f64);
    }
    mean
}

/// True where the projections on an axis, not necessarily of unit length, are farther than `reach` [m]
/// apart, the first primitive above the other.
#[inline(always)]
fn are_projections_apart<S: Scalar, const D: usize, const N: usize>(
    low: &[S; N],
    high: &[S; N],
    first: usize,
    reach: S,
    axis: &[S; D],
) -> S::Mask {
    let (mut least, mut most) = (low[0], high[first]);
    for i in 1..first {
        least = smaller(low[i], least);
    }
    for i in first + 1..N {
        most = most.max(high[i]);
    }
    // Projections are rounded relative to the positions, which may be large compared with their
    // differences.
    let rounding = S::splat(16.0 * f64::EPSILON) * (least.abs() + most.abs());
    let apart = least - most - rounding;
    S::zero().lt(apart) & (reach * reach * dot(axis, axis)).lt(apart * apart)
}

/// True where the unions of the boxes of the first `first` vertices and of the others are farther than
/// `reach` [m] apart along an axis.
#[inline(always)]
fn are_boxes_apart<S: Scalar, const D: usize, const N: usize>(
    low: &[[S; D]; N],
    high: &[[S; D]; N],
    first: usize,
    reach: S,
) -> S::Mask {
    let mut widest = S::splat(f64::NEG_INFINITY);
    for k in 0..D {
        let (mut least, mut most) = ([low[0][k], low[first][k]], [high[0][k], high[first][k]]);
        for i in 0..N {
            let side = usize::from(i >= first);
            least[side] = smaller(low[i][k], least[side]);
            most[side] = most[side].max(high[i][k]);
        }
        widest = widest.max((least[1] - most[0]).max(least[0] - most[1]));
    }
    reach.lt(widest)
}
