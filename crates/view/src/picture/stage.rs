//! Drawing of figures with one camera, light and ground for all frames of a recording.

use super::camera::{Camera, Lens, Projected, ViewDirection, Viewport};
use super::canvas::{Canvas, SAMPLES};
use super::figure::{Dot, DrawnFigure, DrawnTrail, bounds};
use super::ground::Ground;
use super::image::{Image, Rgb, blended};
use super::raster::{self, Corner, Covered};
use super::shading::LitSurface;
use super::shadow::ShadowMap;
use super::space::{Vec3, cross, dot, length, minus, plus, smooth_step, times, unit, weighted};
use super::text::{self, Anchor};
use super::theme::Theme;

/// Line widths for a picture 600 high [pixel]: for a hundred lines, and the minimum for many.
const LINE: f32 = 3.2;
const THIN: f32 = 1.4;
/// Opacity of triangle edges, and the heights of a triangle [pixel] at which edges start to appear and
/// are full: in finer meshes they would paint everything black.
const EDGE: f32 = 0.42;
const EDGES: [f32; 2] = [4.0, 12.0];
/// Colour of inverted elements of 2D bodies.
const INVERTED: Rgb = [214, 60, 52];

/// Style of a picture, independent of its content.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// Width and height [pixel].
    pub size: [usize; 2],
    /// Colours.
    pub theme: Theme,
    /// True for a transparent background.
    pub transparent: bool,
}

/// Camera, light and sizes, shared by all frames.
#[derive(Clone, Debug)]
pub(crate) struct PictureStage {
    pub(crate) style: Style,
    pub(crate) camera: Camera,
    /// Centre of the positions that the camera was fitted to, and their radius [m].
    pub(crate) center: Vec3,
    pub(crate) radius: f32,
    /// Unit vector towards the lamp.
    pub(crate) light: Vec3,
    /// Radius of a usual dot [m].
    pub(crate) dot_radius: f32,
}

impl PictureStage {
    /// Stage for these positions; `dots` of them are points.
    pub(crate) fn new(
        style: Style,
        direction: ViewDirection,
        dimension: usize,
        places: &[Vec3],
        dots: usize,
        viewport: &Viewport,
    ) -> PictureStage {
        let lens = if dimension == 3 { Lens::Perspective } else { Lens::Parallel };
        let camera = Camera::fitted(direction, lens, places, viewport);
        let (center, radius) = bounds(places);
        // Light from over the left shoulder.
        let towards = [(camera.right, -0.45), (camera.back, 0.55), ([0.0, 0.0, 1.0], 0.95)];
        let light = towards.iter().fold([0.0; 3], |sum, (axis, share)| plus(sum, times(*axis, *share)));
        let distance = dot(minus(camera.eye, center), camera.back);
        let pixels = 0.0233 * style.size[1] as f32 * (dots.max(1) as f32).powf(-0.28);
        let dot_radius = pixels / camera.pixels_per_metre(distance) * direction.zoom;
        PictureStage { style, camera, center, radius, light: unit(light), dot_radius }
    }

    /// Draws a figure without title, time and colour scale.
    pub(crate) fn draw(&self, figure: &DrawnFigure) -> Image {
        let [r, g, b] = self.style.theme.background();
        let background = if self.style.transparent { [r, g, b, 0] } else { [r, g, b, 255] };
        let mut canvas = Canvas::new(self.style.size, background);
        let shadow = (figure.dimension == 3)
            .then(|| ShadowMap::new(figure, &figure.drawn(), self.light, self.dot_radius));
        let mut painter = Painter { stage: self, figure, canvas: &mut canvas, shadow: shadow.as_ref() };
        painter.faces();
        painter.segments();
        painter.dots();
        for wall in &figure.walls {
            Ground::new(self, *wall).draw(painter.canvas, shadow.as_ref());
        }
        for trail in &figure.trails {
            painter.trail(trail);
        }
        painter.marks();
        let mut image = canvas.resolved();
        self.names(figure, &mut image);
        image
    }

    /// Copy of the stage, moved.
    pub(crate) fn moved(&self, by: Vec3) -> PictureStage {
        let mut stage = self.clone();
        stage.center = plus(stage.center, by);
        stage.camera.eye = plus(stage.camera.eye, by);
        stage
    }

    fn scaled(&self, pixels: f32) -> f32 {
        pixels * (self.style.size[1] as f32 / 600.0).clamp(0.6, 3.0)
    }

    fn corner(&self, place: Vec3) -> Option<Corner> {
        self.camera.project(place).map(|point| Corner::new(&point, SAMPLES))
    }

