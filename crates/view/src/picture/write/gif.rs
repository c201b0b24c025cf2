//! GIF writer: one palette for all frames, and of each frame only the changed part.

use std::borrow::Cow;
use std::io::Write;

use ::gif::{DisposalMethod, Encoder, EncodingError, Frame, Repeat};

use super::palette::{Palette, TRANSPARENT};
use super::{Animation, PictureError};
use crate::picture::image::{Image, Rectangle};

/// Writes an animation that repeats forever. Delays are rounded to hundredths of a second; pixels are
/// either opaque or transparent.
///
/// # Errors
/// A write error of the stream; [`PictureError::Format`] without frames, and beyond 65,535 pixels a side.
pub fn write(animation: &Animation, out: &mut dyn Write) -> Result<(), PictureError> {
    let Some(first) = animation.frames.first() else {
        return Err(PictureError::Format { format: "GIF", size: [0; 2], message: "no frames".to_owned() });
    };
    let side = |n: usize| u16::try_from(n).map_err(|error| PictureError::format("GIF", first, error));
    let (width, height) = (side(first.width)?, side(first.height)?);
    let palette = Palette::of(&animation.frames);
    let failed = |error: EncodingError| match error {
        EncodingError::Io(error) => PictureError::Write(error),
        error => PictureError::format("GIF", first, error),
    };
    let mut encoder = Encoder::new(out, width, height, &palette.bytes()).map_err(failed)?;
    encoder.set_repeat(Repeat::Infinite).map_err(failed)?;
    for frame in frames(animation, &palette) {
        encoder.write_frame(&frame).map_err(failed)?;
    }
    Ok(())
}

/// Frames in the format's representation; unchanged ones prolong the one before.
fn frames(animation: &Animation, palette: &Palette) -> Vec<Frame<'static>> {
    let transparent = animation.frames.iter().any(|image| image.rgba.chunks_exact(4).any(|p| p[3] < 128));
    let mut frames: Vec<Frame<'static>> = Vec::new();
    let mut before: Option<Vec<u8>> = None;
    let mut time = 0_u64;
    for (image, delay) in animation.frames.iter().zip(&animation.delays) {
        let indices: Vec<u8> = image.rgba.chunks_exact(4).map(|pixel| palette.index(pixel)).collect();
        // Rounded cumulatively, so that errors do not add up.
        let from = (time + 5) / 10;
        time += u64::from(*delay);
        let hundredths = ((time + 5) / 10 - from) as u16;
        match before.as_ref().filter(|_| !transparent) {
            None => frames.push(frame(image, &Rectangle::whole(image), &indices, None, hundredths)),
            Some(before) => match changed(image, before, &indices) {
                None => prolong(&mut frames, hundredths),
                Some(part) => frames.push(frame(image, &part, &indices, Some(before), hundredths)),
            },
        }
        before = Some(indices);
    }
    frames
}

fn prolong(frames: &mut [Frame<'static>], hundredths: u16) {
    if let Some(last) = frames.last_mut() {
        last.delay = last.delay.saturating_add(hundredths);
    }
}

/// Rectangle in which indices differ.
fn changed(image: &Image, before: &[u8], after: &[u8]) -> Option<Rectangle> {
    let (mut columns, mut rows) = ([usize::MAX, 0], [usize::MAX, 0]);
    for (at, _) in before.iter().zip(after).enumerate().filter(|(_, (a, b))| a != b) {
        let (column, row) = (at % image.width, at / image.width);
        columns = [columns[0].min(column), columns[1].max(column)];
        rows = [rows[0].min(row), rows[1].max(row)];
    }
    (columns[0] != usize::MAX).then(|| Rectangle {
        left: columns[0],
        top: rows[0],
        width: columns[1] + 1 - columns[0],
        height: rows[1] + 1 - rows[0],
    })
}

fn frame(
    image: &Image,
    part: &Rectangle,
    indices: &[u8],
    before: Option<&Vec<u8>>,
    hundredths: u16,
) -> Frame<'static> {
    let rows = (part.top..part.top + part.height).map(|row| row * image.width + part.left);
    let at = rows.flat_map(|start| start..start + part.width);
    // Unchanged pixels are transparent: long runs compress well.
    let same = |at: usize| before.is_some_and(|before| before[at] == indices[at]);
    let buffer = at.map(|at| if same(at) { TRANSPARENT } else { indices[at] }).collect();
    // With a transparent background each frame stands alone and is cleared before the next.
    let dispose = if before.is_none() && indices.contains(&TRANSPARENT) {
        DisposalMethod::Background
    } else {
        DisposalMethod::Keep
    };
    Frame {
        delay: hundredths,
        dispose,
        transparent: Some(TRANSPARENT),
        left: part.left as u16,
        top: part.top as u16,
        width: part.width as u16,
        height: part.height as u16,
        buffer: Cow::Owned(buffer),
        ..Frame::default()
    }
}
