//! Mollifier of edge pairs: nearly parallel edges fade out, because their closest points jump.
//!
//! `m(c) = (2 - c/eps) c/eps` for `c < eps`, 1 above, with `c = |a x b|^2` of the edges `a`, `b` and `eps
//! = 1e-3 |A|^2 |B|^2` of the reference edges (Li et al. 2020). Twice differentiable except at `c = eps`;
//! nothing is divided by `c`.

use crate::barrier::{Barrier, EnergyOfDistance};
use crate::closest::{InnerKind, InnerPair, Primitives};
use crate::eigen::positive_part;
use crate::pair::{EdgeEdge, PairGeometry, PointEdge, PointPoint};
use crate::vector::{along, cross, difference, dot, scaled};
use pliant::algebra::Mat;
use pliant::material::Psd;

/// Pair of nearly parallel edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MollifiedPair {
    /// Ends of the first edge, then of the second.
    pub vertices: [u32; 4],
    /// Pair of their primitives that determines the distance.
    pub inner: InnerPair,
    /// Weight [m^2].
    pub weight: f64,
    /// `eps` of the mollifier [m^4].
    pub limit: f64,
}

/// Ratio `eps / (|A|^2 |B|^2)`.
const PARALLEL: f64 = 1e-3;

/// Function of the four vertices of two edges, with first and second derivatives.
#[derive(Clone, Copy, Debug)]
pub struct MollifiedEnergy {
    /// Value.
    pub value: f64,
    /// First derivatives, by vertex.
    pub gradient: [[f64; 3]; 4],
    /// Second derivatives, by vertex and component.
    pub hessian: [[f64; 12]; 12],
}

/// `eps` [m^4] of two edges from their squared reference lengths [m^2].
pub fn parallel_limit(squared_length_a: f64, squared_length_b: f64) -> f64 {
    PARALLEL * squared_length_a * squared_length_b
}

/// `c = |a x b|^2` [m^4].
pub fn squared_cross(x: &[[f64; 3]; 4]) -> f64 {
    let u = cross(&difference(&x[1], &x[0]), &difference(&x[3], &x[2]));
    dot(&u, &u)
}

/// Mollifier `m` and its first two derivatives by `c`.
pub fn mollifier(c: f64, limit: f64) -> [f64; 3] {
    if c >= limit {
        return [1.0, 0.0, 0.0];
    }
    let y = c / limit;
    [(2.0 - y) * y, 2.0 * (1.0 - y) / limit, -2.0 / (limit * limit)]
}

/// Derivatives of `m` and `m'` by `eps`.
pub(crate) fn mollifier_by_limit(c: f64, limit: f64) -> [f64; 2] {
    if c >= limit {
        return [0.0; 2];
    }
    let y = c / limit;
    [-2.0 * (1.0 - y) * y / limit, 2.0 * (2.0 * y - 1.0) / (limit * limit)]
}

/// Derivative of the gradient of the energy `m E` of two edges at `x` by `eps`, by vertex [N/m^4].
pub(crate) fn mollified_by_limit(
    x: &[[f64; 3]; 4],
    pair: &MollifiedPair,
    barrier: &Barrier,
) -> [[f64; 3]; 4] {
    let energy = energy_of_inner_pair(x, &pair.inner, &|squared| barrier.at(squared, pair.weight));
    let (a, b) = (difference(&x[1], &x[0]), difference(&x[3], &x[2]));
    let u = cross(&a, &b);
    let [by_limit, slope_by_limit] = mollifier_by_limit(dot(&u, &u), pair.limit);
    let by_edge = slopes_of_cross(&a, &b, &u);
    let mut gradient = energy.gradient.map(|row| scaled(by_limit, &row));
    for (i, row) in gradient.iter_mut().enumerate() {
        let sign = if i % 2 == 0 { -1.0 } else { 1.0 };
        *row = along(row, sign * energy.value * slope_by_limit, &by_edge[i / 2]);
    }
    gradient
}

/// Mollified energy `m E` of two edges [J] with its derivatives; the Hessian is exact or the nearest
/// positive semidefinite one.
///
/// `d2(m E) = E d2m + 2 sym(dE dm^T) + m d2E` is projected as a whole: mollified pairs are few.
pub fn mollified_pair(
    x: &[[f64; 3]; 4],
    barrier: &Barrier,
    weight: f64,
    limit: f64,
    psd: Psd,
) -> MollifiedEnergy {
    let inner = InnerPair::of_edge_edge(&EdgeEdge::closest(x).coefficients);
    mollified_inner_pair(x, &inner, barrier, weight, limit, psd)
}

/// Mollified energy as in [`mollified_pair`], with the distance of the pair `inner` of their vertices.
pub fn mollified_inner_pair(
    x: &[[f64; 3]; 4],
    inner: &InnerPair,
    barrier: &Barrier,
    weight: f64,
    limit: f64,
    psd: Psd,
) -> MollifiedEnergy {
    let distance = energy_of_inner_pair(x, inner, &|squared| barrier.at(squared, weight));
    let factor = mollifier_of_edges(x, limit);
    let (of_energy, of_factor) = (distance.gradient.as_flattened(), factor.gradient.as_flattened());
    let mut product = MollifiedEnergy { value: factor.value * distance.value, ..distance };
    for i in 0..12 {
        product.gradient.as_flattened_mut()[i] = factor.value * of_energy[i] + distance.value * of_factor[i];
        for j in 0..12 {
            product.hessian[i][j] = factor.value * distance.hessian[i][j]
                + distance.value * factor.hessian[i][j]
                + of_energy[i] * of_factor[j]
                + of_factor[i] * of_energy[j];
        }
    }
    if psd == Psd::Projected {
        project(&mut product.hessian);
    }
    product
}

