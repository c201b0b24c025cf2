//! Picture files.
//!
//! # How to add a format
//! 1. Write a file in this folder with a function that writes an `Image` or an `Animation`.
//! 2. In `crates/cli/src/commands/render.rs`: a variant of `PictureFormat`, its extension in `of`, its
//!    branch in `encode`, and whether it `moves`.
//! 3. Let Pillow read it in CI: the lists of pictures in `.ci/run`, checks in
//!    `tests/tools/read_pictures.py`.
//! 4. Pictures that tests compare with are drawn by
//!    `PLIANT_RECORD_PICTURES=1 cargo test --test pliant pictures`.

mod gif;
mod palette;
mod png;
mod svg;

use std::io;

use super::image::Image;

pub use self::gif::write as write_gif;
pub use self::png::write as write_png;
pub use self::svg::write as write_svg;

/// Sequence of pictures.
#[derive(Clone, Debug)]
pub struct Animation {
    /// Frames, at least one, all of one size.
    pub frames: Vec<Image>,
    /// Display time of each frame [ms].
    pub delays: Vec<u16>,
}

/// Error of writing a picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// The stream could not be written.
    #[error(transparent)]
    Write(#[from] io::Error),
    /// More shapes than an SVG should have.
    #[error("{count} shapes are too many for an .svg, which holds {most}; name a .png")]
    TooMany {
        /// Number of triangles, lines and points.
        count: usize,
        /// Maximum number.
        most: usize,
    },
    /// The format cannot represent the picture.
    #[error("{format} cannot hold a picture of {} x {} pixels: {message}", size[0], size[1])]
    Format {
        /// Name of the format.
        format: &'static str,
        /// Width and height.
        size: [usize; 2],
        /// Message of the format's writer.
        message: String,
    },
}

impl PictureError {
    fn format(format: &'static str, image: &Image, message: impl ToString) -> PictureError {
        PictureError::Format { format, size: [image.width, image.height], message: message.to_string() }
    }
}
