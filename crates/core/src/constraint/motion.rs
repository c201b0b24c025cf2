//! Prescribed motion: rotation about an axis and displacements, as functions of time.

use std::fmt;

use nalgebra::{Isometry3, Point3, Vector3};

use super::Waypoint;
use crate::algebra::{cross, dot, unit};

/// A time-dependent vector: value and rate at the time `t` [s].
pub type Path = Box<dyn Fn(f64) -> ([f64; 3], [f64; 3]) + Send + Sync>;
/// A time-dependent angle: value [rad] and rate [rad/s] at the time `t` [s].
type Turn = Box<dyn Fn(f64) -> (f64, f64) + Send + Sync>;
/// A vector field: value and rate at the reference position `X` [m] and the time `t` [s].
type Field = Box<dyn Fn([f64; 3], f64) -> ([f64; 3], [f64; 3]) + Send + Sync>;

/// Motion `x(t) = c + R(t) (x(0) - c) + sum u(t)`: a rotation about a point `c`, then displacements, each
/// optional.
#[derive(Default)]
pub struct Motion {
    rotation: Option<Rotation>,
    paths: Vec<Path>,
    field: Option<Field>,
    /// Times of kinks, ascending [s].
    breaks: Vec<f64>,
    /// True if positions are known to be continuous.
    is_continuous: bool,
}

/// Rotation about an axis through a point, counter-clockwise as seen against the axis.
pub struct Rotation {
    point: [f64; 3],
    axis: [f64; 3],
    angle: Turn,
}

impl Rotation {
    /// Creates the rotation about `axis` (of any length) through `point` [m]; `angle` returns the angle
    /// [rad] and its rate [rad/s] at the time `t` [s].
    ///
    /// # Panics
    /// If the axis is zero.
    pub fn new(
        point: [f64; 3],
        axis: [f64; 3],
        angle: impl Fn(f64) -> (f64, f64) + Send + Sync + 'static,
    ) -> Self {
        let (axis, length) = unit(&axis);
        assert!(length > 0.0, "an axis has a direction");
        Rotation { point, axis, angle: Box::new(angle) }
    }

    /// Returns the fixed point [m].
    pub fn point(&self) -> [f64; 3] {
        self.point
    }
}

impl Motion {
    /// Creates an empty motion.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a rotation.
    #[must_use]
    pub fn turning(mut self, rotation: Rotation) -> Self {
        self.rotation = Some(rotation);
        self
    }

    /// Adds a displacement common to all vertices.
    #[must_use]
    pub fn along(mut self, path: impl Fn(f64) -> ([f64; 3], [f64; 3]) + Send + Sync + 'static) -> Self {
        self.paths.push(Box::new(path));
        self
    }

    /// Adds a displacement field, evaluated at the reference position of each vertex.
    #[must_use]
    pub fn by(
        mut self,
        field: impl Fn([f64; 3], f64) -> ([f64; 3], [f64; 3]) + Send + Sync + 'static,
    ) -> Self {
        self.field = Some(Box::new(field));
        self
    }

    /// Sets the times [s], ascending, at which velocities or their rates jump; adaptive steps end there.
    #[must_use]
    pub fn breaking_at(mut self, breaks: Vec<f64>) -> Self {
        self.breaks = breaks;
        self
    }

    /// Declares positions continuous in time: steps are not checked for jumps.
    #[must_use]
    pub fn continuous(mut self) -> Self {
        self.is_continuous = true;
        self
    }

    /// True if positions are known to be continuous.
    pub(crate) fn is_continuous(&self) -> bool {
        self.is_continuous
    }

    /// Returns the first kink after `time` [s].
    pub(crate) fn next_break(&self, time: f64) -> Option<f64> {
        self.breaks.get(self.breaks.partition_point(|at| *at <= time)).copied()
    }

    /// Returns the rotation.
    pub fn rotation(&self) -> Option<&Rotation> {
        self.rotation.as_ref()
    }

