//! Time of loads and of prescribed motion: the load factor of a path, rates, kinks and jumps.

use super::{ForceId, System};

impl System {
    /// Makes this load factor the time of loads and of prescribed motion, whatever time is said; `None`:
    /// they are of the time that is said.
    pub(crate) fn set_load_factor(&mut self, load_factor: Option<f64>) {
        self.load_factor = load_factor;
    }

    /// The load factor that loads and prescribed motion are of; `None` where they are of the time.
    pub fn load_factor(&self) -> Option<f64> {
        self.load_factor
    }

    /// Writes the rate of `dE/dx` with the time [N/s] at fixed positions and at `time` [s] over `rate`: the
    /// difference over `difference` [s] to both sides, of terms that change with time alone. Leaves them at
    /// `time`.
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

    /// Says at which times [s], ascending, loads or prescribed motion have a kink or jump: steps whose size
    /// is not fixed land on them.
    pub fn set_breaks(&mut self, breaks: Vec<f64>) {
        self.breaks = breaks;
    }

    /// The first time after `time` [s] at which a hold lets go or the motion of one breaks, or one of
    /// [these](Self::set_breaks), if there is any.
    pub(crate) fn next_break(&self, time: f64) -> Option<f64> {
        let known = self.breaks.get(self.breaks.partition_point(|at| *at <= time)).copied();
        self.pins.next_break(time).into_iter().chain(known).reduce(f64::min)
    }
}