    /// Draws the names of probes over everything.
    fn names(&self, figure: &DrawnFigure, image: &mut Image) {
        let (ink, size) = (self.style.theme.ink(), self.scaled(9.0));
        for mark in figure.marks.iter().filter(|mark| !mark.name.is_empty()) {
            if let Some(Projected { at: [x, y], .. }) = self.camera.project(mark.at) {
                // Left of a mark near the right side, where the name would be cut.
                let is_cut = x + 0.8 * size + text::width(&mark.name, size) > image.width as f32;
                let (aside, anchor) = if is_cut { (-0.8, Anchor::Right) } else { (0.8, Anchor::Left) };
                text::write(image, &mark.name, [x + aside * size, y - 0.8 * size], size, ink, anchor);
            }
        }
    }
}

/// Painter of one figure.
struct Painter<'a> {
    stage: &'a PictureStage,
    figure: &'a DrawnFigure,
    canvas: &'a mut Canvas,
    shadow: Option<&'a ShadowMap>,
}

impl Painter<'_> {
    fn faces(&mut self) {
        let normals = self.figure.vertex_normals();
        for face in 0..self.figure.faces.len() {
            let Some(places) = self.figure.corners(face) else { continue };
            let Some(normals) = self.figure.corner_normals(face, &normals) else { continue };
            if let [Some(a), Some(b), Some(c)] = places.map(|place| self.stage.corner(place)) {
                self.face(face, places, normals, [a, b, c]);
            }
        }
    }

    fn face(&mut self, face: usize, places: [Vec3; 3], normals: [Vec3; 3], corners: [Corner; 3]) {
        let mut colors = self.figure.face_colors[face];
        if self.shadow.is_none() && cross(minus(places[1], places[0]), minus(places[2], places[0]))[2] < 0.0 {
            colors = [INVERTED; 3];
        }
        let outline = Outline::new(&corners, self.stage.scaled(0.9) * SAMPLES as f32);
        let edge = self.stage.style.theme.edge();
        let (stage, shadow, canvas) = (self.stage, self.shadow, &mut *self.canvas);
        raster::triangle(&corners, canvas.size, |sample| {
            if !canvas.shows(sample.column, sample.row, sample.nearness) {
                return;
            }
            let share = sample.on_surface(&corners);
            let flat = mix_colors(&colors, share);
            let lit = shadow.map_or(flat, |shadow| {
                stage.shaded(flat, weighted(places, share), weighted(normals, share), shadow)
            });
            let color = blended(lit, edge, outline.opacity(&sample));
            canvas.set(sample.column, sample.row, sample.nearness, color);
        });
    }

    fn segments(&mut self) {
        let wide = LINE * (self.figure.segments.len() as f32 / 100.0).powf(-0.25);
        let width = self.stage.scaled(wide.clamp(THIN, LINE)) * SAMPLES as f32;
        for (segment, colors) in self.figure.segments.iter().zip(&self.figure.segment_colors) {
            let places = segment.map(|vertex| self.figure.vertices[vertex as usize]);
            if let [Some(a), Some(b)] = places.map(|place| self.stage.corner(place)) {
                self.segment(places, [a, b], colors, width);
            }
        }
    }

    fn segment(&mut self, places: [Vec3; 2], ends: [Corner; 2], colors: &[Rgb; 2], width: f32) {
        let (stage, shadow, canvas) = (self.stage, self.shadow, &mut *self.canvas);
        let along = unit(minus(places[1], places[0]));
        let to_eye = stage.camera.towards(places[0]);
        let side = unit(cross(along, to_eye));
        raster::line(&ends, width, canvas.size, |sample, second, across| {
            if !canvas.shows(sample.column, sample.row, sample.nearness) {
                return;
            }
            let flat = blended(colors[0], colors[1], second.clamp(0.0, 1.0));
            let color = shadow.map_or(flat, |shadow| {
                // Normal of a round thread.
                let normal =
                    unit(plus(times(side, across), times(to_eye, (1.0 - across * across).max(0.04).sqrt())));
                let place = [0, 1, 2].map(|i| places[0][i] + second * (places[1][i] - places[0][i]));
                stage.shaded(flat, place, normal, shadow)
            });
            canvas.set(sample.column, sample.row, sample.nearness, color);
        });
    }

    fn dots(&mut self) {
        for dot in &self.figure.dots {
            let place = self.figure.vertices[dot.vertex as usize];
            if let Some(center) = self.stage.corner(place) {
                self.dot(dot, place, &center);
            }
        }
    }

    fn dot(&mut self, dot: &Dot, place: Vec3, center: &Corner) {
        let (stage, shadow, canvas) = (self.stage, self.shadow, &mut *self.canvas);
        let pixels = stage.dot_radius * dot.size * stage.camera.focal * center.weight;
        let radius = (pixels * SAMPLES as f32).max(1.2);
        let to_eye = stage.camera.towards(place);
        raster::disc(center.at, radius, canvas.size, |column, row, [x, y]| {
            if !canvas.shows(column, row, center.nearness) {
                return;
            }
            let color =
                if shadow.is_some() { stage.shaded_ball(dot.color, to_eye, [x, y]) } else { dot.color };
            canvas.set(column, row, center.nearness, color);
        });
    }

    /// Draws pins and probes, moved slightly towards the eye because they lie on surfaces.
    fn marks(&mut self) {
        let ink = self.stage.style.theme.ink();
        let raised = 0.02 * self.stage.radius;
        for mark in &self.figure.marks {
            let to_eye = self.stage.camera.towards(mark.at);
            let Some(center) = self.stage.corner(plus(mark.at, times(to_eye, raised))) else { continue };
            let radius = self.stage.scaled(if mark.name.is_empty() { 1.7 } else { 2.8 }) * SAMPLES as f32;
            let canvas = &mut *self.canvas;
            raster::disc(center.at, radius, canvas.size, |column, row, _| {
                if canvas.shows(column, row, center.nearness) {
                    canvas.set(column, row, center.nearness, ink);
                }
            });
        }
    }

    fn trail(&mut self, trail: &DrawnTrail) {
        let width = self.stage.scaled(1.3) * SAMPLES as f32;
        let count = trail.places.len().saturating_sub(1).max(1) as f32;
        let corners: Vec<Option<Corner>> =
            trail.places.iter().map(|place| self.stage.corner(*place)).collect();
        for (i, pair) in corners.windows(2).enumerate() {
            let [Some(a), Some(b)] = *pair else { continue };
            let opacity = 0.08 + 0.62 * (i as f32 / count);
            let canvas = &mut *self.canvas;
            raster::line(&[a, b], width, canvas.size, |sample, _, _| {
                if canvas.shows(sample.column, sample.row, sample.nearness) {
                    canvas.tint(sample.column, sample.row, trail.color, opacity);
                }
            });
        }
    }
}

