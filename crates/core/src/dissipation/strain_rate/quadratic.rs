//! Elements of second order: simplices, quadrilaterals and hexahedra.

use super::{StrainRate, Viscosity, ViscousElements};
use crate::algebra::Mat;
use crate::element::{
    QuadraticGradients, QuadraticPositions, SimplexPack, order, quadrature_count, quadrature_position,
    reference_gradients,
};
use crate::energy::elastic::{gather, points_of, rest_packs, scatter};
use crate::energy::patch::{Patch, Patches, Scratch};
use crate::lanes::{Kernel, Lanes, dispatch_compact};

/// Simplices of second order, with a dashpot at every quadrature point:
/// `R = sum_e sum_q w_q (eta Edot : Edot + 1/2 zeta tr(Edot)^2)`.
pub struct QuadraticSimplices<const D: usize>(
    /// Rest data of every pack, one after the other those of its quadrature points.
    Vec<SimplexPack<D>>,
);

impl<const D: usize, const N: usize> StrainRate<D, N, QuadraticSimplices<D>> {
    /// Elements `elements` (global vertex indices) of `body`, corners first, at rest at `rest` (flat, all
    /// vertices of the system) [m].
    ///
    /// # Panics
    /// If `N` is not 6, 8 or 9 in 2D or 10, 20 or 27 in 3D, or an element has no positive volume at a
    /// quadrature point: meshes are checked before.
    pub fn quadratic(body: &str, viscosity: Viscosity, elements: &[[u32; N]], rest: &[f64]) -> Self {
        assert_eq!(
            order::<D, N>(),
            2,
            "a quadratic element has 6, 8 or 9 vertices in 2D, 10, 20 or 27 in 3D"
        );
        let packs = |patches: &Patches<N>| QuadraticSimplices(rest_packs::<D, N>(body, patches, rest));
        Self::new(body, viscosity, elements, rest, packs)
    }
}

impl<const D: usize, const N: usize> ViscousElements<D, N> for QuadraticSimplices<D> {
    fn add_forces(
        &self,
        viscosity: Viscosity,
        patches: &Patches<N>,
        patch: &Patch,
        scratch: &mut Scratch<D>,
    ) -> f64 {
        dispatch_compact(QuadraticViscousKernel { viscosity, patches, packs: &self.0, patch, scratch })
    }

    fn add_blocks(
        &self,
        viscosity: Viscosity,
        x: &[f64],
        vertices: &[u32; N],
        (pack, lane): (usize, usize),
        out: &mut [f64],
    ) {
        let count = quadrature_count::<D, N>();
        let positions = QuadraticPositions::new(points_of::<D, N>(x, vertices));
        for q in 0..count {
            let (inverse, weight) = self.0[pack * count + q].lane(lane);
            let reference = reference_gradients::<D, N>(&quadrature_position::<D, N>(q));
            let gradient =
                reference.map(|g| std::array::from_fn(|j| (0..D).map(|l| g[l] * inverse[l][j]).sum()));
            viscosity.add_blocks(weight, &gradient, &positions.at(q).mul(&inverse).0, out);
        }
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.0[..])
    }
}

/// Adds the viscous forces of a patch to its rows; gives their power.
struct QuadraticViscousKernel<'a, const D: usize, const N: usize> {
    viscosity: Viscosity,
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
