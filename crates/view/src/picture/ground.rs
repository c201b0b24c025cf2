//! Floors and walls: planes with a grid and shadows.

use super::canvas::{Canvas, SAMPLES};
use super::image::{Rgb, blended};
use super::shadow::ShadowMap;
use super::space::{Vec3, dot, length, minus, plus, smooth_step, tangents, times};
use super::stage::PictureStage;

/// Reach of a plane, and the distance at which it starts to fade, relative to the stage's radius.
const REACH: f32 = 2.4;
const FADES: f32 = 0.9;
/// Darkness of a shadow.
const SHADE: f32 = 0.42;
/// Grid spacing relative to the stage's radius, before rounding to 1, 2 or 5.
const GRID: f32 = 0.35;

/// Reach and number of corners of planes in vector pictures: a disc in 3D, a strip in 2D.
const DISC: f32 = 1.6;
const STRIP: f32 = 20.0;
const CORNERS: usize = 48;

/// Plane of a wall.
pub(super) struct Ground<'a> {
    stage: &'a PictureStage,
    point: Vec3,
    normal: Vec3,
    /// Point of the plane nearest to the stage's centre.
    middle: Vec3,
    tangents: [Vec3; 2],
    spacing: f32,
}

impl<'a> Ground<'a> {
    /// Plane through a point with this unit normal.
    pub(super) fn new(stage: &'a PictureStage, [point, normal]: [Vec3; 2]) -> Ground<'a> {
        let height = dot(minus(stage.center, point), normal);
        let middle = minus(stage.center, times(normal, height));
        let spacing = round_number(GRID * stage.radius);
        Ground { stage, point, normal, middle, tangents: tangents(normal), spacing }
    }

    /// Draws the visible part of the plane, if the eye is on the side of the bodies.
    pub(super) fn draw(&self, canvas: &mut Canvas, shadow: Option<&ShadowMap>) {
        for row in 0..canvas.size[1] {
            for column in 0..canvas.size[0] {
                let at = [column, row].map(|n| (n as f32 + 0.5) / SAMPLES as f32);
                match shadow {
                    Some(shadow) => self.sample(canvas, [column, row], at, shadow),
                    None => self.half_plane(canvas, [column, row], at),
                }
            }
        }
    }

    /// Corners in a vector picture: a strip in 2D, in 3D a disc without fading; empty if the eye is
    /// behind the plane.
    pub(super) fn outline(&self, dimension: usize) -> Vec<[f32; 2]> {
        let camera = &self.stage.camera;
        if dimension == 3 && dot(minus(camera.eye, self.point), self.normal) <= 0.0 {
            return vec![];
        }
        let reach = self.stage.radius * if dimension == 3 { DISC } else { STRIP };
        let corner = |[x, y]: [f32; 2]| match dimension {
            3 => plus(times(self.tangents[0], x * reach), times(self.tangents[1], y * reach)),
            _ => plus(times(self.tangents[0], x * reach), times(self.normal, y.min(0.0) * reach)),
        };
        let rim = (0..CORNERS).map(|k| (k as f32 / CORNERS as f32 * std::f32::consts::TAU).sin_cos());
        let around: Vec<[f32; 2]> = match dimension {
            3 => rim.map(|(sin, cos)| [cos, sin]).collect(),
            _ => vec![[-1.0, 0.0], [1.0, 0.0], [1.0, -1.0], [-1.0, -1.0]],
        };
        let places = around.into_iter().map(|place| plus(self.middle, corner(place)));
        places.filter_map(|place| Some(camera.project(place)?.at)).collect()
    }

    fn sample(&self, canvas: &mut Canvas, [column, row]: [usize; 2], at: [f32; 2], shadow: &ShadowMap) {
        let camera = &self.stage.camera;
        let (start, along) = camera.ray(at);
        let approach = dot(along, self.normal);
        if approach > -1e-4 {
            return;
        }
        let distance = dot(minus(self.point, start), self.normal) / approach;
        if distance <= 0.0 || !canvas.shows(column, row, camera.nearness(distance)) {
            return;
        }
        let place = plus(start, times(along, distance));
        let away = length(minus(place, self.middle)) / self.stage.radius;
        let opacity = 1.0 - smooth_step(FADES, REACH, away);
        if opacity <= 0.0 {
            return;
        }
        let shade = SHADE * (1.0 - shadow.lit(place, self.normal));
        if self.stage.style.transparent {
            canvas.tint(column, row, [0, 0, 0], opacity * shade);
        } else {
            let pixel = 1.0 / camera.pixels_per_metre(distance);
            let color = blended(self.color(place, pixel), [0, 0, 0], shade);
            canvas.tint(column, row, color, opacity);
        }
    }

    /// Colour of the plane at a position where a pixel has this size [m].
    fn color(&self, place: Vec3, pixel: f32) -> Rgb {
        let theme = self.stage.style.theme;
        let from_line = self.tangents.map(|tangent| {
            let lines = dot(place, tangent) / self.spacing;
            (lines - lines.round()).abs() * self.spacing
        });
        let nearest = from_line[0].min(from_line[1]);
        blended(theme.ground(), theme.grid(), (1.2 - nearest / pixel).clamp(0.0, 1.0))
    }

    /// Draws a 2D wall: everything beyond its line.
    fn half_plane(&self, canvas: &mut Canvas, [column, row]: [usize; 2], at: [f32; 2]) {
        let camera = &self.stage.camera;
        let beyond = -dot(minus(camera.ray(at).0, self.point), self.normal) * camera.focal;
        let behind_all = camera.nearness(f32::MAX);
        let theme = self.stage.style.theme;
        if beyond > -1.0 && canvas.shows(column, row, behind_all) {
            let color = if beyond < 1.0 { theme.faint() } else { theme.ground() };
            let [r, g, b] = color;
            canvas.tint(column, row, [r, g, b], 1.0);
        }
    }
}

/// Largest of 1, 2 and 5 times a power of ten not above `x`.
pub(super) fn round_number(x: f32) -> f32 {
    let power = 10_f32.powf(x.max(f32::MIN_POSITIVE).log10().floor());
    let times = [5.0, 2.0].into_iter().find(|times| times * power <= x);
    times.unwrap_or(1.0) * power
}
