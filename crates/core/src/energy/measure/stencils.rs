//! Stencils and their data, grouped into patches.

use std::marker::PhantomData;

use super::ScalarStrain;
use crate::energy::Fault;
use crate::energy::elastic::{centroids, points_of};
use crate::energy::patch::{Patches, Workspace};
use crate::lanes::{Lanes, WIDTH};
use crate::numbering::along_curve;

/// Constants of one stencil.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StencilConstants {
    /// Factor `k` of the energy, or of the dissipation, per square of the measure's unit [J, W s].
    pub stiffness: f64,
    /// Parameters of the rest value.
    pub rest: [f64; 2],
}

/// Constants of `WIDTH` stencils, laid out for vector loads.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Pack {
    /// Zero in lanes without a stencil of their own.
    stiffness: [f64; WIDTH],
    rest: [[f64; WIDTH]; 2],
}

impl Pack {
    #[inline(always)]
    pub(crate) fn stiffness<L: Lanes>(&self) -> L {
        L::load(&self.stiffness)
    }

    #[inline(always)]
    pub(crate) fn rest<L: Lanes>(&self) -> [L; 2] {
        [L::load(&self.rest[0]), L::load(&self.rest[1])]
    }
}

/// Stencils of `N` vertices at which `Q` is measured.
pub struct MeasuredStencils<Q, const D: usize, const N: usize> {
    pub(crate) patches: Patches<N>,
    pub(crate) packs: Vec<Pack>,
    measure: PhantomData<Q>,
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize> MeasuredStencils<Q, D, N> {
    /// Creates the stencils `vertices` with their constants; the reference positions `rest` are used to
    /// find neighbours.
    ///
    /// # Panics
    /// If the numbers of constants and stencils differ.
    pub fn new(vertices: &[[u32; N]], constants: &[StencilConstants], rest: &[f64]) -> Self {
        assert_eq!(vertices.len(), constants.len(), "constants for each stencil");
        let order = along_curve::<D>(&centroids(vertices, rest));
        let patches = Patches::new::<D>(vertices, &order, rest.len() / D);
        let empty = Pack { stiffness: [0.0; WIDTH], rest: [[0.0; WIDTH]; 2] };
        let mut packs = vec![empty; patches.index.len()];
        for (pack, stencils) in packs.iter_mut().zip(&patches.stencil) {
            let mut rest = [0.0; 2];
            for (lane, stencil) in stencils.iter().enumerate() {
                if let Some(stencil) = stencil {
                    pack.stiffness[lane] = constants[*stencil as usize].stiffness;
                    rest = constants[*stencil as usize].rest;
                }
                // Padding lanes repeat the stencil before them.
                (pack.rest[0][lane], pack.rest[1][lane]) = (rest[0], rest[1]);
            }
        }
        MeasuredStencils { patches, packs, measure: PhantomData }
    }

    /// Returns stiffness and rest parameters of one lane.
    pub(crate) fn constants(&self, pack: usize, lane: usize) -> (f64, [f64; 2]) {
        let Pack { stiffness, rest } = &self.packs[pack];
        (stiffness[lane], [rest[0][lane], rest[1][lane]])
    }

    /// Creates scratch memory.
    pub fn workspace(&self) -> Workspace<D> {
        Workspace::new(&self.patches)
    }

    /// Returns the fault of the first stencil at which `number` is not finite.
    pub(crate) fn fault(
        &self,
        body: &str,
        number: impl Fn(&[[f64; D]; N], &[f64; 2]) -> f64,
        x: &[f64],
    ) -> Option<Fault> {
        let faulty = self.patches.stencils().filter(|(_, vertices, pack, lane)| {
            let rest = [self.packs[*pack].rest[0][*lane], self.packs[*pack].rest[1][*lane]];
            !number(&points_of(x, vertices), &rest).is_finite()
        });
        let (index, vertices, ..) = faulty.min_by_key(|(stencil, ..)| *stencil)?;
        Some(Q::fault(body, index, &points_of(x, &vertices)))
    }
}
