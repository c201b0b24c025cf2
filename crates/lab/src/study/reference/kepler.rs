//! Exact reference for two bodies: Kepler's equation.

use super::{Reference, ReferenceSearch};
use crate::study::StudyError;
use crate::study::plan::TimeStepping;
use crate::study::trajectory::StateSamples;
use pliant::algebra::dot;

/// Relative position and velocity of a Kepler orbit.
struct Orbit {
    /// `G (m_1 + m_2)`, or `G` times the fixed mass [m^3/s^2].
    mu: f64,
    x: [f64; 3],
    v: [f64; 3],
}

impl Orbit {
    /// Semi-major axis [m]; `None` for an orbit that is not an ellipse.
    fn axis(&self) -> Option<f64> {
        let (r, v2) = (dot(&self.x, &self.x).sqrt(), dot(&self.v, &self.v));
        let axis = 1.0 / (2.0 / r - v2 / self.mu);
        (r > 0.0 && axis.is_finite() && axis > 0.0).then_some(axis)
    }

    /// Mean motion [rad/s].
    fn motion(&self, axis: f64) -> f64 {
        (self.mu / axis.powi(3)).sqrt()
    }

    /// State after `t` [s], by Lagrange's `f` and `g` functions of the difference `E` of eccentric
    /// anomalies; Danby 1988, *Fundamentals of celestial mechanics*, section 6.7.
    fn after(&self, axis: f64, t: f64) -> ([f64; 3], [f64; 3]) {
        let r0 = dot(&self.x, &self.x).sqrt();
        let n = self.motion(axis);
        // e cos E_0 and e sin E_0.
        let (ec, es) = (1.0 - r0 / axis, dot(&self.x, &self.v) / (n * axis * axis));
        let mean = (n * t).rem_euclid(std::f64::consts::TAU);
        // E - ec sin E + es (1 - cos E) = n t is monotonic in E: Newton's method with bracketing.
        let value = |e: f64| e - ec * e.sin() + es * (1.0 - e.cos()) - mean;
        let (mut low, mut high) = (mean - 2.0, mean + 2.0);
        let mut e = mean;
        for _ in 0..100 {
            let f = value(e);
            if f > 0.0 {
                high = e;
            } else {
                low = e;
            }
            let newton = e - f / (1.0 - ec * e.cos() + es * e.sin());
            let next = if low < newton && newton < high { newton } else { 0.5 * (low + high) };
            if next == e {
                break;
            }
            e = next;
        }
        let (sin, cos) = e.sin_cos();
        let r = axis * (1.0 - ec * cos + es * sin);
        let f = 1.0 - axis / r0 * (1.0 - cos);
        let g = (mean - e + sin) / n;
        let df = -n * axis * axis / (r * r0) * sin;
        let dg = 1.0 - axis / r * (1.0 - cos);
        let combine = |a: f64, b: f64| std::array::from_fn(|c| a * self.x[c] + b * self.v[c]);
        (combine(f, g), combine(df, dg))
    }
}

