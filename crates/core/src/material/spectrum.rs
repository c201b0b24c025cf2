//! Eigensystem of `dP/dF`, which all isotropic models share.
//!
//! If `psi` depends on `F = U diag(sigma) V^T` only through the signed singular values, `dP/dF` leaves three
//! kinds of subspaces invariant, each rotated by `U` and `V`: the diagonal matrices ("scaling"), and for each
//! pair of axes the antisymmetric ("twist") and the symmetric ("flip") off-diagonal matrix. Sources: Smith,
//! de Goes and Kim, "Analytic eigensystems for isotropic distortion energies", 2019; Kim and Eberle, "Dynamic
//! deformables", SIGGRAPH course, 2022.

use super::{Psd, Tangent};
use crate::algebra::{Mat, SMALLEST_SUM, Svd, Vect, symmetric_eigen};

/// Eigenvalues of `dP/dF` [Pa]; the scaling block is not yet diagonalised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spectrum<const D: usize> {
    /// `d^2 psi / d sigma_i d sigma_j`, symmetric.
    pub scaling: Mat<f64, D>,
    /// `twist[i][j] = (psi_i + psi_j) / (sigma_i + sigma_j)` for `i < j`, of `U (e_i e_j^T - e_j e_i^T) V^T`.
    pub twist: Mat<f64, D>,
    /// `flip[i][j] = (psi_i - psi_j) / (sigma_i - sigma_j)` for `i < j`, of `U (e_i e_j^T + e_j e_i^T) V^T`.
    pub flip: Mat<f64, D>,
}

/// First and second derivative of a function of one number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Derivatives {
    /// First derivative.
    pub first: f64,
    /// Second derivative.
    pub second: f64,
}

/// Derivatives of `psi(I1, I2, J)`, which is linear in `I1` and `I2`: first derivatives by the name of the
/// invariant, second by the names of both.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InvariantDerivatives {
    /// `d psi / d I1`
    pub i1: f64,
    /// `d psi / d I2`
    pub i2: f64,
    /// `d psi / d J`
    pub j: f64,
    /// `d^2 psi / d I1 dJ`
    pub i1_j: f64,
    /// `d^2 psi / d I2 dJ`
    pub i2_j: f64,
    /// `d^2 psi / dJ^2`
    pub j_j: f64,
}

/// Returns the contribution of `F_33 = 1` to `F : F` in plane strain.
pub(super) const fn out_of_plane<const D: usize>() -> f64 {
    if D == 2 { 1.0 } else { 0.0 }
}

impl<const D: usize> Spectrum<D> {
    /// Returns the spectrum of `psi = a(I_C) + b(J)`, with `I_C = F : F` and `J = det F`. No division is
    /// needed, so the result is valid for every `sigma`.
    pub fn from_invariants(sigma: &Vect<f64, D>, a: Derivatives, b: Derivatives) -> Self {
        let zero = Mat::zero();
        let mut s = Spectrum { scaling: zero, twist: zero, flip: zero };
        // dJ / d sigma_i
        let cofactor = Mat::diagonal(sigma).cofactor();
        for i in 0..D {
            s.scaling[i][i] = 2.0 * a.first
                + 4.0 * a.second * sigma[i] * sigma[i]
                + b.second * cofactor[i][i] * cofactor[i][i];
            for j in i + 1..D {
                let third = if D == 2 { 1.0 } else { sigma[3 - i - j] };
                s.scaling[i][j] = 4.0 * a.second * sigma[i] * sigma[j]
                    + b.second * cofactor[i][i] * cofactor[j][j]
                    + b.first * third;
                s.scaling[j][i] = s.scaling[i][j];
                s.twist[i][j] = 2.0 * a.first + b.first * third;
                s.flip[i][j] = 2.0 * a.first - b.first * third;
            }
        }
        s
    }

    /// Returns the spectrum of `psi(I1, I2, J)`, linear in the invariants `I1 = tr C` and
    /// `I2 = (I1^2 - tr C^2)/2` of `C = F^T F` (in 2D with `F_33 = 1`), with `J = det F`. No division is
    /// needed, so the result is valid for every `sigma`.
    pub fn from_three_invariants(sigma: &Vect<f64, D>, psi: &InvariantDerivatives) -> Self {
        let first = Derivatives { first: psi.i1, second: 0.0 };
        let mut s = Self::from_invariants(sigma, first, Derivatives { first: psi.j, second: psi.j_j });
        let i1 = sigma.iter().map(|s| s * s).sum::<f64>() + out_of_plane::<D>();
        let cofactor = Mat::diagonal(sigma).cofactor();
        // d I1 / d sigma_i, d I2 / d sigma_i, dJ / d sigma_i
        let slopes = |i: usize| (2.0 * sigma[i], 2.0 * sigma[i] * (i1 - sigma[i] * sigma[i]), cofactor[i][i]);
        for i in 0..D {
            let (i1_i, i2_i, j_i) = slopes(i);
            s.scaling[i][i] += 2.0 * psi.i2 * (i1 - sigma[i] * sigma[i]);
            for k in 0..D {
                let (i1_k, i2_k, j_k) = slopes(k);
                s.scaling[i][k] +=
                    psi.i1_j * (i1_i * j_k + j_i * i1_k) + psi.i2_j * (i2_i * j_k + j_i * i2_k);
                if k != i {
                    s.scaling[i][k] += 4.0 * psi.i2 * sigma[i] * sigma[k];
                }
            }
            for k in i + 1..D {
                let third = if D == 2 { 1.0 } else { sigma[3 - i - k] };
                s.twist[i][k] += 2.0 * psi.i2 * (third * third + sigma[i] * sigma[k]);
                s.flip[i][k] += 2.0 * psi.i2 * (third * third - sigma[i] * sigma[k]);
            }
        }
        s
    }

