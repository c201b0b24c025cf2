//! Viscosity of elements: damping by the strain rate.

mod cells;
mod points;

use std::ops::Range;

pub use cells::ViscousCells;
pub use points::ViscousPoints;

use super::{DissipationViews, DissipativeTerm, PositionProducts};
use crate::energy::Stencils;
use crate::energy::patch::{Patch, Patches, Scratch, Workspace};

/// Viscosities of a solid [Pa s], or of a sheet, multiplied by its thickness [Pa s m].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Viscosity {
    /// Shear viscosity `eta`, of a change of shape.
    pub shear: f64,
    /// Second viscosity `zeta`, of a change of volume, in addition to the contribution of `shear`.
    pub second: f64,
}

impl Viscosity {
    /// Returns the sum of both.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Viscosity { shear: self.shear + other.shear, second: self.second + other.second }
    }

    /// Adds the blocks of the damping matrix of one point, for each pair `a <= b` of vertices. `gradient`
    /// are the reference gradients of the shape functions, `f` is the deformation gradient.
    ///
    /// With `dEdot = sym(F^T dFdot)` and `dFdot = e_k grad N_b^T` the stress
    /// `F (2 eta dEdot + zeta tr dEdot)`
    /// contracted with `grad N_a` is `eta (F F^T)_ik grad N_a . grad N_b + eta (F grad N_b)_i (F grad N_a)_k
    /// + zeta (F grad N_a)_i (F grad N_b)_k`.
    fn add_blocks<const D: usize, const R: usize, const N: usize>(
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

/// Kelvin-Voigt damping of every element: `R = sum_e w_e (eta Edot : Edot + 1/2 zeta tr(Edot)^2)` with
/// the rate of Green's strain `Edot = sym(F^T Fdot)`.
///
/// The viscous second Piola-Kirchhoff stress `S = 2 eta Edot + zeta tr(Edot) I` adds to the elastic one,
/// `P = F S`. Rigid motion has `Edot = 0` at any rotation and speed, and `S` is symmetric: momentum and
/// angular momentum are conserved. In the reference configuration, `eta = beta mu` and
/// `zeta = beta lambda` give Rayleigh damping `C = beta K`, with the stiffness `K` of linear elasticity.
/// A mode of angular frequency `omega` then has the damping ratio `beta omega / 2`.
///
/// The elements `E` have `N` vertices in `D` dimensions. [`points`](Self::points) and
/// [`cells`](Self::cells) integrate `R` by different rules.
pub struct StrainRate<const D: usize, const N: usize, E> {
    body: String,
    viscosity: Viscosity,
    elements: E,
    workspace: Workspace<D>,
}

/// Elements with a reference configuration, over which the dissipation function is integrated.
pub trait ViscousElements<const D: usize, const N: usize>: Send + Sync {
    /// Returns the patches of the elements.
    fn patches(&self) -> &Patches<N>;

    /// Adds the viscous forces of a patch to the gradient of `scratch`, at its positions and its
    /// velocities (the direction). Returns their power [W].
    fn add_forces(&self, viscosity: Viscosity, patch: &Patch, scratch: &mut Scratch<D>) -> f64;

    /// Adds the blocks of the damping matrix [N s/m] of the element in a lane of a pack, `(pack, lane)`, for
    /// each pair `a <= b` of its `vertices`.
    fn add_blocks(
        &self,
        viscosity: Viscosity,
        x: &[f64],
        vertices: &[u32; N],
        lane: (usize, usize),
        out: &mut [f64],
    );
}

impl<const D: usize, const N: usize, E: ViscousElements<D, N>> StrainRate<D, N, E> {
    fn of_elements(body: &str, viscosity: Viscosity, elements: E) -> Self {
        let workspace = Workspace::new(elements.patches());
        StrainRate { body: body.into(), viscosity, elements, workspace }
    }

    /// Adds half the difference of the forces at the configurations `x + u` and `x - u` with the
    /// velocities `v`: the part that is linear in `u`.
    fn add_half_of_difference(&mut self, x: &[f64], u: &[f64], v: &[f64], y: &mut [f64]) {
        let largest = |rows: &[f64]| rows.iter().fold(0.0, |largest: f64, row| largest.max(row.abs()));
        let (size, along) = (largest(x), largest(u));
        if size == 0.0 || along == 0.0 {
            return;
        }
        // Scales `u` to the size of `x`, so that rounding loses neither.
        let scale = size / along;
        let mut force = vec![0.0; x.len()];
        for sign in [1.0, -1.0] {
            let at: Vec<f64> = x.iter().zip(u).map(|(x, u)| x + sign * scale * u).collect();
            self.evaluate(&at, v);
            force.fill(0.0);
            self.add_rows(0, &mut force);
            y.iter_mut().zip(&force).for_each(|(y, force)| *y += 0.5 * sign / scale * force);
        }
    }
}

impl<const D: usize, const N: usize, E: ViscousElements<D, N>> DissipativeTerm for StrainRate<D, N, E> {
    fn name(&self) -> String {
        format!("strain-rate damping of `{}`", self.body)
    }

    fn evaluate(&mut self, x: &[f64], v: &[f64]) -> bool {
        let StrainRate { elements, viscosity, workspace, .. } = self;
        elements.patches().evaluate(workspace, x, Some(v), |patch, scratch| {
            elements.add_forces(*viscosity, patch, scratch);
        })
    }

    fn add_rows(&self, first: usize, g: &mut [f64]) {
        self.elements.patches().add_rows(&self.workspace, first, g);
    }

    fn add_damping_product(&mut self, x: &[f64], _v: &[f64], p: &[f64], y: &mut [f64]) {
        self.evaluate(x, p);
        self.add_rows(0, y);
    }

    fn stencils(&mut self) -> Stencils {
        self.elements.patches().lanes()
    }

    fn stencil_dampings(&self, stencils: Range<usize>, x: &[f64], _v: &[f64], out: &mut [f64]) {
        let pairs = N * (N + 1) / 2;
        let lanes = self.elements.patches().lanes_in(stencils).zip(out.chunks_exact_mut(pairs * D * D));
        for ((vertices, pack, lane), out) in lanes {
            out.fill(0.0);
            self.elements.add_blocks(self.viscosity, x, &vertices, (pack, lane), out);
        }
    }

    fn power(&mut self, x: &[f64], v: &[f64]) -> f64 {
        let StrainRate { elements, viscosity, workspace, .. } = self;
        elements
            .patches()
            .sum_along(workspace, x, v, |patch, scratch| elements.add_forces(*viscosity, patch, scratch))
    }
}

impl<const D: usize, const N: usize, E: ViscousElements<D, N>> DissipationViews for StrainRate<D, N, E> {}

impl<const D: usize, const N: usize, E: ViscousElements<D, N>> PositionProducts for StrainRate<D, N, E> {
    /// `Edot(x, v) = sym(F(x)^T F(v))` is bilinear and symmetric, so `p . dR/dv` is a symmetric form of
    /// `Edot(x, v)` and `Edot(x, p)`. Its derivative with respect to `x` is the part, linear in `p`, of
    /// the force at the configuration `v + p` and the velocities `x`. The force is quadratic in the
    /// configuration, so this part is exactly half the difference of the forces at `v + p` and `v - p`.
    fn add_position_product(&mut self, x: &[f64], v: &[f64], p: &[f64], y: &mut [f64]) -> bool {
        self.add_half_of_difference(v, p, x, y);
        true
    }

    /// Adds half the difference of the forces at the configurations `x + u` and `x - u`, which is exact,
    /// too.
    fn add_position_change(&mut self, x: &[f64], v: &[f64], u: &[f64], y: &mut [f64]) -> bool {
        self.add_half_of_difference(x, u, v, y);
        true
    }
}

fn dot<const R: usize>(a: &[f64; R], b: &[f64; R]) -> f64 {
    (0..R).map(|j| a[j] * b[j]).sum()
}
