//! Hessians of elements, `K_(ab) = w sum_(jl) (dP_ij / dF_kl) (grad N_a)_j (grad N_b)_l`; Sifakis, Barbic
//! 2012, section 4.3.
//!
//! For isotropic models the decomposition `F = U diag(sigma) V^T` and the blocks run on lanes, in code
//! that all models share. Only the few numbers of the spectrum come from the model, one element at a
//! time. In the frame of `U` and `V` most of `dP/dF` is zero: with `g_a = V^T grad N_a`,
//! `same = (flip + twist)/2` and `swapped = (flip - twist)/2`,
//!
//! ```text
//! (U^T K_ab U)_ii = scaling_ii g_ai g_bi + sum_(j != i) same_ij g_aj g_bj
//! (U^T K_ab U)_ik = scaling_ik g_ai g_bk + swapped_ik g_ak g_bi,   i != k
//! ```

use std::ops::Range;

use super::Elastic;
use super::block::{Block, SpectrumBlock};
use super::kinematics::{Kinematics, edges_at, rest_gradients};
use super::predicted::add_excess;
use crate::algebra::{Mat, signed_svd, symmetric_eigen_of_lanes};
use crate::element::{
    MOST_POINTS, SimplexPack, is_simplex, quadrature_count, quadrature_position, reference_gradients,
};
use crate::lanes::{Kernel, Lanes, WIDTH, dispatch};
use crate::material::{Psd, Tangent};

/// Packs that go through all phases together, so that intermediate results stay in the L1 cache.
const BATCH: usize = 4;

/// Numbers in the Hessian of a tetrahedron, rounded up to whole packs.
const MOST_ENTRIES: usize = 96;

/// Numbers in the Hessian of a second-order tetrahedron, rounded up to whole packs.
const MOST_QUADRATIC_ENTRIES: usize = 496;

/// Numbers in the Hessian of a hexahedron of 27 nodes.
const MOST_CELL_ENTRIES: usize = 3408;

/// Positions of the nodes of the elements of a pack.
#[repr(align(64))]
struct PackNodes<const D: usize, const N: usize>([[[f64; WIDTH]; D]; N]);

/// Intermediate results at a quadrature point of the elements of a pack.
#[repr(align(64))]
struct PackWork<const D: usize> {
    u: Block<D>,
    v: Block<D>,
    sigma: [[f64; WIDTH]; D],
    spectrum: SpectrumBlock<D>,
}

impl<const D: usize> PackWork<D> {
    const EMPTY: Self =
        PackWork { u: Block::ZERO, v: Block::ZERO, sigma: [[0.0; WIDTH]; D], spectrum: SpectrumBlock::ZERO };
}

/// Writes the Hessians of `stencils`, which are whole packs. If there are positions `from`, the Hessians
/// use the stresses predicted from them.
pub(super) fn fill<const D: usize, const N: usize>(
    elements: &Elastic<D, N>,
    stencils: Range<usize>,
    x: &[f64],
    (psd, from): (Psd, Option<&[f64]>),
    out: &mut [f64],
) {
    let material = &elements.material;
    if from.is_some() || material.spectrum(&[1.0; D]).is_none() {
        return fill_by_tangent(elements, stencils, x, (psd, from), out);
    }
    if const { is_simplex::<D, N>() } {
        fill_by_spectrum::<D, N, BATCH, MOST_QUADRATIC_ENTRIES>(elements, stencils, x, psd, out);
    } else {
        fill_by_spectrum::<D, N, MOST_POINTS, MOST_CELL_ENTRIES>(elements, stencils, x, psd, out);
    }
}

