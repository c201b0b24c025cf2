//! Kernels over packs of elements, on lanes: positions of vertices to deformation gradients, stresses to
//! forces.
//!
//! These are compiled for every element, but not for every material, see [`block`](super::block).

use super::block::Block;
use crate::algebra::Mat;
use crate::element::{
    MOST_POINTS, QuadraticGradients, QuadraticPositions, SimplexPack, edge_matrix, order, quadrature_count,
    vertex_gradients,
};
use crate::energy::DeformationExtremes;
use crate::energy::patch::{PackIndex, Patch, Patches, Scratch};
use crate::lanes::{Kernel, Lanes, RowSlice, WIDTH};

/// Blocks that a material is given at a time: few enough to stay in the first cache, enough to make the call
/// free.
const ENOUGH: usize = 16;

/// Blocks that there is room for: those of one pack of any element.
pub(super) const BLOCKS: usize = MOST_POINTS;

/// Packs of elements that go together.
pub(super) const fn packs_at_once<const D: usize, const N: usize>() -> usize {
    let points = quadrature_count::<D, N>();
    if points > ENOUGH { 1 } else { ENOUGH / points }
}

/// Positions of the vertices of one pack.
#[inline(always)]
pub(crate) fn gather<L: Lanes, const D: usize, const N: usize>(
    rows: &RowSlice<D>,
    index: &PackIndex<N>,
) -> [[L; D]; N] {
    let mut x = [[L::zero(); D]; N];
    // Written out: the compiler does not unroll a loop around so much code, and then keeps `x` in memory.
    x[0] = L::gather(rows, &index[0]);
    x[1] = L::gather(rows, &index[1]);
    x[2] = L::gather(rows, &index[2]);
    if N == 4 {
        x[3] = L::gather(rows, &index[3]);
    }
    if N > 4 {
        for a in 3..N {
            x[a] = L::gather(rows, &index[a]);
        }
    }
    x
}

/// Adds the gradients at the vertices of one pack.
#[inline(always)]
pub(crate) fn scatter<L: Lanes, const D: usize, const N: usize>(
    rows: &mut RowSlice<D>,
    index: &PackIndex<N>,
    gradients: [[L; D]; N],
) {
    // Written out, as in `gather`.
    L::scatter_add(rows, &index[0], gradients[0]);
    L::scatter_add(rows, &index[1], gradients[1]);
    L::scatter_add(rows, &index[2], gradients[2]);
    if N == 4 {
        L::scatter_add(rows, &index[3], gradients[3]);
    }
    if N > 4 {
        for a in 3..N {
            L::scatter_add(rows, &index[a], gradients[a]);
        }
    }
}

/// Writes the deformation gradients of some packs, `quadrature_count` blocks each; linear in the rows.
pub(super) struct DeformationKernel<'a, const D: usize, const N: usize> {
    /// Rest data, as many for each pack as it has quadrature points.
    pub(super) rest: &'a [SimplexPack<D>],
    pub(super) index: &'a [PackIndex<N>],
    pub(super) rows: &'a RowSlice<D>,
    pub(super) f: &'a mut [Block<D>],
}

impl<const D: usize, const N: usize> Kernel for DeformationKernel<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let points = quadrature_count::<D, N>();
        let packs = self.rest.chunks_exact(points).zip(self.f.chunks_exact_mut(points));
        for (index, (rest, f)) in self.index.iter().zip(packs) {
            let x = gather::<L, D, N>(self.rows, index);
            if order::<D, N>() == 1 {
                f[0].store(&edge_matrix(&x).mul(&rest[0].inverse_rest()));
            } else {
                let positions = QuadraticPositions::new(x);
                for q in 0..points {
                    f[q].store(&positions.at(q).mul(&rest[q].inverse_rest()));
                }
            }
        }
    }
}

/// Adds the gradients at the vertices of some packs, given the stresses at their quadrature points.
pub(super) struct ForceKernel<'a, const D: usize, const N: usize> {
    /// Rest data, as many for each pack as it has quadrature points.
    pub(super) rest: &'a [SimplexPack<D>],
    pub(super) index: &'a [PackIndex<N>],
    pub(super) stress: &'a [Block<D>],
    pub(super) gradient: &'a mut RowSlice<D>,
}

impl<const D: usize, const N: usize> Kernel for ForceKernel<'_, D, N> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let points = quadrature_count::<D, N>();
        let packs = self.rest.chunks_exact(points).zip(self.stress.chunks_exact(points));
        for (index, (rest, stress)) in self.index.iter().zip(packs) {
            if order::<D, N>() == 1 {
                let h = weighted::<L, D>(&rest[0], &stress[0]);
                scatter(self.gradient, index, vertex_gradients::<L, D, N>(&h));
            } else {
                let mut gradients = QuadraticGradients::<L, D, N>::new();
                for q in 0..points {
                    gradients.add(q, &weighted(&rest[q], &stress[q]));
                }
                scatter(self.gradient, index, gradients.finish());
            }
        }
    }
}

/// `H = w P J^-T`.
#[inline(always)]
fn weighted<L: Lanes, const D: usize>(rest: &SimplexPack<D>, stress: &Block<D>) -> Mat<L, D> {
    stress.load::<L>().scale(rest.weight()).mul_transpose(&rest.inverse_rest())
}

/// Adds `w psi` of some blocks to one sum per lane.
pub(super) struct EnergyKernel<'a, const D: usize> {
    pub(super) rest: &'a [SimplexPack<D>],
    pub(super) psi: &'a [[f64; WIDTH]],
    pub(super) sum: &'a mut [f64; WIDTH],
}

impl<const D: usize> Kernel for EnergyKernel<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let mut sum = L::load(self.sum);
        for (rest, psi) in self.rest.iter().zip(self.psi) {
            let weight = rest.weight::<L>();
            // Zero times infinity in an empty lane is not zero.
            sum += L::select(L::zero().lt(weight), weight * L::load(psi), L::zero());
        }
        sum.store(self.sum);
    }
}

/// Extremes of `det F` over the quadrature points of a patch.
pub(super) struct ExtremesKernel<'a, const D: usize, const N: usize> {
    pub(super) patches: &'a Patches<N>,
    pub(super) rest: &'a [SimplexPack<D>],
    pub(super) patch: &'a Patch,
    pub(super) scratch: &'a Scratch<D>,
}

impl<const D: usize, const N: usize> Kernel for ExtremesKernel<'_, D, N> {
    type Output = DeformationExtremes;

    #[inline(always)]
    fn run<L: Lanes>(self) -> DeformationExtremes {
        let points = quadrature_count::<D, N>();
        let mut min_j = L::splat(f64::INFINITY);
        let mut inverted = 0;
        let mut f = [Block::<D>::ZERO; BLOCKS];
        for pack in self.patch.packs.clone() {
            let rest = &self.rest[pack * points..][..points];
            let index = std::slice::from_ref(&self.patches.index[pack]);
            DeformationKernel { rest, index, rows: &self.scratch.position, f: &mut f[..points] }.run::<L>();
            // Lanes that fill up repeat an element: they cannot change the minimum, but they must not be
            // counted.
            let real = L::mask_to_bits(L::zero().lt(rest[0].weight::<L>()));
            let mut upright = real;
            for f in &f[..points] {
                let j = f.load::<L>().determinant();
                upright &= L::mask_to_bits(L::zero().lt(j));
                min_j = L::select(min_j.lt(j), min_j, j);
            }
            inverted += u64::from((real & !upright).count_ones());
        }
        DeformationExtremes { min_j: -(-min_j).horizontal_max(), inverted }
    }
}
