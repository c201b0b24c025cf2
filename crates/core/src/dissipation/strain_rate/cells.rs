//! Viscosity of quadrilaterals and hexahedra with hourglass modes.

use super::{StrainRate, Viscosity, ViscousElements};
use crate::algebra::Mat;
use crate::element::Isoparametric;
use crate::energy::elastic::{
    Amplitudes, CellPacks, HourglassSolid, MOST_MODES, RestData, amplitude_rates, by_each, centroids, dot,
    gather, modes, outer_sum, points_of, scatter, times,
};
use crate::energy::patch::{Patch, Patches, Scratch};
use crate::lanes::{Kernel, Lanes, dispatch_compact};
use crate::material::Tangent;
use crate::numbering::along_curve;

/// Cells with a dashpot on their mean deformation gradient and others on their hourglass modes:
/// `R = sum_e V (eta Edot : Edot + 1/2 zeta tr(Edot)^2) + 1/2 z . K z`, `z = Fdot^T q + F^T qdot`. `K` is
/// the stiffness of [`OnePointCells`](crate::energy::elastic::OnePointCells) of a linear material with
/// the moduli `eta` and `zeta`. Like the rate of Green's strain, `z` is zero in a rigid motion and
/// bilinear in positions and velocities. In the reference configuration, `eta = beta mu` and
/// `zeta = beta lambda` give `beta` times the stiffness of these cells.
pub struct ViscousCells<const D: usize, const N: usize> {
    patches: Patches<N>,
    packs: CellPacks<D, N>,
}

impl<const D: usize, const N: usize> StrainRate<D, N, ViscousCells<D, N>> {
    /// Creates the cells `cells` (global vertex indices) of `body` with the reference positions `rest`
    /// (flat, all vertices of the system) [m].
    ///
    /// # Panics
    /// If the volume of a cell is not positive; meshes are checked before.
    pub fn cells(
        body: &str,
        viscosity: Viscosity,
        cell: &'static Isoparametric<D, N>,
        cells: &[[u32; N]],
        rest: &[f64],
    ) -> Self {
        Self::of_solid(body, viscosity, (cell, cells, rest), None)
    }

    /// Creates the derivative of the dissipation of cells with respect to a parameter: their viscosity is
    /// `about` and changes by `viscosity`. The viscosity of hourglass modes is a nonlinear function of
    /// it; all else is linear.
    ///
    /// # Panics
    /// If the volume of a cell is not positive.
    pub fn change_of_cells(
        body: &str,
        viscosity: Viscosity,
        about: Viscosity,
        cell: &'static Isoparametric<D, N>,
        cells: &[[u32; N]],
        rest: &[f64],
    ) -> Self {
        Self::of_solid(body, viscosity, (cell, cells, rest), Some(about))
    }

    fn of_solid(
        body: &str,
        viscosity: Viscosity,
        (cell, cells, rest): (&'static Isoparametric<D, N>, &[[u32; N]], &[f64]),
        about: Option<Viscosity>,
    ) -> Self {
        let tangent = |viscosity: Viscosity| Tangent::isotropic(viscosity.second, viscosity.shear);
        let own = tangent(viscosity);
        let about = about.map(tangent);
        let solid = match &about {
            Some(about) => HourglassSolid { tangent: about, change: Some(&own), axes: &[] },
            None => HourglassSolid { tangent: &own, change: None, axes: &[] },
        };
        let order = along_curve::<D>(&centroids(cells, rest));
        let patches = Patches::new::<D>(cells, &order, rest.len() / D);
        let packs = CellPacks::new(body, cell, &patches, rest, solid);
        Self::of_elements(body, viscosity, ViscousCells { patches, packs })
    }
}

impl<const D: usize, const N: usize> ViscousElements<D, N> for ViscousCells<D, N> {
    fn patches(&self) -> &Patches<N> {
        &self.patches
    }

    fn add_forces(&self, viscosity: Viscosity, patch: &Patch, scratch: &mut Scratch<D>) -> f64 {
        let ViscousCells { patches, packs } = self;
        dispatch_compact(CellViscousKernel { viscosity, patches, packs, patch, scratch })
    }

    fn add_blocks(
        &self,
        viscosity: Viscosity,
        x: &[f64],
        vertices: &[u32; N],
        (pack, lane): (usize, usize),
        out: &mut [f64],
    ) {
        let rest = self.packs.lane(pack, lane);
        let (f, q): (Mat<f64, D>, Amplitudes<f64, D>) = rest.measure(&points_of::<D, N>(x, vertices));
        viscosity.add_blocks(rest.volume(), &rest.gradient, &f.0, out);
        // `z` for a unit velocity of each node, and `K z`.
        let mut slopes = [[[[0.0; D]; MOST_MODES]; D]; N];
        for (a, i) in (0..N).flat_map(|a| (0..D).map(move |i| (a, i))) {
            for (h, k) in (0..modes(D)).flat_map(|h| (0..D).map(move |k| (h, k))) {
                slopes[a][i][h][k] = rest.gradient[a][k] * q[h][i] + rest.weight[h][a] * f[i][k];
            }
        }
        let forces = slopes.map(|of_node| of_node.map(|slope| times(&rest.stiffness, &slope)));
        let pairs = (0..N).flat_map(|a| (a..N).map(move |b| (a, b)));
        for ((a, b), block) in pairs.zip(out.chunks_exact_mut(D * D)) {
            for (entry, (i, k)) in block.iter_mut().zip((0..D).flat_map(|i| (0..D).map(move |k| (i, k)))) {
                let products = slopes[a][i].as_flattened().iter().zip(forces[b][k].as_flattened());
                *entry += products.map(|(slope, force)| slope * force).sum::<f64>();
            }
        }
    }
}

/// Adds the viscous forces of a patch to its rows and returns their power.
struct CellViscousKernel<'a, const D: usize, const N: usize> {
    viscosity: Viscosity,
    patches: &'a Patches<N>,
    packs: &'a CellPacks<D, N>,
    patch: &'a Patch,
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize, const N: usize> Kernel for CellViscousKernel<'_, D, N> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let Scratch { position, direction, gradient } = self.scratch;
        let two_eta = L::splat(2.0 * self.viscosity.shear);
        let zeta = L::splat(self.viscosity.second);
        let mut power = L::zero();
        for pack in self.patch.packs.clone() {
            let (index, rest) = (&self.patches.index[pack], self.packs.rest::<L>(pack));
            let (f, q): (Mat<L, D>, Amplitudes<L, D>) = rest.measure(&gather::<L, D, N>(position, index));
            let (l, q_rate): (Mat<L, D>, Amplitudes<L, D>) =
                rest.measure(&gather::<L, D, N>(direction, index));
            let rate = f.transpose_mul(&l).symmetric();
            let stress = rate.scale(two_eta) + Mat::scalar(zeta * rate.trace());
            let z = amplitude_rates((&f, &q), (&l, &q_rate));
            let y = times(&rest.stiffness::<L>(), &z);
            let volume: L = rest.volume();
            power += volume.mul_add(stress.dot(&rate), dot(&y, &z));
            let by_rate = f.mul(&stress).scale_add(volume, &outer_sum(&q, &y));
            let gradients: [[L; D]; N] = rest.spread(&by_rate, &by_each(&f, &y));
            scatter(gradient, index, gradients);
        }
        power.horizontal_sum()
    }
}
