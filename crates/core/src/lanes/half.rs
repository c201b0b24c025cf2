//! Half of a pack: four numbers, for the rows of small blocks. A whole pack would span parts of three such
//! rows.

use std::ops::{Add, Mul, Sub};

/// Numbers in half of a pack.
pub const HALF: usize = super::WIDTH / 2;

/// Four numbers, side by side.
pub trait HalfPack: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// The number in all lanes.
    fn splat(x: f64) -> Self;
    /// The numbers of `a`.
    fn load(a: &[f64; HALF]) -> Self;
    /// Overwrites `a`.
    fn store(self, a: &mut [f64; HALF]);
    /// Lane `k` of the result is the sum of the lanes of `v[k]`, `(0+1)+(2+3)`.
    fn sums(v: [Self; HALF]) -> Self;
}

/// Four numbers in an array.
#[derive(Clone, Copy, Debug)]
pub struct PortableHalf([f64; HALF]);

macro_rules! binary {
    ($trait:ident, $method:ident) => {
        impl $trait for PortableHalf {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, o: Self) -> Self {
                for l in 0..HALF {
                    self.0[l] = $trait::$method(self.0[l], o.0[l]);
                }
                self
            }
        }
    };
}
binary!(Add, add);
binary!(Sub, sub);
binary!(Mul, mul);

impl HalfPack for PortableHalf {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        PortableHalf([x; HALF])
    }
    #[inline(always)]
    fn load(a: &[f64; HALF]) -> Self {
        PortableHalf(*a)
    }
    #[inline(always)]
    fn store(self, a: &mut [f64; HALF]) {
        *a = self.0;
    }
    #[inline(always)]
    fn sums(v: [Self; HALF]) -> Self {
        let mut sums = v[0];
        for k in 0..HALF {
            let [a, b, c, d] = v[k].0;
            sums.0[k] = (a + b) + (c + d);
        }
        sums
    }
}
