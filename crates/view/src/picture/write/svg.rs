//! SVG writer: a still as shapes, painted from back to front.

use std::fmt::Write as _;
use std::io::Write;

use super::PictureError;
use crate::picture::figure::DrawnFigure;
use crate::picture::film::Film;
use crate::picture::ground::Ground;
use crate::picture::image::{Rgb, blended};
use crate::picture::legend::{BarLayout, ColorScale};
use crate::picture::shading::LitSurface;
use crate::picture::space::{Vec3, cross, dot, minus, times, unit};
use crate::picture::stage::PictureStage;

/// Limit on the shapes in one file: beyond it browsers and editors are slow, and a .png is smaller.
const MOST: usize = 50_000;

/// Stops of the colour bar's gradient.
const STOPS: usize = 16;

/// Writes the first frame of a film as SVG. Triangles are flat and sorted by their centroids, so that
/// intersecting ones overlap wrongly; there are no shadows.
///
/// # Errors
/// A write error of the stream; [`PictureError::TooMany`].
pub fn write(film: &Film, out: &mut dyn Write) -> Result<(), PictureError> {
    let (figure, stage) = film.shot(0);
    let count = figure.faces.len() + figure.segments.len() + figure.dots.len();
    if count > MOST {
        return Err(PictureError::TooMany { count, most: MOST });
    }
    let [width, height] = stage.style.size;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" stroke-linejoin=\"round\" stroke-linecap=\"round\">\n"
    );
    let _ = writeln!(text, "<title>{}</title>", escaped(film.title()));
    if !stage.style.transparent {
        let background = hex(stage.style.theme.background());
        let _ = writeln!(text, "<rect width=\"{width}\" height=\"{height}\" fill=\"{background}\"/>");
    }
    walls(figure, stage).into_iter().for_each(|wall| text += &wall);
    for (_, shape) in shapes(figure, stage) {
        text += &shape;
    }
    for (words, [x, y], size) in film.words(0) {
        let ink = hex(stage.style.theme.ink());
        let words = escaped(&words);
        let size = 1.4 * size;
        let _ = writeln!(
            text,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size:.1}\" fill=\"{ink}\">{words}</text>"
        );
    }
    if let Some(scale) = film.scale() {
        text += &bar(scale, stage);
    }
    text += "</svg>\n";
    Ok(out.write_all(text.as_bytes())?)
}

/// Walls, behind everything.
fn walls(figure: &DrawnFigure, stage: &PictureStage) -> Vec<String> {
    let theme = stage.style.theme;
    let (fill, line) = (hex(theme.ground()), hex(theme.faint()));
    let outlines = figure.walls.iter().map(|wall| Ground::new(stage, *wall).outline(figure.dimension));
    let shape = |corners: Vec<[f32; 2]>| {
        let places: Vec<String> = corners.iter().map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
        format!("<path class=\"wall\" d=\"M{}Z\" fill=\"{fill}\" stroke=\"{line}\"/>\n", places.join("L"))
    };
    outlines.filter(|corners| corners.len() > 2).map(shape).collect()
}

/// Colour bar: gradient, label and ticks.
fn bar(scale: &ColorScale, stage: &PictureStage) -> String {
    let [width, height] = stage.style.size;
    let layout = BarLayout::new(width, height);
    let BarLayout { size, sides: [left, right], ends: [top, bottom], name } = layout;
    let (ink, line) = (hex(stage.style.theme.ink()), hex(stage.style.theme.faint()));
    let mut text = "<linearGradient id=\"scale\" x1=\"0\" y1=\"1\" x2=\"0\" y2=\"0\">".to_owned();
    for stop in 0..=STOPS {
        let share = stop as f32 / STOPS as f32;
        let color = hex((scale.color)(share));
        let _ = write!(text, "<stop offset=\"{share}\" stop-color=\"{color}\"/>");
    }
    let (across, high) = (right - left, bottom - top);
    let _ = writeln!(
        text,
        "</linearGradient>\n<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{across:.1}\" \
         height=\"{high:.1}\" fill=\"url(#scale)\"/>"
    );
    let font = 1.4 * size;
    let mut words = |words: &str, [x, y]: [f32; 2], anchor: &str| {
        let words = escaped(words);
        let _ = writeln!(
            text,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{font:.1}\" fill=\"{ink}\" \
             text-anchor=\"{anchor}\">{words}</text>"
        );
    };
    words(&layout.name_of(scale), name, "end");
    let ticks = layout.ticks(scale.range);
    ticks.iter().for_each(|(y, label)| words(label, [right + 0.8 * size, y + 0.5 * size], "start"));
    let marks: String = ticks.iter().map(|(y, _)| format!("M{right:.1} {y:.1}h{:.1}", 0.4 * size)).collect();
    text + &format!("<path d=\"{marks}\" stroke=\"{line}\"/>\n")
}

