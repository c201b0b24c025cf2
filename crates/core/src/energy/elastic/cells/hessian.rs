//! Hessians of cells. With the amplitudes `z` in reference axes, `y = K z`, `u_a = sum_h gamma_ha y_h`
//! and `Y = sum_h q_h y_h^T`,
//!
//! ```text
//! K_ab = V b_a C b_b + dz/dx_a . K dz/dx_b + [F (u_a x b_b + b_a x u_b) + Y (b_a x b_b)]_x
//! ```
//!
//! where the last term, the stress term, is that of amplitudes pulled back by `cof F`; in 2D it has no
//! `Y` and no `F`. The projection to positive matrices projects `C` and omits the last term; `K` is
//! positive.

use std::ops::Range;

use super::super::block::{Block, SpectrumBlock};
use super::super::hessian::{Entries, FirstRow, add_blocks, pair_block};
use super::super::predicted::add_excess;
use super::OnePointCells;
use super::hourglass::{PullBack, by_each, times};
use super::kernels::loaded;
use super::packs::{PackRest, in_lanes};
use super::rest::{Amplitudes, MOST_MODES, RestData, modes, outer_sum};
use crate::algebra::{Dual, Mat, TURNS, signed_svd};
use crate::lanes::{Kernel, Lanes, WIDTH, dispatch};
use crate::material::Psd;

/// Numbers in the Hessian of a hexahedron, rounded up to whole packs.
const MOST_ENTRIES: usize = 328;

/// Positions of the nodes of a pack.
type PackNodes<const D: usize, const N: usize> = [[[f64; WIDTH]; D]; N];

/// Decomposition `F = U diag(sigma) V^T` of a pack, and the spectrum of its `dP/dF`.
struct PackSpectrum<const D: usize> {
    u: Block<D>,
    v: Block<D>,
    sigma: [[f64; WIDTH]; D],
    spectrum: SpectrumBlock<D>,
}

/// Writes the Hessians of `stencils`, which are whole packs. If there are positions `from`, the Hessians
/// use the stresses predicted from them.
pub(super) fn fill<const D: usize, const N: usize>(
    term: &OnePointCells<D, N>,
    stencils: Range<usize>,
    x: &[f64],
    (psd, from): (Psd, Option<&[f64]>),
    out: &mut [f64],
) {
    let per_stencil = N * (N + 1) / 2 * D * D;
    let has_spectrum = from.is_none() && term.material.spectrum(&[1.0; D]).is_some();
    let packs = stencils.start / WIDTH..stencils.end / WIDTH;
    let mut lanes = term.patches.lanes_in(stencils);
    let mut of_pack = PackSpectrum {
        u: Block::ZERO,
        v: Block::ZERO,
        sigma: [[0.0; WIDTH]; D],
        spectrum: SpectrumBlock::ZERO,
    };
    for (pack, out) in packs.zip(out.chunks_exact_mut(WIDTH * per_stencil)) {
        let cells: Vec<[u32; N]> = lanes.by_ref().take(WIDTH).map(|(vertices, ..)| vertices).collect();
        let nodes = &in_lanes(x, &cells);
        let from_nodes = from.map(|from| in_lanes(from, &cells));
        let from_nodes = from_nodes.as_ref();
        // Stretches on lanes, the spectrum from the model.
        if has_spectrum {
            dispatch(CellStretchKernel { term, pack, nodes, out: &mut of_pack });
            term.material.spectra(&of_pack.sigma, &mut of_pack.spectrum);
        }
        // Blocks of the hourglass modes, and of the material if it has a spectrum.
        let spectrum = has_spectrum.then_some(&of_pack);
        dispatch(CellBlocksKernel { term, pack, nodes, from: from_nodes, spectrum, psd, out });
        if has_spectrum {
            continue;
        }
        // Without a spectrum: add the blocks of the whole tangent, cell by cell.
        for ((lane, vertices), out) in cells.iter().enumerate().zip(out.chunks_exact_mut(per_stencil)) {
            let (volume, gradient) = term.packs.gradients_of_lane(pack, lane);
            if volume == 0.0 {
                continue;
            }
            let f = term.deformation_of(x, vertices, (pack, lane));
            let mut tangent = term.material.tangent(&f, psd);
            if let Some(from) = from.filter(|_| term.nearly_incompressible) {
                let from = term.deformation_of(from, vertices, (pack, lane));
                add_excess(&*term.material, term.stress, [&from, &f], &mut tangent);
            }
            add_blocks(&tangent, volume, &gradient, out);
        }
    }
}

