//! Viscosity of elements: damping by the rate of strain.

use std::ops::Range;

use super::DissipativeTerm;
use crate::algebra::Mat;
use crate::element::{SimplexPack, scatter_stress, simplex_rest, tangents, times, transpose_times};
use crate::energy::Stencils;
use crate::energy::elastic::centroids;
use crate::energy::patch::{Patch, Patches, Scratch, Workspace};
use crate::lanes::{Kernel, Lanes, dispatch};
use crate::numbering::along_curve;

/// Viscosities of a solid [Pa s]; of a sheet, times its thickness [Pa s m].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Viscosity {
    /// Shear viscosity `eta`: of a change of shape.
    pub shear: f64,
    /// Second viscosity `zeta`: of a change of volume, beside what `shear` does there.
    pub second: f64,
}

impl Viscosity {
    /// The sum of both.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Viscosity { shear: self.shear + other.shear, second: self.second + other.second }
    }

    /// Adds the blocks of the damping matrix of one point, for each pair `a <= b` of vertices: `gradient` are the gradients of the shape
    /// functions at rest, `f` the deformation gradient.
    ///
    /// With `dEdot = sym(F^T dFdot)` and `dFdot = e_k grad N_b^T` the stress `F (2 eta dEdot + zeta tr dEdot)` meets `grad N_a` in
    /// `eta (F F^T)_ik grad N_a . grad N_b + eta (F grad N_b)_i (F grad N_a)_k + zeta (F grad N_a)_i (F grad N_b)_k`.
    pub(super) fn add_blocks<const D: usize, const R: usize, const N: usize>(
        &self,
        weight: f64,
        gradient: &[[f64; R]; N],
        f: &[[f64; R]; D],
        out: &mut [f64],
    ) {
        let pushed = gradient.map(|g| f.map(|row| dot(&row, &g)));
        let mut stretch = [[0.0; D]; D];
        for i in 0..D {
            for k in 0..D {
                stretch[i][k] = dot(&f[i], &f[k]);
            }
        }
        let mut blocks = out.chunks_exact_mut(D * D);
        for a in 0..N {
            for b in a..N {
                let block = blocks.next().expect("a block for each pair");
                let both = dot(&gradient[a], &gradient[b]);
                for i in 0..D {
                    for k in 0..D {
                        block[i * D + k] += weight
                            * (self.shear * (stretch[i][k] * both + pushed[b][i] * pushed[a][k])
                                + self.second * pushed[a][i] * pushed[b][k]);
                    }
                }
            }
        }
    }
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

    fn stencils(&mut self) -> Stencils {
        self.patches.lanes()
    }

    fn stencil_dampings(&self, stencils: Range<usize>, x: &[f64], _v: &[f64], out: &mut [f64]) {
        let x = x.as_chunks::<D>().0;
        let pairs = N * (N + 1) / 2;
        let lanes = self.patches.lanes_in(stencils).zip(out.chunks_exact_mut(pairs * D * D));
        for ((vertices, pack, lane), out) in lanes {
            let (inverse_rest, weight) = self.packs[pack].lane(lane);
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
            out.fill(0.0);
            self.viscosity.add_blocks(weight, &gradient, &f, out);
        }
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

fn dot<const R: usize>(a: &[f64; R], b: &[f64; R]) -> f64 {
    (0..R).map(|j| a[j] * b[j]).sum()
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
