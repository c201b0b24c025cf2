//! Student's t distribution with an integer number of degrees of freedom.
//!
//! Source: Abramowitz, Stegun 1964, *Handbook of mathematical functions*, 26.7.3 and 26.7.4: finite sums,
//! exact to rounding.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

/// Two-sided quantile: the `t` with `P(|t'| <= t) = inside`, for `inside` between 0 and 1 and at least
/// one degree of freedom.
pub(super) fn two_sided(inside: f64, degrees: usize) -> f64 {
    // The angle atan(t / sqrt(n)) has no long tail.
    let (mut low, mut high) = (0.0, FRAC_PI_2);
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return (degrees as f64).sqrt() * middle.tan();
        }
        if within(middle, degrees) < inside { low = middle } else { high = middle }
    }
}

/// Probability that `|t| <= sqrt(n) tan(angle)`.
fn within(angle: f64, degrees: usize) -> f64 {
    let (sine, cosine) = angle.sin_cos();
    let is_odd = !degrees.is_multiple_of(2);
    let mut power = if is_odd { cosine } else { 1.0 };
    let (mut sum, mut k) = (0.0, if is_odd { 3 } else { 2 });
    while k <= degrees {
        sum += power;
        // Factor from cos^j to cos^(j + 2): (j + 1)/(j + 2).
        power *= cosine * cosine * (k - 1) as f64 / k as f64;
        k += 2;
    }
    if is_odd { FRAC_2_PI * (angle + sine * sum) } else { sine * sum }
}

#[cfg(test)]
mod tests {
    use super::two_sided;

    // Abramowitz, Stegun 1964, table 26.10, and the normal distribution.
    #[test]
    fn quantiles_are_those_of_the_tables() {
        let table = [(1, 12.706), (2, 4.303), (3, 3.182), (4, 2.776), (10, 2.228), (29, 2.045), (120, 1.980)];
        for (degrees, t) in table {
            let found = two_sided(0.95, degrees);
            assert!((found - t).abs() < 6e-4, "{degrees}: {found}, not {t}");
        }
        assert!((two_sided(0.95, 100_000) - 1.959_964).abs() < 3e-5);
        assert!((two_sided(0.5, 1) - 1.0).abs() < 1e-12, "the quartiles of Cauchy's distribution");
    }
}
