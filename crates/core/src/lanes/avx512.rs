//! The pack as one AVX-512 register.
#![allow(unsafe_code)]

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Sub};

use super::avx2::{Avx2Half, add2, add4, load2};
use super::operators::{assigning_operators, register};
use super::{Lanes, RowSlice, RowSource, WIDTH};
use crate::algebra::{self, Mat};
use crate::scalar::{
    Compared, EXPONENT_BIAS, Elementary, INVERSE_SQRT_BITS, MANTISSA_BITS, Mask, Real, SPLIT_OFFSET,
    SQRT_HALF_BITS, Scalar, TWO_52,
};

/// All lanes.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(super) struct Avx512(__m512d);

/// One bit per lane.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(super) struct Avx512Mask(__mmask8);

macro_rules! binary {
    ($trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for Avx512 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                Avx512(register!($intrinsic(self.0, o.0)))
            }
        }
    };
}
binary!(Add, add, _mm512_add_pd);
binary!(Sub, sub, _mm512_sub_pd);
binary!(Mul, mul, _mm512_mul_pd);
binary!(Div, div, _mm512_div_pd);
assigning_operators!(Avx512);

impl Neg for Avx512 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Avx512(register!(_mm512_xor_pd(self.0, _mm512_set1_pd(-0.0))))
    }
}

impl BitAnd for Avx512Mask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, o: Self) -> Self {
        Avx512Mask(self.0 & o.0)
    }
}

impl BitOr for Avx512Mask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, o: Self) -> Self {
        Avx512Mask(self.0 | o.0)
    }
}

impl Mask for Avx512Mask {
    #[inline(always)]
    fn any(self) -> bool {
        self.0 != 0
    }
}

impl Compared for Avx512 {
    type Mask = Avx512Mask;

    #[inline(always)]
    fn abs(self) -> Self {
        Avx512(register!(_mm512_andnot_pd(_mm512_set1_pd(-0.0), self.0)))
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        // The instruction returns its second operand where either is NaN and where both are zero, as
        // `Scalar` asks.
        Avx512(register!(_mm512_max_pd(self.0, o.0)))
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        register!({
            let signs = _mm512_and_pd(_mm512_set1_pd(-0.0), sign.0);
            Avx512(_mm512_or_pd(_mm512_andnot_pd(_mm512_set1_pd(-0.0), self.0), signs))
        })
    }
    #[inline(always)]
    fn lt(self, o: Self) -> Avx512Mask {
        Avx512Mask(register!(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, o.0)))
    }
    #[inline(always)]
    fn select(mask: Avx512Mask, a: Self, b: Self) -> Self {
        Avx512(register!(_mm512_mask_blend_pd(mask.0, b.0, a.0)))
    }
}

impl Elementary for Avx512 {
    #[inline(always)]
    fn sqrt(self) -> Self {
        Avx512(register!(_mm512_sqrt_pd(self.0)))
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

impl Scalar for Avx512 {
    #[inline(always)]
    fn rotation_by_svd_where<const D: usize>(_: Avx512Mask, f: &Mat<Self, D>) -> Mat<Self, D> {
        /// Not inlined: the branch is rare and its code large.
        #[inline(never)]
        #[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2,fma")]
        fn outlined<const D: usize>(f: &Mat<Avx512, D>) -> Mat<Avx512, D> {
            algebra::rotation_by_svd(f)
        }
        // SAFETY: a value of this type exists, so the processor has the instructions.
        unsafe { outlined(f) }
    }
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Avx512(register!(_mm512_set1_pd(x)))
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Avx512(register!(_mm512_fmadd_pd(self.0, b.0, c.0)))
    }
}

impl Real for Avx512 {
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        register!({
            let shifted =
                _mm512_add_epi64(_mm512_castpd_si512(self.0), _mm512_set1_epi64(SPLIT_OFFSET as i64));
            let two_52 = _mm512_set1_epi64(TWO_52.to_bits() as i64);
            let biased = _mm512_castsi512_pd(_mm512_or_si512(_mm512_srli_epi64::<52>(shifted), two_52));
            let k = _mm512_sub_pd(biased, _mm512_set1_pd(TWO_52 + EXPONENT_BIAS));
            let mantissa = _mm512_and_si512(shifted, _mm512_set1_epi64(MANTISSA_BITS as i64));
            let m = _mm512_add_epi64(mantissa, _mm512_set1_epi64(SQRT_HALF_BITS as i64));
            (Avx512(k), Avx512(_mm512_castsi512_pd(m)))
        })
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        register!({
            let biased = _mm512_add_pd(self.0, _mm512_set1_pd(TWO_52 + EXPONENT_BIAS));
            Avx512(_mm512_castsi512_pd(_mm512_slli_epi64::<52>(_mm512_castpd_si512(biased))))
        })
    }
    #[inline(always)]
    fn inverse_sqrt_seed(self) -> Self {
        register!({
            let half = _mm512_srli_epi64::<1>(_mm512_castpd_si512(self.0));
            Avx512(_mm512_castsi512_pd(_mm512_sub_epi64(_mm512_set1_epi64(INVERSE_SQRT_BITS as i64), half)))
        })
    }
}

