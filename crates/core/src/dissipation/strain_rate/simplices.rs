//! Linear simplices: solids, and sheets in space.

use super::{StrainRate, Viscosity, ViscousElements};
use crate::algebra::Mat;
use crate::element::{SimplexPack, scatter_stress, simplex_rest, tangents, times, transpose_times};
use crate::energy::patch::{Patch, Patches, Scratch};
use crate::lanes::{Kernel, Lanes, dispatch};

/// Linear simplices of `R` dimensions, with one quadrature point.
pub struct ViscousSimplices<const R: usize>(Vec<SimplexPack<R>>);

impl<const D: usize, const R: usize, const N: usize> StrainRate<D, N, ViscousSimplices<R>> {
    /// Simplices `elements` (global vertex indices) of `body`, at rest at `rest` (flat, all vertices of the
    /// system) [m], each with its shape `rest_shape` in coordinates of its own: of `R` dimensions in `D` of
    /// space, triangles in the plane and tetrahedra (`R = D`), triangles of sheets in space.
    ///
    /// # Panics
    /// If `N` is not `R + 1`.
    pub fn linear(
        body: &str,
        viscosity: Viscosity,
        elements: &[[u32; N]],
        rest: &[f64],
        rest_shape: impl Fn(&[u32; N]) -> [[f64; R]; N],
    ) -> Self {
        assert_eq!(N, R + 1, "a simplex has one vertex more than dimensions");
        let packs = |patches: &Patches<N>| ViscousSimplices(simplex_packs(patches, rest_shape));
        Self::new(body, viscosity, elements, rest, packs)
    }
}

/// The rest data of every pack.
pub(crate) fn simplex_packs<const R: usize, const N: usize>(
    patches: &Patches<N>,
    rest_shape: impl Fn(&[u32; N]) -> [[f64; R]; N],
) -> Vec<SimplexPack<R>> {
    let mut packs = vec![SimplexPack::new(); patches.index.len()];
    for (_, vertices, pack, lane) in patches.stencils() {
        let (inverse_rest, weight) = simplex_rest(&rest_shape(&vertices));
        packs[pack].set(lane, &inverse_rest, weight);
    }
    for (pack, stencils) in packs.iter_mut().zip(&patches.stencil) {
        pack.fill_up(stencils.iter().flatten().count());
    }
    packs
}

impl<const D: usize, const R: usize, const N: usize> ViscousElements<D, N> for ViscousSimplices<R> {
    fn add_forces(
        &self,
        viscosity: Viscosity,
        patches: &Patches<N>,
        patch: &Patch,
        scratch: &mut Scratch<D>,
    ) -> f64 {
        dispatch(ViscousKernel { viscosity, patches, packs: &self.0, patch, scratch })
    }

    fn add_blocks(
        &self,
        viscosity: Viscosity,
        x: &[f64],
        vertices: &[u32; N],
        (pack, lane): (usize, usize),
        out: &mut [f64],
    ) {
        let (inverse_rest, weight) = self.0[pack].lane(lane);
        let x = x.as_chunks::<D>().0;
        // grad N_a in coordinates of the rest shape, and the tangents F = sum_a x_a grad N_a^T.
        let mut gradient = [[0.0; R]; N];
        for a in 0..R {
            for j in 0..R {
                gradient[a + 1][j] = inverse_rest[a][j];
                gradient[0][j] -= inverse_rest[a][j];
            }
        }
        let mut f = [[0.0; R]; D];
        for a in 0..N {
            let point = &x[vertices[a] as usize];
            for i in 0..D {
                for j in 0..R {
                    f[i][j] += point[i] * gradient[a][j];
                }
            }
        }
        viscosity.add_blocks(weight, &gradient, &f, out);
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.0[..])
    }
}

/// Adds the viscous forces of a patch to its rows; gives their power.
struct ViscousKernel<'a, const D: usize, const R: usize, const N: usize> {
    viscosity: Viscosity,
    patches: &'a Patches<N>,
    packs: &'a [SimplexPack<R>],
    patch: &'a Patch,
    scratch: &'a mut Scratch<D>,
}

impl<const D: usize, const R: usize, const N: usize> Kernel for ViscousKernel<'_, D, R, N> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let Scratch { position, direction, gradient } = self.scratch;
        let (position, direction, gradient) = (&**position, &**direction, &mut **gradient);
        let two_eta = L::splat(2.0 * self.viscosity.shear);
        let zeta = L::splat(self.viscosity.second);
        let mut power = L::zero();
        for pack in self.patch.packs.clone() {
            let (index, pack) = (&self.patches.index[pack], &self.packs[pack]);
            let rest = pack.inverse_rest::<L>();
            let f = tangents::<L, D, R, N>(position, index, &rest);
            let f_dot = tangents::<L, D, R, N>(direction, index, &rest);
            let rate: Mat<L, R> = transpose_times(&f, &f_dot).symmetric();
            let stress = rate.scale(two_eta) + Mat::scalar(zeta * rate.trace());
            power += pack.weight::<L>() * stress.dot(&rate);
            scatter_stress(gradient, index, &times(&f, &stress), pack);
        }
        power.horizontal_sum()
    }
}
