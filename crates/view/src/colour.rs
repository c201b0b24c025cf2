//! Colours of bodies and of values, as sRGB: red, green and blue from 0 to 255.

use std::array::from_fn;

pub use pliant_record::BODY_COLOURS;

/// Colour: red, green, blue.
pub type Rgb = [u8; 3];

/// Viridis at `0, 1/9, .., 1`: `viridis(10)` of the R package viridisLite 0.4 (MIT), the colour map of
/// matplotlib by S. van der Walt and N. Smith (CC0). Perceptually uniform, and readable without colour
/// vision.
const VIRIDIS: [Rgb; 10] = [
    [0x44, 0x01, 0x54],
    [0x48, 0x28, 0x78],
    [0x3e, 0x4a, 0x89],
    [0x31, 0x68, 0x8e],
    [0x26, 0x82, 0x8e],
    [0x1f, 0x9e, 0x89],
    [0x35, 0xb7, 0x79],
    [0x6d, 0xcd, 0x59],
    [0xb4, 0xde, 0x2c],
    [0xfd, 0xe7, 0x25],
];

/// Colour of values that are not finite.
pub const NOT_FINITE: Rgb = [0x80, 0x80, 0x80];

/// Viridis at `0, 1/255, .., 1`, interpolated linearly between its published samples.
pub fn viridis_table() -> [Rgb; 256] {
    from_fn(|i| viridis_at(i as f64 / 255.0))
}

/// Colour of a value: viridis over the range `low` to `high`, clamped to it; the middle colour if the
/// range is empty.
pub fn of_value(value: f64, (low, high): (f64, f64)) -> Rgb {
    if !value.is_finite() {
        return NOT_FINITE;
    }
    viridis_at(if high > low { ((value - low) / (high - low)).clamp(0.0, 1.0) } else { 0.5 })
}

/// Colour of a body by index; six colours repeat.
pub fn of_body(number: usize) -> Rgb {
    BODY_COLOURS[number % BODY_COLOURS.len()].map(|component| (component * 255.0).round() as u8)
}

fn viridis_at(t: f64) -> Rgb {
    let at = t * (VIRIDIS.len() - 1) as f64;
    let below = (at as usize).min(VIRIDIS.len() - 2);
    let part = at - below as f64;
    from_fn(|c| {
        let (a, b) = (f64::from(VIRIDIS[below][c]), f64::from(VIRIDIS[below + 1][c]));
        (a + part * (b - a)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_meets_the_published_samples_and_grows_lighter() {
        let table = viridis_table();
        assert_eq!((table[0], table[255]), (VIRIDIS[0], VIRIDIS[9]));
        // 1/3 of the range is entry 85, exactly a sample.
        assert_eq!(table[85], VIRIDIS[3]);
        let lightness =
            |c: &Rgb| 0.2126 * f64::from(c[0]) + 0.7152 * f64::from(c[1]) + 0.0722 * f64::from(c[2]);
        assert!(table.windows(8).all(|pair| lightness(&pair[7]) > lightness(&pair[0])));
    }

    #[test]
    fn numbers_beyond_the_range_have_the_colours_of_its_ends() {
        assert_eq!(of_value(-3.0, (0.0, 1.0)), VIRIDIS[0]);
        assert_eq!(of_value(3.0, (0.0, 1.0)), VIRIDIS[9]);
        assert_eq!(of_value(f64::NAN, (0.0, 1.0)), NOT_FINITE);
        assert_eq!(of_value(2.0, (2.0, 2.0)), viridis_at(0.5));
    }

    #[test]
    fn bodies_share_the_colours_of_recordings() {
        assert_eq!(of_body(0), [0, 115, 179]);
        assert_eq!(of_body(6), of_body(0));
    }
}
