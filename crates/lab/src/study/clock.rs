//! Clocks that tests can replace, so that a budget can be tested without waiting.

use std::time::Instant;

use pliant::observer::Work;

/// Tells the time.
pub trait Clock: Sync {
    /// Seconds since some moment.
    fn now(&self) -> f64;

    /// Is told of work that was done; clocks that go by themselves take no notice.
    fn worked(&self, _work: &Work) {}
}

/// The clock on the wall.
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