/// Writes the stretches and axes of a pack.
struct CellStretchKernel<'a, const D: usize, const N: usize> {
    term: &'a OnePointCells<D, N>,
    pack: usize,
    nodes: &'a PackNodes<D, N>,
    out: &'a mut PackSpectrum<D>,
}

impl<const D: usize, const N: usize> Kernel for CellStretchKernel<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let rest: PackRest<'_, L, D, N> = self.term.packs.rest(self.pack);
        let (f, _) = rest.measure(&loaded::<L, D, N>(self.nodes));
        let svd = signed_svd::<L, D>(&f);
        for i in 0..D {
            svd.sigma[i].store(&mut self.out.sigma[i]);
        }
        self.out.u.store(&svd.u);
        self.out.v.store(&svd.v);
    }
}

/// Writes the Hessians of a pack; without a `spectrum` only those of the hourglass modes.
struct CellBlocksKernel<'a, const D: usize, const N: usize> {
    term: &'a OnePointCells<D, N>,
    pack: usize,
    nodes: &'a PackNodes<D, N>,
    from: Option<&'a PackNodes<D, N>>,
    spectrum: Option<&'a PackSpectrum<D>>,
    psd: Psd,
    out: &'a mut [f64],
}

/// Returns `dz` of a unit displacement along `i` of a node with the gradient `b` and these weights.
#[inline(always)]
fn amplitude_slope<L: Lanes, const D: usize>(
    pull_back: PullBack,
    (f, cofactor, q): (&Mat<L, D>, &Mat<L, D>, &Amplitudes<L, D>),
    (b, weights, i): (&[L; D], &[L; MOST_MODES], usize),
) -> Amplitudes<L, D> {
    let mut slope = [[L::zero(); D]; MOST_MODES];
    match pull_back {
        PullBack::None => {
            for h in 0..modes(D) {
                slope[h][i] = weights[h];
            }
        }
        PullBack::Cofactor => {
            let mut along = Mat::zero();
            along[i] = *b;
            slope = by_each::<L, D>(&f.cofactor_derivative(&along).transpose(), q);
            for h in 0..modes(D) {
                for k in 0..D {
                    slope[h][k] = weights[h].mul_add(cofactor[i][k], slope[h][k]);
                }
            }
        }
    }
    slope
}

/// Returns `T (a x b)`; in 2D `a x b`, along the normal.
#[inline(always)]
fn crossed<L: Lanes, const D: usize>(t: &Mat<L, D>, a: &[L; D], b: &[L; D]) -> [L; 3] {
    let normal_z = a[0].mul_add(b[1], -(a[1] * b[0]));
    let mut axis = [L::zero(), L::zero(), normal_z];
    if D == 3 {
        let normal = [
            a[1].mul_add(b[2 % D], -(a[2 % D] * b[1])),
            a[2 % D].mul_add(b[0], -(a[0] * b[2 % D])),
            normal_z,
        ];
        for m in 0..D {
            axis[m] = t[m][0].mul_add(normal[0], t[m][1].mul_add(normal[1], t[m][2 % D] * normal[2]));
        }
    }
    axis
}

/// Adds the stress term of pulled back amplitudes to a block.
#[inline(always)]
fn add_stress_term<L: Lanes, const D: usize>(
    (f, outer): (&Mat<L, D>, &Mat<L, D>),
    (b_a, u_a): (&[L; D], &[L; D]),
    (b_b, u_b): (&[L; D], &[L; D]),
    block: &mut Mat<L, D>,
) {
    let (one, other, third) = (crossed(f, u_a, b_b), crossed(f, b_a, u_b), crossed(outer, b_a, b_b));
    for (i, k, m, sign) in TURNS {
        if i < D && k < D {
            let mut axis = one[m] + other[m];
            if D == 3 {
                axis += third[m];
            }
            block[i][k] = L::splat(sign).mul_add(axis, block[i][k]);
        }
    }
}