/// Solution for two bodies under their mutual gravity only, one of them possibly fixed, on an ellipse.
pub(super) fn solution(search: &mut ReferenceSearch<'_, '_>) -> Result<Option<Reference>, StudyError> {
    let (scene, grid) = (search.scene, search.grid());
    let Some(nbody) = &scene.world.nbody else { return Ok(None) };
    let nothing_else = scene.world.gravity.is_none()
        && scene.world.walls.is_empty()
        && scene.world.ether_drag.unwrap_or(0.0) == 0.0
        && scene.attachment.is_empty()
        && nbody.softening == 0.0
        && nbody.tree.is_none();
    let bare = scene.body.iter().all(|body| {
        let holds_still = body.pin.iter().all(|pin| pin.motion.is_none() && pin.until.is_none());
        body.load.is_empty() && body.damping.is_none() && body.is_particles() && holds_still
    });
    if !(nothing_else && bare) {
        return Ok(None);
    }
    let scheme = scene.time.integrator.into();
    let assembly =
        search.runner.assemble(scene, scheme, TimeStepping::Parts(1)).map_err(StudyError::Scene)?;
    let simulation = &assembly.simulation;
    let system = simulation.system();
    let (d, mass) = (system.dimension(), &assembly.topology.masses);
    if mass.len() != 2 {
        return Ok(None);
    }
    let (x, v) = (simulation.positions(), simulation.velocities());
    let row = |rows: &[f64], i: usize| -> [f64; 3] {
        std::array::from_fn(|c| if c < d { rows[i * d + c] } else { 0.0 })
    };
    let minus = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { std::array::from_fn(|c| a[c] - b[c]) };
    let internal = |i: usize| simulation.numbering().internal(i as u32) as usize;
    let partly = |i: usize| {
        let weights = &system.inverse_mass()[internal(i) * d..][..d];
        weights.contains(&0.0) && !weights.iter().all(|w| *w == 0.0)
    };
    let held = [0, 1].map(|i| system.is_pinned(internal(i)));
    if partly(0) || partly(1) || held == [true, true] {
        return Ok(None);
    }
    let mu = nbody.constant
        * match held {
            [true, _] => mass[0],
            [_, true] => mass[1],
            _ => mass[0] + mass[1],
        };
    let orbit = Orbit { mu, x: minus(row(&x, 1), row(&x, 0)), v: minus(row(&v, 1), row(&v, 0)) };
    let Some(axis) = orbit.axis() else { return Ok(None) };
    // Shares of the relative motion, and the motion of the centre of mass.
    let (first, second) = match held {
        [true, _] => (0.0, 1.0),
        [_, true] => (1.0, 0.0),
        _ => (mass[1] / (mass[0] + mass[1]), mass[0] / (mass[0] + mass[1])),
    };
    let centre = |rows: &[f64]| -> [f64; 3] {
        let (a, b) = (row(rows, 0), row(rows, 1));
        std::array::from_fn(|c| second * a[c] + first * b[c])
    };
    let (centre_x, centre_v) = (centre(&x), centre(&v));
    let mut trajectory = StateSamples::default();
    for i in 1..=grid.times {
        let t = grid.duration * i as f64 / grid.times as f64;
        let (rx, rv) = orbit.after(axis, t);
        let rows = |centre: [f64; 3], relative: [f64; 3]| -> Vec<f64> {
            let body = |share: f64| (0..d).map(move |c| centre[c] + share * relative[c]);
            body(-first).chain(body(second)).collect()
        };
        let moved = std::array::from_fn(|c| centre_x[c] + t * centre_v[c]);
        trajectory.times.push(t);
        trajectory.x.push(rows(moved, rx));
        trajectory.v.push(rows(centre_v, rv));
    }
    // The rounding error of the mean anomaly grows with it, and speeds at the pericentre amplify it.
    let revolutions = orbit.motion(axis) * grid.duration;
    let error = f64::EPSILON * (10.0 + 10.0 * revolutions);
    Ok(Some(Reference {
        id: "kepler".into(),
        how: "exact: Kepler's equation".into(),
        error,
        disagreement: Some(0.0),
        trajectory,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    // A2: 40 digits, e = 0.6 and 0.9.
    #[test]
    fn keplers_equation_gives_the_states_of_the_plan() {
        let states = [
            (
                0.6,
                1.0,
                [-0.628_948_176_826_624_2, 0.799_664_730_970_039_3],
                [-0.982_515_690_938_811_3, -0.022_763_170_097_430_42],
            ),
            (
                0.6,
                100.0,
                [-0.104_183_204_434_180_6, -0.694_741_715_567_950_6],
                [1.236_177_762_687_076_3, 0.564_623_251_085_864_6],
            ),
            (
                0.9,
                10.0,
                [-1.853_853_709_405_579_2, -0.130_885_404_839_925_55],
                [0.161_569_452_558_431_34, -0.223_719_276_791_897_1],
            ),
        ];
        for (e, t, x, v) in states {
            let speed = f64::sqrt((1.0 + e) / (1.0 - e));
            let orbit = Orbit { mu: 1.0, x: [1.0 - e, 0.0, 0.0], v: [0.0, speed, 0.0] };
            let (rx, rv) = orbit.after(orbit.axis().unwrap(), t);
            for c in 0..2 {
                assert!((rx[c] - x[c]).abs() < 3e-13, "e = {e}, t = {t}: {rx:?}");
                assert!((rv[c] - v[c]).abs() < 3e-13, "e = {e}, t = {t}: {rv:?}");
            }
        }
    }
}