/// Mollifier `m` as a function of the vertices.
pub(crate) fn mollifier_of_edges(x: &[[f64; 3]; 4], limit: f64) -> MollifiedEnergy {
    let (a, b) = (difference(&x[1], &x[0]), difference(&x[3], &x[2]));
    let u = cross(&a, &b);
    let [value, slope, curvature] = mollifier(dot(&u, &u), limit);
    // A vertex is the end of its edge (sign +) or its start (sign -).
    let by_edge = slopes_of_cross(&a, &b, &u);
    let second = second_derivatives_of_cross(&a, &b);
    let mut f = MollifiedEnergy { value, gradient: [[0.0; 3]; 4], hessian: [[0.0; 12]; 12] };
    for i in 0..12 {
        let (edge, sign, k) = (i / 6, if i % 6 < 3 { -1.0 } else { 1.0 }, i % 3);
        f.gradient.as_flattened_mut()[i] = sign * slope * by_edge[edge][k];
        for j in 0..12 {
            let (other, other_sign, l) = (j / 6, if j % 6 < 3 { -1.0 } else { 1.0 }, j % 3);
            let of_edges =
                slope * second[edge][other][k][l] + curvature * by_edge[edge][k] * by_edge[other][l];
            f.hessian[i][j] = sign * other_sign * of_edges;
        }
    }
    f
}

/// Derivatives of `c` by the edges `a` and `b`; `u` is their cross product.
fn slopes_of_cross(a: &[f64; 3], b: &[f64; 3], u: &[f64; 3]) -> [[f64; 3]; 2] {
    [scaled(2.0, &cross(b, u)), scaled(2.0, &cross(u, a))]
}

/// `d2c` by `(a, a)`, `(a, b)`, `(b, a)`, `(b, b)`.
fn second_derivatives_of_cross(a: &[f64; 3], b: &[f64; 3]) -> [[Mat<f64, 3>; 2]; 2] {
    let (aa, ab, bb) = (dot(a, a), dot(a, b), dot(b, b));
    let mut second = [[Mat::zero(); 2]; 2];
    for k in 0..3 {
        for l in 0..3 {
            let one = f64::from(u8::from(k == l));
            second[0][0][k][l] = 2.0 * (bb * one - b[k] * b[l]);
            second[1][1][k][l] = 2.0 * (aa * one - a[k] * a[l]);
            second[0][1][k][l] = 2.0 * (2.0 * a[k] * b[l] - ab * one - b[k] * a[l]);
            second[1][0][l][k] = second[0][1][k][l];
        }
    }
    second
}

/// Energy of a squared distance.
type EnergyLaw<'a> = dyn Fn(f64) -> EnergyOfDistance<f64> + 'a;

/// Energy of the distance of a pair among the vertices of two edges, as a function of all four.
fn energy_of_inner_pair(x: &[[f64; 3]; 4], inner: &InnerPair, law: &EnergyLaw<'_>) -> MollifiedEnergy {
    let [p, q, s, t] = inner.slots;
    let mut f = MollifiedEnergy { value: 0.0, gradient: [[0.0; 3]; 4], hessian: [[0.0; 12]; 12] };
    match inner.kind {
        InnerKind::PointPoint => {
            let pair = PairGeometry::of::<PointPoint>(&[x[p], x[q]]);
            add_pair(&pair, &[p, q], law, &mut f);
        }
        InnerKind::PointEdge => {
            let pair = PairGeometry::of::<PointEdge>(&[x[p], x[q], x[s]]);
            add_pair(&pair, &[p, q, s], law, &mut f);
        }
        _ => {
            let pair = PairGeometry::of::<EdgeEdge>(x);
            add_pair(&pair, &[p, q, s, t], law, &mut f);
        }
    }
    f
}

fn add_pair<const N: usize, const P: usize>(
    pair: &PairGeometry<f64, 3, N, P>,
    slots: &[usize; N],
    law: &EnergyLaw<'_>,
    f: &mut MollifiedEnergy,
) {
    let law = law(pair.squared_distance);
    let (gradient, blocks) = (pair.gradient(law.slope), pair.exact_hessian(&law));
    f.value = law.energy;
    for i in 0..N {
        f.gradient[slots[i]] = gradient[i];
        for j in 0..N {
            for k in 0..3 {
                f.hessian[3 * slots[i] + k][3 * slots[j]..][..3].copy_from_slice(&blocks[i][j][k]);
            }
        }
    }
}

/// Orthonormal, translation-invariant combinations of four vertices.
const RELATIVE: [[f64; 4]; 3] = [[0.5, 0.5, -0.5, -0.5], [0.5, -0.5, 0.5, -0.5], [0.5, -0.5, -0.5, 0.5]];

/// Projects a translation-invariant matrix to the nearest positive semidefinite one: an eigenproblem of
/// size nine instead of twelve.
fn project(hessian: &mut [[f64; 12]; 12]) {
    let mut reduced = [[0.0; 9]; 9];
    for i in 0..9 {
        for j in 0..9 {
            for (m, n) in vertex_pairs() {
                reduced[i][j] +=
                    RELATIVE[i / 3][m] * RELATIVE[j / 3][n] * hessian[3 * m + i % 3][3 * n + j % 3];
            }
        }
    }
    positive_part(&mut reduced, 9);
    for i in 0..12 {
        for j in 0..12 {
            let mut sum = 0.0;
            for a in 0..3 {
                for b in 0..3 {
                    sum += RELATIVE[a][i / 3] * RELATIVE[b][j / 3] * reduced[3 * a + i % 3][3 * b + j % 3];
                }
            }
            hessian[i][j] = sum;
        }
    }
}

fn vertex_pairs() -> impl Iterator<Item = (usize, usize)> {
    (0..16).map(|mn| (mn / 4, mn % 4))
}
