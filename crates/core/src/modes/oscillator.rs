//! Exact motion of a single mode.

/// Exact solution of `q'' + rate q' + omega^2 q = force`, `q(0) = 0`, `q'(0) = velocity`: under-damped,
/// over-damped, or without stiffness.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Oscillator {
    /// Stiffness `omega^2` [1/s^2].
    pub square: f64,
    /// Damping `2 zeta omega` [1/s].
    pub rate: f64,
    /// Constant modal force `phi . f` [N kg^-1/2].
    pub force: f64,
    /// Initial modal velocity `phi . M v` [m kg^1/2 / s].
    pub velocity: f64,
}

impl Oscillator {
    /// Returns `(q, q')` at the time `t >= 0` [s].
    ///
    /// With `d = rate/2` and the free responses `h = exp(-d t) S`, `S = sin(w t)/w`,
    /// `w^2 = omega^2 - d^2`, and its derivative: `q = velocity h + force g`, `g` the integral of `h`. If
    /// over-damped, `w` is imaginary and hyperbolic functions replace the others. Clough, Penzien 1993,
    /// *Dynamics of Structures*, sections 2.5 and 6.2.
    pub fn at(&self, t: f64) -> (f64, f64) {
        let (h, slope) = self.response(t);
        (self.velocity * h + self.force * self.integral(t, h, slope), self.velocity * slope + self.force * h)
    }

    /// Displacement and velocity after a unit initial velocity.
    fn response(&self, t: f64) -> (f64, f64) {
        let d = 0.5 * self.rate;
        let square = self.square - d * d;
        if square > 0.0 {
            let w = square.sqrt();
            let (sin, cos) = (w * t).sin_cos();
            let decay = (-d * t).exp();
            return (decay * sin / w, decay * (cos - d * sin / w));
        }
        let r = (-square).sqrt();
        // exp((r - d) t), r - d without cancellation.
        let slow = if d + r > 0.0 { self.square / (d + r) } else { 0.0 };
        let decay = (-slow * t).exp();
        // (1 - exp(-2 r t)) / (2 r)
        let rise = if r * t > 0.0 { -(-2.0 * r * t).exp_m1() / (2.0 * r) } else { t };
        (decay * rise, decay * (1.0 - (d + r) * rise))
    }

    /// Integral of `h` from 0 to `t`: the response to a unit force.
    fn integral(&self, t: f64, h: f64, slope: f64) -> f64 {
        let d = 0.5 * self.rate;
        let r = (d * d - self.square).max(0.0).sqrt();
        if self.square > 0.0 && r > 0.5 * d {
            // Strongly over-damped: h = (exp(-slow t) - exp(-fast t)) / (2 r).
            let risen = |rate: f64| -(-rate * t).exp_m1() / rate;
            return (risen(self.square / (d + r)) - risen(d + r)) / (2.0 * r);
        }
        if self.square > 0.0 {
            // h'' + rate h' + omega^2 h = 0, integrated from h' = 1.
            let w = self.square.sqrt();
            if self.rate == 0.0 {
                let half = (0.5 * w * t).sin() / w;
                return 2.0 * half * half;
            }
            return (1.0 - slope - self.rate * h) / self.square;
        }
        // Drag alone: h = (1 - exp(-rate t)) / rate.
        let z = self.rate * t;
        if z > 1e-2 {
            return (t - h) / self.rate;
        }
        // t^2 (1/2 - z/6 + z^2/24 - ...), to rounding.
        let series = [1.0, -3.0, 12.0, -60.0, 360.0, -2520.0, 20_160.0];
        t * t * series.iter().rev().fold(0.0, |sum, c| sum * z + 0.5 / c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Solution by a Taylor series in steps, independent of the kind of damping.
    fn by_series(o: &Oscillator, t: f64) -> (f64, f64) {
        let (mut q, mut v) = (0.0, o.velocity);
        let steps = 4000;
        let h = t / f64::from(steps);
        for _ in 0..steps {
            // Derivatives of all orders from the equation.
            let mut derivative = [q, v, o.force - o.rate * v - o.square * q, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
            for k in 3..9 {
                derivative[k] = -o.rate * derivative[k - 1] - o.square * derivative[k - 2];
            }
            let (mut next_q, mut next_v, mut power) = (0.0, 0.0, 1.0);
            for (k, d) in derivative.iter().enumerate().take(8) {
                next_q += d * power;
                next_v += derivative[k + 1] * power;
                power *= h / (k + 1) as f64;
            }
            (q, v) = (next_q, next_v);
        }
        (q, v)
    }

    #[test]
    fn every_kind_of_damping_solves_the_equation() {
        let rows = [
            (4.0, 0.0),
            (4.0, 0.3),
            (4.0, 4.0),
            (4.0, 3.999_999),
            (4.0, 30.0),
            (0.0, 0.0),
            (0.0, 0.7),
            (0.0, 1e-5),
            (1e-8, 0.5),
        ];
        for (square, rate) in rows {
            let oscillator = Oscillator { square, rate, force: 1.7, velocity: -0.6 };
            for t in [0.0, 0.01, 1.0, 7.0] {
                let (found, expected) = (oscillator.at(t), by_series(&oscillator, t));
                let scale = 1.0 + expected.0.abs();
                let error = (found.0 - expected.0).abs().max((found.1 - expected.1).abs()) / scale;
                assert!(error < 1e-9, "omega^2 = {square}, rate = {rate}, t = {t}: {found:?} {expected:?}");
            }
        }
    }
}
