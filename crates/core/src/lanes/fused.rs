//! Fused multiply-add out of plain operations, for processors without one.
//!
//! WebAssembly has no fused multiply-add, and one in integers takes longer than all the rest of a kernel.
//! This one takes 41 operations on pairs of numbers, none of them a branch, and gives the same bits as the
//! fused one of a processor.
//!
//! # Method
//! The algorithm is that of Boldo and Melquiond 2008, *Emulation of a FMA and correctly rounded sums: proved
//! algorithms using rounding to odd*, IEEE Transactions on Computers 57(4), with one sum less:
//! 1. `p + e = a b` exactly: Dekker's product, with halves of 26 bits;
//! 2. `s + t = p + c` exactly, and `z + w = t + e` exactly: Knuth's sums;
//! 3. `z` rounded to odd: where `w` is not zero, the neighbour of `z` on the side of `w`, unless `z` is odd;
//! 4. the result is `s + z`, rounded once.
//!
//! The last step rounds correctly. Where `t = 0`, `w = 0` and `z = e` is exact. Elsewhere the sum `p + c` was
//! inexact, so by Sterbenz' lemma it did not cancel: `|s| >= max(|p|, |c|) / 2`, thus `|z|` is at most two
//! units in the last place of `s`. Every number half way between two results is then even as a `z`, and a `z`
//! rounded to odd lies on the same side of it as the exact one.
//!
//! # Where it does not hold
//! An intermediate number may overflow although the result does not; then a difference of infinities makes
//! the result NaN. A product below `2^-960` may have bits below the smallest number. Both are seen in the
//! numbers, and [`slow`] computes them in integers.

/// Half a unit in the 26th place of a mantissa.
const HALF_UNIT: u64 = 1 << 26;
/// The first 26 places, the exponent and the sign.
const FIRST_PLACES: u64 = !((1 << 27) - 1);
const SIGN: u64 = 1 << 63;
/// `2^-960`: products of this size at least are exact in two numbers.
const SMALLEST: f64 = f64::from_bits((1023 - 960) << 52);

/// `a b + c` with a single rounding.
#[inline]
pub fn mul_add(a: f64, b: f64, c: f64) -> f64 {
    let (sum, product) = sum_and_product(a, b, c);
    if is_sound(a, b, sum, product) { sum } else { slow(a, b, c) }
}

/// True if the sum has been computed without an overflow, and the product without an underflow.
#[inline(always)]
fn is_sound(a: f64, b: f64, sum: f64, product: f64) -> bool {
    sum.is_finite() & ((product.abs() >= SMALLEST) | (a == 0.0) | (b == 0.0))
}

/// In integers.
#[cold]
#[inline(never)]
pub(super) fn slow(a: f64, b: f64, c: f64) -> f64 {
    libm::fma(a, b, c)
}

#[inline(always)]
fn upper_half(a: f64) -> f64 {
    f64::from_bits(a.to_bits().wrapping_add(HALF_UNIT) & FIRST_PLACES)
}

/// The rounded sum, and its error.
#[inline(always)]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

#[inline(always)]
fn sum_and_product(a: f64, b: f64, c: f64) -> (f64, f64) {
    let product = a * b;
    let (a_high, b_high) = (upper_half(a), upper_half(b));
    let (a_low, b_low) = (a - a_high, b - b_high);
    let error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
    let (s, t) = two_sum(product, c);
    let (z, w) = two_sum(t, error);
    let inexact = u64::from(w != 0.0).wrapping_neg();
    let is_opposite = (z.to_bits() ^ w.to_bits()) >> 63;
    // One unit less on the other side; then odd, whichever side it is.
    let odd = z.to_bits().wrapping_sub(is_opposite & inexact) | (1 & inexact);
    let sum = s + f64::from_bits(odd);
    // The sum of a negative zero and `z = 0` is to stay negative.
    (f64::from_bits(sum.to_bits() | (s.to_bits() & SIGN)), product)
}

