//! The pack as four NEON registers of two numbers.
//!
//! Every AArch64 processor that runs programs of `std` has the instructions, and the compiler assumes them: they
//! need no test at run time.
#![allow(unsafe_code)]

use std::arch::aarch64::{self, float64x2_t, uint64x2_t};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Sub};

use super::operators::assigning_operators;
use super::{Lanes, RowSlice, RowSource, WIDTH};
use crate::algebra::{self, Mat};
use crate::scalar::{
    EXPONENT_BIAS, INVERSE_SQRT_BITS, MANTISSA_BITS, Mask, Real, SPLIT_OFFSET, SQRT_HALF_BITS, Scalar, TWO_52,
};

/// Registers in a pack.
const REGISTERS: usize = WIDTH / 2;

/// Safe names of instructions that take and give registers alone.
macro_rules! instructions {
    ($($name:ident($($argument:ident: $type:ty),*) -> $result:ty;)*) => {
        $(
            #[inline(always)]
            fn $name($($argument: $type),*) -> $result {
                // SAFETY: NEON is among the features of every AArch64 target of `std`, and nothing else is asked.
                unsafe { aarch64::$name($($argument),*) }
            }
        )*
    };
}
instructions! {
    vaddq_f64(a: float64x2_t, b: float64x2_t) -> float64x2_t;
    vsubq_f64(a: float64x2_t, b: float64x2_t) -> float64x2_t;
    vmulq_f64(a: float64x2_t, b: float64x2_t) -> float64x2_t;
    vdivq_f64(a: float64x2_t, b: float64x2_t) -> float64x2_t;
    vfmaq_f64(a: float64x2_t, b: float64x2_t, c: float64x2_t) -> float64x2_t;
    vnegq_f64(a: float64x2_t) -> float64x2_t;
    vabsq_f64(a: float64x2_t) -> float64x2_t;
    vsqrtq_f64(a: float64x2_t) -> float64x2_t;
    vdupq_n_f64(a: f64) -> float64x2_t;
    vdupq_n_u64(a: u64) -> uint64x2_t;
    vcgtq_f64(a: float64x2_t, b: float64x2_t) -> uint64x2_t;
    vcltq_f64(a: float64x2_t, b: float64x2_t) -> uint64x2_t;
    vbslq_f64(mask: uint64x2_t, a: float64x2_t, b: float64x2_t) -> float64x2_t;
    vandq_u64(a: uint64x2_t, b: uint64x2_t) -> uint64x2_t;
    vorrq_u64(a: uint64x2_t, b: uint64x2_t) -> uint64x2_t;
    vaddq_u64(a: uint64x2_t, b: uint64x2_t) -> uint64x2_t;
    vsubq_u64(a: uint64x2_t, b: uint64x2_t) -> uint64x2_t;
    vtstq_u64(a: uint64x2_t, b: uint64x2_t) -> uint64x2_t;
    vaddvq_u64(a: uint64x2_t) -> u64;
    vreinterpretq_u64_f64(a: float64x2_t) -> uint64x2_t;
    vreinterpretq_f64_u64(a: uint64x2_t) -> float64x2_t;
    vzip1q_f64(a: float64x2_t, b: float64x2_t) -> float64x2_t;
    vzip2q_f64(a: float64x2_t, b: float64x2_t) -> float64x2_t;
}

/// Words shifted to the right by `N` bits.
#[inline(always)]
fn vshrq_n_u64<const N: i32>(a: uint64x2_t) -> uint64x2_t {
    // SAFETY: as above; that `N` is in range is checked when this is compiled.
    unsafe { aarch64::vshrq_n_u64::<N>(a) }
}

/// Words shifted to the left by `N` bits.
#[inline(always)]
fn vshlq_n_u64<const N: i32>(a: uint64x2_t) -> uint64x2_t {
    // SAFETY: as above; that `N` is in range is checked when this is compiled.
    unsafe { aarch64::vshlq_n_u64::<N>(a) }
}

/// The number in lane `N`.
#[inline(always)]
fn vgetq_lane_f64<const N: i32>(a: float64x2_t) -> f64 {
    // SAFETY: as above; that `N` is in range is checked when this is compiled.
    unsafe { aarch64::vgetq_lane_f64::<N>(a) }
}

/// The word in lane `N`.
#[inline(always)]
fn vgetq_lane_u64<const N: i32>(a: uint64x2_t) -> u64 {
    // SAFETY: as above; that `N` is in range is checked when this is compiled.
    unsafe { aarch64::vgetq_lane_u64::<N>(a) }
}

/// Two words.
#[inline(always)]
fn words(low: u64, high: u64) -> uint64x2_t {
    // SAFETY: as above.
    unsafe { aarch64::vcombine_u64(aarch64::vcreate_u64(low), aarch64::vcreate_u64(high)) }
}

/// Lanes 0 and 1, 2 and 3, 4 and 5, 6 and 7.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Neon([float64x2_t; REGISTERS]);

/// All bits of a lane set, or none.
#[derive(Clone, Copy, Debug)]
pub(super) struct NeonMask([uint64x2_t; REGISTERS]);

