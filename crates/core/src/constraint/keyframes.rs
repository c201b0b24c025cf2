//! Keyframes: displacements given at times, with interpolation.

/// Interpolation between two keyframes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Linear: velocities jump at the keyframes.
    Linear,
    /// Monotone cubic with continuous velocity, within the range of the two neighbouring values, and at
    /// rest at both ends: Fritsch, Butland 1984, *A method for constructing local monotone piecewise
    /// cubic interpolants*, SIAM J. Sci. Stat. Comput. 5, 300, with the weights of Brodlie.
    Smooth,
}

/// Interpolated displacements; constant before the first and after the last keyframe.
#[derive(Clone, Debug)]
pub struct Keyframes {
    times: Vec<f64>,
    displacements: Vec<[f64; 3]>,
    /// Rates at the keyframes; empty for linear interpolation.
    rates: Vec<[f64; 3]>,
}

impl Keyframes {
    /// Creates keyframes with displacements [m] at ascending times [s].
    ///
    /// # Panics
    /// If the numbers of times and displacements differ, or there is no time.
    pub fn new(times: Vec<f64>, displacements: Vec<[f64; 3]>, interpolation: Interpolation) -> Self {
        assert_eq!(times.len(), displacements.len(), "one displacement for each time");
        assert!(!times.is_empty() && times.is_sorted(), "ascending times");
        let rates = match interpolation {
            Interpolation::Linear => vec![],
            Interpolation::Smooth => monotone_rates(&times, &displacements),
        };
        Keyframes { times, displacements, rates }
    }

    /// Returns displacement [m] and velocity [m/s] at the time `t` [s]; at a keyframe, the velocity of
    /// the following interval.
    pub fn at(&self, t: f64) -> ([f64; 3], [f64; 3]) {
        let after = self.times.partition_point(|time| *time <= t);
        if after == 0 || after == self.times.len() {
            return (self.displacements[after.saturating_sub(1)], [0.0; 3]);
        }
        let (length, s) = (self.times[after] - self.times[after - 1], t - self.times[after - 1]);
        let (from, to) = (self.displacements[after - 1], self.displacements[after]);
        let slope = [0, 1, 2].map(|c| (to[c] - from[c]) / length);
        if self.rates.is_empty() {
            return ([0, 1, 2].map(|c| from[c] + s * slope[c]), slope);
        }
        let (left, right) = (self.rates[after - 1], self.rates[after]);
        // Newton's form of the cubic.
        let second = [0, 1, 2].map(|c| (slope[c] - left[c]) / length);
        let third = [0, 1, 2].map(|c| (left[c] + right[c] - 2.0 * slope[c]) / (length * length));
        let value = |c: usize| from[c] + s * (left[c] + s * (second[c] + (s - length) * third[c]));
        let rate = |c: usize| left[c] + 2.0 * s * second[c] + s * (3.0 * s - 2.0 * length) * third[c];
        ([0, 1, 2].map(value), [0, 1, 2].map(rate))
    }
}

/// Rates of the monotone cubic: zero at both ends and at extremes, otherwise the weighted harmonic mean
/// of the two slopes.
fn monotone_rates(times: &[f64], displacements: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut rates = vec![[0.0; 3]; times.len()];
    for i in 1..times.len().saturating_sub(1) {
        let (before, after) = (times[i] - times[i - 1], times[i + 1] - times[i]);
        for c in 0..3 {
            let left = (displacements[i][c] - displacements[i - 1][c]) / before;
            let right = (displacements[i + 1][c] - displacements[i][c]) / after;
            if left * right > 0.0 {
                let (w1, w2) = (2.0 * after + before, after + 2.0 * before);
                rates[i][c] = (w1 + w2) / (w1 / left + w2 / right);
            }
        }
    }
    rates
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMES: [f64; 4] = [0.5, 1.0, 2.0, 2.5];
    const VALUES: [f64; 4] = [0.0, 0.3, 1.0, 0.25];

    fn keyframes(interpolation: Interpolation) -> Keyframes {
        Keyframes::new(TIMES.to_vec(), VALUES.map(|x| [x, 2.0 * x, -x]).to_vec(), interpolation)
    }

    #[test]
    fn both_kinds_pass_through_the_values_and_hold_the_ends() {
        for interpolation in [Interpolation::Linear, Interpolation::Smooth] {
            let keyframes = keyframes(interpolation);
            for (t, x) in TIMES.into_iter().zip(VALUES) {
                let (found, _) = keyframes.at(t);
                assert!((found[0] - x).abs() < 1e-15 && (found[1] - 2.0 * x).abs() < 1e-15, "{t}: {found:?}");
            }
            assert_eq!(keyframes.at(0.0), ([0.0, 0.0, -0.0], [0.0; 3]));
            assert_eq!(keyframes.at(9.0), ([0.25, 0.5, -0.25], [0.0; 3]));
        }
        let (x, v) = keyframes(Interpolation::Linear).at(1.5);
        assert!((x[0] - 0.65).abs() < 1e-15 && (v[0] - 0.7).abs() < 1e-15);
    }

    #[test]
    fn smooth_ones_have_a_continuous_velocity_and_never_overshoot() {
        let keyframes = keyframes(Interpolation::Smooth);
        for (i, t) in TIMES.into_iter().enumerate() {
            let (before, after) = (keyframes.at(t - 1e-9).1[0], keyframes.at(t + 1e-9).1[0]);
            assert!((before - after).abs() < 1e-7, "{t}: {before} {after}");
            // At rest at the ends and at the extreme, and nowhere else.
            assert_eq!(after.abs() < 1e-7, i != 1, "{t}: {after}");
        }
        let mut largest = f64::MIN;
        for i in 0..=2000 {
            let t = 0.5 + f64::from(i) * 1e-3;
            let (x, v) = keyframes.at(t);
            largest = largest.max(x[0]);
            let difference = (keyframes.at(t + 1e-6).0[0] - keyframes.at(t - 1e-6).0[0]) / 2e-6;
            assert!((difference - v[0]).abs() < 1e-4, "{t}: {difference} {}", v[0]);
        }
        assert!(largest <= 1.0 + 1e-15, "{largest}");
    }
}
