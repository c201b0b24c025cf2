//! The colour bar.

use super::ground::round_number;
use super::image::{Image, Rgb};
use super::text::{self, Anchor};
use super::theme::Theme;

/// Which colour stands for which number.
#[derive(Clone, Debug)]
pub struct ColorScale {
    /// What is shown, with its unit.
    pub name: String,
    /// Numbers at the ends of the bar.
    pub range: [f64; 2],
    /// Colour of a share of the range, 0 to 1.
    pub color: fn(f32) -> Rgb,
}

/// Room to the right of bodies for a bar in a picture of this height [pixel].
pub(crate) fn room(height: usize) -> f32 {
    9.0 * letters(height)
}

/// Height of letters in a picture of this height [pixel].
pub(crate) fn letters(height: usize) -> f32 {
    (0.0185 * height as f32).clamp(6.5, 40.0)
}

/// Draws the bar at the right side of a picture.
pub(crate) fn draw(image: &mut Image, scale: &ColorScale, theme: Theme) {
    let size = letters(image.height);
    let (bar, margin) = (1.3 * size, 1.6 * size);
    let left = image.width as f32 - margin - bar - 4.6 * size;
    let (top, bottom) = (0.24 * image.height as f32, 0.80 * image.height as f32);
    for row in top as i64..bottom as i64 {
        let color = (scale.color)((bottom - row as f32 - 0.5) / (bottom - top));
        for column in left as i64..(left + bar) as i64 {
            image.blend(column, row, color, 1.0);
        }
    }
    let right = image.width as f32 - margin;
    text::write(image, &scale.name, [right, top - 1.6 * size], size, theme.ink(), Anchor::Right);
    let [low, high] = scale.range;
    for (value, label) in ticks(low, high) {
        let share = ((value - low) / (high - low)) as f32;
        let y = bottom - share * (bottom - top);
        let ends = [[left + bar, y], [left + bar + 0.4 * size, y]];
        text::stroke(image, ends, 1.0, theme.faint(), 1.0);
        let at = [left + bar + 0.8 * size, y + 0.5 * size];
        text::write(image, &label, at, size, theme.ink(), Anchor::Left);
    }
}

/// Round numbers in a range, about five, and how they are written.
pub(crate) fn ticks(low: f64, high: f64) -> Vec<(f64, String)> {
    let step = f64::from(round_number(((high - low) / 4.0) as f32));
    if !(step > 0.0 && step.is_finite() && high > low) {
        return vec![(low, written(low, low.abs()))];
    }
    // Of the digits of a single-precision step only the first is meant.
    let step: f64 = format!("{step:.0e}").parse().unwrap_or(step);
    let (first, last) = ((low / step - 1e-6).ceil() as i64, (high / step + 1e-6).floor() as i64);
    (first..=last).map(|n| (n as f64 * step, written(n as f64 * step, step))).collect()
}

/// A number that is a multiple of `step`.
fn written(value: f64, step: f64) -> String {
    let largest = value.abs().max(step);
    if value == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e5).contains(&largest) && step >= 1e-4 {
        let decimals = (-step.log10().floor()).clamp(0.0, 6.0) as usize;
        format!("{value:.decimals$}")
    } else {
        let decimals = (value.abs().log10().floor() - step.log10().floor()).clamp(0.0, 6.0) as usize;
        format!("{value:.decimals$e}")
    }
}
