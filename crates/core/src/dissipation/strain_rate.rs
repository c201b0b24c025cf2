//! Viscosity of elements: damping by the rate of strain.

use super::DissipativeTerm;
use crate::algebra::Mat;
use crate::element::{SimplexPack, scatter_stress, simplex_rest, tangents, times, transpose_times};
use crate::energy::elastic::centroids;
use crate::energy::patch::{Patch, Patches, Scratch, Workspace};
use crate::lanes::{Kernel, Lanes, dispatch};
use crate::mesh::order::along_curve;

/// Viscosities of a solid [Pa s]; of a sheet, times its thickness [Pa s m].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Viscosity {
    /// Shear viscosity `eta`: of a change of shape.
    pub shear: f64,
    /// Second viscosity `zeta`: of a change of volume, beside what `shear` does there.
    pub second: f64,
}

/// A Kelvin-Voigt dashpot in every element: `R = sum_e w_e (eta Edot : Edot + 1/2 zeta tr(Edot)^2)` with the rate of Green's strain
/// `Edot = sym(F^T Fdot)`.
///
/// It is a second Piola-Kirchhoff stress `S = 2 eta Edot + zeta tr(Edot) I` on top of the elastic one, `P = F S`. A rigid motion
/// has `Edot = 0` at any rotation and speed, and `S` is symmetric: momentum and angular momentum are conserved. At rest, with
/// `eta = beta mu` and `zeta = beta lambda`, it is Rayleigh's damping `C = beta K`, `K` the stiffness of linear elasticity, which
/// gives a mode of angular frequency `omega` the damping ratio `beta omega / 2`.
///
/// `R` dimensions of the element in `D` of space: triangles in the plane and tetrahedra (`R = D`), triangles of sheets in space.
pub struct StrainRate<const D: usize, const R: usize, const N: usize> {
    body: String,
    viscosity: Viscosity,
    patches: Patches<N>,
    packs: Vec<SimplexPack<R>>,
    workspace: Workspace<D>,
}

impl<const D: usize, const R: usize, const N: usize> StrainRate<D, R, N> {
    /// Elements `elements` (global vertex indices) of `body`, at rest at `rest` (flat, all vertices of the system) [m], each with
    /// its shape `rest_shape` in coordinates of its own.
    ///
    /// # Panics
    /// If `N` is not `R + 1`.
    pub fn new(
        body: &str,
        viscosity: Viscosity,
        elements: &[[u32; N]],
        rest: &[f64],
        rest_shape: impl Fn(&[u32; N]) -> [[f64; R]; N],
    ) -> Self {
        assert_eq!(N, R + 1, "a simplex has one vertex more than dimensions");
        let order = along_curve::<D>(&centroids(elements, rest));
        let patches = Patches::new::<D>(elements, &order, rest.len() / D);
        let packs = simplex_packs(&patches, rest_shape);
        StrainRate { body: body.into(), viscosity, workspace: Workspace::new(&patches), patches, packs }
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

impl<const D: usize, const R: usize, const N: usize> DissipativeTerm for StrainRate<D, R, N> {
    fn name(&self) -> String {
        format!("strain-rate damping of `{}`", self.body)
    }

    fn evaluate(&mut self, x: &[f64], v: &[f64]) -> bool {
        let StrainRate { patches, packs, viscosity, workspace, .. } = self;
        patches.evaluate(workspace, x, Some(v), |patch, scratch| {
            dispatch(ViscousKernel { viscosity, patches, packs, patch, scratch });
        })
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.patches.add_rows(&self.workspace, first, g);
    }

    fn add_damping_product(&mut self, x: &[f64], _v: &[f64], p: &[f64], y: &mut [f64]) {
        self.evaluate(x, p);
        self.add_rows(0, y);
    }

    fn power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        let StrainRate { patches, packs, viscosity, workspace, .. } = self;
        patches.sum_along(workspace, x, v, |patch, scratch| {
            dispatch(ViscousKernel { viscosity, patches, packs, patch, scratch })
        })
    }

    fn bytes(&self) -> usize {
        self.patches.bytes() + size_of_val(&self.packs[..]) + self.workspace.bytes()
    }
}

/// Adds the viscous forces of a patch to its rows; gives their power.
struct ViscousKernel<'a, const D: usize, const R: usize, const N: usize> {
    viscosity: &'a Viscosity,
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
