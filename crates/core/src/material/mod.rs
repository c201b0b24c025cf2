//! Hyperelastic materials: energy densities `psi(F)`, their stresses and Hessians.
//!
//! Each model has a file of its own and one line in the registry at the end of this file.
//!
//! # How to add one
//! 1. Write a file in this folder: the type, its `Model` with `ABOUT`, and its energy density. `hencky.rs`
//!    gives the energy in the principal stretches (`Stretches`), `neo_hookean.rs` stress and `spectrum` in
//!    closed form. `Material::psi` alone suffices: dual numbers give the rest, more slowly.
//! 2. Add one line to `register_materials!` below. `pliant list materials`, the schema, the element loop and
//!    the tests in `tests/` know the model from it.
//! 3. Parameters of its own stand in its file (`mooney_rivlin.rs`): `check`, `lame`, `example`, and
//!    `has_axes` if elements may rotate its directions. `pliant-gradient` names their derivatives: a line in
//!    `isotropic_models!` (`names/materials.rs`), or a formula in `names/constants.rs`.
//! 4. Add the name to `names` in `tests/registry.rs`. A model with Lame constants needs values computed
//!    elsewhere: `tests-data/constitutive.json` and `responses.json`, which `tests/reference.rs` reads.
//! 5. Print `docs/scene-format.md` and `scenes/schema.json` anew, as `crates/scene/src/schema/mod.rs` says,
//!    and record its lines: `PLIANT_RECORD_ELEMENTS=1 cargo test --test pliant element_record`.
//! 6. Describe it in `docs/guide/theory/materials.md` and `docs/guide/contents.md`.

mod autodiff;
mod axes;
mod barrier;
mod constants;
mod parameters;
mod preset;
mod registry;
mod spectrum;
mod stress;
mod stretches;

pub use arap::WithoutPoisson;
pub(crate) use autodiff::stress_along;
pub use autodiff::{autodiff_hessian, autodiff_stress};
pub use axes::material_axes;
pub use expressed::{EnergyExpression, EnergyMistake};
pub use holzapfel_gasser_ogden::DispersedFibres;
pub use linear::PlaneIsotropic;
pub use mooney_rivlin::TwoConstants;
pub use ogden::OgdenTerms;
pub use parameters::{Isotropic, Lame, ParameterError, Parameters, Plane, Stiffness};
pub use preset::{AboutPreset, PRESETS, Preset};
pub use registry::{MaterialDescription, MaterialVisitor, Model};
pub use spectrum::{Derivatives, InvariantDerivatives, Spectrum};
pub use stress::Stress;
pub use stretches::Stretches;

use registry::register_materials;

use crate::algebra::{Mat, TURNS, Vect, project_positive, signed_svd};
use crate::scalar::Scalar;

/// Deformations for which a model is defined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Domain {
    /// Every `F`, inverted and collapsed ones included.
    Everywhere,
    /// Only `det F > 0`; outside, `psi = +inf`, and the stress is not finite.
    PositiveJ,
}

/// Form of a Hessian: exact, or with its negative eigenvalues set to zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Psd {
    /// The exact second derivative.
    Exact,
    /// The nearest positive semi-definite matrix, from the analytic eigensystem of isotropic models, else
    /// numerically.
    Projected,
}

/// The fourth-order tensor `dP_ij / dF_kl`, `t.0[i][j][k][l]` [Pa].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tangent<const D: usize>(pub [[Mat<f64, D>; D]; D]);

impl<const D: usize> Tangent<D> {
    /// Returns the zero tensor.
    pub fn zero() -> Self {
        Tangent([[Mat::zero(); D]; D])
    }

    /// Returns the identity, `C : dF = dF`.
    pub fn identity() -> Self {
        let mut t = Self::zero();
        for i in 0..D {
            for j in 0..D {
                t.0[i][j][i][j] = 1.0;
            }
        }
        t
    }

    /// Returns Hooke's law, `C : dF = lambda tr(dF) I + mu (dF + dF^T)` [Pa].
    pub(crate) fn isotropic(lambda: f64, mu: f64) -> Self {
        let mut t = Self::zero();
        for i in 0..D {
            for j in 0..D {
                t.0[i][i][j][j] += lambda;
                t.0[i][j][i][j] += mu;
                t.0[i][j][j][i] += mu;
            }
        }
        t
    }

    /// Returns `s C`.
    pub fn scale(mut self, s: f64) -> Self {
        for i in 0..D {
            for j in 0..D {
                self.0[i][j] = self.0[i][j].scale(s);
            }
        }
        self
    }

