//! Closest points of primitives, including their boundaries: the nearest of all candidate pairs of
//! points.
//!
//! Every candidate is a pair of points of the two primitives, so the distance found is never below the
//! exact one, and no determinant decides between nearly parallel edges. Coefficients of vertices that do
//! not take part are exactly zero.

use crate::pair::{EdgeEdge, PairGeometry, PairKind, PointEdge, PointPoint, PointTriangle, relative};
use crate::vector::{along, difference, dot, inverse_or_zero, mixture, scaled, select, smaller};
use pliant::scalar::Scalar;

/// Closest points of two primitives with `N` vertices in total.
#[derive(Clone, Copy, Debug)]
pub struct ClosestPoints<S, const D: usize, const N: usize> {
    /// `c`, with `difference = sum c_i x_i`.
    pub coefficients: [S; N],
    /// `r`: vector from the closest point of the second primitive to that of the first [m].
    pub difference: [S; D],
    /// `r . r` [m^2].
    pub squared_distance: S,
}

/// Relative difference of squared distances, for each vertex more or less that takes part, that rounding
/// may cause.
const SAME_DISTANCE: f64 = 64.0 * f64::EPSILON;
/// Coefficients up to this bound are zero up to rounding: the point lies on the boundary.
const ON_BORDER: f64 = 16.0 * f64::EPSILON;

impl<S: Scalar> ClosestPoints<S, 3, 4> {
    /// Number of vertices with a coefficient above rounding.
    #[inline(always)]
    fn vertices(&self) -> S {
        let mut count = S::zero();
        for c in &self.coefficients {
            count += S::select(S::splat(ON_BORDER).lt(c.abs()), S::one(), S::zero());
        }
        count
    }
}

/// Kind of pair of primitives in `D` dimensions.
pub trait Primitives<const D: usize, const N: usize> {
    /// Number of vertices of the first primitive.
    const FIRST: usize;

    /// Closest points at the positions `x` [m].
    fn closest<S: Scalar>(x: &[[S; D]; N]) -> ClosestPoints<S, D, N>;
}

impl<const D: usize> Primitives<D, 2> for PointPoint {
    const FIRST: usize = 1;

    #[inline(always)]
    fn closest<S: Scalar>(x: &[[S; D]; 2]) -> ClosestPoints<S, D, 2> {
        let r = difference(&x[0], &x[1]);
        ClosestPoints { coefficients: [S::one(), -S::one()], difference: r, squared_distance: dot(&r, &r) }
    }
}

impl<const D: usize> Primitives<D, 3> for PointEdge {
    const FIRST: usize = 1;

    #[inline(always)]
    fn closest<S: Scalar>(x: &[[S; D]; 3]) -> ClosestPoints<S, D, 3> {
        let edge = difference(&x[2], &x[1]);
        let from = difference(&x[0], &x[1]);
        let s = dot(&from, &edge) * inverse_or_zero(dot(&edge, &edge));
        let s = smaller(s.max(S::zero()), S::one());
        let r = along(&from, -s, &edge);
        // Makes `r` orthogonal to the edge to full precision: for small distances `s` is rounded too
        // coarsely.
        let inside = S::zero().lt(s) & s.lt(S::one());
        let rest = dot(&r, &edge) * inverse_or_zero(dot(&edge, &edge));
        let r = along(&r, S::select(inside, -rest, S::zero()), &edge);
        let c = [S::one(), s - S::one(), -s];
        ClosestPoints { coefficients: c, difference: r, squared_distance: dot(&r, &r) }
    }
}

impl Primitives<3, 4> for PointTriangle {
    const FIRST: usize = 1;

    #[inline(always)]
    fn closest<S: Scalar>(x: &[[S; 3]; 4]) -> ClosestPoints<S, 3, 4> {
        let x = &relative(x);
        let mut best = point_and_edge(x, 0, 1, 2);
        best = nearer(&point_and_edge(x, 0, 2, 3), &best);
        best = nearer(&point_and_edge(x, 0, 3, 1), &best);
        let pair = PairGeometry::of::<PointTriangle>(x);
        let (inner, border) = (&pair.coefficients, S::splat(-ON_BORDER));
        let inside = inner[1].lt(border) & inner[2].lt(border) & inner[3].lt(border);
        nearer_where(inside, x, &pair, &best)
    }
}

impl Primitives<3, 4> for EdgeEdge {
    const FIRST: usize = 2;

    #[inline(always)]
    fn closest<S: Scalar>(x: &[[S; 3]; 4]) -> ClosestPoints<S, 3, 4> {
        let x = &relative(x);
        let mut best = point_and_edge(x, 0, 2, 3);
        best = nearer(&point_and_edge(x, 1, 2, 3), &best);
        best = nearer(&opposite(&point_and_edge(x, 2, 0, 1)), &best);
        best = nearer(&opposite(&point_and_edge(x, 3, 0, 1)), &best);
        let pair = PairGeometry::of::<EdgeEdge>(x);
        let (inner, border) = (&pair.coefficients, S::splat(ON_BORDER));
        let inside = border.lt(inner[0]) & border.lt(inner[1]) & inner[2].lt(-border) & inner[3].lt(-border);
        nearer_where(inside, x, &pair, &best)
    }
}

/// Closest points of vertex `p` and the edge `a`, `b`.
#[inline(always)]
fn point_and_edge<S: Scalar>(x: &[[S; 3]; 4], p: usize, a: usize, b: usize) -> ClosestPoints<S, 3, 4> {
    let of_three = PointEdge::closest(&[x[p], x[a], x[b]]);
    let mut coefficients = [S::zero(); 4];
    coefficients[p] = of_three.coefficients[0];
    coefficients[a] = of_three.coefficients[1];
    coefficients[b] = of_three.coefficients[2];
    ClosestPoints {
        coefficients,
        difference: of_three.difference,
        squared_distance: of_three.squared_distance,
    }
}

