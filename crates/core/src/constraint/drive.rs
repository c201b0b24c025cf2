//! Rigid motion of a pin that is steered during a simulation.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// Angle [rad] below which rotation series end after the first term.
const SMALL: f64 = 1e-4;

/// Pose of a pin and its velocities at one moment.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Waypoint {
    /// Displacement [m] and rotation from the start of the pin's vertices, about their mean there.
    pub pose: Isometry3<f64>,
    /// Velocity of that mean [m/s].
    pub velocity: Vector3<f64>,
    /// Angular velocity [rad/s].
    pub angular_velocity: Vector3<f64>,
}

impl Waypoint {
    /// Creates a waypoint at rest in this pose.
    pub fn at_rest(pose: Isometry3<f64>) -> Self {
        Waypoint { pose, velocity: Vector3::zeros(), angular_velocity: Vector3::zeros() }
    }

    /// True if all values are finite.
    pub fn is_finite(&self) -> bool {
        let vectors = [self.pose.translation.vector, self.velocity, self.angular_velocity];
        vectors
            .iter()
            .flat_map(|vector| vector.iter())
            .chain(self.pose.rotation.coords.iter())
            .all(|x| x.is_finite())
    }

    /// Returns the waypoint after `dt` seconds of constant velocities.
    pub fn after(&self, dt: f64) -> Self {
        let translation = Translation3::from(self.pose.translation.vector + dt * self.velocity);
        let rotation = UnitQuaternion::from_scaled_axis(dt * self.angular_velocity) * self.pose.rotation;
        Waypoint { pose: Isometry3::from_parts(translation, rotation), ..*self }
    }
}

/// Rigid motion of a pin from one [`Waypoint`] to another, with constant velocities afterwards:
/// `x(t) = c + u(t) + R(t) (x_start - c)`, `c` the mean of the starts.
///
/// `u` is the cubic Hermite polynomial with both displacements and velocities, and so is the rotation
/// vector `phi` of `R(t) = exp(phi(t)) R_begin`: position and velocity are continuous. The angular
/// velocity is `J(phi) phi'`, `J` the left Jacobian of rotations (Sola, Deray, Atchuthan 2018, *A micro
/// Lie theory for state estimation in robotics*, equations 145 and 146). The rotation takes the shorter
/// way.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Drive {
    /// Start and arrival times [s].
    times: [f64; 2],
    begin: Waypoint,
    end: Waypoint,
    /// Rotation vector from start to end, and its rate at the end.
    turn: [Vector3<f64>; 2],
    centre: Point3<f64>,
    /// Start of each vertex [m].
    starts: Vec<[f64; 3]>,
}

impl Drive {
    /// Creates the motion of vertices that started at `starts` [m], from `begin` at the time `time` to
    /// `end` after `over` [s], which is positive.
    pub(crate) fn new(time: f64, over: f64, starts: Vec<[f64; 3]>, [begin, end]: [Waypoint; 2]) -> Self {
        let turn = (end.pose.rotation * begin.pose.rotation.inverse()).scaled_axis();
        Drive {
            times: [time, time + over],
            turn: [turn, inverse_left_jacobian(turn, end.angular_velocity)],
            centre: mean(&starts),
            begin,
            end,
            starts,
        }
    }

    /// Returns the start and arrival times [s].
    pub fn times(&self) -> [f64; 2] {
        self.times
    }

    /// Returns the start of each vertex [m].
    pub(super) fn starts(&self) -> &[[f64; 3]] {
        &self.starts
    }

    /// Returns pose and velocities at the time `time` [s].
    pub fn at(&self, time: f64) -> Waypoint {
        let [from, until] = self.times;
        if time <= from {
            return self.begin.after(time - from);
        }
        if time >= until {
            return self.end.after(time - until);
        }
        let (begin, end) = (&self.begin, &self.end);
        let ends = [begin.pose.translation.vector, end.pose.translation.vector];
        let (u, velocity) = hermite(time - from, until - from, ends, [begin.velocity, end.velocity]);
        let rates = [begin.angular_velocity, self.turn[1]];
        let (phi, rate) = hermite(time - from, until - from, [Vector3::zeros(), self.turn[0]], rates);
        let rotation = UnitQuaternion::from_scaled_axis(phi) * begin.pose.rotation;
        Waypoint {
            pose: Isometry3::from_parts(Translation3::from(u), rotation),
            velocity,
            angular_velocity: left_jacobian(phi, rate),
        }
    }

    /// Returns position [m] and velocity [m/s] of the vertices at a waypoint, in the order of their
    /// starts.
    pub(super) fn places(&self, waypoint: &Waypoint) -> impl Iterator<Item = ([f64; 3], [f64; 3])> {
        let (Waypoint { pose, velocity, angular_velocity }, centre) = (*waypoint, self.centre);
        self.starts.iter().map(move |start| {
            let arm = pose.rotation * (Point3::from(*start) - centre);
            let place = centre + pose.translation.vector + arm;
            (place.coords.into(), (velocity + angular_velocity.cross(&arm)).into())
        })
    }
}