/// Four numbers of row `low` and, above them, four of row `high`.
#[inline(always)]
fn stack2<const D: usize, R: RowSource<D>>(rows: &R, low: R::Index, high: R::Index) -> __m512d {
    let (low, high) = (rows.row::<4>(low), rows.row::<4>(high));
    // SAFETY: the references are to four numbers each, and the loads need no alignment.
    let (low, high) = unsafe { (_mm256_loadu_pd(low.as_ptr()), _mm256_loadu_pd(high.as_ptr())) };
    register!(_mm512_insertf64x4::<1>(_mm512_castpd256_pd512(low), high))
}

/// Two numbers of each of the rows `i[l], i[l + 2], i[l + 4], i[l + 6]`.
#[inline(always)]
fn stack4<const D: usize, R: RowSource<D>>(rows: &R, i: &[R::Index; WIDTH], l: usize) -> __m512d {
    let (a, b) = (load2(rows.row(i[l])), load2(rows.row(i[l + 2])));
    let (c, d) = (load2(rows.row(i[l + 4])), load2(rows.row(i[l + 6])));
    register!({
        let low = _mm256_insertf128_pd::<1>(_mm256_castpd128_pd256(a), b);
        let high = _mm256_insertf128_pd::<1>(_mm256_castpd128_pd256(c), d);
        _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(low), high)
    })
}

/// Numbers 0, 1 of every four of `a`, then of `b`: `a0 a1 b0 b1 a4 a5 b4 b5`.
#[inline(always)]
fn low_halves(a: __m512d, b: __m512d) -> __m512d {
    register!(_mm512_permutex2var_pd(a, _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13), b))
}

/// Numbers 2, 3 of every four of `a`, then of `b`: `a2 a3 b2 b3 a6 a7 b6 b7`.
#[inline(always)]
fn high_halves(a: __m512d, b: __m512d) -> __m512d {
    register!(_mm512_permutex2var_pd(a, _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15), b))
}

impl Lanes for Avx512 {
    const PAIRS_PAY: bool = true;
    type Half = Avx2Half;

