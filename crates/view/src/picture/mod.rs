//! Pictures without a browser: a software rasteriser and picture file formats.
//!
//! A [`Figure`] is plain arrays. Triangles have a depth buffer, smooth normals, edges that fade in fine
//! meshes, and a shadow map; pixels are means of four samples. Equal figures give equal bytes.

mod camera;
mod canvas;
mod casting;
mod figure;
mod film;
mod font;
mod ground;
mod image;
mod legend;
mod raster;
mod shading;
mod shadow;
mod space;
mod stage;
mod text;
mod theme;
mod write;

pub use camera::ViewDirection;
pub use figure::{Dot, DrawnFigure, DrawnMark, DrawnTrail};
pub use film::{Film, Fit, RenderOptions};
pub use image::Image;
pub use legend::ColorScale;
pub(crate) use legend::ticks;
pub use space::Vec3;
pub use stage::Style;
pub(crate) use text::{Anchor as TextAnchor, stroke, width as text_width, write as write_text};
pub use theme::Theme;
pub use write::{Animation, PictureError, write_gif, write_png, write_svg};

#[cfg(test)]
mod raster_tests;
#[cfg(test)]
mod stage_tests;
