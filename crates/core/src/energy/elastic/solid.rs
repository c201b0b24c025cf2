//! Answers that all terms of solid elements give alike.

use super::super::patch::{Patch, Patches, Scratch, Workspace};
use super::super::{
    DeformationExtremes, ElementTerm, ForceLayout, Measurements, PredictedStresses, StepLimit, TermViews,
};

/// Solid elements whose gradient lies in patches.
pub trait SolidElements:
    ElementTerm + ForceLayout + StepLimit + Measurements + PredictedStresses + Sized
{
    /// True where any deformation has a finite energy: steps then have no limit.
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

/// Extremes of `det F` over all patches at `x`; `None` without elements.
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
