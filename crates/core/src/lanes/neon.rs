//! The pack as four NEON registers of two numbers.
//!
//! Every AArch64 processor that runs programs of `std` has the instructions, and the compiler assumes them.
//! No test at run time is needed.
#![allow(unsafe_code)]

use std::arch::aarch64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Sub};

use super::operators::{assigning_operators, binary_operator, register};
use super::{Lanes, PortableHalf, RowSlice, RowSource, WIDTH};
use crate::algebra::{self, Mat};
use crate::scalar::{
    Compared, EXPONENT_BIAS, Elementary, INVERSE_SQRT_BITS, MANTISSA_BITS, Mask, Real, SPLIT_OFFSET,
    SQRT_HALF_BITS, Scalar, TWO_52,
};

/// Registers in a pack.
const REGISTERS: usize = WIDTH / 2;

/// Applies an intrinsic to all registers.
macro_rules! each {
    ($pack:ident, $intrinsic:ident $(::<$shift:literal>)?, $first:expr $(, $other:expr)*) => {
        register!($pack([
            $intrinsic$(::<$shift>)?($first.0[0] $(, $other.0[0])*),
            $intrinsic$(::<$shift>)?($first.0[1] $(, $other.0[1])*),
            $intrinsic$(::<$shift>)?($first.0[2] $(, $other.0[2])*),
            $intrinsic$(::<$shift>)?($first.0[3] $(, $other.0[3])*),
        ]))
    };
}

/// Lanes 0 and 1, 2 and 3, 4 and 5, 6 and 7.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Neon([float64x2_t; REGISTERS]);

/// Mask: all bits of a lane set, or none; as an intermediate, the bits of numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct NeonMask([uint64x2_t; REGISTERS]);

impl NeonMask {
    /// One word in all lanes.
    #[inline(always)]
    fn words(word: u64) -> Self {
        NeonMask([register!(vdupq_n_u64(word)); REGISTERS])
    }

    /// Bits of the numbers.
    #[inline(always)]
    fn of(x: Neon) -> Self {
        each!(NeonMask, vreinterpretq_u64_f64, x)
    }

    /// Numbers of these bits.
    #[inline(always)]
    fn numbers(self) -> Neon {
        each!(Neon, vreinterpretq_f64_u64, self)
    }

    /// Bit `l` in lane `l`.
    #[inline(always)]
    fn lane_bits() -> Self {
        let pair = |low: u64| register!(vcombine_u64(vcreate_u64(low), vcreate_u64(low << 1)));
        NeonMask([pair(1), pair(4), pair(16), pair(64)])
    }

    /// All bits that are set in any lane, in both lanes of one register.
    #[inline(always)]
    fn union(self) -> uint64x2_t {
        let [a, b, c, d] = self.0;
        register!(vorrq_u64(vorrq_u64(a, b), vorrq_u64(c, d)))
    }
}

binary_operator!(each, Neon, Add, add, vaddq_f64);
binary_operator!(each, Neon, Sub, sub, vsubq_f64);
binary_operator!(each, Neon, Mul, mul, vmulq_f64);
binary_operator!(each, Neon, Div, div, vdivq_f64);
binary_operator!(each, NeonMask, BitAnd, bitand, vandq_u64);
binary_operator!(each, NeonMask, BitOr, bitor, vorrq_u64);
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
        let union = self.union();
        register!(vgetq_lane_u64::<0>(union) | vgetq_lane_u64::<1>(union)) != 0
    }
}

impl Compared for Neon {
    type Mask = NeonMask;

    #[inline(always)]
    fn abs(self) -> Self {
        each!(Neon, vabsq_f64, self)
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        // The processor's own maximum is NaN where either is, which is not what `Scalar` asks.
        Self::select(o.lt(self), self, o)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Self::select(NeonMask::words(1 << 63), sign, self)
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

impl Elementary for Neon {
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
}

impl Scalar for Neon {
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
        Neon([register!(vdupq_n_f64(x)); REGISTERS])
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        // The instruction adds to its first operand.
        each!(Neon, vfmaq_f64, c, self, b)
    }
}

impl Real for Neon {
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        let shifted = each!(NeonMask, vaddq_u64, NeonMask::of(self), NeonMask::words(SPLIT_OFFSET));
        let exponent = each!(NeonMask, vshrq_n_u64::<52>, shifted);
        let biased = (exponent | NeonMask::words(TWO_52.to_bits())).numbers();
        let mantissa = shifted & NeonMask::words(MANTISSA_BITS);
        let mantissa = each!(NeonMask, vaddq_u64, mantissa, NeonMask::words(SQRT_HALF_BITS));
        (biased - Self::splat(TWO_52 + EXPONENT_BIAS), mantissa.numbers())
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        let biased = NeonMask::of(self + Self::splat(TWO_52 + EXPONENT_BIAS));
        each!(NeonMask, vshlq_n_u64::<52>, biased).numbers()
    }
    #[inline(always)]
    fn inverse_sqrt_seed(self) -> Self {
        let half = each!(NeonMask, vshrq_n_u64::<1>, NeonMask::of(self));
        each!(NeonMask, vsubq_u64, NeonMask::words(INVERSE_SQRT_BITS), half).numbers()
    }
}

