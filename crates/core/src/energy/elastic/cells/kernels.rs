//! Kernels over packs of cells, on lanes: `F` from positions, forces from stresses and amplitudes, and
//! their changes along a direction, on dual numbers.

use std::ops::Range;

use super::super::block::Block;
use super::super::kinematics::{gather, scatter};
use super::hourglass::{PullBack, dot, times};
use super::packs::CellPacks;
use super::rest::RestData;
use crate::algebra::{Dual, Mat};
use crate::energy::DeformationExtremes;
use crate::energy::patch::PackIndex;
use crate::lanes::{Kernel, Lanes, RowSlice, WIDTH};
use crate::scalar::Scalar;

/// Pack of numbers, or of numbers with their change along a direction.
pub(crate) trait PackScalar<L: Lanes>: Scalar {
    /// Returns the derivative of a dual number, otherwise the value.
    fn last(self) -> L;
    fn constant(value: L) -> Self;
}

impl<L: Lanes> PackScalar<L> for L {
    #[inline(always)]
    fn last(self) -> L {
        self
    }
    #[inline(always)]
    fn constant(value: L) -> L {
        value
    }
}

impl<L: Lanes> PackScalar<L> for Dual<L> {
    #[inline(always)]
    fn last(self) -> L {
        self.derivative
    }
    #[inline(always)]
    fn constant(value: L) -> Self {
        Dual { value, derivative: L::zero() }
    }
}

/// Loads the positions of the nodes of a pack.
#[inline(always)]
pub(super) fn loaded<L: Lanes, const D: usize, const N: usize>(
    nodes: &[[[f64; WIDTH]; D]; N],
) -> [[L; D]; N] {
    let mut rows = [[L::zero(); D]; N];
    for a in 0..N {
        for c in 0..D {
            rows[a][c] = L::load(&nodes[a][c]);
        }
    }
    rows
}

/// Packs of cells that a kernel processes together.
pub(super) struct CellPiece<'a, const D: usize, const N: usize> {
    pub(super) packs: &'a CellPacks<D, N>,
    pub(super) index: &'a [PackIndex<N>],
    pub(super) pull_back: PullBack,
    /// Numbers of the packs.
    pub(super) range: Range<usize>,
}

/// Writes `F` of some packs; linear in the rows.
pub(super) struct CellDeformationKernel<'a, const D: usize, const N: usize> {
    pub(super) piece: &'a CellPiece<'a, D, N>,
    pub(super) rows: &'a RowSlice<D>,
    pub(super) f: &'a mut [Block<D>],
}

impl<const D: usize, const N: usize> Kernel for CellDeformationKernel<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let CellPiece { packs, index, range, .. } = self.piece;
        for (pack, f) in range.clone().zip(self.f) {
            let (deformation, _) = packs.rest::<L>(pack).measure(&gather::<L, D, N>(self.rows, &index[pack]));
            f.store(&deformation);
        }
    }
}

/// Adds the gradients at the vertices of some packs, given `P`, or their change `ALONG` a direction,
/// given the change of `P`.
pub(super) struct CellForceKernel<'a, const D: usize, const N: usize, const ALONG: bool> {
    pub(super) piece: &'a CellPiece<'a, D, N>,
    pub(super) stress: &'a [Block<D>],
    pub(super) position: &'a RowSlice<D>,
    pub(super) direction: &'a RowSlice<D>,
    pub(super) gradient: &'a mut RowSlice<D>,
}

impl<const D: usize, const N: usize, const ALONG: bool> CellForceKernel<'_, D, N, ALONG> {
    #[inline(always)]
    fn add<L: Lanes, S: PackScalar<L>>(&mut self, pack: usize, x: &[[S; D]; N], stress: &Block<D>) {
        let rest = self.piece.packs.rest::<L>(pack);
        let pull_back = self.piece.pull_back;
        let (f, q): (Mat<S, D>, _) = rest.measure(x);
        let cofactor = f.cofactor();
        let y = times(&rest.stiffness::<S>(), &pull_back.pulled(&cofactor, &q));
        let (by_f, by_q) = pull_back.pushed((&f, &cofactor), &q, &y);
        let mut by_f = last_of(&by_f.0);
        let volume: L = rest.volume();
        let stress = stress.load::<L>();
        for i in 0..D {
            for k in 0..D {
                by_f[i][k] = volume.mul_add(stress[i][k], by_f[i][k]);
            }
        }
        let gradients: [[L; D]; N] = rest.spread(&Mat(by_f), &last_of(&by_q));
        scatter(self.gradient, &self.piece.index[pack], gradients);
    }
}

