//! Viscosity of elements with quadrature points: simplices, cells of second order, and sheets in space.

use super::{StrainRate, Viscosity, ViscousElements};
use crate::algebra::Mat;
use crate::element::{Tangents, times, transpose_times};
use crate::energy::elastic::{BLOCKS, Block, Kinematics, rest_gradients};
use crate::energy::patch::{Patch, Patches, Scratch};
use crate::lanes::{Kernel, Lanes, Portable, WIDTH, dispatch};

/// Elements of `R` dimensions in `D`-dimensional space with a dashpot at every quadrature point:
/// `R = sum_e sum_q w_q (eta Edot : Edot + 1/2 zeta tr(Edot)^2)`.
pub struct ViscousPoints<const D: usize, const R: usize, const N: usize>(Kinematics<D, R, N>);

impl<const D: usize, const R: usize, const N: usize> StrainRate<D, N, ViscousPoints<D, R, N>> {
    /// Creates the elements `elements` (global vertex indices) of `body` with the reference positions
    /// `rest` (flat, all vertices of the system) [m]. `shape` gives the nodes of an element in `R`
    /// coordinates of its own: solids (`R = D`), or triangles of sheets in space.
    ///
    /// # Panics
    /// If no element has `N` nodes in `R` dimensions, or one has no positive volume at a quadrature
    /// point; meshes are checked before.
    pub fn points(
        body: &str,
        viscosity: Viscosity,
        elements: &[[u32; N]],
        rest: &[f64],
        shape: impl Fn(&[u32; N]) -> [[f64; R]; N],
    ) -> Self {
        Self::of_elements(body, viscosity, ViscousPoints(Kinematics::new(body, elements, rest, shape)))
    }
}

impl<const D: usize, const R: usize, const N: usize> ViscousElements<D, N> for ViscousPoints<D, R, N> {
    fn patches(&self) -> &Patches<N> {
        &self.0.patches
    }

    fn add_forces(&self, viscosity: Viscosity, patch: &Patch, scratch: &mut Scratch<D>) -> f64 {
        let (mut f, mut rate) = ([Block::ZERO; BLOCKS], [Block::ZERO; BLOCKS]);
        let (mut power, mut sum) = ([[0.0; WIDTH]; BLOCKS], [0.0; WIDTH]);
        for piece in self.0.pieces(patch) {
            let f = piece.deform(&scratch.position, &mut f);
            let rate = piece.deform(&scratch.direction, &mut rate);
            let power = &mut power[..f.len()];
            dispatch(ViscousKernel { viscosity, f, rate, power });
            piece.add_weighted(power, &mut sum);
            piece.add_forces(rate, &mut scratch.gradient);
        }
        Portable::load(&sum).horizontal_sum()
    }

    fn add_blocks(
        &self,
        viscosity: Viscosity,
        x: &[f64],
        vertices: &[u32; N],
        lane: (usize, usize),
        out: &mut [f64],
    ) {
        for (q, (f, inverse, weight)) in self.0.at_points(x, vertices, lane).enumerate() {
            viscosity.add_blocks(weight, &rest_gradients::<R, N>(q, &inverse), &f, out);
        }
    }
}

/// Overwrites each rate of `F` by the viscous stress `F S`, and writes the power per volume.
struct ViscousKernel<'a, const D: usize, const R: usize> {
    viscosity: Viscosity,
    f: &'a [Block<D, R>],
    rate: &'a mut [Block<D, R>],
    power: &'a mut [[f64; WIDTH]],
}

impl<const D: usize, const R: usize> Kernel for ViscousKernel<'_, D, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let two_eta = L::splat(2.0 * self.viscosity.shear);
        let zeta = L::splat(self.viscosity.second);
        for ((f, rate), power) in self.f.iter().zip(self.rate).zip(self.power) {
            let f: Tangents<L, D, R> = f.load_tangents();
            let strain: Mat<L, R> = transpose_times(&f, &rate.load_tangents()).symmetric();
            let stress = strain.scale(two_eta) + Mat::scalar(zeta * strain.trace());
            stress.dot(&strain).store(power);
            rate.store_tangents(&times(&f, &stress));
        }
    }
}
