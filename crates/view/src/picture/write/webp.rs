//! WebP writer, lossless, still and animated. The library writes stills; this is the container for
//! animations: <https://developers.google.com/speed/webp/docs/riff_container>.

use std::io::Write;

use image_webp::{ColorType, EncodingError, WebPEncoder};

use super::{Animation, Changes, PictureError, pass_on};
use crate::picture::image::Image;

/// Largest side of a picture [pixel].
const LARGEST: usize = 1 << 14;
/// Flags of `VP8X`: pictures have opacity, and are animated.
const ALPHA: u8 = 0x10;
const ANIMATED: u8 = 0x02;
/// Flag of a frame that replaces what is below it.
const REPLACES: u8 = 0x02;

/// Writes a picture as lossless WebP.
///
/// # Errors
/// A write error of the stream; [`PictureError::Format`] beyond 16,384 pixels a side.
pub fn write_still(image: &Image, out: &mut dyn Write) -> Result<(), PictureError> {
    pass_on(&still(image)?, out)
}

/// Writes an animation that repeats forever as lossless WebP.
///
/// # Errors
/// The errors of [`write_still`], and an animation without frames.
pub fn write_animation(animation: &Animation, out: &mut dyn Write) -> Result<(), PictureError> {
    let changes = Changes::of(animation);
    let first = changes.first("WebP")?;
    let mut body = b"WEBP".to_vec();
    let mut extended = vec![ALPHA | ANIMATED, 0, 0, 0];
    extended.extend(three_bytes(first.width - 1));
    extended.extend(three_bytes(first.height - 1));
    chunk(&mut body, b"VP8X", &extended);
    // Background, unused, and the number of repetitions: 0 means forever.
    chunk(&mut body, b"ANIM", &[0; 6]);
    for (image, part, delay) in &changes.frames {
        let mut frame = Vec::new();
        for number in [part.left / 2, part.top / 2, part.width - 1, part.height - 1, usize::from(*delay)] {
            frame.extend(three_bytes(number));
        }
        frame.push(REPLACES);
        // After `RIFF`, the size and `WEBP`.
        frame.extend(&still(&image.cut(part))?[12..]);
        chunk(&mut body, b"ANMF", &frame);
    }
    let mut file = Vec::new();
    chunk(&mut file, b"RIFF", &body);
    pass_on(&file, out)
}

fn still(image: &Image) -> Result<Vec<u8>, PictureError> {
    if image.width.max(image.height) > LARGEST {
        return Err(PictureError::format("WebP", image, "a side has at most 16384"));
    }
    let mut bytes = Vec::new();
    let (width, height) = (image.width as u32, image.height as u32);
    let encoded = WebPEncoder::new(&mut bytes).encode(&image.rgba, width, height, ColorType::Rgba8);
    encoded.map_err(|error| match error {
        EncodingError::IoError(error) => PictureError::Write(error),
        error => PictureError::format("WebP", image, error),
    })?;
    Ok(bytes)
}

/// Appends a chunk: name, size and content, padded to an even number of bytes.
fn chunk(out: &mut Vec<u8>, name: &[u8; 4], content: &[u8]) {
    out.extend(name);
    out.extend((content.len() as u32).to_le_bytes());
    out.extend(content);
    if content.len() % 2 == 1 {
        out.push(0);
    }
}

fn three_bytes(number: usize) -> [u8; 3] {
    let [a, b, c, _] = (number as u32).to_le_bytes();
    [a, b, c]
}