/// Two numbers.
#[inline(always)]
fn load2(a: &[f64; 2]) -> float64x2_t {
    // SAFETY: the reference is to two numbers, and the load needs no alignment beyond theirs.
    unsafe { vld1q_f64(a.as_ptr()) }
}

/// Overwrites two numbers.
#[inline(always)]
fn store2(a: &mut [f64; 2], v: float64x2_t) {
    // SAFETY: the reference is to two numbers, and the store needs no alignment beyond theirs.
    unsafe { vst1q_f64(a.as_mut_ptr(), v) }
}

/// Adds to two numbers.
#[inline(always)]
fn add2(a: &mut [f64; 2], v: float64x2_t) {
    let sum = register!(vaddq_f64(load2(a), v));
    store2(a, sum);
}

/// First numbers of both, second numbers of both.
#[inline(always)]
fn zip2(a: float64x2_t, b: float64x2_t) -> [float64x2_t; 2] {
    register!([vzip1q_f64(a, b), vzip2q_f64(a, b)])
}

/// Adds `x, y` and, in rows of four, `z, 0` to row `index`.
#[inline(always)]
fn add_row<const D: usize>(rows: &mut RowSlice<D>, index: u16, xy: float64x2_t, z: float64x2_t) {
    if D == 3 {
        let row = rows.row_mut::<4>(index).as_chunks_mut::<2>().0;
        add2(&mut row[0], xy);
        add2(&mut row[1], z);
    } else {
        add2(rows.row_mut::<2>(index), xy);
    }
}

impl Lanes for Neon {
    // A pair would be eight of 32 registers, and kernels hold many packs at once.
    const PAIRS_PAY: bool = false;
    type Half = PortableHalf;

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
            let (a, b) = if D == 3 {
                let [[a, za], [b, zb]] = [rows.halves(i), rows.halves(j)];
                [packs[2].0[r], _] = zip2(load2(za), load2(zb));
                (a, b)
            } else {
                (rows.row(i), rows.row(j))
            };
            [packs[0].0[r], packs[1].0[r]] = zip2(load2(a), load2(b));
        }
        packs
    }
    #[inline(always)]
    fn scatter_add<const D: usize>(rows: &mut RowSlice<D>, index: &[u16; WIDTH], v: [Self; D]) {
        let none = Self::zero();
        let z = if D == 3 { v[2] } else { none };
        for r in 0..REGISTERS {
            let (xy, z) = (zip2(v[0].0[r], v[1].0[r]), zip2(z.0[r], none.0[r]));
            add_row(rows, index[2 * r], xy[0], z[0]);
            add_row(rows, index[2 * r + 1], xy[1], z[1]);
        }
    }
    #[inline(always)]
    fn transpose(v: [Self; WIDTH]) -> [Self; WIDTH] {
        let mut t = v;
        for r in 0..REGISTERS {
            for s in 0..REGISTERS {
                [t[2 * r].0[s], t[2 * r + 1].0[s]] = zip2(v[2 * s].0[r], v[2 * s + 1].0[r]);
            }
        }
        t
    }
    #[inline(always)]
    fn mask_to_bits(mask: NeonMask) -> u8 {
        let union = (mask & NeonMask::lane_bits()).union();
        // One bit a lane: the sum is below 256.
        register!(vaddvq_u64(union)) as u8
    }
    #[inline(always)]
    fn mask_from_bits(bits: u8) -> NeonMask {
        each!(NeonMask, vtstq_u64, NeonMask::words(u64::from(bits)), NeonMask::lane_bits())
    }
    #[inline(always)]
    fn horizontal_sum(self) -> f64 {
        let [a, b, c, d] = self.0;
        register!({
            let columns = vaddq_f64(vaddq_f64(a, c), vaddq_f64(b, d));
            vgetq_lane_f64::<0>(columns) + vgetq_lane_f64::<1>(columns)
        })
    }
}
