//! The Hessians of elements, `K_(ab) = w sum_(jl) (dP_ij / dF_kl) (grad N_a)_j (grad N_b)_l`; Sifakis,
//! Barbic 2012, section 4.3.
//!
//! For isotropic models the decomposition `F = U diag(sigma) V^T` and the blocks run on lanes, for all
//! models alike; only the few numbers of the spectrum come from the model, one element at a time. In the
//! frame of `U` and `V` most of `dP/dF` is zero: with `g_a = V^T grad N_a`, `same = (flip + twist)/2` and
//! `swapped = (flip - twist)/2`,
//!
//! ```text
//! (U^T K_ab U)_ii = scaling_ii g_ai g_bi + sum_(j != i) same_ij g_aj g_bj
//! (U^T K_ab U)_ik = scaling_ik g_ai g_bk + swapped_ik g_ak g_bi,   i != k
//! ```

use std::ops::Range;

use super::Elastic;
use super::block::{Block, SpectrumBlock};
use super::predicted::add_excess;
use crate::algebra::{Mat, signed_svd, symmetric_eigen_of_lanes};
use crate::element::{
    SimplexPack, edge_matrix, order, quadrature_count, quadrature_position, reference_gradients,
};
use crate::lanes::{Kernel, Lanes, WIDTH, dispatch};
use crate::material::{Psd, Tangent};

/// Packs that go through all phases together: what is handed on stays in the first cache.
const BATCH: usize = 4;

/// Numbers in the Hessian of a tetrahedron, rounded up to whole packs.
const MOST_ENTRIES: usize = 96;

/// Intermediate results of the elements of a pack.
#[repr(align(64))]
struct PackWork<const D: usize, const N: usize> {
    points: [[[f64; WIDTH]; D]; N],
    u: Block<D>,
    v: Block<D>,
    sigma: [[f64; WIDTH]; D],
    spectrum: SpectrumBlock<D>,
}

impl<const D: usize, const N: usize> PackWork<D, N> {
    const EMPTY: Self = PackWork {
        points: [[[0.0; WIDTH]; D]; N],
        u: Block::ZERO,
        v: Block::ZERO,
        sigma: [[0.0; WIDTH]; D],
        spectrum: SpectrumBlock::ZERO,
    };
}

/// Writes the Hessians of `stencils`, whole packs of them; with a place `from`, with the stresses that are
/// predicted from it.
pub(super) fn fill<const D: usize, const N: usize>(
    elements: &Elastic<D, N>,
    stencils: Range<usize>,
    x: &[f64],
    (psd, from): (Psd, Option<&[f64]>),
    out: &mut [f64],
) {
    let Elastic { material, patches, rest, .. } = elements;
    if from.is_some() || order::<D, N>() > 1 || material.spectrum(&[1.0; D]).is_none() {
        return fill_by_tangent(elements, stencils, x, (psd, from), out);
    }
    let x = x.as_chunks::<D>().0;
    let per_stencil = N * (N + 1) / 2 * D * D;
    let mut lanes = patches.lanes_in(stencils.clone());
    let mut work = [const { PackWork::<D, N>::EMPTY }; BATCH];
    let packs = &rest[stencils.start / WIDTH..stencils.end / WIDTH];
    let batches = packs.chunks(BATCH).zip(out.chunks_mut(BATCH * WIDTH * per_stencil));
    for (packs, out) in batches {
        let work = &mut work[..packs.len()];
        for pack in &mut *work {
            for lane in 0..WIDTH {
                let (vertices, ..) = lanes.next().expect("whole packs");
                for (node, v) in vertices.into_iter().enumerate() {
                    for c in 0..D {
                        pack.points[node][c][lane] = x[v as usize][c];
                    }
                }
            }
        }
        dispatch(Decompose { packs, work });
        for pack in &mut *work {
            material.spectra(&pack.sigma, &mut pack.spectrum);
        }
        dispatch(PairBlocks { packs, work, psd, out });
    }
}

/// `F` and its decomposition.
struct Decompose<'a, const D: usize, const N: usize> {
    packs: &'a [SimplexPack<D>],
    work: &'a mut [PackWork<D, N>],
}

