//! The Hessians of elements, `K_(ab) = w sum_(jl) (dP_ij / dF_kl) (grad N_a)_j (grad N_b)_l`; Sifakis, Barbic 2012, section 4.3.

use std::ops::Range;

use crate::algebra::Mat;
use crate::element::{SimplexPack, edge_matrix};
use crate::energy::patch::Patches;
use crate::material::{Material, Psd};

/// Writes the Hessians of `stencils`.
pub(super) fn fill<M: Material<D>, const D: usize, const N: usize>(
    material: &M,
    patches: &Patches<N>,
    packs: &[SimplexPack<D>],
    stencils: Range<usize>,
    x: &[f64],
    psd: Psd,
    out: &mut [f64],
) {
    let x = x.as_chunks::<D>().0;
    let block = D * D;
    let pairs = N * (N + 1) / 2;
    let lanes = patches.lanes_in(stencils).zip(out.chunks_exact_mut(pairs * block));
    for ((vertices, pack, lane), out) in lanes {
        let (inverse_rest, weight) = packs[pack].lane(lane);
        if weight == 0.0 {
            out.fill(0.0);
            continue;
        }
        let mut points = [[0.0; D]; N];
        for (point, v) in points.iter_mut().zip(vertices) {
            *point = x[v as usize];
        }
        let tangent = material.hessian(&edge_matrix(&points).mul(&inverse_rest), psd);
        // Gradients of the shape functions: the rows of D_m^-1, and minus their sum.
        let mut gradient = [[0.0; D]; N];
        for a in 0..D {
            for j in 0..D {
                gradient[a + 1][j] = inverse_rest[a][j];
                gradient[0][j] -= inverse_rest[a][j];
            }
        }
        // C_ijkl (grad N_b)_l w
        let mut blocks = out.chunks_exact_mut(block);
        for a in 0..N {
            for b in a..N {
                let out = blocks.next().expect("a block for each pair");
                for i in 0..D {
                    for k in 0..D {
                        let mut sum = 0.0;
                        for j in 0..D {
                            let mut inner = 0.0;
                            for l in 0..D {
                                inner += tangent.0[i][j][k][l] * gradient[b][l];
                            }
                            sum += inner * gradient[a][j];
                        }
                        out[i * D + k] = weight * sum;
                    }
                }
            }
        }
    }
}

/// How far elements may go towards `x + dx`: most of the way to the first `det F = 0`, in (0, 1].
pub(super) fn step_to_collapse<const D: usize, const N: usize>(
    elements: impl Iterator<Item = (usize, [u32; N], Mat<f64, D>, f64)>,
    x: &[f64],
    dx: &[f64],
) -> f64 {
    /// What is left of the way.
    const MARGIN: f64 = 0.9;
    let mut step: f64 = 1.0;
    for (_, vertices, _, _) in elements {
        let now = edge_matrix(&super::points_of::<D, N>(x, &vertices));
        let change = edge_matrix(&super::points_of::<D, N>(dx, &vertices));
        step = step.min(MARGIN * first_root(&now, &change));
    }
    step.min(1.0)
}

/// The smallest `t > 0` with `det(A + t B) = 0`; infinite without one. `det A > 0`.
///
/// The polynomial in `t` has positive value at zero; the first root is bracketed by its own stationary points and found by bisection.
fn first_root<const D: usize>(a: &Mat<f64, D>, b: &Mat<f64, D>) -> f64 {
    let d0 = a.determinant();
    let d1 = a.cofactor().dot(b);
    // In 2D the quadratic coefficient is det B, in 3D it is cof B : A, and det B the cubic one.
    let (d2, d3) = if D == 2 { (b.determinant(), 0.0) } else { (b.cofactor().dot(a), b.determinant()) };
    let at = |t: f64| d0 + t * (d1 + t * (d2 + t * d3));
    // Where the slope d1 + 2 d2 t + 3 d3 t^2 vanishes: between these the polynomial is monotonic.
    let (qa, qb, qc) = (3.0 * d3, 2.0 * d2, d1);
    let discriminant = qb * qb - 4.0 * qa * qc;
    let mut stops = vec![];
    if discriminant >= 0.0 {
        let q = -0.5 * (qb + discriminant.sqrt().copysign(qb));
        stops.extend([q / qa, qc / q]);
    }
    stops.retain(|t: &f64| *t > 0.0 && t.is_finite());
    // Steps are at most 1, and a root beyond the margin does not matter.
    const FAR: f64 = 2.0;
    stops.push(FAR);
    stops.sort_by(f64::total_cmp);
    let mut low = 0.0;
    for stop in stops.into_iter().filter(|t| *t <= FAR) {
        if at(stop) <= 0.0 {
            let mut high = stop;
            for _ in 0..100 {
                let middle = 0.5 * (low + high);
                if at(middle) > 0.0 { low = middle } else { high = middle }
            }
            return low;
        }
        low = stop;
    }
    f64::INFINITY
}