/// Writes the Hessians like [`fill`], for models that know their spectrum, with room for `WORK` points at
/// a time and for `MOST` numbers in the Hessian of an element with several points.
fn fill_by_spectrum<const D: usize, const N: usize, const WORK: usize, const MOST: usize>(
    elements: &Elastic<D, N>,
    stencils: Range<usize>,
    x: &[f64],
    psd: Psd,
    out: &mut [f64],
) {
    let Elastic { material, elements: Kinematics { patches, rest }, .. } = elements;
    let count = quadrature_count::<D, N>();
    // All points of one pack are processed together, or several packs of one point each.
    let together = if count == 1 { BATCH } else { 1 };
    let x = x.as_chunks::<D>().0;
    let per_stencil = N * (N + 1) / 2 * D * D;
    let mut lanes = patches.lanes_in(stencils.clone());
    let mut nodes = [const { PackNodes::<D, N>([[[0.0; WIDTH]; D]; N]) }; BATCH];
    let mut work = [const { PackWork::<D>::EMPTY }; WORK];
    let packs = &rest[stencils.start / WIDTH * count..stencils.end / WIDTH * count];
    let batches = packs.chunks(together * count).zip(out.chunks_mut(together * WIDTH * per_stencil));
    for (packs, out) in batches {
        let work = &mut work[..packs.len()];
        let nodes = &mut nodes[..packs.len() / count];
        // Gather the nodes.
        for pack in nodes.iter_mut() {
            for lane in 0..WIDTH {
                let (vertices, ..) = lanes.next().expect("whole packs");
                for (node, v) in vertices.into_iter().enumerate() {
                    for c in 0..D {
                        pack.0[node][c][lane] = x[v as usize][c];
                    }
                }
            }
        }
        // Stretches and axes on lanes, the spectrum from the model, then the blocks.
        dispatch(Decompose { packs, nodes, work });
        for pack in &mut *work {
            material.spectra(&pack.sigma, &mut pack.spectrum);
        }
        match count {
            1 => dispatch(PairBlocks::<D, N> { packs, work, psd, out }),
            _ => dispatch(PointBlocks::<D, N, MOST> { packs, work, psd, out }),
        }
    }
}

/// Computes `F` and its decomposition.
struct Decompose<'a, const D: usize, const N: usize> {
    packs: &'a [SimplexPack<D>],
    nodes: &'a [PackNodes<D, N>],
    work: &'a mut [PackWork<D>],
}

impl<const D: usize, const N: usize> Kernel for Decompose<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let count = quadrature_count::<D, N>();
        let mut x = [[L::zero(); D]; N];
        for (i, (pack, work)) in self.packs.iter().zip(self.work).enumerate() {
            let q = i % count;
            if q == 0 {
                for node in 0..N {
                    for c in 0..D {
                        x[node][c] = L::load(&self.nodes[i / count].0[node][c]);
                    }
                }
            }
            let svd = signed_svd(&edges_at(&x, q).mul(&pack.inverse_rest::<L>()));
            for i in 0..D {
                svd.sigma[i].store(&mut work.sigma[i]);
            }
            work.u.store(&svd.u);
            work.v.store(&svd.v);
        }
    }
}

/// Writes the weighted blocks of every pair of vertices.
struct PairBlocks<'a, const D: usize, const N: usize> {
    packs: &'a [SimplexPack<D>],
    work: &'a [PackWork<D>],
    psd: Psd,
    /// Hessians, one element after another.
    out: &'a mut [f64],
}

/// Numbers of the Hessians of a pack, in the order in which they are written.
#[repr(align(64))]
pub(super) struct Entries<const MOST: usize>(pub(super) [[f64; WIDTH]; MOST]);

impl<const MOST: usize> Entries<MOST> {
    #[inline(always)]
    fn get<L: Lanes, const D: usize>(&self, block: usize) -> Mat<L, D> {
        let mut k = Mat::zero();
        for i in 0..D {
            for j in 0..D {
                k[i][j] = L::load(&self.0[block * D * D + i * D + j]);
            }
        }
        k
    }

    #[inline(always)]
    pub(super) fn set<L: Lanes, const D: usize>(&mut self, block: usize, k: &Mat<L, D>) {
        for i in 0..D {
            for j in 0..D {
                k[i][j].store(&mut self.0[block * D * D + i * D + j]);
            }
        }
    }