    /// Returns the spectrum of `psi + weight (sigma_1 + ... + sigma_D)`; the sum is `tr S` of `F = R S`
    /// with a rotation `R`.
    #[must_use]
    pub fn plus_trace(mut self, sigma: &Vect<f64, D>, weight: f64) -> Self {
        for i in 0..D {
            for j in i + 1..D {
                self.twist[i][j] += 2.0 * weight / sum_of_stretches(sigma, i, j);
            }
        }
        self
    }

    /// Returns the spectrum of any isotropic `psi` from its `gradient[i] = psi_i` and
    /// `hessian[i][j] = psi_ij` in the stretches.
    ///
    /// The quotients lose digits if two stretches nearly coincide; then they are replaced by their limit
    /// `psi_ii - psi_ij`, averaged over the two. About ten digits survive in the worst case.
    pub fn from_stretches(sigma: &Vect<f64, D>, gradient: &Vect<f64, D>, hessian: &Mat<f64, D>) -> Self {
        let mut s = Spectrum { scaling: *hessian, twist: Mat::zero(), flip: Mat::zero() };
        for i in 0..D {
            for j in i + 1..D {
                s.twist[i][j] = (gradient[i] + gradient[j]) / sum_of_stretches(sigma, i, j);
                let difference = sigma[i] - sigma[j];
                let scale = sigma[i].abs() + sigma[j].abs();
                s.flip[i][j] = if difference.abs() > 1e-5 * scale {
                    (gradient[i] - gradient[j]) / difference
                } else {
                    0.5 * (hessian[i][i] + hessian[j][j]) - hessian[i][j]
                };
            }
        }
        s
    }

    /// Assembles `dP/dF`, with the decomposition `svd` of `F`. [`Psd::Projected`] first sets every
    /// negative eigenvalue to zero, which gives the nearest positive semi-definite tensor.
    pub fn tangent(&self, svd: &Svd<f64, D>, psd: Psd) -> Tangent<D> {
        let projected = psd == Psd::Projected;
        let clamp = |eigenvalue: f64| if projected && eigenvalue < 0.0 { 0.0 } else { eigenvalue };
        let scaling = if projected { nearest_psd(&self.scaling) } else { self.scaling };

        // `image[i][j]` is the tensor applied to `basis[i][j] = u_i v_j^T`.
        let (u, v) = (svd.u.transpose(), svd.v.transpose());
        let mut basis = [[Mat::zero(); D]; D];
        for i in 0..D {
            for j in 0..D {
                for k in 0..D {
                    for l in 0..D {
                        basis[i][j][k][l] = u[i][k] * v[j][l];
                    }
                }
            }
        }
        let mut image = [[Mat::zero(); D]; D];
        for i in 0..D {
            for k in 0..D {
                image[i][i] = basis[k][k].scale_add(scaling[i][k], &image[i][i]);
            }
            for j in i + 1..D {
                let (twist, flip) = (clamp(self.twist[i][j]), clamp(self.flip[i][j]));
                let (same, swapped) = (0.5 * (flip + twist), 0.5 * (flip - twist));
                image[i][j] = basis[i][j].scale(same) + basis[j][i].scale(swapped);
                image[j][i] = basis[j][i].scale(same) + basis[i][j].scale(swapped);
            }
        }
        let mut t = Tangent::zero();
        for i in 0..D {
            for j in 0..D {
                for k in 0..D {
                    for l in 0..D {
                        t.0[k][l] = image[i][j].scale_add(basis[i][j][k][l], &t.0[k][l]);
                    }
                }
            }
        }
        t
    }
}

/// Returns `sigma_i + sigma_j`, bounded away from zero. Where the sum vanishes the rotation of `F` jumps,
/// and a model built on that rotation has no second derivative.
pub(super) fn sum_of_stretches<const D: usize>(sigma: &Vect<f64, D>, i: usize, j: usize) -> f64 {
    let sum = sigma[i] + sigma[j];
    if sum < SMALLEST_SUM { SMALLEST_SUM } else { sum }
}

/// Returns the nearest positive semi-definite matrix in the Frobenius norm.
fn nearest_psd<const D: usize>(a: &Mat<f64, D>) -> Mat<f64, D> {
    let (lambda, v) = symmetric_eigen(a);
    if lambda.iter().all(|&x| x >= 0.0) {
        return *a;
    }
    // NaN stays NaN: a maximum would turn it into a plausible zero.
    let clamped = lambda.map(|x| if x < 0.0 { 0.0 } else { x });
    v.transpose_mul(&Mat::diagonal(&clamped)).mul(&v)
}
