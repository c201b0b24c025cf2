//! Palette for all frames of an animation: median cut over the colours of all frames.

use crate::picture::image::{Image, Rgb};

/// Bits per channel that distinguish colours.
const BITS: u32 = 6;
const CELLS: usize = 1 << (3 * BITS);

/// Palette of at most 255 colours, with the nearest one for each colour cell; index 255 is reserved for
/// transparent.
pub(super) struct Palette {
    pub(super) colors: Vec<Rgb>,
    nearest: Vec<u8>,
}

/// Index of transparent pixels.
pub(super) const TRANSPARENT: u8 = 255;

/// Colour cell: number and sum of its colours.
#[derive(Clone, Copy, Default)]
struct ColorCell {
    count: u64,
    sum: [u64; 3],
}

impl Palette {
    /// Palette of all frames.
    pub(super) fn of(frames: &[Image]) -> Palette {
        let mut cells = vec![ColorCell::default(); CELLS];
        for pixel in frames.iter().flat_map(|image| image.rgba.chunks_exact(4)).filter(|p| p[3] >= 128) {
            let cell = &mut cells[number([pixel[0], pixel[1], pixel[2]])];
            cell.count += 1;
            for i in 0..3 {
                cell.sum[i] += u64::from(pixel[i]);
            }
        }
        let occurs = |cell: &ColorCell| cell.count > 0;
        let colors: Vec<Rgb> =
            cut(cells.iter().copied().filter(occurs).collect()).iter().map(|cells| mean(cells)).collect();
        // No pixel uses the other cells.
        let index = |cell: &ColorCell| if occurs(cell) { nearest(&colors, mean(&[*cell])) } else { 0 };
        let nearest = cells.iter().map(index).collect();
        Palette { colors, nearest }
    }

    /// Index of the colour nearest to a pixel; transparent if the pixel is more than half transparent.
    pub(super) fn index(&self, pixel: &[u8]) -> u8 {
        if pixel[3] < 128 { TRANSPARENT } else { self.nearest[number([pixel[0], pixel[1], pixel[2]])] }
    }

    /// Red, green and blue of all colours, including the transparent one.
    pub(super) fn bytes(&self) -> Vec<u8> {
        let unused = 256 - self.colors.len();
        self.colors.iter().flatten().copied().chain(std::iter::repeat_n(0, 3 * unused)).collect()
    }
}

/// Halves the box with the largest spread, weighted by its number of pixels, until there are enough.
fn cut(cells: Vec<ColorCell>) -> Vec<Vec<ColorCell>> {
    let mut boxes = vec![cells];
    while boxes.len() < 255 {
        let spread = |cells: &Vec<ColorCell>| {
            let count: u64 = cells.iter().map(|cell| cell.count).sum();
            widest(cells).1 * (count as f64).powf(0.35)
        };
        let spreads = boxes.iter().map(spread).enumerate();
        let Some((largest, spread)) = spreads.max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        if spread <= 0.0 {
            break;
        }
        let mut cells = boxes.swap_remove(largest);
        let axis = widest(&cells).0;
        cells.sort_by(|a, b| value(a, axis).total_cmp(&value(b, axis)));
        let half = cells.len() / 2;
        let upper = cells.split_off(half);
        boxes.push(cells);
        boxes.push(upper);
    }
    boxes
}

/// Channel in which colours differ most, and their spread.
fn widest(cells: &[ColorCell]) -> (usize, f64) {
    let width = |axis: usize| {
        let values = || cells.iter().map(|cell| value(cell, axis));
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    };
    let widths = [0, 1, 2].map(|axis| (axis, width(axis)));
    widths.into_iter().fold((0, 0.0), |best, next| if next.1 > best.1 { next } else { best })
}

fn value(cell: &ColorCell, axis: usize) -> f64 {
    cell.sum[axis] as f64 / cell.count as f64
}

fn mean(cells: &[ColorCell]) -> Rgb {
    let count: u64 = cells.iter().map(|cell| cell.count).sum();
    [0, 1, 2].map(|i| {
        let sum: u64 = cells.iter().map(|cell| cell.sum[i]).sum();
        ((sum + count / 2) / count.max(1)) as u8
    })
}

fn number(color: Rgb) -> usize {
    color.iter().fold(0, |number, channel| (number << BITS) | usize::from(channel >> (8 - BITS)))
}

fn nearest(colors: &[Rgb], color: Rgb) -> u8 {
    let distance =
        |other: &Rgb| -> i32 { (0..3).map(|i| (i32::from(other[i]) - i32::from(color[i])).pow(2)).sum() };
    let nearest = colors.iter().enumerate().min_by_key(|(_, other)| distance(other));
    nearest.map_or(0, |(index, _)| index as u8)
}
