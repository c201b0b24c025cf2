//! Text in pictures, drawn with strokes.

use super::font::{Glyph, glyph};
use super::image::{Image, Rgb};

/// Height of a capital letter in glyph units.
const CAPITAL: f32 = 7.0;
/// Space between letters and width of a blank, in glyph units.
const GAP: f32 = 2.2;
const BLANK: f32 = 2.4;
/// Width of strokes, in glyph units.
const STROKE: f32 = 0.95;

/// Alignment of a text at its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Anchor {
    /// Position at the beginning.
    Left,
    /// Position at the end.
    Right,
    /// Position in the middle.
    Middle,
}

/// Width of a text with this capital height.
pub(crate) fn width(text: &str, height: f32) -> f32 {
    let units: f32 = text.chars().map(advance).sum();
    (units - GAP).max(0.0) * height / CAPITAL
}

fn advance(letter: char) -> f32 {
    GAP + if letter == ' ' { BLANK - GAP + 1.0 } else { glyph(letter).width() }
}

/// Writes a line of text at this position of its base line.
pub(crate) fn write(image: &mut Image, text: &str, at: [f32; 2], height: f32, color: Rgb, anchor: Anchor) {
    let unit = height / CAPITAL;
    let before = match anchor {
        Anchor::Left => 0.0,
        Anchor::Right => width(text, height),
        Anchor::Middle => 0.5 * width(text, height),
    };
    let mut x = at[0] - before;
    for letter in text.chars() {
        if letter != ' ' {
            draw(image, &glyph(letter), [x, at[1]], unit, color);
        }
        x += advance(letter) * unit;
    }
}

/// Longest beginning of a text that is no wider than `most`, with an ellipsis if shortened.
pub(crate) fn shortened(text: &str, height: f32, most: f32) -> String {
    if width(text, height) <= most {
        return text.to_owned();
    }
    let mut kept: String = text.to_owned();
    while !kept.is_empty() && width(&format!("{kept}…"), height) > most {
        kept.pop();
    }
    kept + "…"
}

fn draw(image: &mut Image, glyph: &Glyph, at: [f32; 2], unit: f32, color: Rgb) {
    let half = (0.5 * STROKE * unit).max(0.55);
    let strokes: Vec<[[f32; 2]; 2]> = glyph
        .strokes()
        .map(|ends| ends.map(|[x, y]| [at[0] + x * unit, at[1] - (y - Glyph::BASE) * unit]))
        .collect();
    let (right, top) = (at[0] + glyph.width() * unit + half, at[1] - CAPITAL * unit - half);
    let bottom = at[1] + Glyph::BASE * unit + half;
    for row in (top - 1.0).floor() as i64..=(bottom + 1.0).ceil() as i64 {
        for column in (at[0] - half - 1.0).floor() as i64..=(right + 1.0).ceil() as i64 {
            let place = [column as f32 + 0.5, row as f32 + 0.5];
            let distance = strokes.iter().map(|ends| from_stroke(place, ends)).fold(f32::INFINITY, f32::min);
            image.blend(column, row, color, (half + 0.5 - distance).clamp(0.0, 1.0));
        }
    }
}

/// Distance of a point from a line segment.
fn from_stroke(place: [f32; 2], [a, b]: &[[f32; 2]; 2]) -> f32 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let from = [place[0] - a[0], place[1] - a[1]];
    let square = along[0] * along[0] + along[1] * along[1];
    let share = if square > 0.0 { (from[0] * along[0] + from[1] * along[1]) / square } else { 0.0 };
    let share = share.clamp(0.0, 1.0);
    let rest = [from[0] - share * along[0], from[1] - share * along[1]];
    (rest[0] * rest[0] + rest[1] * rest[1]).sqrt()
}

/// Draws a straight line with round ends.
pub(crate) fn stroke(image: &mut Image, ends: [[f32; 2]; 2], width: f32, color: Rgb, opacity: f32) {
    let half = 0.5 * width;
    let range = |axis: usize| {
        let (a, b) = (ends[0][axis], ends[1][axis]);
        let limit = [image.width, image.height][axis] as f32;
        let (low, high) = (a.min(b) - half - 1.0, a.max(b) + half + 1.0);
        low.clamp(0.0, limit) as i64..=high.clamp(0.0, limit) as i64
    };
    let (columns, rows) = (range(0), range(1));
    for row in rows {
        for column in columns.clone() {
            let distance = from_stroke([column as f32 + 0.5, row as f32 + 0.5], &ends);
            image.blend(column, row, color, opacity * (half + 0.5 - distance).clamp(0.0, 1.0));
        }
    }
}
