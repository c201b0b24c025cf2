//! Distance of a trajectory from the reference.

use super::trajectory::{InvariantSeries, StateSamples};

/// Masses of the free vertices and initial positions: scales of the relative errors.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorScales {
    /// Dimension, 2 or 3.
    dimension: usize,
    /// Mass of every vertex, 0 for pinned ones [kg].
    mass: Vec<f64>,
    /// Initial positions, flat [m].
    start: Vec<f64>,
}

/// Errors at one time, in the units of the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TimeError {
    /// Time [s].
    pub time: f64,
    /// Mass-weighted root mean square of distances [m].
    pub q_rms: f64,
    /// Largest distance [m].
    pub q_max: f64,
    /// Mass-weighted root mean square of velocity differences [m/s].
    pub v_rms: f64,
}

/// Errors of one run: largest values over all times of comparison, relative to the reference's motion.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct Errors {
    /// `max_t sqrt(sum m |q - q_ref|^2 / sum m)` over `max_t sqrt(sum m |u_ref|^2 / sum m)`, `u` the
    /// displacement from the start.
    pub q_rms: f64,
    /// `max_t max_i |q_i - q_ref,i|`, relative to the same scale.
    pub q_max: f64,
    /// Velocity error as in `q_rms`, relative to the largest rms velocity of the reference.
    pub v_rms: f64,
    /// Errors at each time.
    pub at: Vec<TimeError>,
}

impl ErrorScales {
    /// Scales for vertices of these masses [kg], in the order of the trajectory, with initial positions
    /// `start`; pinned vertices do not count.
    pub fn new(
        dimension: usize,
        mass: &[f64],
        is_pinned: impl Fn(usize) -> bool,
        start: &[f64],
    ) -> ErrorScales {
        let mass = mass.iter().enumerate().map(|(i, m)| if is_pinned(i) { 0.0 } else { *m }).collect();
        ErrorScales { dimension, mass, start: start.to_vec() }
    }

    /// Total free mass [kg].
    pub fn total(&self) -> f64 {
        self.mass.iter().sum()
    }

    /// Mass-weighted root mean square distance, `sqrt(sum m |a - b|^2 / sum m)`.
    pub fn rms(&self, a: &[f64], b: &[f64]) -> f64 {
        let rows = a.chunks_exact(self.dimension).zip(b.chunks_exact(self.dimension));
        let sum: f64 = rows.zip(&self.mass).map(|((a, b), m)| m * square(a, b)).sum();
        (sum / self.total()).sqrt()
    }

    /// Largest distance of a free vertex.
    fn largest(&self, a: &[f64], b: &[f64]) -> f64 {
        let rows = a.chunks_exact(self.dimension).zip(b.chunks_exact(self.dimension));
        let free = rows.zip(&self.mass).filter(|(_, m)| **m > 0.0);
        free.map(|((a, b), _)| square(a, b)).fold(0.0, f64::max).sqrt()
    }

    /// Largest rms displacement [m] and rms velocity [m/s] of a trajectory.
    pub fn scales(&self, reference: &StateSamples) -> (f64, f64) {
        let zero = vec![0.0; self.start.len()];
        let largest = |values: &[Vec<f64>], from: &[f64]| {
            let size = values.iter().map(|value| self.rms(value, from)).fold(0.0, f64::max);
            // Without motion errors are absolute.
            if size > 0.0 { size } else { 1.0 }
        };
        (largest(&reference.x, &self.start), largest(&reference.v, &zero))
    }

    /// Errors of `trajectory`; infinite if it ended early.
    pub fn errors(&self, trajectory: &StateSamples, reference: &StateSamples) -> Errors {
        let (q_scale, v_scale) = self.scales(reference);
        let pairs = trajectory.x.iter().zip(&trajectory.v).zip(reference.x.iter().zip(&reference.v));
        let at: Vec<TimeError> = pairs
            .zip(&reference.times)
            .map(|(((x, v), (x_ref, v_ref)), time)| TimeError {
                time: *time,
                q_rms: self.rms(x, x_ref),
                q_max: self.largest(x, x_ref),
                v_rms: self.rms(v, v_ref),
            })
            .collect();
        let complete = trajectory.x.len() == reference.x.len();
        let largest = |of: fn(&TimeError) -> f64, scale: f64| match complete {
            true => at.iter().map(of).fold(0.0, f64::max) / scale,
            false => f64::INFINITY,
        };
        Errors {
            q_rms: largest(|e| e.q_rms, q_scale),
            q_max: largest(|e| e.q_max, q_scale),
            v_rms: largest(|e| e.v_rms, v_scale),
            at,
        }
    }

