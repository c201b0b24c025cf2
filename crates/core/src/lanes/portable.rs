//! The pack in plain code, for every processor.
//!
//! Without a fused multiply-add in hardware `mul_add` calls the C library, which rounds correctly and is
//! slow: the bits are the same everywhere, the speed is not. WebAssembly has one of its own (`fused`).
//!
//! On x86-64 this path serves processors older than AVX2 and the tests, on AArch64 the tests alone. Its
//! operations are calls there, not inlined: eight scalar instructions for each would make every kernel huge,
//! and compiling them slow, for hardly any machine. In WebAssembly, where it is the only path, they are
//! calls too: what browsers load is to be small, and most of the time goes into fused multiply-adds.
//! Elsewhere it is the main path, and is inlined and vectorised.

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Sub};

use super::operators::assigning_operators;
use super::{Lanes, PortableHalf, RowSlice, RowSource, WIDTH};
use crate::scalar::{Compared, Elementary, Mask, Real, Scalar};

/// Eight numbers in an array.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Portable([f64; WIDTH]);

/// Eight truth values.
#[derive(Clone, Copy, Debug)]
pub struct PortableMask([bool; WIDTH]);

macro_rules! binary {
    ($pack:ident, $zero:expr, $trait:ident, $method:ident) => {
        impl $trait for $pack {
            type Output = Self;
            #[cfg_attr(
                any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32"),
                inline(never)
            )]
            #[cfg_attr(
                not(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32")),
                inline(always)
            )]
            fn $method(self, o: Self) -> Self {
                let mut r = [$zero; WIDTH];
                for l in 0..WIDTH {
                    r[l] = $trait::$method(self.0[l], o.0[l]);
                }
                $pack(r)
            }
        }
    };
}
binary!(Portable, 0.0, Add, add);
binary!(Portable, 0.0, Sub, sub);
binary!(Portable, 0.0, Mul, mul);
binary!(Portable, 0.0, Div, div);
binary!(PortableMask, false, BitAnd, bitand);
binary!(PortableMask, false, BitOr, bitor);
assigning_operators!(Portable);

/// Applies a method of `f64` to every lane.
macro_rules! lanewise {
    ($method:path, $first:ident $(, $other:ident)*) => {{
        let mut r = [0.0; WIDTH];
        for l in 0..WIDTH {
            r[l] = $method($first.0[l] $(, $other.0[l])*);
        }
        Portable(r)
    }};
}

impl Neg for Portable {
    type Output = Self;
    #[cfg_attr(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32"), inline(never))]
    #[cfg_attr(
        not(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32")),
        inline(always)
    )]
    fn neg(self) -> Self {
        lanewise!(Neg::neg, self)
    }
}

impl Mask for PortableMask {
    #[inline(always)]
    fn any(self) -> bool {
        let mut any = false;
        for l in 0..WIDTH {
            any |= self.0[l];
        }
        any
    }
}

impl Compared for Portable {
    type Mask = PortableMask;

    #[cfg_attr(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32"), inline(never))]
    #[cfg_attr(
        not(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32")),
        inline(always)
    )]
    fn abs(self) -> Self {
        lanewise!(f64::abs, self)
    }
    #[cfg_attr(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32"), inline(never))]
    #[cfg_attr(
        not(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32")),
        inline(always)
    )]
    fn max(self, o: Self) -> Self {
        lanewise!(Compared::max, self, o)
    }
    #[cfg_attr(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32"), inline(never))]
    #[cfg_attr(
        not(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32")),
        inline(always)
    )]
    fn copysign(self, sign: Self) -> Self {
        lanewise!(f64::copysign, self, sign)
    }
    #[cfg_attr(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32"), inline(never))]
    #[cfg_attr(
        not(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32")),
        inline(always)
    )]
    fn lt(self, o: Self) -> PortableMask {
        let mut r = [false; WIDTH];
        for l in 0..WIDTH {
            r[l] = self.0[l] < o.0[l];
        }
        PortableMask(r)
    }
    #[cfg_attr(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32"), inline(never))]
    #[cfg_attr(
        not(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32")),
        inline(always)
    )]
    fn select(mask: PortableMask, a: Self, b: Self) -> Self {
        let mut r = b.0;
        for l in 0..WIDTH {
            if mask.0[l] {
                r[l] = a.0[l];
            }
        }
        Portable(r)
    }
}

impl Elementary for Portable {
    #[cfg_attr(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32"), inline(never))]
    #[cfg_attr(
        not(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32")),
        inline(always)
    )]
    fn sqrt(self) -> Self {
        lanewise!(f64::sqrt, self)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        super::ln(self)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        super::exp(self)
    }
}

impl Scalar for Portable {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Portable([x; WIDTH])
    }
    #[cfg_attr(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32"), inline(never))]
    #[cfg_attr(
        not(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32")),
        inline(always)
    )]
    fn mul_add(self, b: Self, c: Self) -> Self {
        #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
        return Portable(super::fused::mul_add_packs(&self.0, &b.0, &c.0));
        #[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
        lanewise!(f64::mul_add, self, b, c)
    }
}

impl Real for Portable {
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        let (mut k, mut m) = ([0.0; WIDTH], [0.0; WIDTH]);
        for l in 0..WIDTH {
            (k[l], m[l]) = self.0[l].split();
        }
        (Portable(k), Portable(m))
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        lanewise!(Real::power_of_two, self)
    }
    #[inline(always)]
    fn inverse_sqrt_seed(self) -> Self {
        lanewise!(Real::inverse_sqrt_seed, self)
    }
}

impl Lanes for Portable {
    const PAIRS_PAY: bool = false;
    const BY_LANE: bool = cfg!(any(target_arch = "x86_64", target_arch = "aarch64", target_arch = "wasm32"));
    type Half = PortableHalf;

    #[inline(always)]
    fn load(a: &[f64; WIDTH]) -> Self {
        Portable(*a)
    }
    #[inline(always)]
    fn store(self, a: &mut [f64; WIDTH]) {
        *a = self.0;
    }
    #[inline(always)]
    fn gather<const D: usize, R: RowSource<D>>(rows: &R, index: &[R::Index; WIDTH]) -> [Self; D] {
        let mut r = [Portable([0.0; WIDTH]); D];
        for l in 0..WIDTH {
            let row = rows.components(index[l]);
            for c in 0..D {
                r[c].0[l] = row[c];
            }
        }
        r
    }
    #[inline(always)]
    fn scatter_add<const D: usize>(rows: &mut RowSlice<D>, index: &[u16; WIDTH], v: [Self; D]) {
        for l in 0..WIDTH {
            let mut row = rows.get(index[l]);
            for c in 0..D {
                row[c] += v[c].0[l];
            }
            rows.set(index[l], row);
        }
    }
    #[inline(always)]
    fn mask_to_bits(mask: PortableMask) -> u8 {
        let mut bits = 0;
        for l in 0..WIDTH {
            bits |= u8::from(mask.0[l]) << l;
        }
        bits
    }
    #[inline(always)]
    fn mask_from_bits(bits: u8) -> PortableMask {
        let mut r = [false; WIDTH];
        for l in 0..WIDTH {
            r[l] = bits >> l & 1 == 1;
        }
        PortableMask(r)
    }
}
