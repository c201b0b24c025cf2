//! Forward automatic differentiation in one direction.

use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use super::isotropic::isotropic_gradient_along;
use super::{IsotropicFunction, Mat, Vect};
use crate::scalar::{Compared, Elementary, Scalar};

/// Sums of two singular values below this are raised to it, in derivatives of the rotation only: where
/// `sigma_i + sigma_j = 0` the rotation jumps and has no derivative.
pub(crate) const SMALLEST_SUM: f64 = 1e-10;

/// A number and its derivative in one direction.
///
/// It is a [`Scalar`] itself, so any kernel runs on it, and it nests: `Dual<Dual<f64>>` carries a second
/// derivative. Comparisons look at the value only. One direction at a time, and not all entries of a matrix
/// at once, keeps a dual pack of lanes in two registers.
///
/// ```
/// use pliant::algebra::{Dual, Mat};
///
/// let f = Mat([[1.0, 2.0], [3.0, 4.0]]);
/// let direction = Mat([[0.0, 1.0], [0.0, 0.0]]);
/// let det = Dual::along(&f, &direction).determinant();
/// assert_eq!((det.value, det.derivative), (-2.0, f.cofactor()[0][1]));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<S> {
    /// The number.
    pub value: S,
    /// Derivative along the direction.
    pub derivative: S,
}

impl<S: Scalar> Dual<S> {
    /// `f + t d` at `t = 0`, `t` being what derivatives are taken with respect to.
    #[inline(always)]
    pub fn along<const D: usize>(f: &Mat<S, D>, d: &Mat<S, D>) -> Mat<Self, D> {
        let mut r = Mat([[Self::constant(S::zero()); D]; D]);
        for i in 0..D {
            for j in 0..D {
                r[i][j] = Dual { value: f[i][j], derivative: d[i][j] };
            }
        }
        r
    }

    /// A number that does not depend on the variable.
    #[inline(always)]
    pub fn constant(value: S) -> Self {
        Dual { value, derivative: S::zero() }
    }

    /// Value and derivative of a matrix: the inverse of [`along`](Self::along).
    #[inline(always)]
    pub fn parts<const D: usize>(m: &Mat<Self, D>) -> (Mat<S, D>, Mat<S, D>) {
        let (mut value, mut derivative) = (Mat::zero(), Mat::zero());
        for i in 0..D {
            for j in 0..D {
                (value[i][j], derivative[i][j]) = (m[i][j].value, m[i][j].derivative);
            }
        }
        (value, derivative)
    }

    /// `value` with the derivative `slope` times that of `self`.
    #[inline(always)]
    fn chain(self, value: S, slope: S) -> Self {
        Dual { value, derivative: self.derivative * slope }
    }
}

impl<S: Scalar> Add for Dual<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Dual { value: self.value + o.value, derivative: self.derivative + o.derivative }
    }
}

impl<S: Scalar> Sub for Dual<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Dual { value: self.value - o.value, derivative: self.derivative - o.derivative }
    }
}

impl<S: Scalar> Mul for Dual<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        let derivative = self.derivative.mul_add(o.value, o.derivative * self.value);
        Dual { value: self.value * o.value, derivative }
    }
}

impl<S: Scalar> Div for Dual<S> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        let value = self.value / o.value;
        Dual { value, derivative: o.derivative.mul_add(-value, self.derivative) / o.value }
    }
}

impl<S: Scalar> Neg for Dual<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Dual { value: -self.value, derivative: -self.derivative }
    }
}

impl<S: Scalar> AddAssign for Dual<S> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl<S: Scalar> SubAssign for Dual<S> {
    #[inline(always)]
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

impl<S: Scalar> MulAssign for Dual<S> {
    #[inline(always)]
    fn mul_assign(&mut self, o: Self) {
        *self = *self * o;
    }
}

impl<S: Scalar> Compared for Dual<S> {
    type Mask = S::Mask;

    #[inline(always)]
    fn abs(self) -> Self {
        self.chain(self.value.abs(), S::one().copysign(self.value))
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        Self::select(o.value.lt(self.value), self, o)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let slope = S::one().copysign(self.value) * S::one().copysign(sign.value);
        self.chain(self.value.copysign(sign.value), slope)
    }
    #[inline(always)]
    fn lt(self, o: Self) -> S::Mask {
        self.value.lt(o.value)
    }
    #[inline(always)]
    fn select(mask: S::Mask, a: Self, b: Self) -> Self {
        Dual {
            value: S::select(mask, a.value, b.value),
            derivative: S::select(mask, a.derivative, b.derivative),
        }
    }
}

impl<S: Scalar> Elementary for Dual<S> {
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, S::splat(0.5) / root)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        self.chain(self.value.ln(), S::one() / self.value)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        let value = self.value.exp();
        self.chain(value, value)
    }
    /// `(x dy - y dx) / (x^2 + y^2)`.
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        let square = self.value.mul_add(self.value, x.value * x.value) + S::splat(f64::MIN_POSITIVE);
        let cross = x.value * self.derivative - self.value * x.derivative;
        Dual { value: self.value.atan2(x.value), derivative: cross / square }
    }
}