/// Mean of the points; the origin without any.
pub(super) fn mean(points: &[[f64; 3]]) -> Point3<f64> {
    let sum = points.iter().fold(Vector3::zeros(), |sum, point| sum + Vector3::from(*point));
    (sum / points.len().max(1) as f64).into()
}

/// Evaluates the cubic polynomial with these end values and rates, and its rate, after `t` of `over`
/// seconds.
fn hermite(
    t: f64,
    over: f64,
    [a, b]: [Vector3<f64>; 2],
    rates: [Vector3<f64>; 2],
) -> (Vector3<f64>, Vector3<f64>) {
    let s = t / over;
    let (va, vb) = (over * rates[0], over * rates[1]);
    let value = a + s * (va + s * (3.0 * (b - a) - 2.0 * va - vb + s * (2.0 * (a - b) + va + vb)));
    let rate = va + s * (2.0 * (3.0 * (b - a) - 2.0 * va - vb) + s * 3.0 * (2.0 * (a - b) + va + vb));
    (value, rate / over)
}

/// Computes `J(phi) x`.
fn left_jacobian(phi: Vector3<f64>, x: Vector3<f64>) -> Vector3<f64> {
    let angle = phi.norm();
    let (first, second) = if angle < SMALL {
        (0.5, 1.0 / 6.0)
    } else {
        let square = angle * angle;
        ((1.0 - libm::cos(angle)) / square, (angle - libm::sin(angle)) / (square * angle))
    };
    let once = phi.cross(&x);
    x + first * once + second * phi.cross(&once)
}

/// Computes `J(phi)^-1 x`, for angles below a full turn.
fn inverse_left_jacobian(phi: Vector3<f64>, x: Vector3<f64>) -> Vector3<f64> {
    let angle = phi.norm();
    let second = if angle < SMALL {
        1.0 / 12.0
    } else {
        (1.0 - 0.5 * angle / libm::tan(0.5 * angle)) / (angle * angle)
    };
    let once = phi.cross(&x);
    x - 0.5 * once + second * phi.cross(&once)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waypoint(turn: [f64; 3], shift: [f64; 3], velocity: [f64; 3], spin: [f64; 3]) -> Waypoint {
        let pose = Isometry3::new(shift.into(), turn.into());
        Waypoint { pose, velocity: velocity.into(), angular_velocity: spin.into() }
    }

    fn drive() -> Drive {
        let starts = vec![[0.1, 0.2, 0.3], [1.0, -0.5, 0.2], [0.3, 0.9, -1.0]];
        let begin = waypoint([0.3, -0.2, 0.5], [0.1, 0.0, 0.2], [1.0, 2.0, -1.0], [0.4, -1.5, 0.7]);
        let end = waypoint([-0.9, 1.1, 0.2], [0.4, -0.3, 0.1], [-0.5, 0.2, 0.3], [2.0, 0.3, -0.6]);
        Drive::new(2.0, 0.25, starts, [begin, end])
    }

    /// A drive passes both waypoints with their velocities.
    #[test]
    fn a_drive_passes_its_waypoints() {
        let drive = drive();
        for (time, expected) in [(2.0 + 1e-15, drive.begin), (2.25 - 1e-15, drive.end)] {
            let found = drive.at(time);
            assert!((found.pose.to_homogeneous() - expected.pose.to_homogeneous()).norm() < 1e-12);
            assert!((found.velocity - expected.velocity).norm() < 1e-12, "{found:?}");
            assert!((found.angular_velocity - expected.angular_velocity).norm() < 1e-12, "{found:?}");
        }
    }

    /// Velocities are the rates of positions before, during and after the motion.
    #[test]
    fn velocities_are_rates_of_places() {
        let drive = drive();
        // Central differences: h^2 / 6 of third derivatives of some 1e3 m/s^3, and roundings over h.
        let h = 1e-6;
        for time in [1.9, 2.01, 2.1, 2.125, 2.24, 2.4] {
            let places = |time| drive.places(&drive.at(time)).collect::<Vec<_>>();
            for ((a, now), b) in places(time - h).iter().zip(places(time)).zip(places(time + h)) {
                for c in 0..3 {
                    let rate = (b.0[c] - a.0[c]) / (2.0 * h);
                    assert!((rate - now.1[c]).abs() < 1e-8, "at {time}: {rate} and {}", now.1[c]);
                }
            }
        }
    }

    #[test]
    fn the_two_jacobians_are_inverse() {
        let x = Vector3::new(0.3, -0.7, 1.1);
        for angle in [0.0, 1e-9, 0.9e-4, 1.1e-4, 0.1, 1.0, 3.1] {
            let phi = angle * Vector3::new(2.0, -1.0, 2.0) / 3.0;
            let back = inverse_left_jacobian(phi, left_jacobian(phi, x));
            // Below `SMALL` the next term of the series is angle^2 / 360 and less.
            assert!((back - x).norm() < 1e-10, "{angle}: {back}");
        }
    }
}