    /// Returns the tensor of the material rotated by `R`, from the material axes to those of space:
    /// `C' : G = R (C : R^T G R) R^T`.
    pub fn turned(&self, axes: &Mat<f64, D>) -> Self {
        let mut turned = Self::zero();
        turned.add_turned(self, [axes; 4]);
        turned
    }

    /// Returns the derivative of the [rotated tensor](Self::turned) along a change `turn` of `R`.
    pub fn turned_along(&self, axes: &Mat<f64, D>, turn: &Mat<f64, D>) -> Self {
        let mut change = Self::zero();
        for turning in 0..4 {
            change.add_turned(self, [0, 1, 2, 3].map(|i| if i == turning { turn } else { axes }));
        }
        change
    }

    /// Returns the derivative of `P(F R) R^T` by `F` for the rotation `R` from the material axes to those
    /// of space: `C' : G = (C : G R) R^T`.
    pub(crate) fn in_axes(&self, axes: &Mat<f64, D>) -> Self {
        let (mut turned, same) = (Self::zero(), &Mat::identity());
        turned.add_turned(self, [same, same, axes, axes]);
        turned
    }

    /// Adds the tensor that maps `G` to `a (T : b^T G c) d^T`, with the tensor `T` given by `of`.
    fn add_turned(&mut self, of: &Self, [a, b, c, d]: [&Mat<f64, D>; 4]) {
        for (k, l) in (0..D).flat_map(|k| (0..D).map(move |l| (k, l))) {
            let mut unit = Mat::zero();
            unit[k][l] = 1.0;
            let stress = of.apply(&b.transpose_mul(&unit).mul(c));
            let in_space = a.mul(&stress).mul_transpose(d);
            for (i, j) in (0..D).flat_map(|i| (0..D).map(move |j| (i, j))) {
                self.0[i][j][k][l] += in_space[i][j];
            }
        }
    }

    /// Returns `dP = C : dF`, that is `dP_ij = sum_kl C_ijkl dF_kl`.
    pub fn apply(&self, d: &Mat<f64, D>) -> Mat<f64, D> {
        let mut r = Mat::zero();
        for i in 0..D {
            for j in 0..D {
                r[i][j] = self.0[i][j].dot(d);
            }
        }
        r
    }

    /// Adds `factor d2J/dF2` at `F`, with `J = det F`: `e_ikm e_jln F_mn`, in 2D `e_ik e_jl`.
    pub(crate) fn add_second_of_determinant(&mut self, f: &Mat<f64, D>, factor: f64) {
        for (i, k, m, sign) in TURNS.into_iter().filter(|(i, k, ..)| *i < D && *k < D) {
            for (j, l, n, other) in TURNS.into_iter().filter(|(j, l, ..)| *j < D && *l < D) {
                let left = if D == 3 { f[m][n] } else { 1.0 };
                self.0[i][j][k][l] += factor * sign * other * left;
            }
        }
    }

    /// Adds `delta_ik S_jl`, the geometric stiffness of a stress `F S` with constant `S`.
    pub(crate) fn add_turning(&mut self, s: &Mat<f64, D>) {
        for i in 0..D {
            for j in 0..D {
                (0..D).for_each(|l| self.0[i][j][i][l] += s[j][l]);
            }
        }
    }

    /// Returns the nearest symmetric positive semi-definite tensor in the Frobenius norm, as a matrix
    /// that acts on the `D^2` entries of `dF`. Jacobi rotations give the eigenvalues, and negative ones
    /// are set to zero. A tensor that is not finite is returned unchanged.
    pub fn projected(&self) -> Self {
        let n = D * D;
        let mut matrix = vec![0.0; n * n];
        for (entry, matrix) in matrix.iter_mut().enumerate() {
            let (row, column) = (entry / n, entry % n);
            *matrix = 0.5 * (self.entry(row, column) + self.entry(column, row));
        }
        project_positive(&mut matrix, n);
        let mut t = Self::zero();
        for (entry, matrix) in matrix.into_iter().enumerate() {
            let (row, column) = (entry / n, entry % n);
            t.0[row / D][row % D][column / D][column % D] = matrix;
        }
        t
    }

    /// Returns `C_ijkl` with `row = i D + j`, `column = k D + l`.
    fn entry(&self, row: usize, column: usize) -> f64 {
        self.0[row / D][row % D][column / D][column % D]
    }
}

