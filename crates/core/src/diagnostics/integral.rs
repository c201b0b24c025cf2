//! Time integrals of rates known at each step.

/// Time integral of a rate sampled after each step, to fourth order: the cubic through the last four
/// samples (Adams-Moulton weights if steps are equal); at the start, the polynomial through all samples.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Integral {
    /// Integral up to the last restart, plus added amounts.
    before: f64,
    /// Last samples, latest first.
    samples: [f64; 4],
    /// Steps between them [s].
    steps: [f64; 3],
    count: usize,
    /// Integral since the last restart.
    since: f64,
}

impl Integral {
    /// Creates a zero integral at the initial rate `rate`.
    pub(super) fn new(rate: f64) -> Self {
        Integral { before: 0.0, samples: [rate, 0.0, 0.0, 0.0], steps: [0.0; 3], count: 1, since: 0.0 }
    }

    /// Advances by a step `h` [s] to a time with the rate `rate`.
    pub(super) fn advance(&mut self, h: f64, rate: f64) {
        self.samples.rotate_right(1);
        self.samples[0] = rate;
        self.steps.rotate_right(1);
        self.steps[0] = h;
        self.count += 1;
        let [a, b, c, d] = self.samples;
        let intervals = self.count.min(4) - 1;
        let even = self.steps[1..intervals].iter().all(|step| *step == h);
        // With up to four samples, over all intervals at once.
        self.since = match self.count {
            2 => h / 2.0 * (a + b),
            3 if even => h / 3.0 * (a + 4.0 * b + c),
            4 if even => 3.0 * h / 8.0 * (a + 3.0 * b + 3.0 * c + d),
            3 | 4 => self.cubic(self.steps[..intervals].iter().sum()),
            _ if even => self.since + h / 24.0 * (9.0 * a + 19.0 * b - 5.0 * c + d),
            _ => self.since + self.cubic(h),
        };
    }

    /// Integrates the polynomial through the last samples over the last `span` [s], by the two-point
    /// Gauss rule, which is exact.
    fn cubic(&self, span: f64) -> f64 {
        let offset = 0.5 / 3.0_f64.sqrt();
        0.5 * span * (self.interpolated((0.5 - offset) * span) + self.interpolated((0.5 + offset) * span))
    }

    /// Evaluates the polynomial through the last samples, `ago` [s] before the latest, by Neville's
    /// scheme.
    fn interpolated(&self, ago: f64) -> f64 {
        let (n, mut values, mut at) = (self.count.min(4), self.samples, [0.0; 4]);
        for i in 1..n {
            at[i] = at[i - 1] + self.steps[i - 1];
        }
        for order in 1..n {
            for i in 0..n - order {
                let far = at[i + order];
                values[i] = ((far - ago) * values[i] + (ago - at[i]) * values[i + 1]) / (far - at[i]);
            }
        }
        values[0]
    }

    /// Restarts with `rate` after a jump: no polynomial passes through samples before and after.
    pub(super) fn jump(&mut self, rate: f64) {
        *self = Integral { before: self.value(), ..Integral::new(rate) };
    }

    /// Restarts with the current rate: no polynomial passes through samples before and after.
    pub(super) fn restart(&mut self) {
        self.jump(self.samples[0]);
    }

    /// Adds an integrated amount instantly.
    pub(super) fn add(&mut self, amount: f64) {
        self.before += amount;
    }

    /// Returns the integral so far.
    pub(super) fn value(&self) -> f64 {
        self.before + self.since
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Degree 1 is exact from the first step on, degrees 2 and 3 from the second.
    #[test]
    fn cubics_are_integrated_exactly() {
        let h = 0.25;
        for degree in 0..4 {
            let rate = |step: usize| (step as f64 * h - 0.6).powi(degree);
            let exact =
                |t: f64| ((t - 0.6).powi(degree + 1) - (-0.6_f64).powi(degree + 1)) / f64::from(degree + 1);
            let mut integral = Integral::new(rate(0));
            for step in 1..20 {
                integral.advance(h, rate(step));
                let error = (integral.value() - exact(step as f64 * h)).abs();
                if step >= 2 || degree <= 1 {
                    assert!(error < 1e-13, "degree {degree}, step {step}: {error:e}");
                } else {
                    assert!(error > 1e-4, "degree {degree}, step {step}");
                }
            }
        }
    }

    /// Adaptive steps and substeps have any size.
    #[test]
    fn cubics_are_integrated_exactly_over_uneven_steps() {
        let rate = |t: f64| (t - 0.6).powi(3) + 2.0 * t * t - 1.0;
        let exact = |t: f64| ((t - 0.6).powi(4) - 0.6_f64.powi(4)) / 4.0 + 2.0 / 3.0 * t.powi(3) - t;
        let (mut integral, mut t) = (Integral::new(rate(0.0)), 0.0);
        for (i, h) in
            [0.25, 0.25, 0.0625, 0.0625, 0.125, 0.25, 0.3, 0.3, 0.3, 0.3, 0.1].into_iter().enumerate()
        {
            t += h;
            integral.advance(h, rate(t));
            let error = (integral.value() - exact(t)).abs();
            assert!(i < 2 || error < 1e-13, "step {i}: {error:e}");
        }
    }

    #[test]
    fn the_order_is_four_and_jumps_keep_it() {
        let integrate = |steps: usize| {
            let h = 2.0 / steps as f64;
            let mut integral = Integral::new(1.0);
            for step in 1..=steps {
                let t = step as f64 * h;
                // exp until 1, then exp - 5.
                integral.advance(h, t.exp() - if 2 * step > steps { 5.0 } else { 0.0 });
                if 2 * step == steps {
                    integral.jump(t.exp() - 5.0);
                }
            }
            (integral.value() - (2.0_f64.exp() - 1.0 - 5.0)).abs()
        };
        let order = (integrate(40) / integrate(80)).log2();
        assert!((order - 4.0).abs() < 0.2, "{order}");
    }
}