/// The same function on all registers.
macro_rules! each {
    ($pack:ident, $function:ident, $first:expr $(, $other:expr)*) => {
        $pack([
            $function($first.0[0] $(, $other.0[0])*),
            $function($first.0[1] $(, $other.0[1])*),
            $function($first.0[2] $(, $other.0[2])*),
            $function($first.0[3] $(, $other.0[3])*),
        ])
    };
}

macro_rules! binary {
    ($pack:ident, $trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for $pack {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                each!($pack, $intrinsic, self, o)
            }
        }
    };
}
binary!(Neon, Add, add, vaddq_f64);
binary!(Neon, Sub, sub, vsubq_f64);
binary!(Neon, Mul, mul, vmulq_f64);
binary!(Neon, Div, div, vdivq_f64);
binary!(NeonMask, BitAnd, bitand, vandq_u64);
binary!(NeonMask, BitOr, bitor, vorrq_u64);
assigning_operators!(Neon);

impl Neg for Neon {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        each!(Neon, vnegq_f64, self)
    }
}

impl Mask for NeonMask {
    #[inline(always)]
    fn any(self) -> bool {
        let [a, b, c, d] = self.0;
        let any = vorrq_u64(vorrq_u64(a, b), vorrq_u64(c, d));
        vgetq_lane_u64::<0>(any) | vgetq_lane_u64::<1>(any) != 0
    }
}

/// The larger of the two; `b` where either is NaN and where both are zero.
///
/// The processor's own maximum returns NaN if either is, which is not what [`Scalar::max`] asks.
#[inline(always)]
fn larger(a: float64x2_t, b: float64x2_t) -> float64x2_t {
    vbslq_f64(vcgtq_f64(a, b), a, b)
}

#[inline(always)]
fn with_sign(a: float64x2_t, sign: float64x2_t) -> float64x2_t {
    vbslq_f64(vdupq_n_u64(1 << 63), sign, a)
}

impl Scalar for Neon {
    type Mask = NeonMask;

    #[inline(always)]
    fn rotation_by_svd_where<const D: usize>(_: NeonMask, f: &Mat<Self, D>) -> Mat<Self, D> {
        /// Not inlined: the branch is rare and its code large.
        #[inline(never)]
        fn outlined<const D: usize>(f: &Mat<Neon, D>) -> Mat<Neon, D> {
            algebra::rotation_by_svd(f)
        }
        outlined(f)
    }

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Neon([vdupq_n_f64(x); REGISTERS])
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        // The instruction adds to its first operand.
        each!(Neon, vfmaq_f64, c, self, b)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        each!(Neon, vsqrtq_f64, self)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        super::ln(self)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        super::exp(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        each!(Neon, vabsq_f64, self)
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        each!(Neon, larger, self, o)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        each!(Neon, with_sign, self, sign)
    }
    #[inline(always)]
    fn lt(self, o: Self) -> NeonMask {
        each!(NeonMask, vcltq_f64, self, o)
    }
    #[inline(always)]
    fn select(mask: NeonMask, a: Self, b: Self) -> Self {
        each!(Neon, vbslq_f64, mask, a, b)
    }
}

#[inline(always)]
fn split_exponent(x: float64x2_t) -> float64x2_t {
    let shifted = vaddq_u64(vreinterpretq_u64_f64(x), vdupq_n_u64(SPLIT_OFFSET));
    let biased = vorrq_u64(vshrq_n_u64::<52>(shifted), vdupq_n_u64(TWO_52.to_bits()));
    vsubq_f64(vreinterpretq_f64_u64(biased), vdupq_n_f64(TWO_52 + EXPONENT_BIAS))
}

#[inline(always)]
fn split_mantissa(x: float64x2_t) -> float64x2_t {
    let shifted = vaddq_u64(vreinterpretq_u64_f64(x), vdupq_n_u64(SPLIT_OFFSET));
    let mantissa = vandq_u64(shifted, vdupq_n_u64(MANTISSA_BITS));
    vreinterpretq_f64_u64(vaddq_u64(mantissa, vdupq_n_u64(SQRT_HALF_BITS)))
}

#[inline(always)]
fn two_to_the(k: float64x2_t) -> float64x2_t {
    let biased = vaddq_f64(k, vdupq_n_f64(TWO_52 + EXPONENT_BIAS));
    vreinterpretq_f64_u64(vshlq_n_u64::<52>(vreinterpretq_u64_f64(biased)))
}

#[inline(always)]
fn inverse_sqrt_seed_of(x: float64x2_t) -> float64x2_t {
    let half = vshrq_n_u64::<1>(vreinterpretq_u64_f64(x));
    vreinterpretq_f64_u64(vsubq_u64(vdupq_n_u64(INVERSE_SQRT_BITS), half))
}

impl Real for Neon {
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        (each!(Neon, split_exponent, self), each!(Neon, split_mantissa, self))
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        each!(Neon, two_to_the, self)
    }
    #[inline(always)]
    fn inverse_sqrt_seed(self) -> Self {
        each!(Neon, inverse_sqrt_seed_of, self)
    }
}

