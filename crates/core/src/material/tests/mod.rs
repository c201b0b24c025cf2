//! Conformance tests over the registry: every registered model is tested.

mod conformance;
mod degenerate;
mod energy_alone;
mod fibres;
mod invariance;
pub(crate) mod lanes;
mod reference;
mod registry;
mod rubber;
mod stiffness;
mod stretches;

use super::{Material, MaterialSpec, MaterialVisitor, Psd, Tangent, WithoutPoisson, autodiff_stress};
use crate::algebra::tests::sample::{Random, categories};
use crate::algebra::{Dual, Mat, signed_svd};
use crate::scalar::Scalar;

/// Dynamic dispatch over materials, with derivatives also by automatic differentiation.
trait Probe<const D: usize> {
    fn psi(&self, f: &Mat<f64, D>) -> f64;
    fn pk1(&self, f: &Mat<f64, D>) -> Mat<f64, D>;
    fn hessian(&self, f: &Mat<f64, D>, psd: Psd) -> Tangent<D>;
    fn domain(&self) -> super::Domain;
    /// `d psi / dF`.
    fn derived_pk1(&self, f: &Mat<f64, D>) -> Mat<f64, D>;
    /// `dP / dF` of the closed-form stress.
    fn derived_hessian(&self, f: &Mat<f64, D>) -> Tangent<D>;
    /// `d^2 psi / dF^2`.
    fn second_derivative(&self, f: &Mat<f64, D>) -> Tangent<D>;
}

impl<const D: usize, M: Material<D>> Probe<D> for M {
    fn psi(&self, f: &Mat<f64, D>) -> f64 {
        Material::psi(self, f)
    }
    fn pk1(&self, f: &Mat<f64, D>) -> Mat<f64, D> {
        Material::pk1(self, f)
    }
    fn hessian(&self, f: &Mat<f64, D>, psd: Psd) -> Tangent<D> {
        Material::hessian(self, f, psd)
    }
    fn domain(&self) -> super::Domain {
        Material::domain(self)
    }
    fn derived_pk1(&self, f: &Mat<f64, D>) -> Mat<f64, D> {
        autodiff_stress(self, f)
    }
    fn derived_hessian(&self, f: &Mat<f64, D>) -> Tangent<D> {
        by_direction(|direction| Dual::parts(&Material::pk1(self, &Dual::along(f, direction))).1)
    }
    fn second_derivative(&self, f: &Mat<f64, D>) -> Tangent<D> {
        by_direction(|direction| Dual::parts(&autodiff_stress(self, &Dual::along(f, direction))).1)
    }
}

/// Returns the tangent whose columns are the derivatives of the stress along the unit matrices.
fn by_direction<const D: usize>(derivative: impl Fn(&Mat<f64, D>) -> Mat<f64, D>) -> Tangent<D> {
    let mut tangent = Tangent::zero();
    for k in 0..D {
        for l in 0..D {
            let mut direction = Mat::zero();
            direction[k][l] = 1.0;
            let dp = derivative(&direction);
            for i in 0..D {
                for j in 0..D {
                    tangent.0[i][j][k][l] = dp[i][j];
                }
            }
        }
    }
    tangent
}

/// A model that gives its energy density only.
#[derive(Clone)]
pub(crate) struct EnergyAlone<M>(pub(crate) M);

impl<const D: usize, M: Material<D>> Material<D> for EnergyAlone<M> {
    #[inline(always)]
    fn psi<S: Scalar>(&self, f: &Mat<S, D>) -> S {
        self.0.psi(f)
    }
    fn domain(&self) -> super::Domain {
        self.0.domain()
    }
}

struct Boxed;

impl<const D: usize> MaterialVisitor<D> for Boxed {
    type Output = Box<dyn Probe<D>>;
    fn visit<M: Material<D> + Material<3> + Clone>(self, material: M) -> Self::Output {
        Box::new(material)
    }
}

fn probe<const D: usize>(spec: &MaterialSpec) -> Box<dyn Probe<D>> {
    spec.visit(Boxed)
}

/// Every registered model.
fn models<const D: usize>() -> Vec<(MaterialSpec, Box<dyn Probe<D>>)> {
    MaterialSpec::examples()
        .into_iter()
        .map(|spec| {
            let model = probe(&spec);
            (spec, model)
        })
        .collect()
}

/// Returns a model by its name in a scene, with E = 1e6 and nu = 0.3, or at least their shear modulus.
fn named<const D: usize>(name: &str) -> Box<dyn Probe<D>> {
    if name == "arap" {
        return probe(&MaterialSpec::Arap(WithoutPoisson { young: 2.0 * MU, poisson: 0.0 }));
    }
    models().into_iter().find(|(spec, _)| spec.name() == name).expect("a registered model").1
}

/// The Lame parameters of E = 1e6 and nu = 0.3.
const LAMBDA: f64 = 576_923.076_923_076_9;
const MU: f64 = 384_615.384_615_384_6;

/// Returns `(sigma_{D-1} + sigma_D) / |F|`, the relative distance of `F` from the jump of its rotation.
fn gap<const D: usize>(f: &Mat<f64, D>) -> f64 {
    let sigma = signed_svd(f).sigma;
    (sigma[D - 2] + sigma[D - 1]) / f.norm_squared().sqrt()
}

/// Returns the scale of errors in the stress: its own size plus that of its terms.
fn stress_scale<const D: usize>(model: &dyn Probe<D>, f: &Mat<f64, D>) -> f64 {
    model.pk1(f).norm_squared().sqrt() + (LAMBDA + 2.0 * MU) * f.norm_squared().sqrt()
}

/// Returns deformations of every kind away from the jump of the rotation, those with `J <= 0` only if
/// `inverted`.
pub(crate) fn samples<const D: usize>(inverted: bool) -> Vec<Mat<f64, D>> {
    let mut random = Random(21);
    let mut list = vec![];
    for (name, generate) in categories::<D>() {
        if ["rank one", "ambiguous", "scaled gaussian", "independent"].contains(&name) {
            continue;
        }
        for _ in 0..60 {
            let f = generate(&mut random);
            if gap(&f) > 0.2 && (inverted || f.determinant() > 0.02) {
                list.push(f);
            }
        }
    }
    list
}

/// Returns the tensor as a matrix that acts on column-major `vec(F)`.
fn flat<const D: usize>(t: &Tangent<D>) -> nalgebra::DMatrix<f64> {
    nalgebra::DMatrix::from_fn(D * D, D * D, |p, q| t.0[p % D][p / D][q % D][q / D])
}

/// Returns the eigenvalues, ascending.
fn eigenvalues<const D: usize>(t: &Tangent<D>) -> Vec<f64> {
    let mut lambda: Vec<f64> = flat(t).symmetric_eigenvalues().iter().copied().collect();
    lambda.sort_by(f64::total_cmp);
    lambda
}

/// Returns `|a - b| / |a|` in the Frobenius norm.
pub(crate) fn difference<const D: usize>(a: &Tangent<D>, b: &Tangent<D>) -> f64 {
    (flat(a) - flat(b)).norm() / flat(a).norm()
}
