//! Rounded numbers in messages.

use std::fmt;

/// A number rounded to `DIGITS` significant digits, without trailing zeros, and with a power of ten below
/// 1e-3 and from 1e6 on. Infinite values and NaN are described in words.
///
/// ```
/// use pliant::quantity::Rounded;
/// assert_eq!(Rounded::<4>(19.6200001).to_string(), "19.62");
/// assert_eq!(Rounded::<4>(4.2e-4).to_string(), "4.2e-4");
/// assert_eq!(Rounded::<4>(9999.96).to_string(), "10000");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rounded<const DIGITS: usize>(pub f64);

impl<const DIGITS: usize> fmt::Display for Rounded<DIGITS> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.0.is_finite() {
            let words = match self.0 {
                x if x.is_nan() => "not a number",
                x if x > 0.0 => "more than 1.797e308",
                _ => "less than -1.797e308",
            };
            return formatter.write_str(words);
        }
        // Round first, so that 9999.96 becomes 10000.
        let rounded: f64 = format!("{:.*e}", DIGITS - 1, self.0).parse().unwrap_or(self.0);
        let plain = rounded == 0.0 || (1e-3..1e6).contains(&rounded.abs());
        // Zero has no sign.
        let shown = if rounded == 0.0 { 0.0 } else { rounded };
        if plain { write!(formatter, "{shown}") } else { write!(formatter, "{shown:e}") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_lose_nothing_that_counts() {
        for (number, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1e-3, "0.001"),
            (9.9996e-4, "0.001"),
            (-5.65e-4, "-5.65e-4"),
            (0.123_456, "0.1235"),
            (999_949.0, "999900"),
            (999_951.0, "1e6"),
            (-1.5e9, "-1.5e9"),
            (f64::INFINITY, "more than 1.797e308"),
            (f64::NEG_INFINITY, "less than -1.797e308"),
            (f64::NAN, "not a number"),
            (5e-324, "5e-324"),
        ] {
            assert_eq!(Rounded::<4>(number).to_string(), text);
        }
        assert_eq!(Rounded::<17>(0.1 + 0.2).to_string(), "0.30000000000000004");
    }
}