impl<const D: usize, const N: usize> CellBlocksKernel<'_, D, N> {
    /// Returns `y`, evaluated or predicted.
    #[inline(always)]
    fn stresses<L: Lanes>(
        &self,
        rest: &PackRest<'_, L, D, N>,
        x: &[[L; D]; N],
        z: &Amplitudes<L, D>,
    ) -> Amplitudes<L, D> {
        let mut amplitudes = *z;
        if let Some(from) = self.from {
            let from = loaded::<L, D, N>(from);
            let mut moved = [[Dual::constant(L::zero()); D]; N];
            for a in 0..N {
                for i in 0..D {
                    moved[a][i] = Dual { value: from[a][i], derivative: x[a][i] - from[a][i] };
                }
            }
            let (f, q): (Mat<Dual<L>, D>, _) = rest.measure(&moved);
            let at = self.term.pull_back.pulled(&f.cofactor(), &q);
            for h in 0..modes(D) {
                for i in 0..D {
                    amplitudes[h][i] = at[h][i].value + at[h][i].derivative;
                }
            }
        }
        times(&rest.stiffness::<L>(), &amplitudes)
    }
}

impl<const D: usize, const N: usize> Kernel for CellBlocksKernel<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        // F, amplitudes and their stresses.
        let pull_back = self.term.pull_back;
        let rest: PackRest<'_, L, D, N> = self.term.packs.rest(self.pack);
        let x = loaded::<L, D, N>(self.nodes);
        let (f, q): (Mat<L, D>, Amplitudes<L, D>) = rest.measure(&x);
        let cofactor = f.cofactor();
        let y = self.stresses(&rest, &x, &pull_back.pulled(&cofactor, &q));
        let has_stress_term = pull_back == PullBack::Cofactor && self.psd == Psd::Exact;
        let outer = outer_sum(&q, &y);
        let stiffness = rest.stiffness::<L>();
        // dz/dx_a, K dz/dx_a and u_a of every node but the first.
        let none = [[L::zero(); D]; N];
        let (mut b, mut u, mut turned) = (none, none, none);
        let mut slopes = [[[[L::zero(); D]; MOST_MODES]; D]; N];
        let mut forces = slopes;
        for a in 1..N {
            let mut weights = [L::zero(); MOST_MODES];
            for k in 0..D {
                b[a][k] = rest.gradient(a, k);
            }
            for h in 0..modes(D) {
                weights[h] = rest.weight(h, a);
                for k in 0..D {
                    u[a][k] = weights[h].mul_add(y[h][k], u[a][k]);
                }
            }
            for i in 0..D {
                slopes[a][i] = amplitude_slope(pull_back, (&f, &cofactor, &q), (&b[a], &weights, i));
                forces[a][i] = times(&stiffness, &slopes[a][i]);
            }
        }
        // Material moduli in the frame of U and V.
        let volume: L = rest.volume();
        let (mut frame, mut moduli) = (Mat::zero(), (Mat::zero(), Mat::zero(), Mat::zero()));
        if let Some(spectrum) = self.spectrum {
            let turn = spectrum.v.load::<L>().transpose();
            frame = spectrum.u.load::<L>();
            let (scaling, same, swapped) = spectrum.spectrum.in_frame::<L>(self.psd == Psd::Projected);
            moduli = (scaling.scale(volume), same.scale(volume), swapped.scale(volume));
            for a in 1..N {
                turned[a] = turn.mul_vec(&b[a]);
            }
        }
        // Blocks of the pairs; those of the first node follow from the others.
        let place = |a: usize, b: usize| a * N - a * (a + 1) / 2 + b;
        let mut entries = Entries::<MOST_ENTRIES>([[0.0; WIDTH]; MOST_ENTRIES]);
        let mut first = FirstRow::<L, D, N>::new();
        for a in 1..N {
            for c in a..N {
                let mut block = Mat::zero();
                // V b_a C b_b.
                if self.spectrum.is_some() {
                    let k = pair_block((&moduli.0, &moduli.1, &moduli.2), (&turned[a], &turned[c]));
                    block = frame.mul(&k).mul_transpose(&frame);
                }
                // dz/dx_a . K dz/dx_b.
                for i in 0..D {
                    for k in 0..D {
                        for h in 0..modes(D) {
                            for m in 0..D {
                                block[i][k] = slopes[a][i][h][m].mul_add(forces[c][k][h][m], block[i][k]);
                            }
                        }
                    }
                }
                if has_stress_term && a != c {
                    add_stress_term((&f, &outer), (&b[a], &u[a]), (&b[c], &u[c]), &mut block);
                }
                entries.set(place(a, c), &block);
                first.take((a, c), &block);
            }
        }
        let first = first.blocks();
        for a in 0..N {
            entries.set(a, &first[a]);
        }
        entries.write::<L>(N * (N + 1) / 2 * D * D, self.out);
    }
}