impl PictureStage {
    /// Shaded colour at a position on a two-sided surface.
    fn shaded(&self, color: Rgb, place: Vec3, normal: Vec3, shadow: &ShadowMap) -> Rgb {
        let to_eye = self.camera.towards(place);
        let normal = unit(if dot(normal, to_eye) < 0.0 { times(normal, -1.0) } else { normal });
        let lit = if dot(normal, self.light) > 0.0 { shadow.lit(place, normal) } else { 0.0 };
        LitSurface { normal, to_eye, to_light: self.light, lit }.shaded(color)
    }
}

impl PictureStage {
    /// Shaded colour at a point of a ball, offset from its centre in radii (right, down); without
    /// shadows.
    fn shaded_ball(&self, color: Rgb, to_eye: Vec3, [x, y]: [f32; 2]) -> Rgb {
        let toward = (1.0 - x * x - y * y).max(0.0).sqrt();
        let normal = weighted([self.camera.right, self.camera.up, self.camera.back], [x, -y, toward]);
        LitSurface { normal, to_eye, to_light: self.light, lit: 1.0 }.shaded(color)
    }
}

/// Edges of a triangle.
struct Outline {
    /// Heights over the edges [sample].
    heights: [f32; 3],
    half_width: f32,
    opacity: f32,
}

impl Outline {
    fn new(corners: &[Corner; 3], width: f32) -> Outline {
        let [a, b, c] = corners.map(|corner| [corner.at[0], corner.at[1], 0.0]);
        let area = length(cross(minus(b, a), minus(c, a)));
        let heights = [minus(c, b), minus(a, c), minus(b, a)].map(|edge| area / length(edge).max(1e-6));
        let lowest = heights.iter().fold(f32::INFINITY, |a, b| a.min(*b)) / SAMPLES as f32;
        let opacity = EDGE * smooth_step(EDGES[0], EDGES[1], lowest);
        Outline { heights, half_width: 0.5 * width, opacity }
    }

    fn opacity(&self, sample: &Covered) -> f32 {
        let distance = (0..3).map(|i| sample.share[i] * self.heights[i]).fold(f32::INFINITY, f32::min);
        self.opacity * (self.half_width + 0.5 - distance).clamp(0.0, 1.0)
    }
}

fn mix_colors(colors: &[Rgb; 3], share: [f32; 3]) -> Rgb {
    if colors[0] == colors[1] && colors[1] == colors[2] {
        return colors[0];
    }
    let mixed = weighted(colors.map(|color| color.map(f32::from)), share);
    mixed.map(super::image::byte)
}
