//! Synchronisation of simulated time with the clock.

use std::time::Duration;

use pliant_files::clock::Instant;

/// Largest lag behind the clock that is caught up [s]; larger ones are dropped.
const LARGEST_LAG: f64 = 0.1;
/// Time over which the actual speed is measured.
const WINDOW: Duration = Duration::from_millis(500);

/// Pacing of steps.
pub(crate) struct Pace {
    /// Simulated seconds per second; `None` for maximum speed.
    pub(crate) speed: Option<f64>,
    anchor: (Instant, f64),
    window: (Instant, f64),
    reached: f64,
}

impl Pace {
    pub(crate) fn new(speed: Option<f64>, time: f64) -> Pace {
        let now = Instant::now();
        Pace { speed, anchor: (now, time), window: (now, time), reached: 0.0 }
    }

    /// Restarts pacing at a simulated time [s].
    pub(crate) fn restart(&mut self, time: f64) {
        *self = Pace { reached: self.reached, ..Pace::new(self.speed, time) };
    }

    /// Time to wait before a step from a simulated time [s].
    pub(crate) fn wait(&mut self, time: f64) -> Duration {
        let Some(speed) = self.speed else { return Duration::ZERO };
        let ahead = (time - self.anchor.1) / speed - self.anchor.0.elapsed().as_secs_f64();
        if ahead < -LARGEST_LAG {
            self.anchor = (Instant::now(), time);
        }
        Duration::try_from_secs_f64(ahead.max(0.0)).unwrap_or(Duration::MAX)
    }

    /// Recently achieved simulated seconds per second.
    pub(crate) fn reached(&mut self, time: f64) -> f64 {
        let elapsed = self.window.0.elapsed();
        if elapsed >= WINDOW {
            self.reached = (time - self.window.1) / elapsed.as_secs_f64();
            self.window = (Instant::now(), time);
        }
        self.reached
    }
}
