//! Exact Hessians of packs of cells, on lanes, for materials that know the spectrum of `dP/dF`.
//!
//! As [`hessian`](super::hessian) has them, with `dP/dF` in the frame of `F = U diag(sigma) V^T` as that of
//! [simplices](crate::energy::elastic::hessian). What is a product of vectors is taken together: with
//! `m_a = w/D v_a + c/2 l_a`, `v_a = (s^2 C : F + s P) b_a` and `c = w (s^2 F : C : F / D^2 + p/D)`,
//!
//! ```text
//! K_ab = sum_q { w s^2 b_a C b_b + m_a l_b^T + l_a m_b^T + w p/J^2 g_a g_b^T
//!                + w (pm/theta - p/J) [F (b_a x b_b)]_x } - V pm/theta^2 G_a G_b^T
//! ```

use super::super::block::{Block, BlockMaterial, SpectrumBlock};
use super::super::hessian::{FirstRow, pair_block};
use super::Dilatation;
use super::collapse::loaded;
use super::kernels::{MOST_POINTS, Points, cell_gradient, root};
use crate::algebra::{Mat, TURNS, signed_svd};
use crate::lanes::{Kernel, Lanes, WIDTH, dispatch};
use crate::material::Stress;

/// Blocks of the pairs of nodes of a hexahedron.
const MOST_PAIRS_OF_NODES: usize = 36;

/// Deformation of a pack of cells at its quadrature points.
#[repr(align(64))]
struct CellStates<const D: usize> {
    u: [Block<D>; MOST_POINTS],
    v: [Block<D>; MOST_POINTS],
    /// Singular values of `Fb`.
    sigma: [[[f64; WIDTH]; D]; MOST_POINTS],
    spectrum: [SpectrumBlock<D>; MOST_POINTS],
    /// `Fb`.
    dilated: [Block<D>; MOST_POINTS],
    /// `P(Fb)`.
    stress: [Block<D>; MOST_POINTS],
    /// `s`.
    scale: [[f64; WIDTH]; MOST_POINTS],
    theta: [f64; WIDTH],
}

impl<const D: usize> CellStates<D> {
    /// The means of `g` and of the pressures.
    #[inline(always)]
    fn means<L: Lanes, const N: usize>(&self, points: &Points<'_, D, N>) -> ([[L; D]; N], L) {
        let (mut slopes, mut mean) = ([[L::zero(); D]; N], L::zero());
        for (q, rest) in points.rest.iter().enumerate() {
            let (u, v) = (self.u[q].load::<L>(), self.v[q].load::<L>());
            let part = rest.part::<L>();
            let cofactor = self.deformation(q, &u, &v).cofactor().scale(part);
            for a in 1..N {
                for i in 0..D {
                    for k in 0..D {
                        slopes[a][i] = cofactor[i][k].mul_add(rest.gradient(a, k), slopes[a][i]);
                    }
                }
            }
            mean = part.mul_add(self.pressure::<L>(q), mean);
        }
        (slopes, mean)
    }

    /// `P : Fb / D` at a point.
    #[inline(always)]
    fn pressure<L: Lanes>(&self, q: usize) -> L {
        self.stress[q].load::<L>().dot(&self.dilated[q].load::<L>()) * L::splat(1.0 / D as f64)
    }

    /// `F` at a point.
    #[inline(always)]
    fn deformation<L: Lanes>(&self, q: usize, u: &Mat<L, D>, v: &Mat<L, D>) -> Mat<L, D> {
        let scale = L::load(&self.scale[q]);
        let mut stretched = *u;
        for k in 0..D {
            let sigma = L::load(&self.sigma[q][k]) / scale;
            for i in 0..D {
                stretched[i][k] = u[i][k] * sigma;
            }
        }
        stretched.mul_transpose(v)
    }
}

/// Blocks of the pairs `a <= b` of nodes of a pack of cells.
#[repr(align(64))]
pub(super) struct PackBlocks<const D: usize>([Block<D>; MOST_PAIRS_OF_NODES]);

impl<const D: usize> PackBlocks<D> {
    pub(super) const ZERO: Self = PackBlocks([Block::ZERO; MOST_PAIRS_OF_NODES]);

    /// Writes the blocks of one cell, one after the other.
    pub(super) fn write_lane(&self, lane: usize, out: &mut [f64]) {
        for (block, out) in self.0.iter().zip(out.chunks_exact_mut(D * D)) {
            for (r, row) in out.chunks_exact_mut(D).enumerate() {
                row.iter_mut().enumerate().for_each(|(c, entry)| *entry = block.entry(r, c)[lane]);
            }
        }
    }