impl<const D: usize, const N: usize> Kernel for Decompose<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (pack, work) in self.packs.iter().zip(self.work) {
            let mut x = [[L::zero(); D]; N];
            for node in 0..N {
                for c in 0..D {
                    x[node][c] = L::load(&work.points[node][c]);
                }
            }
            let svd = signed_svd(&edge_matrix(&x).mul(&pack.inverse_rest::<L>()));
            for i in 0..D {
                svd.sigma[i].store(&mut work.sigma[i]);
            }
            work.u.store(&svd.u);
            work.v.store(&svd.v);
        }
    }
}

/// The blocks of every pair of vertices, weighted.
struct PairBlocks<'a, const D: usize, const N: usize> {
    packs: &'a [SimplexPack<D>],
    work: &'a [PackWork<D, N>],
    psd: Psd,
    /// The Hessians, one element after another.
    out: &'a mut [f64],
}

/// The numbers of the Hessians of a pack, in the order in which they are written.
#[repr(align(64))]
struct Entries([[f64; WIDTH]; MOST_ENTRIES]);

impl Entries {
    #[inline(always)]
    fn set<L: Lanes, const D: usize>(&mut self, block: usize, k: &Mat<L, D>) {
        for i in 0..D {
            for j in 0..D {
                k[i][j].store(&mut self.0[block * D * D + i * D + j]);
            }
        }
    }

    /// Writes `count` numbers of each lane, one lane after another.
    #[inline(always)]
    fn write<L: Lanes>(&self, count: usize, out: &mut [f64]) {
        for (i, columns) in self.0.as_chunks::<WIDTH>().0.iter().enumerate().take(count.div_ceil(WIDTH)) {
            let mut pack = [L::zero(); WIDTH];
            for c in 0..WIDTH {
                pack[c] = L::load(&columns[c]);
            }
            let rows = L::transpose(pack);
            for l in 0..WIDTH {
                let out = &mut out[l * count..][..count][i * WIDTH..];
                if let Some(out) = out.first_chunk_mut() {
                    rows[l].store(out);
                } else {
                    out.copy_from_slice(&rows[l].to_array()[..out.len()]);
                }
            }
        }
    }
}

#[inline(always)]
fn clamp<L: Lanes>(eigenvalue: L, projected: bool) -> L {
    // A comparison, not a maximum: NaN is kept.
    if projected { L::select(eigenvalue.lt(L::zero()), L::zero(), eigenvalue) } else { eigenvalue }
}

/// The nearest positive semi-definite matrix.
#[inline(always)]
fn nearest_psd<L: Lanes, const D: usize>(a: &Mat<L, D>) -> Mat<L, D> {
    // All leading minors positive: nothing to do, which is what is usual.
    let mut minor = a[0][0];
    let mut fine = L::zero().lt(minor);
    minor = a[0][0].mul_add(a[1][1], -(a[0][1] * a[1][0]));
    fine = fine & L::zero().lt(minor);
    if D == 3 {
        fine = fine & L::zero().lt(a.determinant());
    }
    if L::mask_to_bits(fine) == u8::MAX {
        return *a;
    }
    let (lambda, vectors) = symmetric_eigen_of_lanes(a);
    let mut clamped = [L::zero(); D];
    for i in 0..D {
        clamped[i] = clamp(lambda[i], true);
    }
    Mat::select(fine, a, &vectors.transpose_mul(&Mat::diagonal(&clamped)).mul(&vectors))
}

