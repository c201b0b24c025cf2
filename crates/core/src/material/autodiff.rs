//! Stress and Hessian by automatic differentiation of the energy density.

use super::{Material, Psd, Tangent};
use crate::algebra::{Dual, Mat};
use crate::scalar::Scalar;

/// Computes `P = d psi / dF` [Pa], exact to rounding, by running `psi` on dual numbers, once for each entry
/// of `F`.
///
/// Outside the domain of a barrier model the result is not finite.
#[inline(always)]
pub fn autodiff_stress<S: Scalar, const D: usize, M: Material<D> + ?Sized>(
    material: &M,
    f: &Mat<S, D>,
) -> Mat<S, D> {
    let mut p = Mat::zero();
    for k in 0..D {
        for l in 0..D {
            let mut direction = Mat::zero();
            direction[k][l] = S::one();
            p[k][l] = material.psi(&Dual::along(f, &direction)).derivative;
        }
    }
    p
}

/// Computes `dP/dF` [Pa], exact to rounding, by running the stress on dual numbers along each entry of
/// `F`. If the model gives only its energy density, the stress runs on duals of duals. [`Psd::Projected`]
/// sets negative eigenvalues to zero [numerically](Tangent::projected).
///
/// Outside the domain of a barrier model the result is not finite.
pub fn autodiff_hessian<const D: usize, M: Material<D> + ?Sized>(
    material: &M,
    f: &Mat<f64, D>,
    psd: Psd,
) -> Tangent<D> {
    let mut tangent = Tangent::zero();
    for k in 0..D {
        for l in 0..D {
            let mut direction = Mat::zero();
            direction[k][l] = 1.0;
            let (_, dp) = stress_along(material, f, &direction);
            for i in 0..D {
                for j in 0..D {
                    tangent.0[i][j][k][l] = dp[i][j];
                }
            }
        }
    }
    match psd {
        Psd::Exact => tangent,
        Psd::Projected => tangent.projected(),
    }
}

/// Computes `P` and `dP = dP/dF : dF` [Pa] for one `F`, in one compiled function for all callers.
#[inline(never)]
pub(crate) fn stress_along<const D: usize, M: Material<D> + ?Sized>(
    material: &M,
    f: &Mat<f64, D>,
    df: &Mat<f64, D>,
) -> (Mat<f64, D>, Mat<f64, D>) {
    Dual::parts(&material.pk1(&Dual::along(f, df)))
}
