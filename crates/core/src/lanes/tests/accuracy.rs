//! Logarithm, exponential and power against twice the precision.

use super::*;
use crate::scalar::Elementary;

/// A number in twice the precision, `self.0 + self.1`.
#[derive(Clone, Copy)]
struct Double(f64, f64);

impl Double {
    fn sum(a: f64, b: f64) -> Double {
        let s = a + b;
        let t = s - a;
        Double(s, (a - (s - t)) + (b - t))
    }
    fn add(self, o: Double) -> Double {
        let s = Double::sum(self.0, o.0);
        Double::sum(s.0, s.1 + (self.1 + o.1))
    }
    fn mul(self, o: Double) -> Double {
        let p = self.0 * o.0;
        let e = f64::mul_add(self.0, o.0, -p);
        Double::sum(p, e + (self.0 * o.1 + self.1 * o.0))
    }
    fn scale(self, s: f64) -> Double {
        self.mul(Double(s, 0.0))
    }
    /// `e^self - 1` for `|self| <= 1`: Taylor's series at `self / 256`, then eight times `(1 + y)^2 - 1 = 2
    /// y + y^2`.
    fn exp_minus_1(self) -> Double {
        let x = self.scale(1.0 / 256.0);
        let mut y = Double(0.0, 0.0);
        for n in (1..=12).rev() {
            // y <- x/n (1 + y), with 1/n corrected to twice the precision
            let inverse = 1.0 / f64::from(n);
            let inverse = Double(inverse, f64::mul_add(-f64::from(n), inverse, 1.0) / f64::from(n));
            y = x.mul(inverse).mul(Double(1.0, 0.0).add(y));
        }
        for _ in 0..8 {
            y = y.scale(2.0).add(y.mul(y));
        }
        y
    }
}

/// `ln 2`, from its decimal expansion.
const LN_2: Double = Double(std::f64::consts::LN_2, 2.319_046_813_846_299_6e-17);

/// `ln x` by one step of Newton's method, of third order, from an approximation `y`.
fn ln_from(x: f64, y: f64) -> Double {
    let (k, m) = Real::split(x);
    let y = Double(y, 0.0).add(LN_2.scale(-k));
    // m e^-y - 1 = (m - 1) + m (e^-y - 1): no cancellation where m is near 1.
    let e = Double(m - 1.0, 0.0).add(Double(-y.0, -y.1).exp_minus_1().scale(m));
    let correction = e.add(e.mul(e).scale(-0.5));
    LN_2.scale(k).add(y).add(correction)
}

/// `2^k`, without the standard library, whose last bits Miri varies.
fn two_to(k: i32) -> f64 {
    f64::from(k).power_of_two()
}

/// `e^x` as a factor and a power of two.
fn exp_of(x: f64) -> (Double, i32) {
    let k = (x * std::f64::consts::LOG2_E).round();
    let r = Double(x, 0.0).add(LN_2.scale(-k));
    (Double(1.0, 0.0).add(r.exp_minus_1()), k as i32)
}

/// The distance of `x` from `exact` in units of the last place of `exact`.
fn ulps(x: f64, exact: Double) -> f64 {
    let unit = exact.0.abs().next_up() - exact.0.abs();
    (((x - exact.0) - exact.1) / unit).abs()
}

const SAMPLES: usize = if cfg!(miri) { 50 } else { 20_000 };

#[test]
fn the_reference_agrees_with_known_digits() {
    // From an arbitrary-precision library: ln 10 and e, rounded and remainder.
    let ln_10 = ln_from(10.0, std::f64::consts::LN_10);
    assert_eq!(ln_10.0, std::f64::consts::LN_10);
    assert!((ln_10.1 - -2.170_756_223_382_249_4e-16).abs() < 1e-30);
    let (e, k) = exp_of(1.0);
    let e = e.scale(two_to(k));
    assert_eq!(e.0, std::f64::consts::E);
    assert!((e.1 - 1.445_646_891_729_250_2e-16).abs() < 1e-30);
}

#[test]
fn ln_is_within_one_ulp() {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    for range in 0..5 {
        let mut worst: f64 = 0.0;
        for _ in 0..SAMPLES {
            let u = uniform(&mut random);
            let x = match range {
                0 => 0.3 + 3.0 * u,
                1 => 1.0 + (2.0 * u - 1.0) * 10f64.powf(-16.0 * uniform(&mut random)),
                2 => 10f64.powf(600.0 * u - 300.0),
                3 => 10f64.powf(6.0 * u - 3.0),
                // Subnormal.
                _ => f64::MIN_POSITIVE * 10f64.powf(-12.0 * u),
            };
            let y = Elementary::ln(x);
            worst = worst.max(if x == 1.0 { y.abs() } else { ulps(y, reference_ln(x, y)) });
        }
        assert!(worst < 0.9, "range {range}: {worst} ulp");
    }
}

