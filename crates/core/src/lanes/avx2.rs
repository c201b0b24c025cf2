//! The pack as two AVX2 registers of four numbers.
#![allow(unsafe_code)]

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Sub};

use super::operators::{assigning_operators, binary_operator, register};
use super::{HALF, HalfPack, Lanes, RowSlice, RowSource, WIDTH};
use crate::algebra::{self, Mat};
use crate::scalar::{
    Compared, EXPONENT_BIAS, Elementary, INVERSE_SQRT_BITS, MANTISSA_BITS, Mask, Real, SPLIT_OFFSET,
    SQRT_HALF_BITS, Scalar, TWO_52,
};

/// Lanes 0 to 3 and lanes 4 to 7.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Avx2(__m256d, __m256d);

/// Mask: all bits of a lane set, or none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Avx2Mask(__m256d, __m256d);

/// Four numbers.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(super) struct Avx2Half(__m256d);

/// Applies an intrinsic to both registers.
macro_rules! both {
    ($pack:ident, $intrinsic:ident $(::<$mode:ident>)?, $first:expr $(, $other:expr)*) => {
        register!($pack(
            $intrinsic$(::<$mode>)?($first.0 $(, $other.0)*),
            $intrinsic$(::<$mode>)?($first.1 $(, $other.1)*)
        ))
    };
}

binary_operator!(both, Avx2, Add, add, _mm256_add_pd);
binary_operator!(both, Avx2, Sub, sub, _mm256_sub_pd);
binary_operator!(both, Avx2, Mul, mul, _mm256_mul_pd);
binary_operator!(both, Avx2, Div, div, _mm256_div_pd);
binary_operator!(both, Avx2Mask, BitAnd, bitand, _mm256_and_pd);
binary_operator!(both, Avx2Mask, BitOr, bitor, _mm256_or_pd);
assigning_operators!(Avx2);

impl Neg for Avx2 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        both!(Avx2, _mm256_xor_pd, self, Avx2::splat(-0.0))
    }
}

impl Mask for Avx2Mask {
    #[inline(always)]
    fn any(self) -> bool {
        Avx2::mask_to_bits(self) != 0
    }
}

impl Compared for Avx2 {
    type Mask = Avx2Mask;

    #[inline(always)]
    fn abs(self) -> Self {
        both!(Avx2, _mm256_andnot_pd, Avx2::splat(-0.0), self)
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        // The instruction returns its second operand where either is NaN and where both are zero, as
        // `Scalar` asks.
        both!(Avx2, _mm256_max_pd, self, o)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let signs = both!(Avx2, _mm256_and_pd, Avx2::splat(-0.0), sign);
        both!(Avx2, _mm256_or_pd, self.abs(), signs)
    }
    #[inline(always)]
    fn lt(self, o: Self) -> Avx2Mask {
        both!(Avx2Mask, _mm256_cmp_pd::<_CMP_LT_OQ>, self, o)
    }
    #[inline(always)]
    fn select(mask: Avx2Mask, a: Self, b: Self) -> Self {
        both!(Avx2, _mm256_blendv_pd, b, a, mask)
    }
}

