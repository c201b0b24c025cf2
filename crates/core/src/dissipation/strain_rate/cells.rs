//! Quadrilaterals and hexahedra.

use super::{StrainRate, Viscosity, ViscousElements};
use crate::algebra::Mat;
use crate::element::Isoparametric;
use crate::energy::elastic::{
    BendingPack, BendingSolid, CellBending, CellPacks, Dilatation, PointPack, cell_gradient, gather,
    gradient_of_lane, points_of, scatter,
};
use crate::energy::patch::{Patch, Patches, Scratch};
use crate::lanes::{Kernel, Lanes, dispatch_compact};
use crate::material::Tangent;

/// Cells with a dashpot at every quadrature point that sees the mean of the rates of volume:
/// `R = sum_e sum_q w_q (eta E'_q : E'_q + 1/2 zeta m^2)`, `m` the mean of `tr Edot_q` over the
/// cell and `E'_q = Edot_q + (m - tr Edot_q)/D I`, and the dissipation of bending that cells lack. At
/// rest, with `eta = beta mu` and `zeta = beta lambda`, it is `beta` times the stiffness of
/// [`MeanDilatation`](crate::energy::elastic::MeanDilatation) of the linear material.
pub struct ViscousCells<const D: usize, const N: usize> {
    cell: &'static Isoparametric<D, N>,
    packs: CellPacks<D, N>,
    /// `None` where no cell lacks any.
    bending: Option<CellBending<D, N>>,
}

impl<const D: usize, const N: usize> StrainRate<D, N, ViscousCells<D, N>> {
    /// Cells `cells` (global vertex indices) of `body`, at rest at `rest` (flat, all vertices of the system)
    /// [m].
    ///
    /// # Panics
    /// If `det J` is not positive at a quadrature point: meshes are checked before.
    pub fn cells(
        body: &str,
        viscosity: Viscosity,
        cell: &'static Isoparametric<D, N>,
        cells: &[[u32; N]],
        rest: &[f64],
    ) -> Self {
        let of_patches = |patches: &Patches<N>| {
            let packs = CellPacks::new(body, cell, patches, rest);
            let tangent = &Tangent::isotropic(viscosity.second, viscosity.shear);
            let solid = BendingSolid {
                tangent,
                change: None,
                axes: &[],
                turning: None,
                dilatation: Dilatation::Small,
            };
            let bending = CellBending::new(cell, patches, &packs, solid, rest);
            ViscousCells { cell, packs, bending }
        };
        Self::new(body, viscosity, cells, rest, of_patches)
    }

    /// The change of the dissipation of cells with a parameter: of cells of this `viscosity`, which changes
    /// by that of `self`. What cells lack in bending is no linear function of the viscosities, as all else
    /// is.
    #[must_use]
    pub fn as_change_of(mut self, viscosity: Viscosity, rest: &[f64]) -> Self {
        let tangent = &Tangent::isotropic(viscosity.second, viscosity.shear);
        let change = Some(&Tangent::isotropic(self.viscosity.second, self.viscosity.shear));
        let solid = BendingSolid { tangent, change, axes: &[], turning: None, dilatation: Dilatation::Small };
        let ViscousCells { cell, packs, bending } = &mut self.elements;
        *bending = CellBending::new(cell, &self.patches, packs, solid, rest);
        self
    }
}

impl<const D: usize, const N: usize> ViscousElements<D, N> for ViscousCells<D, N> {
    fn add_forces(
        &self,
        viscosity: Viscosity,
        patches: &Patches<N>,
        patch: &Patch,
        scratch: &mut Scratch<D>,
    ) -> f64 {
        dispatch_compact(CellViscousKernel { viscosity, patches, cells: self, patch, scratch })
    }