/// `ln x`, also of subnormal numbers.
fn reference_ln(x: f64, y: f64) -> Double {
    if x < f64::MIN_POSITIVE {
        let shift = LN_2.scale(54.0);
        let r = ln_from(x * two_to(54), y + shift.0);
        return r.add(shift.scale(-1.0));
    }
    ln_from(x, y)
}

#[test]
fn exp_is_within_one_ulp() {
    let mut random = Pcg64Mcg::seed_from_u64(4);
    for range in [0.4, 3.0, 50.0, 708.0] {
        let mut worst: f64 = 0.0;
        for _ in 0..SAMPLES {
            let x = range * (2.0 * uniform(&mut random) - 1.0);
            let (exact, k) = exp_of(x);
            // Both divided by 2^k, in two steps because 2^-k may overflow.
            let y = Elementary::exp(x) * two_to(-k / 2) * two_to(-k + k / 2);
            worst = worst.max(ulps(y, exact));
        }
        assert!(worst < 1.0, "up to {range}: {worst} ulp");
    }
}

#[test]
fn powf_has_the_documented_error() {
    let mut random = Pcg64Mcg::seed_from_u64(6);
    for _ in 0..SAMPLES {
        let (x, a) = (10f64.powf(2.0 * uniform(&mut random) - 1.0), 40.0 * uniform(&mut random) - 20.0);
        let y = Elementary::powf(x, a);
        let log = ln_from(x, Elementary::ln(x)).scale(a);
        // e^(high + low) = e^high (1 + low)
        let (exact, k) = exp_of(log.0);
        let exact = exact.add(exact.scale(log.1)).scale(two_to(k));
        let error = ((y - exact.0) - exact.1).abs() / exact.0;
        assert!(error <= (1.0 + log.0.abs()) * f64::EPSILON, "{x}^{a}: relative error {error:e}");
    }
}

/// The exact root is that of `x^2 + y^2` in twice the precision.
#[test]
fn hypot_is_within_one_ulp() {
    let mut worst = 0.0_f64;
    for i in 0..100_000 {
        let x = 1.0 + f64::from(i) * 1.1e-5;
        let y = x * (f64::from(i % 997) * 0.37).exp2() * 2f64.powi(-370);
        let square = Double(x, 0.0).mul(Double(x, 0.0)).add(Double(y, 0.0).mul(Double(y, 0.0)));
        let root = square.0.sqrt();
        let rest = square.add(Double(root, 0.0).mul(Double(-root, 0.0)));
        worst = worst.max(ulps(hypot(x, y), Double::sum(root, 0.5 * (rest.0 + rest.1) / root)));
        assert_eq!(hypot(y, -x).to_bits(), hypot(x, y).to_bits());
        // Where squares overflow or underflow.
        for scale in [2f64.powi(700), 2f64.powi(-700)] {
            assert_eq!(hypot(x * scale, x * scale).to_bits(), (hypot(x, x) * scale).to_bits());
        }
    }
    assert!(worst <= 1.0, "{worst}");
    assert_eq!(hypot(3.0, -4.0), 5.0);
    assert_eq!(hypot(f64::NAN, f64::NEG_INFINITY), f64::INFINITY);
    assert!(hypot(0.0, f64::NAN).is_nan());
    assert_eq!((hypot(0.0, 0.0), hypot(5e-324, 0.0), hypot(f64::MAX, 1.0)), (0.0, 5e-324, f64::MAX));
}

#[test]
fn the_limits_are_right() {
    let ln = |x: f64| Elementary::ln(x);
    let exp = |x: f64| Elementary::exp(x);
    assert_eq!(ln(1.0).to_bits(), 0);
    assert_eq!(ln(0.0), f64::NEG_INFINITY);
    assert_eq!(ln(-0.0), f64::NEG_INFINITY);
    assert_eq!(ln(f64::INFINITY), f64::INFINITY);
    for x in [-1.0, -5e-324, f64::MIN, f64::NEG_INFINITY, f64::NAN] {
        assert!(ln(x).is_nan(), "ln {x}");
    }
    assert_eq!(exp(0.0), 1.0);
    assert_eq!(exp(-0.0), 1.0);
    assert_eq!(exp(f64::INFINITY), f64::INFINITY);
    assert_eq!(exp(f64::NEG_INFINITY), 0.0);
    assert!(exp(f64::NAN).is_nan());
    // The largest argument with a finite result, and the smallest with one that is not zero.
    assert!(exp(709.782_712_893_384).is_finite());
    assert_eq!(exp(709.782_712_893_384_1), f64::INFINITY);
    assert_eq!(exp(-745.133_219_101_941_1), 5e-324);
    assert_eq!(exp(-745.133_219_101_941_2), 0.0);
    assert_eq!(exp(f64::MAX), f64::INFINITY);
    assert_eq!(exp(f64::MIN), 0.0);
    assert_eq!(Elementary::powf(2.5, 0.0), 1.0);
    assert_eq!(Elementary::powf(0.0, 2.0), 0.0);
    assert_eq!(Elementary::powf(0.0, -2.0), f64::INFINITY);
    assert!(Elementary::powf(-2.0, 2.0).is_nan());
}