    /// Writes the whole symmetric matrix of one cell of `N` nodes.
    pub(super) fn expand_lane<const N: usize>(&self, lane: usize, matrix: &mut [f64]) {
        for a in 0..N {
            for b in a..N {
                let block = &self.0[place(N, a, b)];
                for r in 0..D {
                    for c in 0..D {
                        let entry = block.entry(r, c)[lane];
                        matrix[(a * D + r) * N * D + b * D + c] = entry;
                        matrix[(b * D + c) * N * D + a * D + r] = entry;
                    }
                }
            }
        }
    }
}

/// Number of the block of a pair `a <= b` of `n` nodes.
const fn place(n: usize, a: usize, b: usize) -> usize {
    a * n - a * (a + 1) / 2 + b
}

/// The exact Hessians of a pack of cells with their nodes at `nodes`; of materials that have a spectrum.
pub(super) fn blocks<const D: usize, const N: usize>(
    (material, how): (&dyn BlockMaterial<D>, Stress),
    points: Points<'_, D, N>,
    nodes: &[[[f64; WIDTH]; D]; N],
    out: &mut PackBlocks<D>,
) {
    let mut states = CellStates {
        u: [Block::ZERO; MOST_POINTS],
        v: [Block::ZERO; MOST_POINTS],
        sigma: [[[0.0; WIDTH]; D]; MOST_POINTS],
        spectrum: [SpectrumBlock::ZERO; MOST_POINTS],
        dilated: [Block::ZERO; MOST_POINTS],
        stress: [Block::ZERO; MOST_POINTS],
        scale: [[0.0; WIDTH]; MOST_POINTS],
        theta: [0.0; WIDTH],
    };
    let count = points.rest.len();
    dispatch(StateKernel { points, nodes, states: &mut states });
    for (sigma, spectrum) in states.sigma.iter().zip(&mut states.spectrum).take(count) {
        material.spectra(sigma, spectrum);
    }
    if points.dilatation == Dilatation::Finite {
        states.stress = states.dilated;
        material.stress(how, &mut states.stress[..count]);
    }
    dispatch(CellBlocksKernel { points, states: &states, out });
}

/// Decompositions at the quadrature points of a pack.
struct StateKernel<'a, const D: usize, const N: usize> {
    points: Points<'a, D, N>,
    nodes: &'a [[[f64; WIDTH]; D]; N],
    states: &'a mut CellStates<D>,
}

impl<const D: usize, const N: usize> Kernel for StateKernel<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let StateKernel { points, nodes, states } = self;
        let x = loaded::<L, D, N>(nodes);
        let mut theta = L::zero();
        for (q, rest) in points.rest.iter().enumerate() {
            let f = cell_gradient::<L, D, N>(&x, rest);
            theta = rest.part::<L>().mul_add(f.determinant(), theta);
            states.dilated[q].store(&f);
        }
        theta.store(&mut states.theta);
        for q in 0..points.rest.len() {
            let f = states.dilated[q].load::<L>();
            let mut scale = L::one();
            if points.dilatation == Dilatation::Finite {
                scale = root::<L, D>(theta, f.determinant());
            }
            let svd = signed_svd(&f);
            for i in 0..D {
                (svd.sigma[i] * scale).store(&mut states.sigma[q][i]);
            }
            scale.store(&mut states.scale[q]);
            states.u[q].store(&svd.u);
            states.v[q].store(&svd.v);
            states.dilated[q].store(&f.scale(scale));
        }
    }
}

/// Blocks of a pack from its states.
struct CellBlocksKernel<'a, const D: usize, const N: usize> {
    points: Points<'a, D, N>,
    states: &'a CellStates<D>,
    out: &'a mut PackBlocks<D>,
}

/// Slopes of the nodes of a cell at a point, those of `J` and what is made of them.
struct NodeSlopes<L, const D: usize, const N: usize> {
    /// `V^T b`.
    turned: [[L; D]; N],
    /// `b`.
    rest: [[L; D]; N],
    /// `g`.
    volume: [[L; D]; N],
    l: [[L; D]; N],
    m: [[L; D]; N],
}

/// Adds `u v^T`.
#[inline(always)]
fn add_outer<L: Lanes, const D: usize>(u: &[L; D], v: &[L; D], block: &mut Mat<L, D>) {
    for i in 0..D {
        for k in 0..D {
            block[i][k] = u[i].mul_add(v[k], block[i][k]);
        }
    }
}

/// Adds `factor [F (b_a x b_b)]_x`.
#[inline(always)]
fn add_second<L: Lanes, const D: usize>(
    f: &Mat<L, D>,
    (a, b): (&[L; D], &[L; D]),
    factor: L,
    block: &mut Mat<L, D>,
) {
    let normal_z = a[0].mul_add(b[1], -(a[1] * b[0]));
    let mut axis = [L::zero(), L::zero(), normal_z];
    if D == 3 {
        let normal = [
            a[1].mul_add(b[2 % D], -(a[2 % D] * b[1])),
            a[2 % D].mul_add(b[0], -(a[0] * b[2 % D])),
            normal_z,
        ];
        for m in 0..D {
            axis[m] = f[m][0].mul_add(normal[0], f[m][1].mul_add(normal[1], f[m][2 % D] * normal[2]));
        }
    }
    for (i, k, m, sign) in TURNS {
        if i < D && k < D {
            block[i][k] = (factor * L::splat(sign)).mul_add(axis[m], block[i][k]);
        }
    }
}