/// `a[l] b[l] + c[l]` in every lane, on pairs of lanes.
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
#[inline(always)]
pub(super) fn mul_add_packs(
    a: &[f64; super::WIDTH],
    b: &[f64; super::WIDTH],
    c: &[f64; super::WIDTH],
) -> [f64; super::WIDTH] {
    let mut r = [0.0; super::WIDTH];
    let mut check = pairs::SoundnessCheck::new();
    for i in 0..super::WIDTH / 2 {
        let pair = |x: &[f64; super::WIDTH]| pairs::load(x.as_chunks().0, i);
        let (sum, product) = pairs::sum_and_product(pair(a), pair(b), pair(c));
        check.take(sum, product);
        r.as_chunks_mut().0[i] = pairs::store(sum);
    }
    if !check.is_passed() {
        for l in 0..super::WIDTH {
            r[l] = mul_add(a[l], b[l], c[l]);
        }
    }
    r
}

/// Operations of `sum_and_product` on pairs of numbers: compilers do not find them.
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod pairs {
    use core::arch::wasm32::{
        f64x2, f64x2_abs, f64x2_add, f64x2_eq, f64x2_extract_lane, f64x2_ge, f64x2_mul, f64x2_ne, f64x2_pmin,
        f64x2_splat, f64x2_sub, i64x2_add, i64x2_all_true, i64x2_lt, i64x2_splat, v128, v128_and, v128_or,
        v128_xor,
    };

    use super::{FIRST_PLACES, HALF_UNIT, SIGN, SMALLEST};

    #[inline(always)]
    pub(super) fn load(pairs: &[[f64; 2]], i: usize) -> v128 {
        f64x2(pairs[i][0], pairs[i][1])
    }

    #[inline(always)]
    pub(super) fn store(pair: v128) -> [f64; 2] {
        [f64x2_extract_lane::<0>(pair), f64x2_extract_lane::<1>(pair)]
    }

    /// Condition of [`is_sound`](super::is_sound) for several pairs.
    pub(super) struct SoundnessCheck {
        smallest: v128,
        nothing: v128,
    }

    impl SoundnessCheck {
        #[inline(always)]
        pub(super) fn new() -> Self {
            SoundnessCheck { smallest: f64x2_splat(f64::INFINITY), nothing: f64x2_splat(0.0) }
        }

        #[inline(always)]
        pub(super) fn take(&mut self, sum: v128, product: v128) {
            self.smallest = f64x2_pmin(self.smallest, f64x2_abs(product));
            self.nothing = f64x2_add(self.nothing, f64x2_sub(sum, sum));
        }

        /// False also for products with a zero, which need another look.
        #[inline(always)]
        pub(super) fn is_passed(&self) -> bool {
            let is_large = f64x2_ge(self.smallest, f64x2_splat(SMALLEST));
            i64x2_all_true(v128_and(is_large, f64x2_eq(self.nothing, f64x2_splat(0.0))))
        }
    }

    #[inline(always)]
    fn upper_half(a: v128) -> v128 {
        v128_and(i64x2_add(a, i64x2_splat(HALF_UNIT as i64)), i64x2_splat(FIRST_PLACES as i64))
    }

    #[inline(always)]
    fn two_sum(a: v128, b: v128) -> (v128, v128) {
        let sum = f64x2_add(a, b);
        let of_b = f64x2_sub(sum, a);
        (sum, f64x2_add(f64x2_sub(a, f64x2_sub(sum, of_b)), f64x2_sub(b, of_b)))
    }

    #[inline(always)]
    pub(super) fn sum_and_product(a: v128, b: v128, c: v128) -> (v128, v128) {
        let product = f64x2_mul(a, b);
        let (a_high, b_high) = (upper_half(a), upper_half(b));
        let (a_low, b_low) = (f64x2_sub(a, a_high), f64x2_sub(b, b_high));
        let error = f64x2_sub(f64x2_mul(a_high, b_high), product);
        let error = f64x2_add(f64x2_add(error, f64x2_mul(a_high, b_low)), f64x2_mul(a_low, b_high));
        let error = f64x2_add(error, f64x2_mul(a_low, b_low));
        let (s, t) = two_sum(product, c);
        let (z, w) = two_sum(t, error);
        let inexact = f64x2_ne(w, f64x2_splat(0.0));
        // All ones, which is -1.
        let is_opposite = i64x2_lt(v128_xor(z, w), i64x2_splat(0));
        let lower = i64x2_add(z, v128_and(is_opposite, inexact));
        let sum = f64x2_add(s, v128_or(lower, v128_and(i64x2_splat(1), inexact)));
        (v128_or(sum, v128_and(s, i64x2_splat(SIGN as i64))), product)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Marsaglia's generator.
    struct Random(u64);

    impl Random {
        fn bits(&mut self) -> u64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            self.0
        }

        /// A number with a binary exponent from `-range` to `range` and its last `zeros` places zero.
        fn number(&mut self, range: u64, zeros: u64) -> f64 {
            let mantissa = self.bits() & (SIGN | ((1 << 52) - 1)) & !((1 << zeros) - 1);
            f64::from_bits(mantissa | (1023 - range + self.bits() % (2 * range + 1)) << 52)
        }

        fn below(&mut self, count: u64) -> u64 {
            self.bits() % count
        }
    }

    fn special(random: &mut Random) -> f64 {
        let numbers = [
            0.0,
            1.0,
            f64::from_bits(1),
            f64::from_bits((1 << 52) - 1),
            f64::MIN_POSITIVE,
            f64::MAX,
            f64::INFINITY,
            f64::NAN,
            f64::EPSILON,
            1.0 + f64::EPSILON,
            1.0 - 0.5 * f64::EPSILON,
            SMALLEST,
            2f64.powi(1000),
            2f64.powi(-537),
            f64::from_bits(random.bits()),
        ];
        let number = numbers[random.below(numbers.len() as u64) as usize];
        if random.below(2) == 0 { -number } else { number }
    }

    /// Operands of the kinds that can go wrong.
    fn operands(random: &mut Random, kind: u64) -> [f64; 3] {
        let (zeros, further, last) = (random.below(53), random.below(53), random.below(53));
        match kind {
            // Any bits: overflows, NaN, subnormal numbers.
            0 => [(); 3].map(|()| f64::from_bits(random.bits())),
            // Numbers of like size, and of different sizes.
            1 => [random.number(2, 0), random.number(2, 0), random.number(4, 0)],
            2 => [random.number(50, 0), random.number(50, 0), random.number(110, 0)],
            3 => [random.number(500, 0), random.number(500, 0), random.number(1000, 0)],
            // Few places: results half way between two numbers, and exact ones.
            4 => [random.number(2, zeros), random.number(2, further), random.number(110, last)],
            5 => [special(random), special(random), special(random)],
            // Cancellation, of all but some places.
            _ => {
                let (a, b) = (random.number(30, 0), random.number(30, zeros));
                let near = (-(a * b)).to_bits().wrapping_add(random.below(9)).wrapping_sub(4);
                [a, b, f64::from_bits(near) * 2f64.powi(random.below(7) as i32 - 3)]
            }
        }
    }

    /// A processor's fused multiply-add, or that of the C library.
    #[test]
    fn every_result_is_that_of_the_fused_operation() {
        let mut random = Random(0x9e37_79b9_7f4a_7c15);
        let mut unsound = 0;
        for i in 0..20_000_000 {
            let [a, b, c] = operands(&mut random, i % 7);
            let (expected, found) = (f64::mul_add(a, b, c), mul_add(a, b, c));
            let is_same = expected.to_bits() == found.to_bits() || (expected.is_nan() && found.is_nan());
            assert!(is_same, "{a:e} * {b:e} + {c:e} is {expected:e}, not {found:e}");
            let (sum, product) = sum_and_product(a, b, c);
            unsound += u64::from(!is_sound(a, b, sum, product));
        }
        // Both ways have been taken.
        assert!((1_000_000..10_000_000).contains(&unsound), "{unsound}");
    }
}