/// Two numbers.
#[inline(always)]
fn load2(a: &[f64; 2]) -> float64x2_t {
    // SAFETY: the reference is to two numbers, and the load needs no alignment beyond theirs.
    unsafe { aarch64::vld1q_f64(a.as_ptr()) }
}

/// Overwrites two numbers.
#[inline(always)]
fn store2(a: &mut [f64; 2], v: float64x2_t) {
    // SAFETY: the reference is to two numbers, and the store needs no alignment beyond theirs.
    unsafe { aarch64::vst1q_f64(a.as_mut_ptr(), v) }
}

/// The bits of a mask that stand for the lanes of each register.
#[inline(always)]
fn lane_bits() -> [uint64x2_t; REGISTERS] {
    [words(1, 2), words(4, 8), words(16, 32), words(64, 128)]
}

/// Adds `x, y` and, in rows of four, `z, 0` to row `index`.
#[inline(always)]
fn add_row<const D: usize>(rows: &mut RowSlice<D>, index: u16, xy: float64x2_t, z: float64x2_t) {
    if D == 3 {
        let row = rows.row_mut::<4>(index).as_chunks_mut::<2>().0;
        let sum = vaddq_f64(load2(&row[0]), xy);
        store2(&mut row[0], sum);
        let sum = vaddq_f64(load2(&row[1]), z);
        store2(&mut row[1], sum);
    } else {
        let row = rows.row_mut::<2>(index);
        let sum = vaddq_f64(load2(row), xy);
        store2(row, sum);
    }
}

impl Lanes for Neon {
    // A pair would be eight of 32 registers, and kernels hold many packs at once.
    const PAIRS_PAY: bool = false;

    #[inline(always)]
    fn load(a: &[f64; WIDTH]) -> Self {
        let a = a.as_chunks::<2>().0;
        Neon([load2(&a[0]), load2(&a[1]), load2(&a[2]), load2(&a[3])])
    }
    #[inline(always)]
    fn store(self, a: &mut [f64; WIDTH]) {
        let a = a.as_chunks_mut::<2>().0;
        for r in 0..REGISTERS {
            store2(&mut a[r], self.0[r]);
        }
    }
    #[inline(always)]
    fn gather<const D: usize, R: RowSource<D>>(rows: &R, index: &[R::Index; WIDTH]) -> [Self; D] {
        let mut packs = [Self::zero(); D];
        for r in 0..REGISTERS {
            let (i, j) = (index[2 * r], index[2 * r + 1]);
            if D == 3 {
                let [[a, za], [b, zb]] = [rows.halves(i), rows.halves(j)];
                let (a, b) = (load2(a), load2(b));
                packs[0].0[r] = vzip1q_f64(a, b);
                packs[1].0[r] = vzip2q_f64(a, b);
                packs[2].0[r] = vzip1q_f64(load2(za), load2(zb));
            } else {
                let (a, b) = (load2(rows.row(i)), load2(rows.row(j)));
                packs[0].0[r] = vzip1q_f64(a, b);
                packs[1].0[r] = vzip2q_f64(a, b);
            }
        }
        packs
    }
    #[inline(always)]
    fn scatter_add<const D: usize>(rows: &mut RowSlice<D>, index: &[u16; WIDTH], v: [Self; D]) {
        let none = vdupq_n_f64(0.0);
        for r in 0..REGISTERS {
            let (x, y) = (v[0].0[r], v[1].0[r]);
            let z = if D == 3 { v[2].0[r] } else { none };
            add_row(rows, index[2 * r], vzip1q_f64(x, y), vzip1q_f64(z, none));
            add_row(rows, index[2 * r + 1], vzip2q_f64(x, y), vzip2q_f64(z, none));
        }
    }
    #[inline(always)]
    fn transpose(v: [Self; WIDTH]) -> [Self; WIDTH] {
        let mut t = v;
        for r in 0..REGISTERS {
            for s in 0..REGISTERS {
                let (a, b) = (v[2 * s].0[r], v[2 * s + 1].0[r]);
                t[2 * r].0[s] = vzip1q_f64(a, b);
                t[2 * r + 1].0[s] = vzip2q_f64(a, b);
            }
        }
        t
    }
    #[inline(always)]
    fn mask_to_bits(mask: NeonMask) -> u8 {
        let [a, b, c, d] = each!(NeonMask, vandq_u64, mask, NeonMask(lane_bits())).0;
        // One bit a lane: the sum is below 256.
        vaddvq_u64(vorrq_u64(vorrq_u64(a, b), vorrq_u64(c, d))) as u8
    }
    #[inline(always)]
    fn mask_from_bits(bits: u8) -> NeonMask {
        let bits = NeonMask([vdupq_n_u64(u64::from(bits)); REGISTERS]);
        each!(NeonMask, vtstq_u64, bits, NeonMask(lane_bits()))
    }
    #[inline(always)]
    fn horizontal_sum(self) -> f64 {
        let [a, b, c, d] = self.0;
        let columns = vaddq_f64(vaddq_f64(a, c), vaddq_f64(b, d));
        vgetq_lane_f64::<0>(columns) + vgetq_lane_f64::<1>(columns)
    }
}
