//! Isotropic functions of a matrix: functions of its signed singular values.

use super::{Dual, Mat, SMALLEST_SUM, Svd, Vect, signed_svd};
use crate::scalar::Scalar;

/// A function `psi(sigma)` of the signed singular values `sigma_0 >= ... >= |sigma_(D-1)|` of a matrix, see
/// [`signed_svd`].
///
/// To be a function of the matrix it must not change when two values are exchanged, nor when two change sign
/// together. Written in the stretches alone; value, gradient and second derivative as a function of the
/// matrix follow, on `f64`, on packs of lanes and on dual numbers.
pub trait IsotropicFunction<const D: usize> {
    /// `psi(sigma)`.
    fn in_stretches<S: Scalar>(&self, sigma: &Vect<S, D>) -> S;

    /// `psi_i = d psi / d sigma_i`; by automatic differentiation unless given in closed form.
    #[inline(always)]
    fn slopes<S: Scalar>(&self, sigma: &Vect<S, D>) -> Vect<S, D> {
        let mut slopes = [S::zero(); D];
        for i in 0..D {
            slopes[i] = self.in_stretches(&along_axis(sigma, i)).derivative;
        }
        slopes
    }

    /// `psi_ij = d^2 psi / d sigma_i d sigma_j`, symmetric; by automatic differentiation of the slopes.
    #[inline(always)]
    fn curvatures<S: Scalar>(&self, sigma: &Vect<S, D>) -> Mat<S, D> {
        let mut curvatures = Mat::zero();
        for j in 0..D {
            let column = self.slopes(&along_axis(sigma, j));
            for i in 0..D {
                curvatures[i][j] = column[i].derivative;
            }
        }
        curvatures
    }
}

/// `sigma + t e_axis` at `t = 0`.
#[inline(always)]
fn along_axis<S: Scalar, const D: usize>(sigma: &Vect<S, D>, axis: usize) -> Vect<Dual<S>, D> {
    let mut r = [Dual::constant(S::zero()); D];
    for i in 0..D {
        r[i] = Dual { value: sigma[i], derivative: if i == axis { S::one() } else { S::zero() } };
    }
    r
}

/// `psi(sigma(F))`. [`Scalar::isotropic_value`] is the same function with derivatives.
#[inline(always)]
pub fn isotropic_value<S: Scalar, const D: usize, I: IsotropicFunction<D>>(function: &I, f: &Mat<S, D>) -> S {
    function.in_stretches(&signed_svd(f).sigma)
}

/// `d psi / dF = U diag(psi_i) V^T`. [`Scalar::isotropic_gradient`] is the same function with derivatives.
#[inline(always)]
pub fn isotropic_gradient<S: Scalar, const D: usize, I: IsotropicFunction<D>>(
    function: &I,
    f: &Mat<S, D>,
) -> Mat<S, D> {
    let svd = signed_svd(f);
    compose(&svd, &function.slopes(&svd.sigma))
}

/// The decomposition of `F`, and the slopes and curvatures of `psi` there: what a tangent is made of.
pub fn isotropic_hessian<const D: usize, I: IsotropicFunction<D>>(
    function: &I,
    f: &Mat<f64, D>,
) -> (Svd<f64, D>, Vect<f64, D>, Mat<f64, D>) {
    let svd = signed_svd(f);
    (svd, function.slopes(&svd.sigma), function.curvatures(&svd.sigma))
}

/// `U diag(d) V^T`.
#[inline(always)]
fn compose<S: Scalar, const D: usize>(svd: &Svd<S, D>, d: &Vect<S, D>) -> Mat<S, D> {
    let mut scaled = svd.u;
    for i in 0..D {
        for k in 0..D {
            scaled[i][k] = svd.u[i][k] * d[k];
        }
    }
    scaled.mul_transpose(&svd.v)
}

/// `d psi / dF` and its derivative in the direction `dF`.
///
/// With `A = U^T dF V` the derivative is `U B V^T`, `B_ii = sum_j psi_ij A_jj`, and for `i != j`, with the
/// quotients `t = (psi_i + psi_j) / (sigma_i + sigma_j)` and `f = (psi_i - psi_j) / (sigma_i - sigma_j)`,
/// `B_ij = (f + t)/2 A_ij + (f - t)/2 A_ji`. Where two stretches nearly coincide `f` is its limit, `psi_ii -
/// psi_ij` averaged over the two; where their sum vanishes `t` is kept finite, as for the rotation. From the
/// eigensystem of Smith, de Goes and Kim, "Analytic eigensystems for isotropic distortion energies", 2019.
#[inline(always)]
pub(super) fn isotropic_gradient_along<S: Scalar, const D: usize, I: IsotropicFunction<D>>(
    function: &I,
    f: &Mat<S, D>,
    df: &Mat<S, D>,
) -> (Mat<S, D>, Mat<S, D>) {
    let half = S::splat(0.5);
    let svd = signed_svd(f);
    let sigma = &svd.sigma;
    let slopes = function.slopes(sigma);
    let curvatures = function.curvatures(sigma);
    let a = svd.u.transpose_mul(&df.mul(&svd.v));
    let mut b = Mat::zero();
    for i in 0..D {
        for j in 0..D {
            b[i][i] = curvatures[i][j].mul_add(a[j][j], b[i][i]);
        }
        for j in i + 1..D {
            let sum = sigma[i] + sigma[j];
            let smallest = S::splat(SMALLEST_SUM);
            let twist = (slopes[i] + slopes[j]) / S::select(sum.lt(smallest), smallest, sum);
            let difference = sigma[i] - sigma[j];
            let near = difference.abs().lt(S::splat(1e-5) * (sigma[i].abs() + sigma[j].abs()));
            let limit = half.mul_add(curvatures[i][i] + curvatures[j][j], -curvatures[i][j]);
            // The unused quotient must not divide by zero: its derivative would spoil the selection.
            let apart = S::select(near, S::one(), difference);
            let flip = S::select(near, limit, (slopes[i] - slopes[j]) / apart);
            let (same, swapped) = (half * (flip + twist), half * (flip - twist));
            b[i][j] = same.mul_add(a[i][j], swapped * a[j][i]);
            b[j][i] = same.mul_add(a[j][i], swapped * a[i][j]);
        }
    }
    (compose(&svd, &slopes), svd.u.mul(&b).mul_transpose(&svd.v))
}