/// All shapes with their depths, the farthest first.
fn shapes(figure: &DrawnFigure, stage: &PictureStage) -> Vec<(f32, String)> {
    let mut shapes: Vec<(f32, String)> = Vec::new();
    shapes.extend((0..figure.faces.len()).filter_map(|face| triangle(figure, stage, face)));
    shapes.extend((0..figure.segments.len()).filter_map(|segment| line(figure, stage, segment)));
    shapes.extend((0..figure.dots.len()).filter_map(|dot| circle(figure, stage, dot)));
    // Stable: shapes of equal depth keep their order.
    shapes.sort_by(|a, b| a.0.total_cmp(&b.0));
    shapes
}

fn triangle(figure: &DrawnFigure, stage: &PictureStage, face: usize) -> Option<(f32, String)> {
    let [a, b, c] = figure.corners(face)?;
    let [p, q, r] = [stage.camera.project(a)?, stage.camera.project(b)?, stage.camera.project(c)?];
    let middle = [0, 1, 2].map(|i| (a[i] + b[i] + c[i]) / 3.0);
    let normal = unit(cross(minus(b, a), minus(c, a)));
    let color = figure.face_colors[face].map(|color| color.map(f32::from));
    let mean = [0, 1, 2].map(|i| ((color[0][i] + color[1][i] + color[2][i]) / 3.0) as u8);
    let fill = if figure.dimension == 3 { lit(stage, middle, normal, mean) } else { mean };
    let edge = hex(blended(fill, stage.style.theme.edge(), 0.35));
    let [[ax, ay], [bx, by], [cx, cy]] = [p.at, q.at, r.at];
    let path = format!("M{ax:.1} {ay:.1}L{bx:.1} {by:.1}L{cx:.1} {cy:.1}Z");
    let fill = hex(fill);
    let shape = format!("<path d=\"{path}\" fill=\"{fill}\" stroke=\"{edge}\" stroke-width=\".5\"/>\n");
    Some(((p.nearness + q.nearness + r.nearness) / 3.0, shape))
}

fn lit(stage: &PictureStage, place: Vec3, normal: Vec3, color: Rgb) -> Rgb {
    let to_eye = stage.camera.towards(place);
    let normal = if dot(normal, to_eye) < 0.0 { times(normal, -1.0) } else { normal };
    LitSurface { normal, to_eye, to_light: stage.light, lit: 1.0 }.shaded(color)
}

fn line(figure: &DrawnFigure, stage: &PictureStage, segment: usize) -> Option<(f32, String)> {
    let [a, b] =
        figure.segments[segment].map(|vertex| stage.camera.project(figure.vertices[vertex as usize]));
    let (a, b) = (a?, b?);
    let color = hex(figure.segment_colors[segment][0]);
    let ([ax, ay], [bx, by]) = (a.at, b.at);
    let shape =
        format!("<path d=\"M{ax:.1} {ay:.1}L{bx:.1} {by:.1}\" stroke=\"{color}\" stroke-width=\"1.5\"/>\n");
    Some((0.5 * (a.nearness + b.nearness), shape))
}

fn circle(figure: &DrawnFigure, stage: &PictureStage, dot: usize) -> Option<(f32, String)> {
    let dot = &figure.dots[dot];
    let center = stage.camera.project(figure.vertices[dot.vertex as usize])?;
    let radius = (stage.dot_radius * dot.size * stage.camera.focal * center.weight).max(0.6);
    let ([x, y], color) = (center.at, hex(dot.color));
    Some((
        center.nearness,
        format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"{color}\"/>\n"),
    ))
}

fn hex([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Escapes text, because names and titles are data.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