    fn add_blocks(
        &self,
        viscosity: Viscosity,
        x: &[f64],
        vertices: &[u32; N],
        (pack, lane): (usize, usize),
        out: &mut [f64],
    ) {
        let Viscosity { shear, second } = viscosity;
        // 2 eta E' : E' = 2 eta (Edot : Edot - (tr Edot)^2 / D) + 2 eta m^2 / D.
        let of_shear = Viscosity { shear, second: -2.0 * shear / D as f64 };
        let of_volume = Viscosity { shear: 0.0, second: second + 2.0 * shear / D as f64 };
        let nodes = points_of::<D, N>(x, vertices);
        let volume = self.packs.volume[pack][lane];
        let mut mean = [[0.0; D]; N];
        for rest in self.packs.rest(pack) {
            let (gradient, part) = rest.lane(lane);
            let f = gradient_of_lane(&nodes, &gradient);
            of_shear.add_blocks(volume * part, &gradient, &f.0, out);
            for (mean, gradient) in mean.iter_mut().zip(&gradient) {
                let pushed = f.mul_vec(gradient);
                (0..D).for_each(|i| mean[i] += part * pushed[i]);
            }
        }
        of_volume.add_blocks(volume, &mean, &Mat::identity().0, out);
        if let Some(bending) = &self.bending {
            bending.add_damping(&nodes, (pack, lane), out);
        }
    }

    fn bytes(&self) -> usize {
        self.packs.bytes() + self.bending.as_ref().map_or(0, CellBending::bytes)
    }
}

/// Adds the viscous forces of a patch to its rows; gives their power.
struct CellViscousKernel<'a, const D: usize, const N: usize> {
    viscosity: Viscosity,
    patches: &'a Patches<N>,
    cells: &'a ViscousCells<D, N>,
    patch: &'a Patch,
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize, const N: usize> Kernel for CellViscousKernel<'_, D, N> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let Scratch { position, direction, gradient } = self.scratch;
        let ViscousCells { packs, bending, .. } = self.cells;
        let two_eta = L::splat(2.0 * self.viscosity.shear);
        let zeta = L::splat(self.viscosity.second);
        let mut power = L::zero();
        for pack in self.patch.packs.clone() {
            let index = &self.patches.index[pack];
            let x = gather::<L, D, N>(position, index);
            let v = gather::<L, D, N>(direction, index);
            let volume = L::load(&packs.volume[pack]);
            let mut mean = L::zero();
            for rest in packs.rest(pack) {
                let (_, rate) = rate(&x, &v, rest);
                mean = rest.part::<L>().mul_add(rate.trace(), mean);
            }
            let mut gradients = [[L::zero(); D]; N];
            for rest in packs.rest(pack) {
                let weight = volume * rest.part::<L>();
                let (f, rate) = rate(&x, &v, rest);
                let rate = rate + Mat::scalar((mean - rate.trace()) * L::splat(1.0 / D as f64));
                let stress = rate.scale(two_eta) + Mat::scalar(zeta * mean);
                power += weight * stress.dot(&rate);
                let h = f.mul(&stress).scale(weight);
                for a in 1..N {
                    for i in 0..D {
                        for k in 0..D {
                            let force = h[i][k] * rest.gradient::<L>(a, k);
                            gradients[a][i] += force;
                            gradients[0][i] -= force;
                        }
                    }
                }
            }
            if let Some(bending) = bending {
                let pack = BendingPack { bending, index, pack, turns: true };
                power += pack.add_viscous(&x, &v, &mut gradients);
            }
            scatter(gradient, index, gradients);
        }
        power.horizontal_sum()
    }
}

/// `F` and the rate of Green's strain at a point.
#[inline(always)]
fn rate<L: Lanes, const D: usize, const N: usize>(
    x: &[[L; D]; N],
    v: &[[L; D]; N],
    point: &PointPack<D, N>,
) -> (Mat<L, D>, Mat<L, D>) {
    let f = cell_gradient(x, point);
    (f, f.transpose_mul(&cell_gradient(v, point)).symmetric())
}
