//! Step fraction until the first element collapses.

use super::kinematics::edges_at;
use super::{Elastic, points_of};
use crate::algebra::Mat;
use crate::element::quadrature_count;
use crate::energy::patch::PackIndex;
use crate::lanes::{Kernel, Lanes, VertexRows, WIDTH, dispatch};
use crate::scalar::Scalar;

/// Fraction of the displacement up to a collapse that a step takes.
pub(super) const MARGIN: f64 = 0.9;

/// Step fraction up to which roots are sought: steps go up to 1, and a margin is taken off.
const FAR: f64 = 2.0;

/// Fraction of `det F` that the other terms of the polynomial may reach; the rest exceeds their rounding.
const DOMINANT: f64 = 1.0 - 1e-12;

/// Returns the step fraction towards `x + dx`, at most 1: `MARGIN` times that at the first `det F = 0`.
pub(super) fn step_to_collapse<const D: usize, const N: usize>(
    elements: &Elastic<D, N>,
    x: &[f64],
    dx: &[f64],
) -> f64 {
    let patches = &elements.elements.patches;
    let [mut from, mut motion] = [(); 2].map(|()| VertexRows::<D>::new(patches.stride));
    let mut suspects = vec![];
    let mut step: f64 = 1.0;
    for patch in &patches.patches {
        patches.copy(patch, x, &mut from);
        patches.copy(patch, dx, &mut motion);
        let packs = &patches.index[patch.packs.clone()];
        suspects.clear();
        dispatch(FindSuspects { packs, from: &from, motion: &motion, suspects: &mut suspects });
        for &(pack, lane) in &suspects {
            let vertices = patches.vertices_of(patch, pack, lane);
            let [now, change] = [x, dx].map(|rows| points_of::<D, N>(rows, &vertices));
            for q in 0..quadrature_count::<D, N>() {
                step = step.min(MARGIN * first_root(&edges_at(&now, q), &edges_at(&change, q)));
            }
        }
    }
    step
}

/// Finds the elements of a patch that may collapse in the step.
struct FindSuspects<'a, const D: usize, const N: usize> {
    packs: &'a [PackIndex<N>],
    /// Positions of the vertices of the patch, and their displacements.
    from: &'a VertexRows<D>,
    motion: &'a VertexRows<D>,
    /// Receives pack, counted from the first of the patch, and lane of each.
    suspects: &'a mut Vec<(usize, usize)>,
}

impl<const D: usize, const N: usize> Kernel for FindSuspects<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let FindSuspects { packs, from, motion, suspects: found } = self;
        for (pack, index) in packs.iter().enumerate() {
            let [mut at, mut change] = [[[L::zero(); D]; N]; 2];
            for node in 0..N {
                let index = widened(&index[node]);
                at[node] = L::gather(from, &index);
                change[node] = L::gather(motion, &index);
            }
            let mut bits = 0;
            for q in 0..quadrature_count::<D, N>() {
                bits |= suspects(&edges_at(&at, q), &edges_at(&change, q));
            }
            for lane in 0..WIDTH {
                if bits >> lane & 1 == 1 {
                    found.push((pack, lane));
                }
            }
        }
    }
}

/// Converts local vertex numbers to row numbers.
#[inline(always)]
fn widened(index: &[u16; WIDTH]) -> [u32; WIDTH] {
    let mut rows = [0; WIDTH];
    for lane in 0..WIDTH {
        rows[lane] = u32::from(index[lane]);
    }
    rows
}

/// Returns the coefficients of `det(A + t B) = d0 + d1 t + d2 t^2 + d3 t^3`: `det A`, `cof A : B`,
/// `cof B : A` and `det B` in 3D; in 2D `det B` is the quadratic one.
#[inline(always)]
fn volume_polynomial<S: Scalar, const D: usize>(a: &Mat<S, D>, b: &Mat<S, D>) -> [S; 4] {
    let (of_a, of_b) = (a.cofactor(), b.cofactor());
    let (d0, d1, last) = (a.determinant(), of_a.dot(b), b.determinant());
    if D == 2 { [d0, d1, last, S::zero()] } else { [d0, d1, of_b.dot(a), last] }
}

/// Returns the bits of the lanes in which `det(A + t B)` may become zero for `0 < t <= FAR`.
#[inline(always)]
pub(super) fn suspects<L: Lanes, const D: usize>(a: &Mat<L, D>, b: &Mat<L, D>) -> u8 {
    let [d0, others @ ..] = volume_polynomial(a, b);
    !L::mask_to_bits(largest_terms(others).lt(L::splat(DOMINANT) * d0))
}

/// Returns a bound on the terms beyond the first over `0 < t <= FAR`.
#[inline(always)]
fn largest_terms<S: Scalar>([d1, d2, d3]: [S; 3]) -> S {
    let far = S::splat(FAR);
    far * (d1.abs() + far * (d2.abs() + far * d3.abs()))
}

/// Returns the smallest `t > 0` with `det(A + t B) = 0`, given `det A > 0`; infinite if there is none up
/// to `FAR`.
///
/// The polynomial in `t` is monotonic between its stationary points. The first of these intervals at
/// whose end it is not positive has the root, which bisection finds.
pub(super) fn first_root<const D: usize>(a: &Mat<f64, D>, b: &Mat<f64, D>) -> f64 {
    let [d0, d1, d2, d3] = volume_polynomial(a, b);
    if largest_terms([d1, d2, d3]) < DOMINANT * d0 {
        return f64::INFINITY;
    }
    let at = |t: f64| d0 + t * (d1 + t * (d2 + t * d3));
    // d1 + 2 d2 t + 3 d3 t^2 = 0
    let (qa, qb, qc) = (3.0 * d3, 2.0 * d2, d1);
    let discriminant = qb * qb - 4.0 * qa * qc;
    let q = -0.5 * (qb + discriminant.max(0.0).sqrt().copysign(qb));
    let stationary = if discriminant >= 0.0 { [q / qa, qc / q] } else { [FAR; 2] };
    let inside = |t: f64| if t > 0.0 && t < FAR { t } else { FAR };
    let stationary = stationary.map(inside);
    let mut low = 0.0;
    for stop in [stationary[0].min(stationary[1]), stationary[0].max(stationary[1]), FAR] {
        if at(stop) <= 0.0 {
            let mut high = stop;
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if at(middle) > 0.0 { low = middle } else { high = middle }
            }
            return low;
        }
        low = stop;
    }
    f64::INFINITY
}
