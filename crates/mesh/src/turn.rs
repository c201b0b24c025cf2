//! Sines and cosines that are bit-identical on every machine. Those of the C library differ between its
//! versions and between instruction sets.

// The constants are written as in fdlibm.
#![allow(clippy::excessive_precision)]

use std::f64::consts::{FRAC_2_PI, FRAC_PI_4};

/// High part of `pi / 2` in two parts, as in fdlibm: it has 33 bits, so that its products with small
/// numbers are exact.
const HALF_PI_HIGH: f64 = 1.570_796_326_734_125_614_17;
const HALF_PI_LOW: f64 = 6.077_100_506_506_192_249_32e-11;

/// Cosine and sine of `k / n` of a full turn, `n > 0`: exact at the quarters, with the same digits in
/// every octant.
pub(super) fn of_fraction(k: usize, n: usize) -> [f64; 2] {
    let (k, n) = (k as u128 % n as u128, n as u128);
    let (octant, rest) = (8 * k / n, 8 * k % n);
    let small = |part: u128| series(part as f64 / n as f64 * FRAC_PI_4);
    // Odd octants are measured from their end.
    let [c, s] = small(if octant % 2 == 0 { rest } else { n - rest });
    match octant {
        0 => [c, s],
        1 => [s, c],
        2 => [-s, c],
        3 => [-c, s],
        4 => [-c, -s],
        5 => [-s, -c],
        6 => [s, -c],
        _ => [c, -s],
    }
}

/// Cosine and sine of an angle [rad]; beyond a million turns only roughly.
pub(super) fn of_angle(angle: f64) -> [f64; 2] {
    let quarters = (angle * FRAC_2_PI).round();
    let rest = (angle - quarters * HALF_PI_HIGH) - quarters * HALF_PI_LOW;
    let [c, s] = series(rest);
    match quarters.rem_euclid(4.0) as u8 {
        0 => [c, s],
        1 => [-s, c],
        2 => [-c, -s],
        _ => [s, -c],
    }
}

/// Taylor series up to `t^18`, whose remainder is below an ulp for `|t| <= pi/4`.
fn series(t: f64) -> [f64; 2] {
    let square = t * t;
    let (mut cosine, mut sine) = (1.0, 1.0);
    for i in (1..=9).rev() {
        let i = f64::from(2 * i);
        cosine = 1.0 - square / (i * (i - 1.0)) * cosine;
        sine = 1.0 - square / (i * (i + 1.0)) * sine;
    }
    [cosine, t * sine]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_those_of_the_library_to_rounding() {
        for n in [1, 2, 3, 5, 7, 8, 12, 360, 1001] {
            for k in 0..n {
                let angle = std::f64::consts::TAU * k as f64 / n as f64;
                let [c, s] = of_fraction(k, n);
                // The rounding of `angle` itself is up to 4.4e-16.
                assert!((c - angle.cos()).abs() < 1e-15 && (s - angle.sin()).abs() < 1e-15, "{k}/{n}");
                assert!((c * c + s * s - 1.0).abs() < 4e-16);
                let [c, s] = of_angle(angle - 3.0);
                let (c0, s0) = ((angle - 3.0).cos(), (angle - 3.0).sin());
                assert!((c - c0).abs() < 3e-16 && (s - s0).abs() < 3e-16, "{k}/{n}");
            }
        }
        assert_eq!(of_fraction(1, 4), [-0.0, 1.0]);
        assert_eq!(of_fraction(6, 8), [0.0, -1.0]);
        // Mirror images have the same digits.
        assert_eq!(of_fraction(1, 12)[0], of_fraction(2, 12)[1]);
    }
}
