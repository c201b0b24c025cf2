//! Numbers of about 32 digits, as an unevaluated sum of two `f64` (Dekker 1971): the reference for accuracy
//! tests.

use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::scalar::{Compared, Elementary, Scalar};

#[derive(Clone, Copy, Debug)]
pub(super) struct DoubleDouble(pub(super) f64, pub(super) f64);

fn quick_two_sum(a: f64, b: f64) -> DoubleDouble {
    let s = a + b;
    DoubleDouble(s, b - (s - a))
}

impl Add for DoubleDouble {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        let s = self.0 + o.0;
        let b = s - self.0;
        let e = (self.0 - (s - b)) + (o.0 - b);
        quick_two_sum(s, e + self.1 + o.1)
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    fn neg(self) -> Self {
        DoubleDouble(-self.0, -self.1)
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        let p = self.0 * o.0;
        quick_two_sum(p, self.0.mul_add(o.0, -p) + (self.0 * o.1 + self.1 * o.0))
    }
}

impl Div for DoubleDouble {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let q = self.0 / o.0;
        let r = self - o * DoubleDouble(q, 0.0);
        let q2 = r.0 / o.0;
        let r = r - o * DoubleDouble(q2, 0.0);
        quick_two_sum(q, q2) + DoubleDouble(r.0 / o.0, 0.0)
    }
}

impl AddAssign for DoubleDouble {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl SubAssign for DoubleDouble {
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

impl MulAssign for DoubleDouble {
    fn mul_assign(&mut self, o: Self) {
        *self = *self * o;
    }
}

impl Compared for DoubleDouble {
    type Mask = bool;
    fn abs(self) -> Self {
        if self.0 < 0.0 { -self } else { self }
    }
    fn max(self, o: Self) -> Self {
        if o.lt(self) { self } else { o }
    }
    fn copysign(self, sign: Self) -> Self {
        if self.0.is_sign_negative() == sign.0.is_sign_negative() { self } else { -self }
    }
    fn lt(self, o: Self) -> bool {
        (self - o).0 < 0.0
    }
    fn select(mask: bool, a: Self, b: Self) -> Self {
        if mask { a } else { b }
    }
}

impl Elementary for DoubleDouble {
    fn sqrt(self) -> Self {
        if self.0 == 0.0 {
            return self;
        }
        let q = DoubleDouble(self.0.sqrt(), 0.0);
        q + (self - q * q) / (q + q)
    }
    fn ln(self) -> Self {
        unreachable!("not needed by the decompositions")
    }
    fn exp(self) -> Self {
        unreachable!("not needed by the decompositions")
    }
}

impl Scalar for DoubleDouble {
    fn splat(x: f64) -> Self {
        DoubleDouble(x, 0.0)
    }
    fn mul_add(self, b: Self, c: Self) -> Self {
        self * b + c
    }
}
