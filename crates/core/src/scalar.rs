//! Number type over which material and element kernels are written.
//!
//! A kernel is written once. It runs on `f64`, on a pack of lanes ([`crate::lanes`]) and on dual numbers, so
//! that the same source gives the reference value, the fast value and the derivative. The trait has only IEEE
//! operations that are exactly rounded everywhere (`+ - * / sqrt fma`, compare, select); therefore every
//! instruction set gives the same bits.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::algebra::{self, IsotropicFunction, Mat};

/// Result of comparing two scalars, lane by lane.
pub trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> {
    /// True if any lane is true.
    fn any(self) -> bool;
}

impl Mask for bool {
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
}

/// Order and sign of numbers, lane by lane.
pub trait Compared: Copy {
    /// Result of a comparison.
    type Mask: Mask;

    /// Absolute value.
    fn abs(self) -> Self;
    /// The larger of the two; `o` if `self` is NaN.
    fn max(self, o: Self) -> Self;
    /// `|self|` with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;
    /// `self < o`; false if either is NaN.
    fn lt(self, o: Self) -> Self::Mask;
    /// `mask ? a : b`, lane by lane.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
}

/// Elementary functions.
pub trait Elementary: Copy + Mul<Output = Self> {
    /// Square root.
    fn sqrt(self) -> Self;
    /// Natural logarithm; NaN for negative arguments, `-inf` at zero, see [`crate::lanes::ln`].
    fn ln(self) -> Self;
    /// `e^self`, see [`crate::lanes::exp`].
    fn exp(self) -> Self;
    /// `self^exponent = e^(exponent ln self)` for positive `self`, see [`crate::lanes::powf`].
    #[inline(always)]
    fn powf(self, exponent: Self) -> Self {
        (exponent * self.ln()).exp()
    }
    /// The angle of the point `(x, self)` in `(-pi, pi]`, see [`crate::lanes::atan2`].
    #[inline(always)]
    fn atan2(self, x: Self) -> Self
    where
        Self: Scalar,
    {
        crate::lanes::atan2(self, x)
    }
}

/// A real number, a pack of real numbers, or a real number with derivatives.
pub trait Scalar:
    Compared
    + Elementary
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
{
    /// The constant `x` in every lane.
    fn splat(x: f64) -> Self;
    /// `self * b + c` with a single rounding.
    fn mul_add(self, b: Self, c: Self) -> Self;

    /// The rotation of the signed polar decomposition `F = R S`, see [`algebra::rotation`].
    ///
    /// This is a primitive because its derivative has a closed form: dual numbers do not differentiate the
    /// iteration.
    #[inline(always)]
    fn rotation<const D: usize>(f: &Mat<Self, D>) -> Mat<Self, D> {
        algebra::rotation(f)
    }

    /// The rotation of `f` from its singular values, see [`algebra::rotation_by_svd`], in lanes where `mask`
    /// is true; other lanes are undefined. Packs of lanes do not inline this rare branch of the general case.
    #[inline(always)]
    fn rotation_by_svd_where<const D: usize>(mask: Self::Mask, f: &Mat<Self, D>) -> Mat<Self, D> {
        let _ = mask;
        algebra::rotation_by_svd(f)
    }

    /// The value of an isotropic function at `F`, see [`algebra::isotropic_value`].
    ///
    /// This is a primitive for the reason of [`rotation`](Self::rotation): if stretches coincide, the
    /// singular vectors have no derivative, but the function has.
    #[inline(always)]
    fn isotropic_value<const D: usize, I: IsotropicFunction<D>>(function: &I, f: &Mat<Self, D>) -> Self {
        algebra::isotropic_value(function, f)
    }

    /// The gradient of an isotropic function at `F`, see [`algebra::isotropic_gradient`].
    #[inline(always)]
    fn isotropic_gradient<const D: usize, I: IsotropicFunction<D>>(
        function: &I,
        f: &Mat<Self, D>,
    ) -> Mat<Self, D> {
        algebra::isotropic_gradient(function, f)
    }

    /// Zero in every lane.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }
    /// One in every lane.
    #[inline(always)]
    fn one() -> Self {
        Self::splat(1.0)
    }
}

