//! PNG writer.

use std::io::Write;

use ::png::{BitDepth, ColorType, Encoder, EncodingError};

use super::PictureError;
use crate::picture::image::Image;

/// Writes a picture as PNG, with opacity unless it is opaque.
///
/// # Errors
/// A write error of the stream.
pub fn write(image: &Image, out: &mut dyn Write) -> Result<(), PictureError> {
    let is_opaque = image.rgba.chunks_exact(4).all(|pixel| pixel[3] == 255);
    let written = || -> Result<(), EncodingError> {
        let mut encoder = Encoder::new(out, image.width as u32, image.height as u32);
        encoder.set_color(if is_opaque { ColorType::Rgb } else { ColorType::Rgba });
        encoder.set_depth(BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        if is_opaque {
            let pixels = image.rgba.chunks_exact(4).flat_map(|pixel| pixel[..3].iter().copied());
            writer.write_image_data(&pixels.collect::<Vec<_>>())?;
        } else {
            writer.write_image_data(&image.rgba)?;
        }
        writer.finish()
    };
    written().map_err(|error| match error {
        EncodingError::IoError(error) => PictureError::Write(error),
        error => PictureError::format("PNG", image, error),
    })
}
