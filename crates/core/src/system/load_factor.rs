//! Time of loads and prescribed motion: the load factor of arc-length continuation, load rates, kinks and
//! jumps.

use super::{ForceId, System};

impl System {
    /// Sets the load factor as the time of loads and prescribed motion; `None` returns to the time of the
    /// system.
    pub(crate) fn set_load_factor(&mut self, load_factor: Option<f64>) {
        self.load_factor = load_factor;
    }

    /// Returns the load factor; `None` if loads and prescribed motion depend on time.
    pub fn load_factor(&self) -> Option<f64> {
        self.load_factor
    }

    /// Writes the time derivative of `dE/dx` [N/s] at fixed positions and at `time` [s] to `rate`:
    /// central difference over `difference` [s] of the time-dependent terms. Leaves them at `time`.
    pub(crate) fn load_rate(&mut self, x: &[f64], time: f64, difference: f64, rate: &mut [f64]) {
        self.force = ForceId::NONE;
        rate.fill(0.0);
        let mut before = vec![0.0; rate.len()];
        for term in self.terms.iter_mut().filter(|term| term.properties().changes_with_time) {
            for (at, gradient) in [(time - difference, &mut before[..]), (time + difference, &mut *rate)] {
                if let Some(driven) = term.driven() {
                    driven.set_time(at);
                }
                term.add_gradient(x, gradient);
            }
            if let Some(driven) = term.driven() {
                driven.set_time(time);
            }
        }
        rate.iter_mut().zip(&before).for_each(|(rate, before)| *rate = (*rate - before) / (2.0 * difference));
    }

    /// Sets the times [s], ascending, at which loads or prescribed motion have a kink or jump; adaptive
    /// steps end there.
    pub fn set_breaks(&mut self, breaks: Vec<f64>) {
        self.breaks = breaks;
    }

    /// Returns the first time after `time` [s] at which a pin is released, a prescribed motion has a
    /// kink, or one of [these](Self::set_breaks) occurs.
    pub(crate) fn next_break(&self, time: f64) -> Option<f64> {
        let known = self.breaks.get(self.breaks.partition_point(|at| *at <= time)).copied();
        self.pins.next_break(time).into_iter().chain(known).reduce(f64::min)
    }
}