    /// Relative errors of momentum and angular momentum: `max_t |p - p_ref|` over `sum m` times the
    /// reference's largest rms velocity, and `max_t |L - L_ref|` over that times its largest rms distance
    /// from the origin.
    pub fn momentum_errors(&self, series: &InvariantSeries, reference: &StateSamples) -> (f64, f64) {
        let (_, speed) = self.scales(reference);
        let zero = vec![0.0; self.start.len()];
        let reach = reference.x.iter().map(|x| self.rms(x, &zero)).fold(f64::MIN_POSITIVE, f64::max);
        let (mut linear, mut angular) = (0.0f64, 0.0f64);
        let measured = series.momentum.iter().zip(&series.angular_momentum).skip(1);
        for ((p, l), (x, v)) in measured.zip(reference.x.iter().zip(&reference.v)) {
            let (p_ref, l_ref) = self.momenta(x, v);
            linear = linear.max(square(p, &p_ref).sqrt());
            angular = angular.max(square(l, &l_ref).sqrt());
        }
        let scale = self.total() * speed;
        (linear / scale, angular / (scale * reach))
    }

    /// Momentum `sum m v` and angular momentum `sum m x cross v`.
    fn momenta(&self, x: &[f64], v: &[f64]) -> ([f64; 3], [f64; 3]) {
        let (mut p, mut l) = ([0.0; 3], [0.0; 3]);
        let d = self.dimension;
        for ((x, v), m) in x.chunks_exact(d).zip(v.chunks_exact(d)).zip(&self.mass) {
            let row = |row: &[f64]| std::array::from_fn::<f64, 3, _>(|c| row.get(c).copied().unwrap_or(0.0));
            let (x, v) = (row(x), row(v));
            for c in 0..3 {
                let (a, b) = ((c + 1) % 3, (c + 2) % 3);
                p[c] += m * v[c];
                l[c] += m * (x[a] * v[b] - x[b] * v[a]);
            }
        }
        (p, l)
    }
}

/// Squared distance `|a - b|^2`.
fn square(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two free vertices of masses 1 and 3 and a pinned one, in 2D, at one time.
    fn trajectory(x: [f64; 6], v: [f64; 6]) -> StateSamples {
        StateSamples { times: vec![1.0], x: vec![x.to_vec()], v: vec![v.to_vec()] }
    }

    // E
    #[test]
    fn errors_are_weighted_by_mass_and_relative_to_the_motion() {
        let weights = ErrorScales::new(2, &[1.0, 3.0, 5.0], |i| i == 2, &[0.0; 6]);
        let reference = trajectory([2.0, 0.0, 0.0, 2.0, 9.0, 9.0], [1.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
        let other = trajectory([2.0, 0.2, 0.0, 2.0, 0.0, 0.0], [1.0, 0.0, 1.0, 0.4, 0.0, 0.0]);
        let errors = weights.errors(&other, &reference);
        // sqrt(1 * 0.04 / 4) / sqrt((1 * 4 + 3 * 4) / 4) = 0.1 / 2; the largest distance is 0.2.
        assert!((errors.q_rms - 0.05).abs() < 1e-15);
        assert!((errors.q_max - 0.1).abs() < 1e-15);
        // sqrt(3 * 0.16 / 4) / sqrt((1 + 3) / 4)
        assert!((errors.v_rms - 0.12f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn a_run_that_ended_early_has_no_finite_error() {
        let weights = ErrorScales::new(2, &[1.0, 3.0, 5.0], |i| i == 2, &[0.0; 6]);
        let reference = trajectory([2.0, 0.0, 0.0, 2.0, 9.0, 9.0], [1.0; 6]);
        let errors = weights.errors(&StateSamples::default(), &reference);
        assert_eq!(errors.q_rms, f64::INFINITY);
    }
}
