//! Extremes of deformation, on lanes.

use super::block::Block;
use super::kinematics::{BLOCKS, Kinematics};
use crate::element::quadrature_count;
use crate::energy::DeformationExtremes;
use crate::energy::patch::{Patch, Scratch};
use crate::lanes::{Kernel, Lanes};

/// Extremes of `det F` over the quadrature points of a patch.
pub(super) struct ExtremesKernel<'a, const D: usize, const N: usize> {
    pub(super) elements: &'a Kinematics<D, D, N>,
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
            let rest = &self.elements.rest[pack * points];
            self.elements.deform_pack::<L>(pack, &self.scratch.position, &mut f[..points]);
            // Lanes that fill up repeat an element: they cannot change the minimum, but they must not be
            // counted.
            let real = L::mask_to_bits(L::zero().lt(rest.weight::<L>()));
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
