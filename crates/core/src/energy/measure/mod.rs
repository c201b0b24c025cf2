//! Energy terms that depend on one scalar measured at a few vertices: the length of a spring, the angle of a
//! hinge.
//!
//! # How to add one
//! 1. Write a file in this folder that implements `ScalarStrain`: `OF`, `deviation`, and `positive_parts` if
//!    it has a projected Hessian in closed form. `length.rs` is the shortest.
//! 2. `ScalarStrainEnergy` and, for its dashpot, `MeasuredRate` (`dissipation/measured.rs`) follow. Build
//!    both in `crates/terms/src/springs.rs`.
//! 3. Add it to the tests in `tests.rs` beside this file; `dissipation/tests.rs` has its dashpot.
//! 4. For scenes: a key (`crates/scene/src/schema/bending.rs`), its stencils
//!    (`crates/scene/src/assembly/bending.rs`), its derivatives (`crates/gradient/src/names`).

mod blocks;
mod curvature;
mod hinge;
mod kernels;
mod law;
mod length;
mod stencils;
#[cfg(test)]
mod tests;

use std::marker::PhantomData;
use std::ops::Range;

pub use curvature::Curvature;
pub use hinge::HingeAngle;
pub use law::{RateLaw, ScalarLaw, Square};
pub use length::Length;
pub use stencils::{MeasuredStencils, StencilConstants};

use self::blocks::HessianMatrix;
pub(crate) use self::blocks::{DampingMatrix, fill};
pub(crate) use self::kernels::{DissipationKernel, RateKernel, gather, moving, rate};
use self::kernels::{StencilEnergyKernel, StencilGradientKernel, StencilHessianKernel};
pub(crate) use self::law::FormulaPrograms;
use super::patch::Workspace;
use super::{EnergyKind, EnergyTerm, Fault, TermProperties, TermViews};
use crate::lanes::{dispatch, dispatch_compact};
use crate::material::Psd;
use crate::scalar::Scalar;

/// A scalar measure `s(x)` of `N` vertices, invariant under rigid motion.
pub trait ScalarStrain<const D: usize, const N: usize>: Send + Sync + 'static {
    /// Name of a stencil: `hinge`.
    const OF: &'static str;

    /// Returns the deviation `s(x) - s_0` from its rest value, given by `rest`, and `ds/dx`. The function is
    /// generic over the scalar: it runs on lanes and on dual numbers.
    fn deviation<S: Scalar>(x: &[[S; D]; N], rest: &[S; 2]) -> (S, [[S; D]; N]);

    /// Returns the error of a stencil whose energy is not finite, the `index`-th of `body`.
    fn fault(body: &str, index: usize, _: &[[f64; D]; N]) -> Fault {
        Fault::Stencil { what: Self::OF, body: body.into(), index }
    }

    /// Returns vectors `u` whose sum of products `sum u u^T` is a close upper bound of
    /// `ds/dx ds/dx^T + (s - s_0) d2s/dx2`, the projected Hessian. `None` if the measure has no closed
    /// form for them.
    fn positive_parts<S: Scalar>(x: &[[S; D]; N], rest: &[S; 2]) -> Option<[[[S; D]; N]; PARTS]> {
        let _ = (x, rest);
        None
    }
}

/// Number of vectors in a closed-form projected Hessian.
pub const PARTS: usize = 6;

/// Energy of a scalar measure: `E = sum k psi(s(x))` over stencils of `N` vertices, `psi` a [`ScalarLaw`], by
/// default `1/2 (s - s_0)^2`.
pub struct ScalarStrainEnergy<Q, const D: usize, const N: usize, W = Square> {
    body: String,
    law: W,
    stencils: MeasuredStencils<Q, D, N>,
    workspace: Workspace<D>,
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize> ScalarStrainEnergy<Q, D, N> {
    /// Creates the stencils `vertices` (global vertex indices) of `body` with their constants. The
    /// reference positions `rest` (flat, all vertices of the system) [m] are used only to find
    /// neighbours.
    ///
    /// # Panics
    /// If the numbers of constants and stencils differ.
    pub fn new(body: &str, vertices: &[[u32; N]], constants: &[StencilConstants], rest: &[f64]) -> Self {
        Self::with_law(body, Square, vertices, constants, rest)
    }
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize, W: ScalarLaw> ScalarStrainEnergy<Q, D, N, W> {
    /// Creates stencils with a law, otherwise like [`new`](ScalarStrainEnergy::new).
    ///
    /// # Panics
    /// If the numbers of constants and stencils differ.
    pub fn with_law(
        body: &str,
        law: W,
        vertices: &[[u32; N]],
        constants: &[StencilConstants],
        rest: &[f64],
    ) -> Self {
        let stencils = MeasuredStencils::new(vertices, constants, rest);
        ScalarStrainEnergy { body: body.into(), law, workspace: stencils.workspace(), stencils }
    }
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize, W: ScalarLaw> EnergyTerm
    for ScalarStrainEnergy<Q, D, N, W>
{
    fn name(&self) -> String {
        format!("{}s of `{}`", Q::OF, self.body)
    }

    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Elastic)
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let ScalarStrainEnergy { stencils, workspace, law, .. } = self;
        stencils.patches.sum(workspace, x, |patch, scratch| {
            dispatch_compact(StencilEnergyKernel { stencils, law, patch, scratch })
        })
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let ScalarStrainEnergy { stencils, workspace, law, .. } = self;
        stencils.patches.evaluate(workspace, x, None, |patch, scratch| {
            dispatch(StencilGradientKernel { stencils, law, patch, scratch });
        })
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.stencils.patches.add_rows(&self.workspace, first, g);
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        let ScalarStrainEnergy { stencils, workspace, law, .. } = self;
        stencils.patches.evaluate(workspace, x, Some(p), |patch, scratch| {
            dispatch_compact(StencilHessianKernel { stencils, law, patch, scratch });
        });
        stencils.patches.add_rows(workspace, 0, y);
    }

    fn stencils(&mut self) -> crate::energy::Stencils {
        self.stencils.patches.lanes()
    }

    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        let matrix = HessianMatrix { law: &self.law, psd, measure: PhantomData::<Q> };
        fill(&self.stencils, stencils, (x, &[]), matrix, out);
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        let sum = |points: &[[f64; D]; N], rest: &[f64; 2]| {
            let (s, gradient) = Q::deviation(points, &W::origin(rest));
            gradient.as_flattened().iter().fold(self.law.force(s, rest), |sum, g| sum + g)
        };
        self.stencils.fault(&self.body, sum, x)
    }
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize, W: ScalarLaw> TermViews
    for ScalarStrainEnergy<Q, D, N, W>
{
}