    #[inline(always)]
    fn load(a: &[f64; WIDTH]) -> Self {
        // SAFETY: the reference is to eight numbers, and the load needs no alignment.
        Avx512(unsafe { _mm512_loadu_pd(a.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, a: &mut [f64; WIDTH]) {
        // SAFETY: the reference is to eight numbers, and the store needs no alignment.
        unsafe { _mm512_storeu_pd(a.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn gather<const D: usize, R: RowSource<D>>(rows: &R, i: &[R::Index; WIDTH]) -> [Self; D] {
        let mut r = [Avx512::zero(); D];
        if D == 3 {
            let (a, b) = (stack2(rows, i[0], i[4]), stack2(rows, i[1], i[5]));
            let (c, d) = (stack2(rows, i[2], i[6]), stack2(rows, i[3], i[7]));
            // x0 x1 z0 z1 x4 x5 z4 z5, the same of lanes 2, 3, 6, 7, and y instead of x
            let (xz, xz2) = register!((_mm512_unpacklo_pd(a, b), _mm512_unpacklo_pd(c, d)));
            let (y, y2) = register!((_mm512_unpackhi_pd(a, b), _mm512_unpackhi_pd(c, d)));
            r[0] = Avx512(low_halves(xz, xz2));
            r[1] = Avx512(low_halves(y, y2));
            r[2] = Avx512(high_halves(xz, xz2));
        } else {
            let (even, odd) = (stack4(rows, i, 0), stack4(rows, i, 1));
            r[0] = Avx512(register!(_mm512_unpacklo_pd(even, odd)));
            r[1] = Avx512(register!(_mm512_unpackhi_pd(even, odd)));
        }
        r
    }
    #[inline(always)]
    fn scatter_add<const D: usize>(rows: &mut RowSlice<D>, i: &[u16; WIDTH], v: [Self; D]) {
        // x0 y0 x2 y2 x4 y4 x6 y6 and x1 y1 x3 y3 x5 y5 x7 y7
        let even = register!(_mm512_unpacklo_pd(v[0].0, v[1].0));
        let odd = register!(_mm512_unpackhi_pd(v[0].0, v[1].0));
        if D == 3 {
            let zero = register!(_mm512_setzero_pd());
            let z_even = register!(_mm512_unpacklo_pd(v[2].0, zero));
            let z_odd = register!(_mm512_unpackhi_pd(v[2].0, zero));
            // Rows 0 and 4, 1 and 5, 2 and 6, 3 and 7.
            let (a, b) = (low_halves(even, z_even), low_halves(odd, z_odd));
            let (c, d) = (high_halves(even, z_even), high_halves(odd, z_odd));
            add4(rows, i[0], register!(_mm512_castpd512_pd256(a)));
            add4(rows, i[1], register!(_mm512_castpd512_pd256(b)));
            add4(rows, i[2], register!(_mm512_castpd512_pd256(c)));
            add4(rows, i[3], register!(_mm512_castpd512_pd256(d)));
            add4(rows, i[4], register!(_mm512_extractf64x4_pd::<1>(a)));
            add4(rows, i[5], register!(_mm512_extractf64x4_pd::<1>(b)));
            add4(rows, i[6], register!(_mm512_extractf64x4_pd::<1>(c)));
            add4(rows, i[7], register!(_mm512_extractf64x4_pd::<1>(d)));
        } else {
            add2(rows, i[0], register!(_mm512_castpd512_pd128(even)));
            add2(rows, i[1], register!(_mm512_castpd512_pd128(odd)));
            add2(rows, i[2], register!(_mm512_extractf64x2_pd::<1>(even)));
            add2(rows, i[3], register!(_mm512_extractf64x2_pd::<1>(odd)));
            add2(rows, i[4], register!(_mm512_extractf64x2_pd::<2>(even)));
            add2(rows, i[5], register!(_mm512_extractf64x2_pd::<2>(odd)));
            add2(rows, i[6], register!(_mm512_extractf64x2_pd::<3>(even)));
            add2(rows, i[7], register!(_mm512_extractf64x2_pd::<3>(odd)));
        }
    }
    #[inline(always)]
    fn load_interleaved<const D: usize>(rows: &[[f64; D]; WIDTH]) -> [Self; D] {
        let numbers = rows.as_flattened().as_chunks::<WIDTH>().0;
        let mut r = [Avx512::zero(); D];
        let (a, b) = (Self::load(&numbers[0]).0, Self::load(&numbers[1]).0);
        if D == 3 {
            // x0 y0 z0 x1 y1 z1 x2 y2 | z2 x3 y3 z3 x4 y4 z4 x5 | y5 z5 x6 y6 z6 x7 y7 z7
            let c = Self::load(&numbers[2]).0;
            register!({
                let x = _mm512_permutex2var_pd(a, _mm512_setr_epi64(0, 3, 6, 9, 12, 15, 0, 0), b);
                let y = _mm512_permutex2var_pd(a, _mm512_setr_epi64(1, 4, 7, 10, 13, 0, 0, 0), b);
                let z = _mm512_permutex2var_pd(a, _mm512_setr_epi64(2, 5, 8, 11, 14, 0, 0, 0), b);
                r[0] = Avx512(_mm512_permutex2var_pd(x, _mm512_setr_epi64(0, 1, 2, 3, 4, 5, 10, 13), c));
                r[1] = Avx512(_mm512_permutex2var_pd(y, _mm512_setr_epi64(0, 1, 2, 3, 4, 8, 11, 14), c));
                r[2] = Avx512(_mm512_permutex2var_pd(z, _mm512_setr_epi64(0, 1, 2, 3, 4, 9, 12, 15), c));
            });
        } else {
            register!({
                let even = _mm512_setr_epi64(0, 2, 4, 6, 8, 10, 12, 14);
                let odd = _mm512_setr_epi64(1, 3, 5, 7, 9, 11, 13, 15);
                r[0] = Avx512(_mm512_permutex2var_pd(a, even, b));
                r[1] = Avx512(_mm512_permutex2var_pd(a, odd, b));
            });
        }
        r
    }
    #[inline(always)]
    fn store_interleaved<const D: usize>(v: [Self; D], rows: &mut [[f64; D]; WIDTH]) {
        let numbers = rows.as_flattened_mut().as_chunks_mut::<WIDTH>().0;
        let (x, y) = (v[0].0, v[1].0);
        if D == 3 {
            let z = v[2].0;
            let (a, b, c) = register!({
                let a = _mm512_permutex2var_pd(x, _mm512_setr_epi64(0, 8, 0, 1, 9, 0, 2, 10), y);
                let b = _mm512_permutex2var_pd(x, _mm512_setr_epi64(0, 3, 11, 0, 4, 12, 0, 5), y);
                let c = _mm512_permutex2var_pd(x, _mm512_setr_epi64(13, 0, 6, 14, 0, 7, 15, 0), y);
                (
                    _mm512_permutex2var_pd(a, _mm512_setr_epi64(0, 1, 8, 3, 4, 9, 6, 7), z),
                    _mm512_permutex2var_pd(b, _mm512_setr_epi64(10, 1, 2, 11, 4, 5, 12, 7), z),
                    _mm512_permutex2var_pd(c, _mm512_setr_epi64(0, 13, 2, 3, 14, 5, 6, 15), z),
                )
            });
            Avx512(a).store(&mut numbers[0]);
            Avx512(b).store(&mut numbers[1]);
            Avx512(c).store(&mut numbers[2]);
        } else {
            let (a, b) = register!((
                _mm512_permutex2var_pd(x, _mm512_setr_epi64(0, 8, 1, 9, 2, 10, 3, 11), y),
                _mm512_permutex2var_pd(x, _mm512_setr_epi64(4, 12, 5, 13, 6, 14, 7, 15), y),
            ));
            Avx512(a).store(&mut numbers[0]);
            Avx512(b).store(&mut numbers[1]);
        }
    }
    #[inline(always)]
    fn transpose(v: [Self; WIDTH]) -> [Self; WIDTH] {
        let mut r = v;
        for odd in 0..2 {
            // Numbers `odd`, `odd + 2`, ... of rows 0 and 1, of rows 2 and 3, and so on, in halves of a
            // quarter.
            let pair = |i: usize| {
                let (a, b) = (v[i].0, v[i + 1].0);
                if odd == 0 {
                    register!(_mm512_unpacklo_pd(a, b))
                } else {
                    register!(_mm512_unpackhi_pd(a, b))
                }
            };
            let (a, b, c, d) = (pair(0), pair(2), pair(4), pair(6));
            let (ab0, ab2) =
                register!((_mm512_shuffle_f64x2::<0x88>(a, b), _mm512_shuffle_f64x2::<0xdd>(a, b)));
            let (cd0, cd2) =
                register!((_mm512_shuffle_f64x2::<0x88>(c, d), _mm512_shuffle_f64x2::<0xdd>(c, d)));
            r[odd] = Avx512(register!(_mm512_shuffle_f64x2::<0x88>(ab0, cd0)));
            r[odd + 2] = Avx512(register!(_mm512_shuffle_f64x2::<0x88>(ab2, cd2)));
            r[odd + 4] = Avx512(register!(_mm512_shuffle_f64x2::<0xdd>(ab0, cd0)));
            r[odd + 6] = Avx512(register!(_mm512_shuffle_f64x2::<0xdd>(ab2, cd2)));
        }
        r
    }
    #[inline(always)]
    fn mask_to_bits(mask: Avx512Mask) -> u8 {
        mask.0
    }
    #[inline(always)]
    fn mask_from_bits(bits: u8) -> Avx512Mask {
        Avx512Mask(bits)
    }
}
