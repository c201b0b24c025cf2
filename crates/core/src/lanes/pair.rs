//! Two packs at once.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Sub};

use super::operators::assigning_operators;
use crate::algebra::Mat;
use crate::scalar::{Compared, Elementary, Mask, Real, Scalar};

/// Two scalars side by side; the mask of a pair is a pair of masks.
///
/// Divisions and square roots have a long latency that one pack cannot fill. On some instruction sets a
/// kernel is a tenth to a third faster on a pair of packs than on one pack after the other, with
/// bit-identical results: see [`Lanes::PAIRS_PAY`](super::Lanes::PAIRS_PAY).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair<S>(pub S, pub S);

macro_rules! binary {
    ($trait:ident, $method:ident, $bound:path) => {
        impl<S: $bound> $trait for Pair<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                Pair($trait::$method(self.0, o.0), $trait::$method(self.1, o.1))
            }
        }
    };
}
binary!(Add, add, Scalar);
binary!(Sub, sub, Scalar);
binary!(Mul, mul, Scalar);
binary!(Div, div, Scalar);
binary!(BitAnd, bitand, Mask);
binary!(BitOr, bitor, Mask);
assigning_operators!(Pair<S>, S: Scalar);

impl<S: Scalar> Neg for Pair<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Pair(-self.0, -self.1)
    }
}

impl<M: Mask> Mask for Pair<M> {
    #[inline(always)]
    fn any(self) -> bool {
        self.0.any() | self.1.any()
    }
}

impl<S: Scalar> Compared for Pair<S> {
    type Mask = Pair<S::Mask>;

    #[inline(always)]
    fn abs(self) -> Self {
        Pair(self.0.abs(), self.1.abs())
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        Pair(self.0.max(o.0), self.1.max(o.1))
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Pair(self.0.copysign(sign.0), self.1.copysign(sign.1))
    }
    #[inline(always)]
    fn lt(self, o: Self) -> Self::Mask {
        Pair(self.0.lt(o.0), self.1.lt(o.1))
    }
    #[inline(always)]
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self {
        Pair(S::select(mask.0, a.0, b.0), S::select(mask.1, a.1, b.1))
    }
}

impl<S: Scalar> Elementary for Pair<S> {
    #[inline(always)]
    fn sqrt(self) -> Self {
        Pair(self.0.sqrt(), self.1.sqrt())
    }
    #[inline(always)]
    fn ln(self) -> Self {
        Pair(self.0.ln(), self.1.ln())
    }
    #[inline(always)]
    fn exp(self) -> Self {
        Pair(self.0.exp(), self.1.exp())
    }
}

impl<S: Scalar> Scalar for Pair<S> {
    #[inline(always)]
    fn rotation_by_svd_where<const D: usize>(mask: Self::Mask, f: &Mat<Self, D>) -> Mat<Self, D> {
        let (mut a, mut b) = Self::unzip_rows(&f.0);
        if mask.0.any() {
            a = S::rotation_by_svd_where(mask.0, &Mat(a)).0;
        }
        if mask.1.any() {
            b = S::rotation_by_svd_where(mask.1, &Mat(b)).0;
        }
        Mat(Self::zip_rows(&a, &b))
    }
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Pair(S::splat(x), S::splat(x))
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Pair(self.0.mul_add(b.0, c.0), self.1.mul_add(b.1, c.1))
    }
}

impl<S: Real> Real for Pair<S> {
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        let (a, b) = (self.0.split(), self.1.split());
        (Pair(a.0, b.0), Pair(a.1, b.1))
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        Pair(self.0.power_of_two(), self.1.power_of_two())
    }
    #[inline(always)]
    fn inverse_sqrt_seed(self) -> Self {
        Pair(self.0.inverse_sqrt_seed(), self.1.inverse_sqrt_seed())
    }
}

impl<S: Scalar> Pair<S> {
    /// The pairs `(a[i], b[i])`.
    #[inline(always)]
    pub fn zip<const N: usize>(a: &[S; N], b: &[S; N]) -> [Self; N] {
        let mut r = [Self::zero(); N];
        for i in 0..N {
            r[i] = Pair(a[i], b[i]);
        }
        r
    }

    /// The pairs `(a[i][j], b[i][j])`, for matrices and for the vertices of an element.
    #[inline(always)]
    pub fn zip_rows<const N: usize, const M: usize>(a: &[[S; M]; N], b: &[[S; M]; N]) -> [[Self; M]; N] {
        let mut r = [[Self::zero(); M]; N];
        for i in 0..N {
            r[i] = Self::zip(&a[i], &b[i]);
        }
        r
    }

    /// The first and the second halves of every entry: the inverse of [`Pair::zip_rows`].
    #[inline(always)]
    pub fn unzip_rows<const N: usize, const M: usize>(p: &[[Self; M]; N]) -> ([[S; M]; N], [[S; M]; N]) {
        let (mut a, mut b) = ([[S::zero(); M]; N], [[S::zero(); M]; N]);
        for i in 0..N {
            (a[i], b[i]) = Self::unzip(&p[i]);
        }
        (a, b)
    }

    /// The first and the second halves of `p`: the inverse of [`Pair::zip`].
    #[inline(always)]
    pub fn unzip<const N: usize>(p: &[Self; N]) -> ([S; N], [S; N]) {
        let (mut a, mut b) = ([S::zero(); N], [S::zero(); N]);
        for i in 0..N {
            (a[i], b[i]) = (p[i].0, p[i].1);
        }
        (a, b)
    }
}
