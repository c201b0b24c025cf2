//! Camera: projection of points in space to pixels.

use super::space::{Vec3, dot, minus, plus, times, unit};

/// Tangent of half the vertical angle of view, 14 degrees.
const HALF_HEIGHT: f32 = 0.249_328;

/// Camera direction and zoom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewDirection {
    /// Rotation about the vertical axis, from the front (looking along +y) towards +x [degrees].
    pub azimuth: f32,
    /// Elevation above the horizon [degrees].
    pub elevation: f32,
    /// Magnification relative to the fitted view.
    pub zoom: f32,
}

impl Default for ViewDirection {
    fn default() -> ViewDirection {
        ViewDirection { azimuth: 25.0, elevation: 18.0, zoom: 1.0 }
    }
}

/// Part of a picture for bodies to fill: its centre and half its size [pixel].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Viewport {
    pub(crate) center: [f32; 2],
    pub(crate) half: [f32; 2],
    /// Height of the whole picture [pixel].
    pub(crate) height: f32,
}

impl Viewport {
    /// Viewport of a picture with margins `[left, top, right, bottom]` [pixel].
    pub(crate) fn inside(size: [usize; 2], without: [f32; 4]) -> Viewport {
        let [width, height] = size.map(|n| n as f32);
        let [left, top, right, bottom] = without;
        let half = [(width - left - right).max(8.0) / 2.0, (height - top - bottom).max(8.0) / 2.0];
        Viewport { center: [left + half[0], top + half[1]], half, height }
    }
}

/// Kind of projection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Lens {
    /// Perspective, from one point.
    Perspective,
    /// Parallel, for two-dimensional scenes.
    Parallel,
}

/// Camera with perspective or parallel projection.
#[derive(Clone, Debug)]
pub(crate) struct Camera {
    pub(crate) eye: Vec3,
    /// Unit vectors of the picture: right, up, and towards the eye.
    pub(crate) right: Vec3,
    pub(crate) up: Vec3,
    pub(crate) back: Vec3,
    pub(crate) lens: Lens,
    /// Pixels per metre at a distance of one metre, or at any distance for parallel projection.
    pub(crate) focal: f32,
    /// Pixel of the ray along `-back`.
    pub(crate) center: [f32; 2],
}

/// Point projected into a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Projected {
    /// Position from the upper left corner, y downwards [pixel].
    pub(crate) at: [f32; 2],
    /// Depth value, larger for nearer points, linear in the picture of a plane.
    pub(crate) nearness: f32,
    /// Weight that makes attributes of a plane linear in its picture.
    pub(crate) weight: f32,
}

impl Camera {
    /// Fits the camera in this direction as close as possible with all points in its viewport.
    pub(crate) fn fitted(
        direction: ViewDirection,
        lens: Lens,
        points: &[Vec3],
        viewport: &Viewport,
    ) -> Camera {
        let [right, up, back] = axes(direction, lens);
        let seen: Vec<Vec3> = points.iter().map(|&p| [dot(p, right), dot(p, up), dot(p, back)]).collect();
        let (place, focal) = match lens {
            Lens::Perspective => perspective(&seen, viewport),
            Lens::Parallel => parallel(&seen, viewport),
        };
        let eye = plus(plus(times(right, place[0]), times(up, place[1])), times(back, place[2]));
        Camera { eye, right, up, back, lens, focal: focal * direction.zoom, center: viewport.center }
    }

    /// Projects a point; `None` unless it is in front of the eye.
    pub(crate) fn project(&self, point: Vec3) -> Option<Projected> {
        let from_eye = minus(point, self.eye);
        let distance = -dot(from_eye, self.back);
        let (nearness, weight) = match self.lens {
            Lens::Perspective if distance > 1e-6 => (1.0 / distance, 1.0 / distance),
            Lens::Perspective => return None,
            Lens::Parallel => (-distance, 1.0),
        };
        let scale = self.focal * weight;
        let x = self.center[0] + scale * dot(from_eye, self.right);
        let y = self.center[1] - scale * dot(from_eye, self.up);
        (x.abs() < 1e6 && y.abs() < 1e6).then_some(Projected { at: [x, y], nearness, weight })
    }

