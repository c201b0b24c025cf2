//! Logarithm, exponential and power, written once for `f64` and for packs: bit-identical everywhere.

// The constants stand as fdlibm prints them.
#![allow(clippy::excessive_precision)]

use crate::scalar::{Real, Scalar};

/// `ln 2` in two parts; the first has 21 trailing zero bits, so that its product with an exponent is exact.
const LN_2_HIGH: f64 = 6.931_471_803_691_238_164_90e-01;
const LN_2_LOW: f64 = 1.908_214_929_270_587_700_02e-10;

/// Natural logarithm, at most 1 ulp from the exact value.
///
/// NaN for negative arguments and NaN, `-inf` at zero, `inf` at `inf`. The method is fdlibm's `e_log.c`:
/// with `x = 2^k (1 + f)` and `s = f / (2 + f)`, `ln(1 + f) = f - f^2/2 + s (f^2/2 + R(s^2))` where `R` is a
/// minimax polynomial. Cases are resolved by selection, not by branches.
#[inline(always)]
pub fn ln<R: Real>(x: R) -> R {
    let c = R::splat;
    let subnormal = x.lt(c(f64::MIN_POSITIVE));
    // 2^54 makes every subnormal normal.
    let (k, m) = R::select(subnormal, x * c(18_014_398_509_481_984.0), x).split();
    let k = R::select(subnormal, k - c(54.0), k);

    let f = m - R::one();
    let s = f / (f + c(2.0));
    let z = s * s;
    let w = z * z;
    let odd = w.mul_add(
        w.mul_add(c(1.531_383_769_920_937_332e-01), c(2.222_219_843_214_978_396e-01)),
        c(3.999_999_999_940_941_908e-01),
    );
    let even = w.mul_add(
        w.mul_add(
            w.mul_add(c(1.479_819_860_511_658_591e-01), c(1.818_357_216_161_805_012e-01)),
            c(2.857_142_874_366_239_149e-01),
        ),
        c(6.666_666_666_666_735_130e-01),
    );
    let r = z.mul_add(even, w * odd);
    let half_square = c(0.5) * f * f;
    let low = s.mul_add(half_square + r, k * c(LN_2_LOW));
    let y = k.mul_add(c(LN_2_HIGH), f - (half_square - low));

    let undefined = R::select(x.lt(R::zero()), c(f64::NAN), c(f64::NEG_INFINITY));
    let y = R::select(R::zero().lt(x), y, undefined);
    // Infinity and NaN are their own logarithms.
    R::select(x.lt(c(f64::INFINITY)), y, x)
}

/// Exponential, at most 1 ulp from the exact value where the result is normal.
///
/// `inf` above 709.79, subnormal below -708.4, 0 below -745.2, NaN for NaN. The method is fdlibm's
/// `e_exp.c`: with `x = k ln 2 + r` and `|r| <= ln(2)/2`, `e^r = 1 + r + r c(r) / (2 - c(r))` where `c` is a
/// minimax polynomial.
#[inline(always)]
pub fn exp<R: Real>(x: R) -> R {
    let c = R::splat;
    // Adding 1.5 2^52 rounds to the nearest integer.
    let rounder = c(1.5 * crate::scalar::TWO_52);
    let k = x.mul_add(c(std::f64::consts::LOG2_E), rounder) - rounder;
    let high = k.mul_add(c(-LN_2_HIGH), x);
    let low = k * c(LN_2_LOW);
    let r = high - low;
    let t = r * r;
    let p = t.mul_add(c(4.138_136_797_057_238_460_39e-08), c(-1.653_390_220_546_525_153_90e-06));
    let p = t.mul_add(p, c(6.613_756_321_437_934_361_17e-05));
    let p = t.mul_add(p, c(-2.777_777_777_701_559_338_42e-03));
    let p = t.mul_add(p, c(1.666_666_666_666_660_190_37e-01));
    let q = r - t * p;
    let y = R::one() - ((low - (r * q) / (c(2.0) - q)) - high);

    // 2^k in two factors, because k itself may exceed the range of the exponent.
    let half = k.mul_add(c(0.5), rounder) - rounder;
    let y = y * half.power_of_two() * (k - half).power_of_two();
    let y = R::select(x.lt(c(-746.0)), R::zero(), y);
    // The sum is infinity for large x and NaN for NaN.
    R::select(x.lt(c(710.0)), y, x + c(f64::INFINITY))
}

/// `x^a = e^(a ln x)` for positive `x`.
///
/// The rounding of `a ln x` is magnified by its size: the relative error is below `(1 + |a ln x|) 2^-52`, so
/// a few ulp for the stretches of a deformed body and about 700 ulp at the ends of the range. NaN for
/// negative `x`, also where `a` is an integer; 0 or `inf` at `x = 0`.
#[inline(always)]
pub fn powf<R: Real>(x: R, a: R) -> R {
    x.powf(a)
}

