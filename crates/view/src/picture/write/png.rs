//! PNG writer, still and animated (APNG).

use std::io::Write;

use ::png::{BitDepth, BlendOp, ColorType, DisposeOp, Encoder, EncodingError};

use super::{Animation, Changes, PictureError};
use crate::picture::image::Image;

/// Writes a picture as PNG, with opacity unless it is opaque.
///
/// # Errors
/// A write error of the stream.
pub fn write_still(image: &Image, out: &mut dyn Write) -> Result<(), PictureError> {
    let written = || -> Result<(), EncodingError> {
        let opaque = is_opaque(image);
        let mut writer = encoder(image, opaque, out).write_header()?;
        writer.write_image_data(&bytes(image, opaque))?;
        writer.finish()
    };
    written().map_err(|error| failed(image, error))
}

/// Writes an animation that repeats forever as APNG; programs without APNG support show the first frame.
///
/// # Errors
/// A write error of the stream; [`PictureError::Format`] without frames.
pub fn write_animation(animation: &Animation, out: &mut dyn Write) -> Result<(), PictureError> {
    let changes = Changes::of(animation);
    let first = changes.first("APNG")?;
    let opaque = animation.frames.iter().all(is_opaque);
    let written = || -> Result<(), EncodingError> {
        let mut encoder = encoder(first, opaque, out);
        encoder.set_animated(changes.frames.len() as u32, 0)?;
        encoder.set_dispose_op(DisposeOp::None)?;
        encoder.set_blend_op(BlendOp::Source)?;
        let mut writer = encoder.write_header()?;
        for (image, part, delay) in &changes.frames {
            writer.set_frame_delay(*delay, 1000)?;
            writer.reset_frame_position()?;
            writer.set_frame_dimension(part.width as u32, part.height as u32)?;
            writer.set_frame_position(part.left as u32, part.top as u32)?;
            writer.write_image_data(&bytes(&image.cut(part), opaque))?;
        }
        writer.finish()
    };
    written().map_err(|error| failed(first, error))
}

fn encoder<'a, W: Write>(image: &Image, opaque: bool, out: W) -> Encoder<'a, W> {
    let mut encoder = Encoder::new(out, image.width as u32, image.height as u32);
    encoder.set_color(if opaque { ColorType::Rgb } else { ColorType::Rgba });
    encoder.set_depth(BitDepth::Eight);
    encoder
}

fn is_opaque(image: &Image) -> bool {
    image.rgba.chunks_exact(4).all(|pixel| pixel[3] == 255)
}

fn bytes(image: &Image, opaque: bool) -> Vec<u8> {
    if opaque {
        image.rgba.chunks_exact(4).flat_map(|pixel| pixel[..3].iter().copied()).collect()
    } else {
        image.rgba.clone()
    }
}

fn failed(image: &Image, error: EncodingError) -> PictureError {
    match error {
        EncodingError::IoError(error) => PictureError::Write(error),
        error => PictureError::format("PNG", image, error),
    }
}