impl<const D: usize, const N: usize> Kernel for PairBlocks<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let projected = self.psd == Psd::Projected;
        let half = L::splat(0.5);
        let count = N * (N + 1) / 2 * D * D;
        // Where the block of a pair `a <= b` is.
        let place = |a: usize, b: usize| a * N - a * (a + 1) / 2 + b;
        let mut entries = Entries([[0.0; WIDTH]; MOST_ENTRIES]);
        let packs = self.packs.iter().zip(self.work).zip(self.out.chunks_exact_mut(WIDTH * count));
        for ((pack, work), out) in packs {
            let mut scaling = work.spectrum.scaling.load::<L>();
            if projected {
                scaling = nearest_psd(&scaling);
            }
            let (twist, flip) = (work.spectrum.twist.load::<L>(), work.spectrum.flip.load::<L>());
            let (mut same, mut swapped) = (Mat::<L, D>::zero(), Mat::<L, D>::zero());
            for i in 0..D {
                for j in i + 1..D {
                    let twist = clamp(twist[i][j], projected);
                    let flip = clamp(flip[i][j], projected);
                    same[i][j] = half * (flip + twist);
                    swapped[i][j] = half * (flip - twist);
                    same[j][i] = same[i][j];
                    swapped[j][i] = swapped[i][j];
                }
            }
            let weight = pack.weight::<L>();
            // Rows: the gradients of the shape functions in the frame of V.
            let g = pack.inverse_rest::<L>().mul(&work.v.load::<L>());
            let u = work.u.load::<L>();
            // A translation costs nothing: the blocks of vertex 0 are minus the sums of the others.
            let mut first = [Mat::<L, D>::zero(); N];
            for a in 0..D {
                for b in a..D {
                    let mut k = Mat::<L, D>::zero();
                    for i in 0..D {
                        let mut diagonal = scaling[i][i] * g[a][i] * g[b][i];
                        for j in 0..D {
                            if j != i {
                                diagonal = same[i][j].mul_add(g[a][j] * g[b][j], diagonal);
                                k[i][j] = weight
                                    * scaling[i][j]
                                        .mul_add(g[a][i] * g[b][j], swapped[i][j] * (g[a][j] * g[b][i]));
                            }
                        }
                        k[i][i] = weight * diagonal;
                    }
                    let block = u.mul(&k).mul_transpose(&u);
                    entries.set(place(a + 1, b + 1), &block);
                    // K_0b = -sum_a K_ab, with K_ba = K_ab^T; K_00 = -sum_b K_0b^T.
                    first[b + 1] = first[b + 1] - block;
                    if a != b {
                        first[a + 1] = first[a + 1] - block.transpose();
                    }
                }
                first[0] = first[0] - first[a + 1].transpose();
            }
            for b in 0..N {
                entries.set(b, &first[b]);
            }
            entries.write::<L>(count, out);
        }
    }
}

/// As [`fill`], one quadrature point after another: for models that give the whole tangent, and for elements
/// with several points.
fn fill_by_tangent<const D: usize, const N: usize>(
    elements: &Elastic<D, N>,
    stencils: Range<usize>,
    x: &[f64],
    (psd, from): (Psd, Option<&[f64]>),
    out: &mut [f64],
) {
    let Elastic { material, patches, rest, .. } = elements;
    let count = quadrature_count::<D, N>();
    let pairs = N * (N + 1) / 2;
    let lanes = patches.lanes_in(stencils).zip(out.chunks_exact_mut(pairs * D * D));
    for ((vertices, pack, lane), out) in lanes {
        out.fill(0.0);
        let before = from.map(|from| elements.points(from, &vertices, pack, lane));
        for (q, [dx, inverse]) in elements.points(x, &vertices, pack, lane).into_iter().enumerate() {
            let weight = rest[pack * count + q].lane(lane).1;
            let f = dx.mul(&inverse);
            let mut tangent = material.tangent(&f, psd);
            if let Some(before) = &before {
                let from = before[q][0].mul(&inverse);
                add_excess(&**material, elements.stress, [&from, &f], &mut tangent);
            }
            // Gradients of the shape functions, grad N_a = J^-T dN_a/dxi.
            let reference = reference_gradients::<D, N>(&quadrature_position::<D, N>(q));
            let mut gradient = [[0.0; D]; N];
            for a in 0..N {
                for j in 0..D {
                    gradient[a][j] = (0..D).map(|l| reference[a][l] * inverse[l][j]).sum();
                }
            }
            add_blocks(&tangent, weight, &gradient, out);
        }
    }
}

/// Adds the blocks `w C_ijkl (grad N_a)_j (grad N_b)_l` of a tangent `C`, for each pair `a <= b`.
fn add_blocks<const D: usize, const N: usize>(
    tangent: &Tangent<D>,
    weight: f64,
    gradient: &[[f64; D]; N],
    out: &mut [f64],
) {
    let mut blocks = out.chunks_exact_mut(D * D);
    for a in 0..N {
        // w (grad N_a)_j C_ijkl
        let mut half = [[[0.0; D]; D]; D];
        for i in 0..D {
            for k in 0..D {
                for l in 0..D {
                    half[i][k][l] =
                        weight * (0..D).map(|j| gradient[a][j] * tangent.0[i][j][k][l]).sum::<f64>();
                }
            }
        }
        for b in a..N {
            let out = blocks.next().expect("a block for each pair");
            for i in 0..D {
                for k in 0..D {
                    out[i * D + k] += (0..D).map(|l| half[i][k][l] * gradient[b][l]).sum::<f64>();
                }
            }
        }
    }
}
