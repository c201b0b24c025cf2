//! Colours, marks and fonts.

use std::borrow::Cow;
use std::iter::{Once, once};

use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, IntoDrawingArea};
use plotters::element::{Drawable, PointCollection};
use plotters::prelude::DrawingBackend;
use plotters::prelude::SVGBackend;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{BLACK, Color, IntoFont, RGBColor, ShapeStyle, TextStyle, WHITE};
use plotters_backend::{BackendCoord, DrawingErrorKind};

use super::PlotError;

/// Drawing area.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// Result of drawing, with the library's error.
pub(super) type Drawn = Result<(), Box<dyn std::error::Error>>;

/// Colours that remain distinct with colour vision deficiency; Okabe, Ito 2008, *Color universal design*.
const COLORS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
    RGBColor(140, 120, 30),
];

/// Grey of grids and remarks.
pub(super) const GREY: RGBColor = RGBColor(110, 110, 110);

/// Colour of line `i`.
pub(super) fn color(i: usize) -> RGBColor {
    COLORS[i % COLORS.len()]
}

/// Stroke widths that stand for dash patterns until [`dashed`] replaces them, because the library has no
/// dashes. No other stroke has these widths.
const DASHES: [(u32, &str); 3] =
    [(2, ""), (3, " stroke-dasharray=\"9 4\""), (4, " stroke-dasharray=\"2 4\"")];

/// Stroke of line `i`: eight colours, solid, then dashed, then dotted.
pub(super) fn stroke(i: usize) -> ShapeStyle {
    color(i).mix(0.85).stroke_width(DASHES[i / COLORS.len() % DASHES.len()].0)
}

/// Replaces the stroke widths of [`stroke`] by dash patterns.
fn dashed(svg: String) -> String {
    DASHES[1..].iter().fold(svg, |svg, (width, dashes)| {
        svg.replace(&format!(" stroke-width=\"{width}\""), &format!(" stroke-width=\"2\"{dashes}"))
    })
}

/// Text style with letters of this height.
pub(super) fn letters(height: i32, color: RGBColor) -> TextStyle<'static> {
    let mut style = TextStyle::from(("sans-serif", height).into_font());
    style.color = color.to_backend_color();
    style
}

/// Text style anchored at the centre.
pub(super) fn centred(height: i32, color: RGBColor) -> TextStyle<'static> {
    letters(height, color).pos(Pos::new(HPos::Center, VPos::Center))
}

/// Mark of a point: a small shape that identifies the line, or the cross of a failed run. Shapes change
/// before colours repeat.
pub(super) struct Mark<C> {
    pub(super) at: C,
    /// Index of the line.
    pub(super) line: usize,
    pub(super) failed: bool,
}

impl<'a, C> PointCollection<'a, C> for &'a Mark<C> {
    type Point = &'a C;
    type IntoIter = Once<&'a C>;

    fn point_iter(self) -> Self::IntoIter {
        once(&self.at)
    }
}

impl<C, B: DrawingBackend> Drawable<B> for Mark<C> {
    fn draw<I: Iterator<Item = BackendCoord>>(
        &self,
        mut at: I,
        backend: &mut B,
        _: (u32, u32),
    ) -> Result<(), DrawingErrorKind<B::ErrorType>> {
        let Some((x, y)) = at.next() else { return Ok(()) };
        let style = color(self.line).stroke_width(if self.failed { 2 } else { 1 });
        if self.failed {
            backend.draw_line((x - 4, y - 4), (x + 4, y + 4), &style)?;
            return backend.draw_line((x - 4, y + 4), (x + 4, y - 4), &style);
        }
        let round = self.line / COLORS.len();
        let corners: &[(i32, i32)] = match (self.line + round) % 4 {
            0 => return backend.draw_circle((x, y), 3, &style, round.is_multiple_of(2)),
            1 => &[(-3, -3), (3, -3), (3, 3), (-3, 3)],
            2 => &[(0, -4), (4, 3), (-4, 3)],
            _ => &[(0, -4), (4, 0), (0, 4), (-4, 0)],
        };
        let corners = corners.iter().map(|(dx, dy)| (x + dx, y + dy));
        if round.is_multiple_of(2) {
            return backend.fill_polygon(corners, &style);
        }
        backend.draw_path(corners.clone().chain(corners.take(1)), &style)
    }
}

/// Draws on a white page of this size; returns the SVG.
pub(super) fn page(
    title: &str,
    size: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Drawn,
) -> Result<String, PlotError> {
    let mut svg = String::new();
    let drawn = (|| -> Drawn {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        draw(&root)?;
        root.present()?;
        Ok(())
    })();
    drawn.map_err(|error| PlotError { title: title.to_owned(), reason: error.to_string() })?;
    // Default attributes are removed: a quarter of the text.
    Ok(dashed(svg.replace(" opacity=\"1\"", "").replace(" stroke-width=\"1\"", "")))
}

/// Text shortened to `most` letters, with dots at the end if it is longer.
pub(super) fn shortened(text: &str, most: usize) -> Cow<'_, str> {
    match text.char_indices().nth(most) {
        None => Cow::Borrowed(text),
        Some(_) => Cow::Owned(text.chars().take(most.saturating_sub(1)).chain(['…']).collect()),
    }
}

/// Draws a title at the top; returns the area below.
pub(super) fn titled<'a>(area: &Area<'a>, title: &str) -> Result<Area<'a>, Box<dyn std::error::Error>> {
    if title.is_empty() {
        return Ok(area.clone());
    }
    let (top, rest) = area.split_vertically(30);
    // A letter is about half as wide as high.
    let letters_that_fit = (area.dim_in_pixel().0 as usize).saturating_sub(28) / 9;
    top.draw_text(&shortened(title, letters_that_fit), &letters(17, BLACK), (14, 9))?;
    Ok(rest)
}