/// `sqrt(x^2 + y^2)`, at most 1 ulp from the exact value; infinite if either number is, else NaN if
/// either is.
///
/// That of the C library differs between its versions. The method is algorithm 5 of Borges 2020, *An improved
/// algorithm for hypot(a,b)*, ACM TOMS 47(1): the root, corrected by the error of its square.
pub fn hypot(x: f64, y: f64) -> f64 {
    let scale = 2f64.powi(600);
    let (x, y) = (x.abs(), y.abs());
    if x.is_infinite() || y.is_infinite() {
        return f64::INFINITY;
    }
    let (long, short) = if x < y { (y, x) } else { (x, y) };
    // The shorter side is half an ulp of the longer one at most, or there is a NaN.
    if short <= long * 2f64.powi(-54) || short.is_nan() || long.is_nan() {
        return long + short;
    }
    if long > 2f64.powi(511) {
        return corrected_root(long / scale, short / scale) * scale;
    }
    if short < 2f64.powi(-459) {
        return corrected_root(long * scale, short * scale) / scale;
    }
    corrected_root(long, short)
}

/// `sqrt(long^2 + short^2)` where no square overflows or underflows.
fn corrected_root(long: f64, short: f64) -> f64 {
    let root = (long * long + short * short).sqrt();
    let error = if root <= 2.0 * short {
        let beyond = root - short;
        long * (2.0 * beyond - long) + (beyond - 2.0 * (long - short)) * beyond
    } else {
        let beyond = root - long;
        2.0 * beyond * (long - 2.0 * short) + ((4.0 * beyond - short) * short + beyond * beyond)
    };
    root - error / (2.0 * root)
}

/// The angle of the point `(x, y)`, in `(-pi, pi]`, to about 2 ulp; 0 at the origin.
///
/// NaN for NaN. The method is fdlibm's `s_atan.c` on the quotient of the smaller by the larger coordinate:
/// below 7/16 the polynomial itself, else of the angle from `atan(1/2)` or `pi/4`.
#[inline(always)]
pub fn atan2<S: Scalar>(y: S, x: S) -> S {
    let c = S::splat;
    let (ax, ay) = (x.abs(), y.abs());
    let steep = ax.lt(ay);
    let (low, high) = (S::select(steep, ax, ay), S::select(steep, ay, ax));
    let (middle, large) = ((c(0.4375) * high).lt(low), (c(0.6875) * high).lt(low));
    let numerator = S::select(middle, c(2.0).mul_add(low, -high), low);
    let denominator = S::select(middle, c(2.0).mul_add(high, low), high);
    let numerator = S::select(large, low - high, numerator);
    let denominator = S::select(large, low + high, denominator);
    // The origin has an angle of zero by the sum.
    let t = numerator / (denominator + c(f64::MIN_POSITIVE));
    let offset = S::select(middle, c(4.636_476_090_008_060_935_15e-01), S::zero());
    let offset = S::select(large, c(std::f64::consts::FRAC_PI_4), offset);
    let rest = S::select(middle, c(2.269_877_745_296_168_709_24e-17), S::zero());
    let rest = S::select(large, c(3.061_616_997_868_383_017_93e-17), rest);
    let z = t * t;
    let p = z.mul_add(c(1.628_582_011_536_578_236_23e-02), c(-3.653_157_274_421_691_552_70e-02));
    let p = z.mul_add(p, c(4.976_877_994_615_932_360_17e-02));
    let p = z.mul_add(p, c(-5.833_570_133_790_573_486_45e-02));
    let p = z.mul_add(p, c(6.661_073_137_387_531_206_69e-02));
    let p = z.mul_add(p, c(-7.691_876_205_044_829_994_95e-02));
    let p = z.mul_add(p, c(9.090_887_133_436_506_561_96e-02));
    let p = z.mul_add(p, c(-1.111_111_040_546_235_578_80e-01));
    let p = z.mul_add(p, c(1.428_571_427_250_346_637_11e-01));
    let p = z.mul_add(p, c(-1.999_999_999_987_648_324_76e-01));
    let p = z.mul_add(p, c(3.333_333_333_333_293_180_27e-01));
    let angle = offset + (t - (t * (z * p) - rest));
    // From the other axis, and from behind; `pi` and `pi/2` in two parts.
    let angle = S::select(
        steep,
        c(std::f64::consts::FRAC_PI_2) - (angle - c(6.123_233_995_736_766_035_87e-17)),
        angle,
    );
    let behind = c(std::f64::consts::PI) - (angle - c(1.224_646_799_147_353_207_17e-16));
    S::select(x.lt(S::zero()), behind, angle).copysign(y)
}
