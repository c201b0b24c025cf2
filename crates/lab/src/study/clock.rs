//! Clocks that tests can replace, so that a budget can be tested without waiting.

use std::time::Instant;

use pliant::observer::Work;

/// Source of time.
pub trait Clock: Sync {
    /// Seconds since an arbitrary moment.
    fn now(&self) -> f64;

    /// Reports finished work, by which a test's clock advances; real clocks ignore it.
    fn worked(&self, _work: &Work) {}
}

/// Wall clock.
#[derive(Clone, Copy, Debug)]
pub struct WallClock(Instant);

impl Default for WallClock {
    fn default() -> Self {
        WallClock(Instant::now())
    }
}

impl Clock for WallClock {
    fn now(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }
}
