//! Duration and frame times of a run.

/// Frames closer than this fraction of the frame interval coincide.
const SAME_FRAME: f64 = 1e-6;

/// Duration of a run and frame rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Simulated time [s]; the run ends with the step nearest to it, or exactly there with adaptive
    /// steps.
    pub duration: f64,
    /// Frames per simulated second. A frame is taken at the step nearest to each multiple of `1 / rate`,
    /// or exactly there with adaptive steps, and at the end.
    pub rate: f64,
}

impl Plan {
    /// Returns the number of steps of size `h` in the plan.
    pub fn steps(&self, h: f64) -> u64 {
        let steps = (self.duration / h).round() as u64;
        if self.duration > 0.0 { steps.max(1) } else { 0 }
    }

    /// Returns the number of frames, including first and last.
    pub fn frames(&self, h: f64) -> u64 {
        let steps = self.steps(h);
        let (mut count, mut step) = (1, 0);
        // One iteration per frame.
        while step < steps {
            step = self.frame_step(count, h).max(step + 1).min(steps);
            count += 1;
        }
        count
    }

    /// Returns the number of frames, including first and last, with adaptive steps.
    pub fn exact_frames(&self) -> u64 {
        if self.duration > 0.0 {
            (self.duration * self.rate - SAME_FRAME).ceil().max(1.0) as u64 + 1
        } else {
            1
        }
    }

    /// Returns the time of frame `index` since the start [s], with adaptive steps.
    pub fn frame_time(&self, index: u64) -> f64 {
        if index + 1 < self.exact_frames() { index as f64 / self.rate } else { self.duration }
    }

    /// Returns the step of frame `index`.
    pub(super) fn frame_step(&self, index: u64, h: f64) -> u64 {
        (index as f64 / (self.rate * h)).round() as u64
    }
}