    /// Writes `count` numbers of each lane, one lane after another.
    #[inline(always)]
    pub(super) fn write<L: Lanes>(&self, count: usize, out: &mut [f64]) {
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
    // A comparison keeps NaN, a maximum does not.
    if projected { L::select(eigenvalue.lt(L::zero()), L::zero(), eigenvalue) } else { eigenvalue }
}

/// Returns the nearest positive semi-definite matrix.
#[inline(always)]
fn nearest_psd<L: Lanes, const D: usize>(a: &Mat<L, D>) -> Mat<L, D> {
    // All leading minors are positive in the usual case: nothing to do.
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

impl<const D: usize> SpectrumBlock<D> {
    /// Returns `scaling`, `same` and `swapped`, if `projected` of the nearest positive semi-definite
    /// `dP/dF`.
    #[inline(always)]
    pub(super) fn in_frame<L: Lanes>(&self, projected: bool) -> (Mat<L, D>, Mat<L, D>, Mat<L, D>) {
        let half = L::splat(0.5);
        let mut scaling = self.scaling.load::<L>();
        if projected {
            scaling = nearest_psd(&scaling);
        }
        let (twist, flip) = (self.twist.load::<L>(), self.flip.load::<L>());
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
        (scaling, same, swapped)
    }
}

/// Blocks `K_0b` of the first node of an element: minus the sums of the others, because a translation
/// costs no energy.
pub(super) struct FirstRow<L, const D: usize, const N: usize>([Mat<L, D>; N]);

impl<L: Lanes, const D: usize, const N: usize> FirstRow<L, D, N> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        FirstRow([Mat::zero(); N])
    }

    /// Adds the contribution of a pair `0 < a <= b`: `K_0b = -sum_a K_ab`, with `K_ba = K_ab^T`.
    #[inline(always)]
    pub(super) fn take(&mut self, (a, b): (usize, usize), block: &Mat<L, D>) {
        self.0[b] = self.0[b] - *block;
        if a != b {
            self.0[a] = self.0[a] - block.transpose();
        }
    }

    /// Returns the blocks after all pairs were taken: `K_00 = -sum_b K_0b^T`.
    #[inline(always)]
    pub(super) fn blocks(mut self) -> [Mat<L, D>; N] {
        for b in 1..N {
            self.0[0] = self.0[0] - self.0[b].transpose();
        }
        self.0
    }
}

/// Returns `U^T K_ab U` without its weight, of vertices with the gradients `g_a` and `g_b` in the frame
/// of `V`.
#[inline(always)]
pub(super) fn pair_block<L: Lanes, const D: usize>(
    (scaling, same, swapped): (&Mat<L, D>, &Mat<L, D>, &Mat<L, D>),
    (a, b): (&[L; D], &[L; D]),
) -> Mat<L, D> {
    let mut k = Mat::zero();
    for i in 0..D {
        let mut diagonal = scaling[i][i] * a[i] * b[i];
        for j in 0..D {
            if j != i {
                diagonal = same[i][j].mul_add(a[j] * b[j], diagonal);
                k[i][j] = scaling[i][j].mul_add(a[i] * b[j], swapped[i][j] * (a[j] * b[i]));
            }
        }
        k[i][i] = diagonal;
    }
    k
}

impl<const D: usize, const N: usize> Kernel for PairBlocks<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let projected = self.psd == Psd::Projected;
        let count = N * (N + 1) / 2 * D * D;
        // Index of the block of a pair `a <= b`.
        let place = |a: usize, b: usize| a * N - a * (a + 1) / 2 + b;
        let mut entries = Entries::<MOST_ENTRIES>([[0.0; WIDTH]; MOST_ENTRIES]);
        let packs = self.packs.iter().zip(self.work).zip(self.out.chunks_exact_mut(WIDTH * count));
        for ((pack, work), out) in packs {
            let (scaling, same, swapped) = work.spectrum.in_frame::<L>(projected);
            let weight = pack.weight::<L>();
            // Rows: the gradients of the shape functions in the frame of V.
            let g = pack.inverse_rest::<L>().mul(&work.v.load::<L>());
            let u = work.u.load::<L>();
            let mut first = FirstRow::<L, D, N>::new();
            for a in 0..D {
                for b in a..D {
                    let k = pair_block((&scaling, &same, &swapped), (&g[a], &g[b])).scale(weight);
                    let block = u.mul(&k).mul_transpose(&u);
                    entries.set(place(a + 1, b + 1), &block);
                    first.take((a + 1, b + 1), &block);
                }
            }
            let first = first.blocks();
            for b in 0..N {
                entries.set(b, &first[b]);
            }
            entries.write::<L>(count, out);
        }
    }
}