    /// Returns the part common to all vertices at the time `time` [s].
    pub(super) fn at(&self, time: f64) -> Moment<'_> {
        let mut displacement = ([0.0; 3], [0.0; 3]);
        for path in &self.paths {
            displacement = sum(displacement, path(time));
        }
        let rotation = self.rotation.as_ref().map(|rotation| {
            let (angle, rate) = (rotation.angle)(time);
            Turned {
                point: rotation.point,
                axis: rotation.axis,
                sin: libm::sin(angle),
                cos: libm::cos(angle),
                rate,
            }
        });
        Moment { time, displacement, rotation, field: self.field.as_ref() }
    }
}

impl fmt::Debug for Motion {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Motion { rotation, paths, field, .. } = self;
        write!(formatter, "Motion({}, {}, {})", rotation.is_some(), paths.len(), field.is_some())
    }
}

/// A motion at one time.
pub(super) struct Moment<'a> {
    time: f64,
    displacement: ([f64; 3], [f64; 3]),
    rotation: Option<Turned>,
    field: Option<&'a Field>,
}

#[derive(Clone, Copy)]
struct Turned {
    point: [f64; 3],
    axis: [f64; 3],
    sin: f64,
    cos: f64,
    rate: f64,
}

impl Moment<'_> {
    /// Returns position and velocity of the vertex with the start `start` and the reference position
    /// `rest`.
    pub(super) fn place(&self, start: [f64; 3], rest: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        let mut place = self.displacement;
        match &self.rotation {
            Some(rotation) => place = sum(place, rotation.place(start)),
            None => place.0 = add(place.0, start),
        }
        if let Some(field) = self.field {
            place = sum(place, field(rest, self.time));
        }
        place
    }
}

impl Moment<'_> {
    /// Returns pose and velocities of a rigid body whose mean started at `centre`; `None` if the motion
    /// is not rigid.
    pub(super) fn rigid(&self, centre: Point3<f64>) -> Option<Waypoint> {
        if self.field.is_some() {
            return None;
        }
        let start = centre.coords.into();
        let (place, velocity) = self.place(start, start);
        let (turn, spin) = self.rotation.as_ref().map_or_else(Default::default, |rotation| {
            let axis = Vector3::from(rotation.axis);
            let angle = libm::atan2(rotation.sin, rotation.cos);
            (angle * axis, rotation.rate * axis)
        });
        let pose = Isometry3::new(Vector3::from(place) - centre.coords, turn);
        Some(Waypoint { pose, velocity: velocity.into(), angular_velocity: spin })
    }

    /// Returns the derivatives with respect to the start of a vertex, given the derivatives `x` with
    /// respect to its position and `v` with respect to its velocity: `R^T x + R'^T v`.
    pub(super) fn by_start(&self, x: [f64; 3], v: [f64; 3]) -> [f64; 3] {
        let Some(rotation) = &self.rotation else { return x };
        // R' = rate [a] R, and R'^T v = -rate R^T (a x v).
        let turned = cross(&rotation.axis, &v).map(|v| -rotation.rate * v);
        Turned { point: [0.0; 3], ..rotation.back() }.place(add(x, turned)).0
    }

    /// Returns the start from which the vertex with the reference position `rest` arrives at `place` now:
    /// `x(0) = c + R^T (x - sum u - c)`.
    pub(super) fn start(&self, place: [f64; 3], rest: [f64; 3]) -> [f64; 3] {
        let field = self.field.map_or([0.0; 3], |field| field(rest, self.time).0);
        let turned = [0, 1, 2].map(|c| place[c] - self.displacement.0[c] - field[c]);
        self.rotation.as_ref().map_or(turned, |rotation| rotation.back().place(turned).0)
    }
}

impl Turned {
    /// Inverse rotation.
    fn back(&self) -> Turned {
        Turned { sin: -self.sin, rate: -self.rate, ..*self }
    }

    /// Rodrigues' formula: `x = c + r cos + (a x r) sin + a (a . r) (1 - cos)`, `v = rate a x (x - c)`.
    fn place(&self, start: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        let Turned { point, axis, sin, cos, rate } = *self;
        let r = [0, 1, 2].map(|c| start[c] - point[c]);
        let (across, along) = (cross(&axis, &r), dot(&axis, &r));
        let turned = [0, 1, 2].map(|c| r[c] * cos + across[c] * sin + axis[c] * along * (1.0 - cos));
        (add(point, turned), cross(&axis, &turned).map(|v| rate * v))
    }
}

fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| a[c] + b[c])
}

fn sum(a: ([f64; 3], [f64; 3]), b: ([f64; 3], [f64; 3])) -> ([f64; 3], [f64; 3]) {
    (add(a.0, b.0), add(a.1, b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Velocities are the rates of positions: halving the step of central differences leaves a quarter of
    /// the error.
    #[test]
    fn velocities_are_the_limits_of_differences() {
        let rotation = Rotation::new([0.1, -0.2, 0.3], [1.0, 2.0, -0.5], |t| (3.0 * t * t, 6.0 * t));
        let motion = Motion::new()
            .turning(rotation)
            .along(|t| ([t * t, 0.0, t.sin()], [2.0 * t, 0.0, t.cos()]))
            .by(|x, t| ([x[1] * t.exp(), 0.0, 0.0], [x[1] * t.exp(), 0.0, 0.0]));
        let (start, rest) = ([0.7, 0.4, -0.6], [0.5, 1.5, 0.0]);
        let place = |t: f64| motion.at(t).place(start, rest);
        let error =
            |h: f64, c: usize| (place(0.4 + h).0[c] - place(0.4 - h).0[c]) / (2.0 * h) - place(0.4).1[c];
        for c in 0..3 {
            let (coarse, fine) = (error(2e-3, c), error(1e-3, c));
            assert!((coarse / fine - 4.0).abs() < 0.05, "{c}: {coarse} {fine}");
        }
    }

    // Positions and velocities are affine in the start: differences are exact.
    #[test]
    fn derivatives_by_starts_are_the_transpose_of_the_motion() {
        let rotation = Rotation::new([0.1, -0.2, 0.3], [1.0, 2.0, -0.5], |t| (3.0 * t, 3.0));
        let motion = Motion::new().turning(rotation).along(|t| ([t, 0.0, -t], [1.0, 0.0, -1.0]));
        let (start, rest, x, v) = ([0.7, 0.4, -0.6], [0.0; 3], [0.3, -1.1, 0.4], [0.8, 0.2, -0.5]);
        let moment = motion.at(0.8);
        let value = |start: [f64; 3]| {
            let (place, velocity) = moment.place(start, rest);
            dot(&x, &place) + dot(&v, &velocity)
        };
        let by_start = moment.by_start(x, v);
        for c in 0..3 {
            let moved = [0, 1, 2].map(|k| start[k] + if k == c { 0.5 } else { 0.0 });
            let difference = (value(moved) - value(start)) / 0.5;
            assert!((by_start[c] - difference).abs() < 1e-14, "{c}: {} {difference}", by_start[c]);
        }
    }

    #[test]
    fn the_start_is_where_the_motion_comes_from() {
        let rotation = Rotation::new([0.1, -0.2, 0.3], [1.0, 2.0, -0.5], |t| (3.0 * t, 3.0));
        let motion = Motion::new()
            .turning(rotation)
            .along(|t| ([t, 0.0, -t], [1.0, 0.0, -1.0]))
            .by(|x, t| ([x[1] * t, 0.0, 0.0], [x[1], 0.0, 0.0]));
        let (start, rest) = ([0.7, 0.4, -0.6], [0.5, 1.5, 0.0]);
        let back = motion.at(0.8).start(motion.at(0.8).place(start, rest).0, rest);
        (0..3).for_each(|c| assert!((back[c] - start[c]).abs() < 1e-15 * 10.0, "{back:?}"));
    }

    #[test]
    fn a_rotation_is_counter_clockwise_and_keeps_the_axis() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let motion =
            Motion::new().turning(Rotation::new([1.0, 0.0, 5.0], [0.0, 0.0, 3.0], move |_| (quarter, 2.0)));
        let (x, v) = motion.at(0.0).place([3.0, 0.0, 1.0], [0.0; 3]);
        for (found, expected) in x.iter().chain(&v).zip([1.0, 2.0, 1.0, -4.0, 0.0, 0.0]) {
            assert!((found - expected).abs() < 1e-15, "{x:?} {v:?}");
        }
    }
}
