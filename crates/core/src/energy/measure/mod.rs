//! Terms that store energy by one number measured at a few vertices: the length of a spring, the angle of a
//! hinge.

mod blocks;
mod curvature;
mod hinge;
mod kernels;
mod length;
mod stencils;
#[cfg(test)]
mod tests;

use std::ops::Range;

pub use curvature::Curvature;
pub use hinge::HingeAngle;
pub use length::Length;
pub use stencils::{MeasuredStencils, StencilConstants};

pub(crate) use self::blocks::{MatrixOutput, fill};
pub(crate) use self::kernels::{RateKernel, gather, scatter};
use self::kernels::{StencilEnergyKernel, StencilGradientKernel, StencilHessianKernel};
use super::patch::Workspace;
use super::{EnergyKind, EnergyTerm, Fault, TermProperties, TermViews};
use crate::lanes::{dispatch, dispatch_compact};
use crate::material::Psd;
use crate::scalar::Scalar;

/// One number `s(x)` measured at `N` vertices, the same under every rigid motion.
pub trait ScalarStrain<const D: usize, const N: usize>: Send + Sync + 'static {
    /// Name of a stencil: `hinge`.
    const OF: &'static str;

    /// The deviation `s(x) - s_0` from rest, which is what `rest` says, and `ds/dx`. Written once, generic
    /// over the scalar: it runs on lanes and on dual numbers.
    fn deviation<S: Scalar>(x: &[[S; D]; N], rest: &[S; 2]) -> (S, [[S; D]; N]);

    /// Vectors `u` whose products `sum u u^T` are nowhere less than `ds/dx ds/dx^T + (s - s_0) d2s/dx2`, and
    /// near it, where the measure knows them in closed form: its projected Hessian.
    fn positive_parts<S: Scalar>(x: &[[S; D]; N], rest: &[S; 2]) -> Option<[[[S; D]; N]; PARTS]> {
        let _ = (x, rest);
        None
    }
}

/// Vectors that a projected Hessian in closed form is made of.
pub const PARTS: usize = 6;

/// `E = sum 1/2 k (s(x) - s_0)^2` over stencils of `N` vertices.
pub struct ScalarStrainEnergy<Q, const D: usize, const N: usize> {
    body: String,
    stencils: MeasuredStencils<Q, D, N>,
    workspace: Workspace<D>,
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize> ScalarStrainEnergy<Q, D, N> {
    /// Stencils `vertices` (global vertex indices) of `body` with their constants, at rest at `rest` (flat,
    /// all vertices of the system) [m]: rest positions only say what is near what.
    ///
    /// # Panics
    /// If there are not as many constants as stencils.
    pub fn new(body: &str, vertices: &[[u32; N]], constants: &[StencilConstants], rest: &[f64]) -> Self {
        let stencils = MeasuredStencils::new(vertices, constants, rest);
        ScalarStrainEnergy { body: body.into(), workspace: stencils.workspace(), stencils }
    }
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize> EnergyTerm for ScalarStrainEnergy<Q, D, N> {
    fn name(&self) -> String {
        format!("{}s of `{}`", Q::OF, self.body)
    }

    fn properties(&self) -> TermProperties {
        TermProperties::of(EnergyKind::Elastic)
    }

    fn energy(&mut self, x: &[f64]) -> f64 {
        let ScalarStrainEnergy { stencils, workspace, .. } = self;
        stencils.patches.sum(workspace, x, |patch, scratch| {
            dispatch_compact(StencilEnergyKernel { stencils, patch, scratch })
        })
    }

    fn evaluate(&mut self, x: &[f64]) -> bool {
        let ScalarStrainEnergy { stencils, workspace, .. } = self;
        stencils.patches.evaluate(workspace, x, None, |patch, scratch| {
            dispatch(StencilGradientKernel { stencils, patch, scratch });
        })
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.stencils.patches.add_rows(&self.workspace, first, g);
    }

    fn add_hessian_product(&mut self, x: &[f64], p: &[f64], y: &mut [f64]) {
        let ScalarStrainEnergy { stencils, workspace, .. } = self;
        stencils.patches.evaluate(workspace, x, Some(p), |patch, scratch| {
            dispatch_compact(StencilHessianKernel { stencils, patch, scratch });
        });
        stencils.patches.add_rows(workspace, 0, y);
    }

    fn stencils(&mut self) -> crate::energy::Stencils {
        self.stencils.patches.lanes()
    }

    fn stencil_hessians(&self, stencils: Range<usize>, x: &[f64], psd: Psd, out: &mut [f64]) {
        fill(&self.stencils, stencils, x, MatrixOutput::Hessian(psd), out);
    }

    fn fault(&self, x: &[f64]) -> Option<Fault> {
        self.stencils.fault(
            &self.body,
            |points, rest| {
                let (s, gradient) = Q::deviation(points, rest);
                gradient.as_flattened().iter().fold(s, |sum, g| sum + g)
            },
            x,
        )
    }

    fn bytes(&self) -> usize {
        self.stencils.bytes() + self.workspace.bytes()
    }
}

impl<Q: ScalarStrain<D, N>, const D: usize, const N: usize> TermViews for ScalarStrainEnergy<Q, D, N> {}
