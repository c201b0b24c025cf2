//! Canvas of samples, several per pixel, each with a depth.

use super::image::{Image, Rgb, over};

/// Samples per pixel along each side.
pub(super) const SAMPLES: usize = 2;

/// Colours and depths of all samples.
pub(super) struct Canvas {
    /// Number of sample columns and rows.
    pub(super) size: [usize; 2],
    nearness: Vec<f32>,
    color: Vec<[u8; 4]>,
}

impl Canvas {
    /// Canvas of a picture of this size [pixel], filled with a colour.
    pub(super) fn new(size: [usize; 2], background: [u8; 4]) -> Canvas {
        let size = size.map(|n| n * SAMPLES);
        let count = size[0] * size[1];
        Canvas { size, nearness: vec![f32::NEG_INFINITY; count], color: vec![background; count] }
    }

    /// True if a point at this depth would be visible.
    pub(super) fn shows(&self, column: usize, row: usize, nearness: f32) -> bool {
        nearness > self.nearness[row * self.size[0] + column]
    }

    /// Sets a sample.
    pub(super) fn set(&mut self, column: usize, row: usize, nearness: f32, color: Rgb) {
        let at = row * self.size[0] + column;
        self.nearness[at] = nearness;
        self.color[at] = [color[0], color[1], color[2], 255];
    }

    /// Blends a colour over a sample and keeps its depth.
    pub(super) fn tint(&mut self, column: usize, row: usize, color: Rgb, opacity: f32) {
        let at = row * self.size[0] + column;
        self.color[at] = over(self.color[at], color, opacity);
    }

    /// Resolves the picture: each pixel is the mean of its samples.
    pub(super) fn resolved(&self) -> Image {
        let [width, height] = self.size.map(|n| n / SAMPLES);
        let mut rgba = Vec::with_capacity(4 * width * height);
        for row in 0..height {
            for column in 0..width {
                rgba.extend(self.mean(column * SAMPLES, row * SAMPLES));
            }
        }
        Image { width, height, rgba }
    }

    /// Mean of a pixel's samples, weighted by opacity.
    fn mean(&self, column: usize, row: usize) -> [u8; 4] {
        let mut sums = [0_u32; 4];
        for y in row..row + SAMPLES {
            for sample in &self.color[y * self.size[0] + column..][..SAMPLES] {
                let opacity = u32::from(sample[3]);
                for i in 0..3 {
                    sums[i] += u32::from(sample[i]) * opacity;
                }
                sums[3] += opacity;
            }
        }
        let count = (SAMPLES * SAMPLES) as u32;
        let opacity = sums[3].max(1);
        let color = [0, 1, 2].map(|i| ((sums[i] + opacity / 2) / opacity) as u8);
        [color[0], color[1], color[2], ((sums[3] + count / 2) / count) as u8]
    }
}
