//! Times in messages.

use std::fmt;

use super::Rounded;

/// A time [s] with three significant digits and a prefix.
///
/// ```
/// use pliant::quantity::Seconds;
/// assert_eq!(Seconds(3.9063e-4).to_string(), "391 us");
/// assert_eq!(Seconds(0.0167).to_string(), "16.7 ms");
/// assert_eq!(Seconds(2.0).to_string(), "2 s");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seconds(pub f64);

impl fmt::Display for Seconds {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Round first, so that 999.96 us become 1 ms.
        let rounded: f64 = format!("{:.2e}", self.0).parse().unwrap_or(self.0);
        let prefixes = [("", 1.0), ("m", 1e3), ("u", 1e6), ("n", 1e9), ("p", 1e12)];
        let fits = |(_, factor): &&(&str, f64)| rounded == 0.0 || rounded.abs() * factor >= 1.0;
        let (prefix, factor) = prefixes.iter().find(fits).unwrap_or(&("f", 1e15));
        write!(formatter, "{} {prefix}s", Rounded::<3>(rounded * factor))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_a_prefix_and_no_power_of_ten_below_a_second() {
        for (time, text) in [
            (0.0, "0 s"),
            (1.0, "1 s"),
            (0.9999, "1 s"),
            (9.996e-4, "1 ms"),
            (9.994e-4, "999 us"),
            (-1.234e-6, "-1.23 us"),
            (3.2584e-8, "32.6 ns"),
            (1e-12, "1 ps"),
            (2.5e-15, "2.5 fs"),
            (86_400.0, "86400 s"),
            (f64::INFINITY, "more than 1.797e308 s"),
        ] {
            assert_eq!(Seconds(time).to_string(), text);
        }
    }
}
