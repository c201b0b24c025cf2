//! Views that all terms of solid elements share.

use super::block::Block;
use super::kinematics::{BLOCKS, Kinematics};
use crate::element::quadrature_count;
use crate::energy::patch::{Patch, Patches, Scratch, Workspace};
use crate::energy::{
    DeformationExtremes, ElementTerm, ForceLayout, Measurements, PredictedStresses, StepLimit, TermViews,
};
use crate::lanes::{Kernel, Lanes};

/// Solid elements whose gradient lies in patches.
pub trait SolidElements:
    ElementTerm + ForceLayout + StepLimit + Measurements + PredictedStresses + Sized
{
    /// True if any deformation has a finite energy: steps then have no limit.
    fn is_finite_everywhere(&self) -> bool;
}

impl<T: SolidElements> TermViews for T {
    fn elements(&self) -> Option<&dyn ElementTerm> {
        Some(self)
    }

    fn layout(&self) -> Option<&dyn ForceLayout> {
        Some(self)
    }

    fn limit(&self) -> Option<&dyn StepLimit> {
        if self.is_finite_everywhere() { None } else { Some(self) }
    }

    fn predicted(&self) -> Option<&dyn PredictedStresses> {
        Some(self)
    }

    fn measurements(&mut self) -> Option<&mut dyn Measurements> {
        Some(self)
    }
}

/// Returns the extremes of `det F` over all patches at `x`; `None` without elements.
pub(super) fn extremes<const D: usize, const N: usize>(
    patches: &Patches<N>,
    workspace: &mut Workspace<D>,
    x: &[f64],
    of_patch: impl Fn(&Patch, &mut Scratch<D>) -> DeformationExtremes + Sync + Send,
) -> Option<DeformationExtremes> {
    let mut extremes = vec![DeformationExtremes::NONE; patches.patches.len()];
    patches.map(workspace, x, &mut extremes, of_patch);
    extremes.into_iter().reduce(DeformationExtremes::merge)
}

/// Finds the extremes of `det F` over the quadrature points of a patch.
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
            // Padding lanes repeat an element: they cannot change the minimum, but they must not be
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