#[inline(always)]
fn last_of<L: Lanes, S: PackScalar<L>, const D: usize, const M: usize>(rows: &[[S; D]; M]) -> [[L; D]; M] {
    let mut last = [[L::zero(); D]; M];
    for a in 0..M {
        for i in 0..D {
            last[a][i] = rows[a][i].last();
        }
    }
    last
}

impl<const D: usize, const N: usize, const ALONG: bool> Kernel for CellForceKernel<'_, D, N, ALONG> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        for (pack, stress) in self.piece.range.clone().zip(self.stress) {
            let index = &self.piece.index[pack];
            let x = gather::<L, D, N>(self.position, index);
            if ALONG {
                let dx = gather::<L, D, N>(self.direction, index);
                let mut both = [[Dual::constant(L::zero()); D]; N];
                for a in 0..N {
                    for c in 0..D {
                        both[a][c] = Dual { value: x[a][c], derivative: dx[a][c] };
                    }
                }
                self.add::<L, Dual<L>>(pack, &both, stress);
            } else {
                self.add::<L, L>(pack, &x, stress);
            }
        }
    }
}

/// Adds the energies of some packs to one sum per lane, from the densities of the material.
pub(super) struct CellEnergyKernel<'a, const D: usize, const N: usize> {
    pub(super) piece: &'a CellPiece<'a, D, N>,
    pub(super) psi: &'a [[f64; WIDTH]],
    pub(super) position: &'a RowSlice<D>,
    pub(super) sum: &'a mut [f64; WIDTH],
}

impl<const D: usize, const N: usize> Kernel for CellEnergyKernel<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let CellPiece { packs, index, pull_back, range } = self.piece;
        let mut sum = L::load(self.sum);
        for (pack, psi) in range.clone().zip(self.psi) {
            let rest = packs.rest::<L>(pack);
            let (f, q): (Mat<L, D>, _) = rest.measure(&gather::<L, D, N>(self.position, &index[pack]));
            let q = pull_back.pulled(&f.cofactor(), &q);
            let hourglass = L::splat(0.5) * dot(&q, &times(&rest.stiffness::<L>(), &q));
            let volume: L = rest.volume();
            // An empty lane has volume zero, but zero times infinity is not zero.
            let energy = volume.mul_add(L::load(psi), hourglass);
            sum += L::select(L::zero().lt(volume), energy, L::zero());
        }
        sum.store(self.sum);
    }
}

/// Finds the extremes of `det F` over some packs.
pub(super) struct CellExtremesKernel<'a, const D: usize, const N: usize> {
    pub(super) piece: &'a CellPiece<'a, D, N>,
    pub(super) position: &'a RowSlice<D>,
}

impl<const D: usize, const N: usize> Kernel for CellExtremesKernel<'_, D, N> {
    type Output = DeformationExtremes;

    #[inline(always)]
    fn run<L: Lanes>(self) -> DeformationExtremes {
        let CellPiece { packs, index, range, .. } = self.piece;
        let (mut min_j, mut inverted) = (L::splat(f64::INFINITY), 0);
        for pack in range.clone() {
            let rest = packs.rest::<L>(pack);
            let (f, _) = rest.measure(&gather::<L, D, N>(self.position, &index[pack]));
            let (j, volume): (L, L) = (f.determinant(), rest.volume());
            // Padding lanes repeat a cell: they cannot change the minimum, but they must not be counted.
            let real = L::mask_to_bits(L::zero().lt(volume));
            inverted += u64::from((real & !L::mask_to_bits(L::zero().lt(j))).count_ones());
            min_j = L::select(min_j.lt(j), min_j, j);
        }
        DeformationExtremes { min_j: -(-min_j).horizontal_max(), inverted }
    }
}