/// A scalar with an accessible exponent: `f64` and packs of lanes, but not dual numbers.
///
/// The elementary functions of [`crate::lanes`] are written once over this trait, without the platform's
/// logarithm and exponential; therefore every instruction set and plain `f64` give the same bits.
pub trait Real: Scalar {
    /// `(k, m)` with `self = 2^k m`, `k` an integer and `m` in `[sqrt(1/2), sqrt(2))`.
    ///
    /// Meaningless, but harmless, unless `self` is positive, normal and finite.
    fn split(self) -> (Self, Self);
    /// `2^self` for an integer `self` in `-1022..=1023`; meaningless, but harmless, elsewhere.
    fn power_of_two(self) -> Self;
    /// `1 / sqrt(self)` to 3.5 % for positive, normal `self`, from its bits alone.
    ///
    /// Zero gives a large finite number, everything else something harmless.
    fn inverse_sqrt_seed(self) -> Self;
}

impl Compared for f64 {
    type Mask = bool;

    #[inline(always)]
    fn abs(self) -> f64 {
        f64::abs(self)
    }
    #[inline(always)]
    fn max(self, o: f64) -> f64 {
        if self > o { self } else { o }
    }
    #[inline(always)]
    fn copysign(self, sign: f64) -> f64 {
        f64::copysign(self, sign)
    }
    #[inline(always)]
    fn lt(self, o: f64) -> bool {
        self < o
    }
    #[inline(always)]
    fn select(mask: bool, a: f64, b: f64) -> f64 {
        if mask { a } else { b }
    }
}

impl Elementary for f64 {
    #[inline(always)]
    fn sqrt(self) -> f64 {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn ln(self) -> f64 {
        crate::lanes::ln(self)
    }
    #[inline(always)]
    fn exp(self) -> f64 {
        crate::lanes::exp(self)
    }
}

impl Scalar for f64 {
    #[inline(always)]
    fn splat(x: f64) -> f64 {
        x
    }
    #[inline(always)]
    fn mul_add(self, b: f64, c: f64) -> f64 {
        f64::mul_add(self, b, c)
    }
}

/// The bits of `sqrt(1/2)`: where the mantissa of [`Real::split`] begins.
pub(crate) const SQRT_HALF_BITS: u64 = 0x3fe6_a09e_667f_3bcd;
/// Offset that brings `sqrt(1/2)` to the next binade, so that the exponent field of the sum counts from
/// there.
pub(crate) const SPLIT_OFFSET: u64 = 0x3ff0_0000_0000_0000 - SQRT_HALF_BITS;
/// The mantissa field of an `f64`.
pub(crate) const MANTISSA_BITS: u64 = 0x000f_ffff_ffff_ffff;
/// `2^52`: an integer below `2^52` that is or-ed into its mantissa becomes a floating-point number.
pub(crate) const TWO_52: f64 = 4_503_599_627_370_496.0;
/// The bias of the exponent field of an `f64`.
pub(crate) const EXPONENT_BIAS: f64 = 1023.0;

/// Constant that the halved bits of `x` are subtracted from for an approximation of `1 / sqrt(x)`: the one
/// that makes the largest
/// relative error smallest, 3.44 % (Robertson 2012, *A Brief History of InvSqrt*, thesis, University of New
/// Brunswick).
pub(crate) const INVERSE_SQRT_BITS: u64 = 0x5fe6_eb50_c7b5_37a9;

impl Real for f64 {
    #[inline(always)]
    fn split(self) -> (f64, f64) {
        let shifted = self.to_bits().wrapping_add(SPLIT_OFFSET);
        let k = f64::from_bits((shifted >> 52) | TWO_52.to_bits()) - (TWO_52 + EXPONENT_BIAS);
        let m = f64::from_bits((shifted & MANTISSA_BITS) + SQRT_HALF_BITS);
        (k, m)
    }
    #[inline(always)]
    fn power_of_two(self) -> f64 {
        // The sum holds the biased exponent in its lowest bits; everything above is shifted out.
        f64::from_bits((self + (TWO_52 + EXPONENT_BIAS)).to_bits() << 52)
    }
    #[inline(always)]
    fn inverse_sqrt_seed(self) -> f64 {
        f64::from_bits(INVERSE_SQRT_BITS.wrapping_sub(self.to_bits() >> 1))
    }
}