    /// Origin and direction of the ray through a pixel; the direction has component 1 along the view, so
    /// that a point at `t` is `t` metres in front of the eye.
    pub(crate) fn ray(&self, at: [f32; 2]) -> (Vec3, Vec3) {
        let x = times(self.right, (at[0] - self.center[0]) / self.focal);
        let y = times(self.up, (self.center[1] - at[1]) / self.focal);
        let across = plus(x, y);
        match self.lens {
            Lens::Perspective => (self.eye, minus(across, self.back)),
            Lens::Parallel => (plus(self.eye, across), times(self.back, -1.0)),
        }
    }

    /// Unit direction from a point to the eye.
    pub(crate) fn towards(&self, point: Vec3) -> Vec3 {
        match self.lens {
            Lens::Perspective => unit(minus(self.eye, point)),
            Lens::Parallel => self.back,
        }
    }

    /// Value of [`Projected::nearness`] at this distance along the view [m].
    pub(crate) fn nearness(&self, distance: f32) -> f32 {
        if self.lens == Lens::Perspective { 1.0 / distance } else { -distance }
    }

    /// Pixels per metre across the view at this distance [m].
    pub(crate) fn pixels_per_metre(&self, distance: f32) -> f32 {
        if self.lens == Lens::Perspective { self.focal / distance } else { self.focal }
    }
}

fn axes(direction: ViewDirection, lens: Lens) -> [Vec3; 3] {
    if lens == Lens::Parallel {
        return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    }
    let (sin_turn, cos_turn) = direction.azimuth.to_radians().sin_cos();
    let (sin_tilt, cos_tilt) = direction.elevation.to_radians().sin_cos();
    let right = [cos_turn, sin_turn, 0.0];
    let up = [-sin_tilt * sin_turn, sin_tilt * cos_turn, cos_tilt];
    [right, up, [cos_tilt * sin_turn, -cos_tilt * cos_turn, sin_tilt]]
}

/// Fits the eye: `|x - eye_x| <= (eye_z - z) half / focal` for all points, likewise for y, gives four
/// half-spaces; the eye is where the opposite pair meets that keeps it farther away. Returns the eye and
/// its focal length.
fn perspective(seen: &[Vec3], viewport: &Viewport) -> (Vec3, f32) {
    let focal = 0.5 * viewport.height / HALF_HEIGHT;
    let mut eye = [0.0; 3];
    let mut away = f32::NEG_INFINITY;
    for axis in 0..2 {
        let tangent = viewport.half[axis] / focal;
        let reach = |sign: f32| largest(seen.iter().map(|p| sign * p[axis] + p[2] * tangent));
        let (positive, negative) = (reach(1.0), reach(-1.0));
        eye[axis] = 0.5 * (positive - negative);
        away = away.max(0.5 * (positive + negative) / tangent);
    }
    let front = largest(seen.iter().map(|p| p[2]));
    // A single point has no size to fit: place it in the middle, a metre away.
    eye[2] = if away - front > 1e-9 * front.abs() { away } else { front + 1.0 };
    (eye, focal)
}

fn parallel(seen: &[Vec3], viewport: &Viewport) -> (Vec3, f32) {
    let mut eye = [0.0; 3];
    let mut focal = f32::INFINITY;
    for axis in 0..2 {
        let (high, low) = (largest(seen.iter().map(|p| p[axis])), -largest(seen.iter().map(|p| -p[axis])));
        eye[axis] = 0.5 * (high + low);
        if high > low {
            focal = focal.min(2.0 * viewport.half[axis] / (high - low));
        }
    }
    eye[2] = largest(seen.iter().map(|p| p[2])) + 1.0;
    (eye, if focal.is_finite() { focal } else { viewport.half[0] })
}

/// Largest finite value; zero if there is none.
fn largest(values: impl Iterator<Item = f32>) -> f32 {
    let largest = values.filter(|x| x.is_finite()).fold(f32::NEG_INFINITY, f32::max);
    if largest.is_finite() { largest } else { 0.0 }
}