impl Elementary for Avx2 {
    #[inline(always)]
    fn sqrt(self) -> Self {
        both!(Avx2, _mm256_sqrt_pd, self)
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

impl Scalar for Avx2 {
    #[inline(always)]
    fn rotation_by_svd_where<const D: usize>(_: Avx2Mask, f: &Mat<Self, D>) -> Mat<Self, D> {
        /// Not inlined: the branch is rare and its code large.
        #[inline(never)]
        #[target_feature(enable = "avx2,fma")]
        fn outlined<const D: usize>(f: &Mat<Avx2, D>) -> Mat<Avx2, D> {
            algebra::rotation_by_svd(f)
        }
        // SAFETY: a value of this type exists, so the processor has the instructions.
        unsafe { outlined(f) }
    }
    #[inline(always)]
    fn splat(x: f64) -> Self {
        let v = register!(_mm256_set1_pd(x));
        Avx2(v, v)
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        both!(Avx2, _mm256_fmadd_pd, self, b, c)
    }
}

#[inline(always)]
fn split_half(x: __m256d) -> (__m256d, __m256d) {
    register!({
        let shifted = _mm256_add_epi64(_mm256_castpd_si256(x), _mm256_set1_epi64x(SPLIT_OFFSET as i64));
        let two_52 = _mm256_set1_epi64x(TWO_52.to_bits() as i64);
        let biased = _mm256_castsi256_pd(_mm256_or_si256(_mm256_srli_epi64::<52>(shifted), two_52));
        let k = _mm256_sub_pd(biased, _mm256_set1_pd(TWO_52 + EXPONENT_BIAS));
        let mantissa = _mm256_and_si256(shifted, _mm256_set1_epi64x(MANTISSA_BITS as i64));
        let m = _mm256_add_epi64(mantissa, _mm256_set1_epi64x(SQRT_HALF_BITS as i64));
        (k, _mm256_castsi256_pd(m))
    })
}

#[inline(always)]
fn inverse_sqrt_seed_half(x: __m256d) -> __m256d {
    register!({
        let half = _mm256_srli_epi64::<1>(_mm256_castpd_si256(x));
        _mm256_castsi256_pd(_mm256_sub_epi64(_mm256_set1_epi64x(INVERSE_SQRT_BITS as i64), half))
    })
}

#[inline(always)]
fn power_of_two_half(k: __m256d) -> __m256d {
    register!({
        let biased = _mm256_add_pd(k, _mm256_set1_pd(TWO_52 + EXPONENT_BIAS));
        _mm256_castsi256_pd(_mm256_slli_epi64::<52>(_mm256_castpd_si256(biased)))
    })
}

impl Real for Avx2 {
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        let (a, b) = (split_half(self.0), split_half(self.1));
        (Avx2(a.0, b.0), Avx2(a.1, b.1))
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        Avx2(power_of_two_half(self.0), power_of_two_half(self.1))
    }
    #[inline(always)]
    fn inverse_sqrt_seed(self) -> Self {
        Avx2(inverse_sqrt_seed_half(self.0), inverse_sqrt_seed_half(self.1))
    }
}

/// Applies an intrinsic to the one register.
macro_rules! one {
    ($pack:ident, $intrinsic:ident, $a:expr, $b:expr) => {
        $pack(register!($intrinsic($a.0, $b.0)))
    };
}

binary_operator!(one, Avx2Half, Add, add, _mm256_add_pd);
binary_operator!(one, Avx2Half, Sub, sub, _mm256_sub_pd);
binary_operator!(one, Avx2Half, Mul, mul, _mm256_mul_pd);

impl HalfPack for Avx2Half {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Avx2Half(register!(_mm256_set1_pd(x)))
    }
    #[inline(always)]
    fn load(a: &[f64; HALF]) -> Self {
        // SAFETY: the reference is to four numbers, and the load needs no alignment.
        Avx2Half(unsafe { _mm256_loadu_pd(a.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, a: &mut [f64; HALF]) {
        // SAFETY: the reference is to four numbers, and the store needs no alignment.
        unsafe { _mm256_storeu_pd(a.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn sums([a, b, c, d]: [Self; HALF]) -> Self {
        register!({
            // Lanes 0 + 1 of both, 2 + 3 of both.
            let ab = _mm256_hadd_pd(a.0, b.0);
            let cd = _mm256_hadd_pd(c.0, d.0);
            let (low, high) =
                (_mm256_permute2f128_pd::<0x20>(ab, cd), _mm256_permute2f128_pd::<0x31>(ab, cd));
            Avx2Half(_mm256_add_pd(low, high))
        })
    }
}

/// Two numbers.
#[inline(always)]
pub(super) fn load2(a: &[f64; 2]) -> __m128d {
    // SAFETY: the reference is to two numbers, and the load needs no alignment.
    unsafe { _mm_loadu_pd(a.as_ptr()) }
}

/// The numbers of `low` and, above them, of `high`.
#[inline(always)]
pub(super) fn stack(low: &[f64; 2], high: &[f64; 2]) -> __m256d {
    let (low, high) = (load2(low), load2(high));
    register!(_mm256_insertf128_pd::<1>(_mm256_castpd128_pd256(low), high))
}

#[inline(always)]
fn gather_half<const D: usize, R: RowSource<D>>(rows: &R, i: &[R::Index; WIDTH], l: usize) -> [__m256d; D] {
    let mut r = [register!(_mm256_setzero_pd()); D];
    if D == 3 {
        let [[a, za], [b, zb]] = [rows.halves(i[l]), rows.halves(i[l + 1])];
        let [[c, zc], [d, zd]] = [rows.halves(i[l + 2]), rows.halves(i[l + 3])];
        // x0 y0 x2 y2 and x1 y1 x3 y3
        let (even, odd) = (stack(a, c), stack(b, d));
        r[0] = register!(_mm256_unpacklo_pd(even, odd));
        r[1] = register!(_mm256_unpackhi_pd(even, odd));
        // z0 0 z2 0 and z1 0 z3 0
        r[2] = register!(_mm256_unpacklo_pd(stack(za, zc), stack(zb, zd)));
    } else {
        let even = stack(rows.row(i[l]), rows.row(i[l + 2]));
        let odd = stack(rows.row(i[l + 1]), rows.row(i[l + 3]));
        r[0] = register!(_mm256_unpacklo_pd(even, odd));
        r[1] = register!(_mm256_unpackhi_pd(even, odd));
    }
    r
}

/// Adds two numbers to row `index`.
#[inline(always)]
pub(super) fn add2<const D: usize>(rows: &mut RowSlice<D>, index: u16, v: __m128d) {
    let row = rows.row_mut::<2>(index);
    // SAFETY: the reference is to two numbers, and neither access needs alignment.
    unsafe { _mm_storeu_pd(row.as_mut_ptr(), _mm_add_pd(_mm_loadu_pd(row.as_ptr()), v)) }
}

/// Adds four numbers to row `index`.
#[inline(always)]
pub(super) fn add4<const D: usize>(rows: &mut RowSlice<D>, index: u16, v: __m256d) {
    let row = rows.row_mut::<4>(index);
    // SAFETY: the reference is to four numbers, and neither access needs alignment.
    unsafe { _mm256_storeu_pd(row.as_mut_ptr(), _mm256_add_pd(_mm256_loadu_pd(row.as_ptr()), v)) }
}

#[inline(always)]
fn scatter_add_half<const D: usize>(rows: &mut RowSlice<D>, i: &[u16; WIDTH], l: usize, v: [__m256d; D]) {
    // x0 y0 x2 y2 and x1 y1 x3 y3
    let even = register!(_mm256_unpacklo_pd(v[0], v[1]));
    let odd = register!(_mm256_unpackhi_pd(v[0], v[1]));
    if D == 3 {
        // z0 0 z2 0 and z1 0 z3 0
        let z_even = register!(_mm256_unpacklo_pd(v[2], _mm256_setzero_pd()));
        let z_odd = register!(_mm256_unpackhi_pd(v[2], _mm256_setzero_pd()));
        add4(rows, i[l], register!(_mm256_permute2f128_pd::<0x20>(even, z_even)));
        add4(rows, i[l + 1], register!(_mm256_permute2f128_pd::<0x20>(odd, z_odd)));
        add4(rows, i[l + 2], register!(_mm256_permute2f128_pd::<0x31>(even, z_even)));
        add4(rows, i[l + 3], register!(_mm256_permute2f128_pd::<0x31>(odd, z_odd)));
    } else {
        add2(rows, i[l], register!(_mm256_castpd256_pd128(even)));
        add2(rows, i[l + 1], register!(_mm256_castpd256_pd128(odd)));
        add2(rows, i[l + 2], register!(_mm256_extractf128_pd::<1>(even)));
        add2(rows, i[l + 3], register!(_mm256_extractf128_pd::<1>(odd)));
    }
}

/// Transposes four rows of four.
#[inline(always)]
fn transpose4([a, b, c, d]: [__m256d; 4]) -> [__m256d; 4] {
    register!({
        let (ab0, ab1) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
        let (cd0, cd1) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
        [
            _mm256_permute2f128_pd::<0x20>(ab0, cd0),
            _mm256_permute2f128_pd::<0x20>(ab1, cd1),
            _mm256_permute2f128_pd::<0x31>(ab0, cd0),
            _mm256_permute2f128_pd::<0x31>(ab1, cd1),
        ]
    })
}

impl Lanes for Avx2 {
    const PAIRS_PAY: bool = false;
    type Half = Avx2Half;

    #[inline(always)]
    fn load(a: &[f64; WIDTH]) -> Self {
        let p = a.as_ptr();
        // SAFETY: the reference is to eight numbers, and the loads need no alignment.
        unsafe { Avx2(_mm256_loadu_pd(p), _mm256_loadu_pd(p.add(4))) }
    }
    #[inline(always)]
    fn store(self, a: &mut [f64; WIDTH]) {
        let p = a.as_mut_ptr();
        // SAFETY: the reference is to eight numbers, and the stores need no alignment.
        unsafe {
            _mm256_storeu_pd(p, self.0);
            _mm256_storeu_pd(p.add(4), self.1);
        }
    }
    #[inline(always)]
    fn gather<const D: usize, R: RowSource<D>>(rows: &R, index: &[R::Index; WIDTH]) -> [Self; D] {
        let (low, high) = (gather_half(rows, index, 0), gather_half(rows, index, 4));
        let mut r = [Avx2(low[0], high[0]); D];
        for c in 1..D {
            r[c] = Avx2(low[c], high[c]);
        }
        r
    }
    #[inline(always)]
    fn scatter_add<const D: usize>(rows: &mut RowSlice<D>, index: &[u16; WIDTH], v: [Self; D]) {
        let (mut low, mut high) = ([v[0].0; D], [v[0].1; D]);
        for c in 1..D {
            (low[c], high[c]) = (v[c].0, v[c].1);
        }
        scatter_add_half(rows, index, 0, low);
        scatter_add_half(rows, index, 4, high);
    }
    #[inline(always)]
    fn transpose(v: [Self; WIDTH]) -> [Self; WIDTH] {
        let low = transpose4([v[0].0, v[1].0, v[2].0, v[3].0]);
        let next = transpose4([v[0].1, v[1].1, v[2].1, v[3].1]);
        let right = transpose4([v[4].0, v[5].0, v[6].0, v[7].0]);
        let last = transpose4([v[4].1, v[5].1, v[6].1, v[7].1]);
        let mut r = v;
        for l in 0..4 {
            r[l] = Avx2(low[l], right[l]);
            r[l + 4] = Avx2(next[l], last[l]);
        }
        r
    }
    #[inline(always)]
    fn mask_to_bits(mask: Avx2Mask) -> u8 {
        register!(_mm256_movemask_pd(mask.0) | _mm256_movemask_pd(mask.1) << 4) as u8
    }
    #[inline(always)]
    fn mask_from_bits(bits: u8) -> Avx2Mask {
        register!({
            let bits = _mm256_set1_epi64x(i64::from(bits));
            let (low, high) = (_mm256_setr_epi64x(1, 2, 4, 8), _mm256_setr_epi64x(16, 32, 64, 128));
            Avx2Mask(
                _mm256_castsi256_pd(_mm256_cmpeq_epi64(_mm256_and_si256(bits, low), low)),
                _mm256_castsi256_pd(_mm256_cmpeq_epi64(_mm256_and_si256(bits, high), high)),
            )
        })
    }
}