impl<S: Scalar> Scalar for Dual<S> {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self::constant(S::splat(x))
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        let derivative = self.derivative.mul_add(b.value, b.derivative.mul_add(self.value, c.derivative));
        Dual { value: self.value.mul_add(b.value, c.value), derivative }
    }
    /// Derivative of the rotation in `F = R S`: `R^T dR` is antisymmetric, with the axial vector
    /// `(tr(S) I - S)^-1 axial(R^T dF - dF^T R)`; in two dimensions `R^T dR = (R^T dF - dF^T R) / tr S`.
    ///
    /// From differentiating `F = R S` and taking the antisymmetric part. The eigenvalues of `tr(S) I - S`
    /// are the sums of two singular values; they are kept away from zero, so the derivative is always finite
    /// where `F` is.
    #[inline(always)]
    fn rotation<const D: usize>(f: &Mat<Self, D>) -> Mat<Self, D> {
        let (f, df) = Self::parts(f);
        let r = S::rotation(&f);
        let inverse = spin_inverse(&r.transpose_mul(&f).symmetric());
        let spin = cross(&inverse.mul_vec(&axial(&r.transpose_mul(&df))));
        Self::along(&r, &(r * spin))
    }
    /// `d psi = (d psi / dF) : dF`.
    #[inline(always)]
    fn isotropic_value<const D: usize, I: IsotropicFunction<D>>(function: &I, f: &Mat<Self, D>) -> Self {
        let (f, df) = Self::parts(f);
        let derivative = S::isotropic_gradient(function, &f).dot(&df);
        Dual { value: S::isotropic_value(function, &f), derivative }
    }
    #[inline(always)]
    fn isotropic_gradient<const D: usize, I: IsotropicFunction<D>>(
        function: &I,
        f: &Mat<Self, D>,
    ) -> Mat<Self, D> {
        let (f, df) = Self::parts(f);
        let (gradient, derivative) = isotropic_gradient_along(function, &f, &df);
        Self::along(&gradient, &derivative)
    }
}

/// `(tr(S) I - S)^-1`; in 2D `1 / tr S` in the first entry. Bounded by `1 / SMALLEST_SUM`.
#[inline(always)]
fn spin_inverse<S: Scalar, const D: usize>(stretch: &Mat<S, D>) -> Mat<S, D> {
    let smallest = S::splat(SMALLEST_SUM);
    let trace = stretch.trace();
    if D == 2 {
        return Mat::scalar(S::one() / S::select(trace.lt(smallest), smallest, trace));
    }
    let m = Mat::scalar(trace) - *stretch;
    let c = m.cofactor();
    let det = m.determinant_with(&c);
    // tr(cof) / det is the sum of the reciprocal eigenvalues.
    let floor = smallest.mul_add(c.trace(), S::splat(1e-290));
    c.scale(S::one() / S::select(det.lt(floor), floor, det))
}

/// The axial vector of `A - A^T`: `w_0 = A_21 - A_12` and so on; in 2D its one component, first.
#[inline(always)]
fn axial<S: Scalar, const D: usize>(a: &Mat<S, D>) -> Vect<S, D> {
    let mut w = [S::zero(); D];
    if D == 2 {
        w[0] = a[1][0] - a[0][1];
    } else {
        for i in 0..D {
            let (p, q) = ((i + 1) % D, (i + 2) % D);
            w[i] = a[q][p] - a[p][q];
        }
    }
    w
}

/// The antisymmetric matrix with this axial vector, the inverse of taking it: `[w]_10 = w_0` in 2D, `w x` in
/// 3D.
#[inline(always)]
fn cross<S: Scalar, const D: usize>(w: &Vect<S, D>) -> Mat<S, D> {
    let mut m = Mat::zero();
    if D == 2 {
        m[1][0] = w[0];
        m[0][1] = -w[0];
    } else {
        for i in 0..D {
            let (p, q) = ((i + 1) % D, (i + 2) % D);
            m[q][p] = w[i];
            m[p][q] = -w[i];
        }
    }
    m
}
