//! Viscosity of elements of second order.

use std::ops::Range;

use super::{DissipativeTerm, Viscosity};
use crate::algebra::Mat;
use crate::element::{
    QuadraticGradients, QuadraticPositions, SimplexPack, order, quadrature_count, quadrature_position,
    reference_gradients,
};
use crate::energy::Stencils;
use crate::energy::elastic::{centroids, gather, points_of, rest_packs, scatter};
use crate::energy::patch::{Patch, Patches, Scratch, Workspace};
use crate::lanes::{Kernel, Lanes, dispatch_compact};
use crate::numbering::along_curve;

/// The dashpot of [`StrainRate`](super::StrainRate) at every quadrature point of elements of second order:
/// `R = sum_e sum_q w_q (eta Edot : Edot + 1/2 zeta tr(Edot)^2)`.
pub struct QuadraticStrainRate<const D: usize, const N: usize> {
    body: String,
    viscosity: Viscosity,
    patches: Patches<N>,
    /// Rest data of every pack, one after the other those of its quadrature points.
    packs: Vec<SimplexPack<D>>,
    workspace: Workspace<D>,
}

impl<const D: usize, const N: usize> QuadraticStrainRate<D, N> {
    /// Elements `elements` (global vertex indices) of `body`, corners first, at rest at `rest` (flat, all vertices of the system)
    /// [m].
    ///
    /// # Panics
    /// If `N` is not 6 in 2D or 10 in 3D, or an element has no positive volume at a quadrature point: meshes are checked before.
    pub fn new(body: &str, viscosity: Viscosity, elements: &[[u32; N]], rest: &[f64]) -> Self {
        assert_eq!(order::<D, N>(), 2, "a quadratic simplex has 6 vertices in 2D, 10 in 3D");
        let order = along_curve::<D>(&centroids(elements, rest));
        let patches = Patches::new::<D>(elements, &order, rest.len() / D);
        let packs = rest_packs::<D, N>(body, &patches, rest);
        let workspace = Workspace::new(&patches);
        QuadraticStrainRate { body: body.into(), viscosity, workspace, patches, packs }
    }
}

impl<const D: usize, const N: usize> DissipativeTerm for QuadraticStrainRate<D, N> {
    fn name(&self) -> String {
        format!("strain-rate damping of `{}`", self.body)
    }

    fn evaluate(&mut self, x: &[f64], v: &[f64]) -> bool {
        let QuadraticStrainRate { patches, packs, viscosity, workspace, .. } = self;
        patches.evaluate(workspace, x, Some(v), |patch, scratch| {
            dispatch_compact(QuadraticViscousKernel { viscosity, patches, packs, patch, scratch });
        })
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.patches.add_rows(&self.workspace, first, g);
    }

    fn add_damping_product(&mut self, x: &[f64], _v: &[f64], p: &[f64], y: &mut [f64]) {
        self.evaluate(x, p);
        self.add_rows(0, y);
    }

    fn stencils(&mut self) -> Stencils {
        self.patches.lanes()
    }

    fn stencil_dampings(&self, stencils: Range<usize>, x: &[f64], _v: &[f64], out: &mut [f64]) {
        let count = quadrature_count::<D, N>();
        let pairs = N * (N + 1) / 2;
        let lanes = self.patches.lanes_in(stencils).zip(out.chunks_exact_mut(pairs * D * D));
        for ((vertices, pack, lane), out) in lanes {
            out.fill(0.0);
            let positions = QuadraticPositions::new(points_of::<D, N>(x, &vertices));
            for q in 0..count {
                let (inverse, weight) = self.packs[pack * count + q].lane(lane);
                let reference = reference_gradients::<D, N>(&quadrature_position::<D, N>(q));
                let gradient =
                    reference.map(|g| std::array::from_fn(|j| (0..D).map(|l| g[l] * inverse[l][j]).sum()));
                self.viscosity.add_blocks(weight, &gradient, &positions.at(q).mul(&inverse).0, out);
            }
        }
    }

    fn power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        let QuadraticStrainRate { patches, packs, viscosity, workspace, .. } = self;
        patches.sum_along(workspace, x, v, |patch, scratch| {
            dispatch_compact(QuadraticViscousKernel { viscosity, patches, packs, patch, scratch })
        })
    }

    fn bytes(&self) -> usize {
        self.patches.bytes() + size_of_val(&self.packs[..]) + self.workspace.bytes()
    }
}

/// Adds the viscous forces of a patch to its rows; gives their power.
struct QuadraticViscousKernel<'a, const D: usize, const N: usize> {
    viscosity: &'a Viscosity,
    patches: &'a Patches<N>,
    packs: &'a [SimplexPack<D>],
    patch: &'a Patch,
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize, const N: usize> Kernel for QuadraticViscousKernel<'_, D, N> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let points = quadrature_count::<D, N>();
        let Scratch { position, direction, gradient } = self.scratch;
        let two_eta = L::splat(2.0 * self.viscosity.shear);
        let zeta = L::splat(self.viscosity.second);
        let mut power = L::zero();
        for pack in self.patch.packs.clone() {
            let index = &self.patches.index[pack];
            let x = QuadraticPositions::new(gather::<L, D, N>(position, index));
            let v = QuadraticPositions::new(gather::<L, D, N>(direction, index));
            let mut gradients = QuadraticGradients::<L, D, N>::new();
            for q in 0..points {
                let rest = &self.packs[pack * points + q];
                let (inverse, weight) = (rest.inverse_rest::<L>(), rest.weight::<L>());
                let f = x.at(q).mul(&inverse);
                let rate: Mat<L, D> = f.transpose_mul(&v.at(q).mul(&inverse)).symmetric();
                let stress = rate.scale(two_eta) + Mat::scalar(zeta * rate.trace());
                power += weight * stress.dot(&rate);
                gradients.add(q, &f.mul(&stress).scale(weight).mul_transpose(&inverse));
            }
            scatter(gradient, index, gradients.finish());
        }
        power.horizontal_sum()
    }
}