/// Closest points with the primitives exchanged.
#[inline(always)]
fn opposite<S: Scalar>(points: &ClosestPoints<S, 3, 4>) -> ClosestPoints<S, 3, 4> {
    ClosestPoints {
        coefficients: scaled(-S::one(), &points.coefficients),
        difference: scaled(-S::one(), &points.difference),
        squared_distance: points.squared_distance,
    }
}

/// The nearer of two candidates.
///
/// Across a boundary between regions, squared distances differ by the square of the distance to it, which
/// rounding hides up to 1e-8 of the distance. Between candidates that close, points inside an edge win
/// over a corner, so that regions change where the parameter does.
#[inline(always)]
fn nearer<S: Scalar>(a: &ClosestPoints<S, 3, 4>, b: &ClosestPoints<S, 3, 4>) -> ClosestPoints<S, 3, 4> {
    let more = S::splat(SAME_DISTANCE) * (a.vertices() - b.vertices());
    chosen(a.squared_distance.lt(b.squared_distance * (S::one() + more)), a, b)
}

/// Interior points of the pair, if they lie inside and are not farther than `best`. Their distance is
/// that of the points, their direction is orthogonal to both primitives to full precision.
#[inline(always)]
fn nearer_where<S: Scalar>(
    inside: S::Mask,
    x: &[[S; 3]; 4],
    pair: &PairGeometry<S, 3, 4, 2>,
    best: &ClosestPoints<S, 3, 4>,
) -> ClosestPoints<S, 3, 4> {
    let r = mixture(&pair.coefficients, x);
    let squared_distance = dot(&r, &r);
    let difference = scaled(squared_distance.sqrt(), &pair.normal);
    let inner = ClosestPoints { coefficients: pair.coefficients, difference, squared_distance };
    chosen(inside & squared_distance.lt(best.squared_distance * S::splat(1.0 + SAME_DISTANCE)), &inner, best)
}

#[inline(always)]
fn chosen<S: Scalar>(
    mask: S::Mask,
    a: &ClosestPoints<S, 3, 4>,
    b: &ClosestPoints<S, 3, 4>,
) -> ClosestPoints<S, 3, 4> {
    ClosestPoints {
        coefficients: select(mask, &a.coefficients, &b.coefficients),
        difference: select(mask, &a.difference, &b.difference),
        squared_distance: S::select(mask, a.squared_distance, b.squared_distance),
    }
}

/// Kind of the pair in whose interior the closest points lie, by increasing number of vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum InnerKind {
    /// [`PointPoint`].
    PointPoint,
    /// [`PointEdge`].
    PointEdge,
    /// [`PointTriangle`].
    PointTriangle,
    /// [`EdgeEdge`].
    EdgeEdge,
}

/// Pair of smaller primitives in whose interior the closest points lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InnerPair {
    /// Kind of the pair.
    pub kind: InnerKind,
    /// Slots of its vertices in the original pair: the point first, then the others; two ends of each
    /// edge.
    pub slots: [usize; 4],
}

impl InnerPair {
    /// Number of vertices of the pair.
    pub fn vertices(&self) -> usize {
        match self.kind {
            InnerKind::PointPoint => PointPoint::START.len(),
            InnerKind::PointEdge => PointEdge::START.len(),
            InnerKind::PointTriangle | InnerKind::EdgeEdge => 4,
        }
    }

    /// Interior pair of a point (vertex 0) and a triangle, from the coefficients of their closest points.
    pub fn of_point_triangle(c: &[f64; 4]) -> Self {
        let (slots, count) = parts(c, 1..4);
        match count {
            1 => InnerPair { kind: InnerKind::PointPoint, slots: [0, slots[0], 0, 0] },
            2 => InnerPair { kind: InnerKind::PointEdge, slots: [0, slots[0], slots[1], 0] },
            _ => InnerPair { kind: InnerKind::PointTriangle, slots: [0, 1, 2, 3] },
        }
    }

    /// Interior pair of a point (vertex 0) and an edge.
    pub fn of_point_edge(c: &[f64; 3]) -> Self {
        let (slots, count) = parts(&[c[0], c[1], c[2], 0.0], 1..3);
        match count {
            1 => InnerPair { kind: InnerKind::PointPoint, slots: [0, slots[0], 0, 0] },
            _ => InnerPair { kind: InnerKind::PointEdge, slots: [0, 1, 2, 0] },
        }
    }

    /// Interior pair of two edges, vertices 0, 1 and 2, 3.
    pub fn of_edge_edge(c: &[f64; 4]) -> Self {
        let ((first, of_first), (second, of_second)) = (parts(c, 0..2), parts(c, 2..4));
        match (of_first, of_second) {
            (1, 1) => InnerPair { kind: InnerKind::PointPoint, slots: [first[0], second[0], 0, 0] },
            (1, _) => InnerPair { kind: InnerKind::PointEdge, slots: [first[0], 2, 3, 0] },
            (_, 1) => InnerPair { kind: InnerKind::PointEdge, slots: [second[0], 0, 1, 0] },
            _ => InnerPair { kind: InnerKind::EdgeEdge, slots: [0, 1, 2, 3] },
        }
    }
}

/// Slots of the range with nonzero coefficients, and their number.
fn parts(c: &[f64; 4], range: std::ops::Range<usize>) -> ([usize; 3], usize) {
    let (mut slots, mut count) = ([0; 3], 0);
    for slot in range {
        if c[slot] != 0.0 {
            slots[count] = slot;
            count += 1;
        }
    }
    (slots, count)
}
