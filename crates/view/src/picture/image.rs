//! Pixel images.

pub(super) use crate::colour::Rgb;

/// Image of 8-bit red, green, blue and opacity; colours are not premultiplied by opacity.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Pixels row by row from the top, `4 width height` bytes.
    pub rgba: Vec<u8>,
}

impl Image {
    /// Image of one colour.
    pub fn filled(size: [usize; 2], color: [u8; 4]) -> Image {
        let [width, height] = size;
        Image { width, height, rgba: color.repeat(width * height) }
    }

    /// Value of a pixel.
    pub fn pixel(&self, column: usize, row: usize) -> [u8; 4] {
        let at = 4 * (row * self.width + column);
        [0, 1, 2, 3].map(|i| self.rgba[at + i])
    }

    /// Blends a colour with this opacity, 0 to 1, over a pixel; ignores positions outside the image.
    pub(crate) fn blend(&mut self, column: i64, row: i64, color: Rgb, opacity: f32) {
        let inside = (0..self.width as i64).contains(&column) && (0..self.height as i64).contains(&row);
        if inside && opacity > 0.0 {
            let at = 4 * (row as usize * self.width + column as usize);
            let below = [0, 1, 2, 3].map(|i| self.rgba[at + i]);
            self.rgba[at..at + 4].copy_from_slice(&over(below, color, opacity.min(1.0)));
        }
    }

    /// Copies another image, which must fit, to a position.
    pub(crate) fn paste(&mut self, other: &Image, column: usize, row: usize) {
        for (y, line) in other.rgba.chunks_exact(4 * other.width).enumerate() {
            let at = 4 * ((row + y) * self.width + column);
            self.rgba[at..at + line.len()].copy_from_slice(line);
        }
    }
}

/// Composites `color` over `below`.
pub(crate) fn over(below: [u8; 4], color: Rgb, opacity: f32) -> [u8; 4] {
    let under = f32::from(below[3]) / 255.0 * (1.0 - opacity);
    let total = opacity + under;
    if total <= 0.0 {
        return [0; 4];
    }
    let mix = |i: usize| (opacity * f32::from(color[i]) + under * f32::from(below[i])) / total;
    [byte(mix(0)), byte(mix(1)), byte(mix(2)), byte(255.0 * total)]
}

/// Rounds to the nearest byte.
pub(crate) fn byte(x: f32) -> u8 {
    (x + 0.5).clamp(0.0, 255.0) as u8
}

/// Linear interpolation `a (1 - t) + b t`.
pub(crate) fn blended(a: Rgb, b: Rgb, t: f32) -> Rgb {
    [0, 1, 2].map(|i| byte(f32::from(a[i]) + t * (f32::from(b[i]) - f32::from(a[i]))))
}

/// Rectangle in an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Rectangle {
    pub(crate) left: usize,
    pub(crate) top: usize,
    pub(crate) width: usize,
    pub(crate) height: usize,
}

impl Rectangle {
    /// Rectangle of the whole image.
    pub(crate) fn whole(image: &Image) -> Rectangle {
        Rectangle { left: 0, top: 0, width: image.width, height: image.height }
    }
}