/// Writes the blocks of every pair of nodes of a pack of second-order elements, as sums over its points.
struct PointBlocks<'a, const D: usize, const N: usize, const MOST: usize> {
    packs: &'a [SimplexPack<D>],
    work: &'a [PackWork<D>],
    psd: Psd,
    /// Hessians, one element after another.
    out: &'a mut [f64],
}

impl<const D: usize, const N: usize, const MOST: usize> Kernel for PointBlocks<'_, D, N, MOST> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let projected = self.psd == Psd::Projected;
        // Index of the block of a pair `a <= b`.
        let place = |a: usize, b: usize| a * N - a * (a + 1) / 2 + b;
        let mut entries = Entries::<MOST>([[0.0; WIDTH]; MOST]);
        for (q, (pack, work)) in self.packs.iter().zip(self.work).enumerate() {
            let (scaling, same, swapped) = work.spectrum.in_frame::<L>(projected);
            let weight = pack.weight::<L>();
            let (scaling, same, swapped) = (scaling.scale(weight), same.scale(weight), swapped.scale(weight));
            let u = work.u.load::<L>();
            // Gradients of the shape functions in the frame of V, `V^T J^-T dN_a/dxi`.
            let reference = reference_gradients::<D, N>(&quadrature_position::<D, N>(q));
            let turned = pack.inverse_rest::<L>().mul(&work.v.load::<L>());
            let mut g = [[L::zero(); D]; N];
            for a in 1..N {
                for l in 0..D {
                    for i in 0..D {
                        g[a][i] = L::splat(reference[a][l]).mul_add(turned[l][i], g[a][i]);
                    }
                }
            }
            for a in 1..N {
                for b in a..N {
                    let k = pair_block((&scaling, &same, &swapped), (&g[a], &g[b]));
                    let sum = entries.get::<L, D>(place(a, b)) + u.mul(&k).mul_transpose(&u);
                    entries.set(place(a, b), &sum);
                }
            }
        }
        let mut first = FirstRow::<L, D, N>::new();
        for a in 1..N {
            for b in a..N {
                first.take((a, b), &entries.get(place(a, b)));
            }
        }
        let first = first.blocks();
        for b in 0..N {
            entries.set(b, &first[b]);
        }
        entries.write::<L>(N * (N + 1) / 2 * D * D, self.out);
    }
}

/// Writes the Hessians like [`fill`], one quadrature point after another, for models that give the whole
/// tangent.
fn fill_by_tangent<const D: usize, const N: usize>(
    elements: &Elastic<D, N>,
    stencils: Range<usize>,
    x: &[f64],
    (psd, from): (Psd, Option<&[f64]>),
    out: &mut [f64],
) {
    let Elastic { material, elements: kinematics, .. } = elements;
    let pairs = N * (N + 1) / 2;
    let lanes = kinematics.patches.lanes_in(stencils).zip(out.chunks_exact_mut(pairs * D * D));
    for ((vertices, pack, lane), out) in lanes {
        out.fill(0.0);
        let mut before = from.map(|from| kinematics.at_points(from, &vertices, (pack, lane)));
        for (q, (f, inverse, weight)) in kinematics.at_points(x, &vertices, (pack, lane)).enumerate() {
            let f = Mat(f);
            let mut tangent = material.tangent(&f, psd);
            if let Some((from, ..)) = before.as_mut().and_then(Iterator::next) {
                add_excess(&**material, elements.stress, [&Mat(from), &f], &mut tangent);
            }
            add_blocks(&tangent, weight, &rest_gradients::<D, N>(q, &inverse), out);
        }
    }
}

/// Adds the blocks `w C_ijkl (grad N_a)_j (grad N_b)_l` of a tangent `C`, for each pair `a <= b`.
pub(super) fn add_blocks<const D: usize, const N: usize>(
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
