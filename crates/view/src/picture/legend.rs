//! Colour bar.

use super::ground::round_number;
use super::image::{Image, Rgb};
use super::text::{self, Anchor};
use super::theme::Theme;

/// Scale of colours for values.
#[derive(Clone, Debug)]
pub struct ColorScale {
    /// Label of the quantity, with its unit.
    pub name: String,
    /// Values at the ends of the bar.
    pub range: [f64; 2],
    /// Colour at a fraction of the range, 0 to 1.
    pub color: fn(f32) -> Rgb,
}

/// Smallest distance of the bar from the top, in letter heights: title and label are above it.
const UNDER_TITLE: f32 = 6.2;

/// Width reserved for a bar right of the bodies in a picture of this height [pixel].
pub(crate) fn room(height: usize) -> f32 {
    9.0 * letters(height)
}

/// Height of letters in a picture of this height [pixel].
pub(crate) fn letters(height: usize) -> f32 {
    (0.0185 * height as f32).clamp(6.5, 40.0)
}

/// Layout of the bar and its texts at the right side of a picture [pixel].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BarLayout {
    /// Height of letters.
    pub(crate) size: f32,
    /// Left and right side of the bar.
    pub(crate) sides: [f32; 2],
    /// Upper and lower end of the bar.
    pub(crate) ends: [f32; 2],
    /// End of the label's base line.
    pub(crate) name: [f32; 2],
}

impl BarLayout {
    pub(crate) fn new(width: usize, height: usize) -> BarLayout {
        let size = letters(height);
        let (bar, margin) = (1.3 * size, 1.6 * size);
        let right = width as f32 - margin;
        let left = right - bar - 4.6 * size;
        // Below the title, even in small pictures, where letters do not shrink.
        let top = (0.24 * height as f32).max(UNDER_TITLE * size);
        let bottom = (0.80 * height as f32).max(top + size);
        BarLayout { size, sides: [left, left + bar], ends: [top, bottom], name: [right, top - 1.6 * size] }
    }

    /// Label, shortened to fit.
    pub(crate) fn name_of(&self, scale: &ColorScale) -> String {
        text::shortened(&scale.name, self.size, self.name[0] - 1.6 * self.size)
    }

    /// Tick positions from the top with their labels; fewer on a short bar.
    pub(crate) fn ticks(&self, [low, high]: [f64; 2]) -> Vec<(f32, String)> {
        let [top, bottom] = self.ends;
        let place = |value: f64| bottom - ((value - low) / (high - low)) as f32 * (bottom - top);
        let all: Vec<(f32, String)> =
            ticks(low, high).into_iter().map(|(value, label)| (place(value), label)).collect();
        let room = ((bottom - top) / (1.5 * self.size)) as usize;
        let step = all.len().div_ceil(room.max(1)).max(1);
        all.into_iter().step_by(step).collect()
    }
}

/// Draws the bar at the right side of a picture.
pub(crate) fn draw(image: &mut Image, scale: &ColorScale, theme: Theme) {
    let layout = BarLayout::new(image.width, image.height);
    let BarLayout { size, sides: [left, right], ends: [top, bottom], name } = layout;
    for row in top as i64..bottom as i64 {
        let color = (scale.color)((bottom - row as f32 - 0.5) / (bottom - top));
        for column in left as i64..right as i64 {
            image.blend(column, row, color, 1.0);
        }
    }
    text::write(image, &layout.name_of(scale), name, size, theme.ink(), Anchor::Right);
    for (y, label) in layout.ticks(scale.range) {
        let ends = [[right, y], [right + 0.4 * size, y]];
        text::stroke(image, ends, 1.0, theme.faint(), 1.0);
        let at = [right + 0.8 * size, y + 0.5 * size];
        text::write(image, &label, at, size, theme.ink(), Anchor::Left);
    }
}

/// About five round numbers in a range, with their labels.
pub(crate) fn ticks(low: f64, high: f64) -> Vec<(f64, String)> {
    let step = f64::from(round_number(((high - low) / 4.0) as f32));
    if !(step > 0.0 && step.is_finite() && high > low) {
        return vec![(low, written(low, low.abs()))];
    }
    // Only the first digit of the single-precision step is meaningful.
    let step: f64 = format!("{step:.0e}").parse().unwrap_or(step);
    let (first, last) = ((low / step - 1e-6).ceil() as i64, (high / step + 1e-6).floor() as i64);
    (first..=last).map(|n| (n as f64 * step, written(n as f64 * step, step))).collect()
}

/// Formats a multiple of `step`.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colour;

    fn scale() -> ColorScale {
        let color = |share| colour::of_value(f64::from(share), (0.0, 1.0));
        ColorScale { name: "speed [m/s]".to_owned(), range: [0.0, 2.0], color }
    }

    #[test]
    fn bar_runs_from_the_lowest_color_to_the_highest() {
        let mut image = Image::filled([320, 240], [255, 255, 255, 255]);
        draw(&mut image, &scale(), Theme::Light);
        let BarLayout { sides, ends, .. } = BarLayout::new(320, 240);
        let column = (0.5 * (sides[0] + sides[1])) as usize;
        let at = |row: f32| {
            let [r, g, b, _] = image.pixel(column, row as usize);
            [r, g, b]
        };
        let near = |seen: Rgb, share: f64| {
            let meant = colour::of_value(share, (0.0, 1.0));
            (0..3).all(|i| seen[i].abs_diff(meant[i]) <= 4)
        };
        assert!(near(at(ends[0] + 0.5), 1.0) && near(at(ends[1] - 1.5), 0.0), "ends");
        assert!(near(at(0.5 * (ends[0] + ends[1])), 0.5), "middle");
        assert_eq!(at(ends[0] - 1.5), [255; 3], "above");
    }

    #[test]
    fn numbers_stand_beside_their_colors() {
        let layout = BarLayout::new(320, 240);
        let ticks = layout.ticks([0.0, 2.0]);
        let [top, bottom] = layout.ends;
        let labels: Vec<&str> = ticks.iter().map(|(_, label)| label.as_str()).collect();
        assert_eq!(labels, ["0", "0.5", "1.0", "1.5", "2.0"]);
        for (k, (y, _)) in ticks.iter().enumerate() {
            let expected = bottom - 0.25 * k as f32 * (bottom - top);
            assert!((y - expected).abs() < 1e-3, "{k}: {y} instead of {expected}");
        }
    }

    #[test]
    fn name_of_the_bar_is_below_the_title() {
        for height in [60, 90, 120, 180, 240, 720] {
            let layout = BarLayout::new(height * 4 / 3, height);
            let size = letters(height);
            // Base line of the title, with the depth of its letters.
            let title = (2.3 + 0.35) * 1.15 * size;
            assert!(layout.name[1] - size > title, "{height}: {} under {title}", layout.name[1]);
            assert!(layout.ends[1] > layout.ends[0]);
            let ticks = layout.ticks([0.0, 1.0]);
            let apart = ticks.windows(2).map(|pair| pair[0].0 - pair[1].0).fold(f32::INFINITY, f32::min);
            assert!(apart > size, "{height}: numbers overlap, {apart} apart");
        }
    }
}