impl<const D: usize, const N: usize> Kernel for CellBlocksKernel<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let CellBlocksKernel { points, states, out } = self;
        let finite = points.dilatation == Dilatation::Finite;
        let (half, of_d) = (L::splat(0.5), L::splat(1.0 / D as f64));
        let volume = L::load(points.volume);
        let theta = L::load(&states.theta);
        let (mean_slope, mean_pressure) =
            if finite { states.means::<L, N>(&points) } else { ([[L::zero(); D]; N], L::zero()) };
        for a in 1..N {
            for b in a..N {
                out.0[place(N, a, b)] = Block::ZERO;
            }
        }
        for (q, rest) in points.rest.iter().enumerate() {
            let (u, v) = (states.u[q].load::<L>(), states.v[q].load::<L>());
            let s = L::load(&states.scale[q]);
            let w = volume * rest.part::<L>();
            let weight = w * s * s;
            let (scaling, same, swapped) = states.spectrum[q].in_frame::<L>(false);
            let (scaling, same, swapped) = (scaling.scale(weight), same.scale(weight), swapped.scale(weight));
            let turn = v.transpose();
            let none = [[L::zero(); D]; N];
            let mut of = NodeSlopes { turned: none, rest: none, volume: none, l: none, m: none };
            for a in 1..N {
                for i in 0..D {
                    of.rest[a][i] = rest.gradient(a, i);
                }
                of.turned[a] = turn.mul_vec(&of.rest[a]);
            }
            let (mut f, mut by_slopes, mut by_turns) = (Mat::zero(), L::zero(), L::zero());
            if finite {
                f = states.deformation(q, &u, &v);
                let j = f.determinant();
                let p = states.pressure::<L>(q);
                // `C : F` along the axes of the stretches, where `F` is diagonal.
                let (mut along, mut work) = (u, L::zero());
                for i in 0..D {
                    let mut row = L::zero();
                    for k in 0..D {
                        row = scaling[i][k].mul_add(L::load(&states.sigma[q][k]) / s, row);
                    }
                    work = row.mul_add(L::load(&states.sigma[q][i]) / s, work);
                    for r in 0..D {
                        along[r][i] = u[r][i] * row;
                    }
                }
                let cofactor = f.cofactor();
                let with_stress = states.stress[q].load::<L>().scale_add(w * s, &along.mul_transpose(&v));
                let of_l = half * (work * of_d + w * p) * of_d;
                for a in 1..N {
                    let stressed = with_stress.mul_vec(&of.rest[a]);
                    of.volume[a] = cofactor.mul_vec(&of.rest[a]);
                    for i in 0..D {
                        of.l[a][i] = mean_slope[a][i] / theta - of.volume[a][i] / j;
                        of.m[a][i] = of_d.mul_add(stressed[i], of_l * of.l[a][i]);
                    }
                }
                by_slopes = w * p / (j * j);
                by_turns = w * (mean_pressure / theta - p / j);
            }
            for a in 1..N {
                let mut scaled = [L::zero(); D];
                for i in 0..D {
                    scaled[i] = by_slopes * of.volume[a][i];
                }
                for b in a..N {
                    let k = pair_block((&scaling, &same, &swapped), (&of.turned[a], &of.turned[b]));
                    let mut block = out.0[place(N, a, b)].load::<L>() + u.mul(&k).mul_transpose(&u);
                    if finite {
                        add_outer(&of.m[a], &of.l[b], &mut block);
                        add_outer(&of.l[a], &of.m[b], &mut block);
                        add_outer(&scaled, &of.volume[b], &mut block);
                        if a != b {
                            add_second(&f, (&of.rest[a], &of.rest[b]), by_turns, &mut block);
                        }
                    }
                    out.0[place(N, a, b)].store(&block);
                }
            }
        }
        let mut first = FirstRow::<L, D, N>::new();
        let by_mean = -(volume * mean_pressure) / (theta * theta);
        for a in 1..N {
            let mut scaled = [L::zero(); D];
            for i in 0..D {
                scaled[i] = by_mean * mean_slope[a][i];
            }
            for b in a..N {
                let mut block = out.0[place(N, a, b)].load::<L>();
                if finite {
                    add_outer(&scaled, &mean_slope[b], &mut block);
                    out.0[place(N, a, b)].store(&block);
                }
                first.take((a, b), &block);
            }
        }
        let first = first.blocks();
        for b in 0..N {
            out.0[b].store(&first[b]);
        }
    }
}