/// A hyperelastic energy density `psi(F)`.
///
/// Implement it generically over the scalar: it runs on `f64`, on SIMD lanes and on dual numbers. In two
/// dimensions the model is in plane strain (`F_33 = 1`), per unit thickness.
///
/// Only the energy density is required. Stress and Hessian follow by automatic differentiation, exact to
/// rounding, for explicit and implicit integrators; closed forms are faster. Mark functions that run on
/// lanes `#[inline(always)]`.
///
/// ```
/// use pliant::algebra::Mat;
/// use pliant::material::{Material, Psd};
/// use pliant::scalar::Scalar;
///
/// /// `psi = mu/2 (F : F - 3 - 2 ln J) + k/4 (|F a|^2 - 1)^2`: neo-Hookean with fibres along `a = e_1`.
/// struct Fibres {
///     mu: f64,
///     k: f64,
/// }
///
/// impl Material<3> for Fibres {
///     #[inline(always)]
///     fn psi<S: Scalar>(&self, f: &Mat<S, 3>) -> S {
///         let matrix = f.norm_squared() - S::splat(3.0) - S::splat(2.0) * f.determinant().ln();
///         let fibre = f[0][0] * f[0][0] + f[1][0] * f[1][0] + f[2][0] * f[2][0] - S::one();
///         S::splat(0.5 * self.mu) * matrix + S::splat(0.25 * self.k) * fibre * fibre
///     }
/// }
///
/// let material = Fibres { mu: 1.0, k: 10.0 };
/// let along = material.hessian(&Mat::identity(), Psd::Exact).0[0][0][0][0];
/// assert!((along - (2.0 * 1.0 + 2.0 * 10.0)).abs() < 1e-12);
/// ```
pub trait Material<const D: usize>: Send + Sync + 'static {
    /// Returns the energy density `psi(F)` [J/m^3]; in 2D [J/m^2] per metre of thickness.
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S;

    /// Returns the first Piola-Kirchhoff stress `P = d psi / dF` [Pa], by forward automatic
    /// differentiation of [`psi`](Self::psi) unless the model overrides it.
    #[inline(always)]
    fn pk1<S: Scalar>(&self, f: &Mat<S, D>) -> Mat<S, D> {
        autodiff_stress(self, f)
    }

    /// Returns the eigenvalues of `dP/dF` for an `F` with these signed singular values; `None` if the
    /// model does not provide them.
    fn spectrum(&self, sigma: &Vect<f64, D>) -> Option<Spectrum<D>> {
        let _ = sigma;
        None
    }

    /// Returns the second derivative `dP/dF` [Pa], from the [`spectrum`](Self::spectrum) if the model has
    /// one, else by [automatic differentiation](autodiff_hessian).
    fn hessian(&self, f: &Mat<f64, D>, psd: Psd) -> Tangent<D> {
        let svd = signed_svd(f);
        match self.spectrum(&svd.sigma) {
            Some(spectrum) => spectrum.tangent(&svd, psd),
            None => autodiff_hessian(self, f, psd),
        }
    }

    /// Returns the domain of the model.
    fn domain(&self) -> Domain {
        Domain::Everywhere
    }

    /// Returns the stretch `F_33` of a model in two dimensions; 1 in plane strain and in 3D.
    fn out_of_plane_stretch(&self, _: &Mat<f64, D>) -> f64 {
        1.0
    }
}

// One line per model: its name in a scene, its file, its type, the type of its parameters. `rustfmt` does
// not find modules behind a macro: format new files with `rustfmt --edition 2024 FILE`.
register_materials! {
    "linear" => linear::Linear(PlaneIsotropic);
    "stvk" => stvk::Stvk(Isotropic);
    "corotated" => corotated::Corotated(Isotropic);
    "fixed-corotated" => fixed_corotated::FixedCorotated(Isotropic);
    "arap" => arap::Arap(WithoutPoisson);
    "neo-hookean" => neo_hookean::NeoHookean(Isotropic);
    "stable-neo-hookean" => stable_neo_hookean::StableNeoHookean(Isotropic);
    "stable-neo-hookean-log" => stable_neo_hookean_log::StableNeoHookeanLog(Isotropic);
    "neo-hookean-j" => neo_hookean_j::NeoHookeanJ(Isotropic);
    "isochoric-neo-hookean" => isochoric_neo_hookean::IsochoricNeoHookean(Isotropic);
    "mooney-rivlin" => mooney_rivlin::MooneyRivlin(TwoConstants);
    "ogden" => ogden::Ogden(OgdenTerms);
    "holzapfel-gasser-ogden" => holzapfel_gasser_ogden::HolzapfelGasserOgden(DispersedFibres);
    "hencky" => hencky::Hencky(Isotropic);
    "displacement-gradient" => displacement_gradient::DisplacementGradient(Stiffness);
    "dirichlet" => dirichlet::Dirichlet(Stiffness);
    "expression" => expressed::ExpressedEnergy(EnergyExpression);
}

#[cfg(test)]
pub(crate) mod tests;
