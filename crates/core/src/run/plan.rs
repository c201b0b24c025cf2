//! How far a run goes, and when its frames are.

/// Frames nearer to each other than this part of the time between them are one.
const SAME_FRAME: f64 = 1e-6;

/// How far to go and how often to show a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Simulated time [s]; the run ends with the step nearest to it, exactly there where step sizes follow
    /// the error.
    pub duration: f64,
    /// Frames per simulated second. A frame is taken at the step nearest to each multiple of `1 / rate`,
    /// exactly there where step sizes follow the error, and at the end.
    pub rate: f64,
}

impl Plan {
    /// Number of steps of size `h` that the plan takes.
    pub fn steps(&self, h: f64) -> u64 {
        let steps = (self.duration / h).round() as u64;
        if self.duration > 0.0 { steps.max(1) } else { 0 }
    }

    /// Number of frames, the first and the last included.
    pub fn frames(&self, h: f64) -> u64 {
        let steps = self.steps(h);
        let (mut count, mut step) = (1, 0);
        // Only as many iterations as frames.
        while step < steps {
            step = self.frame_step(count, h).max(step + 1).min(steps);
            count += 1;
        }
        count
    }

    /// Number of frames, the first and the last included, where steps land on their times.
    pub fn exact_frames(&self) -> u64 {
        if self.duration > 0.0 {
            (self.duration * self.rate - SAME_FRAME).ceil().max(1.0) as u64 + 1
        } else {
            1
        }
    }

    /// When frame `index` is taken [s], counted from the start, where steps land on that time.
    pub fn frame_time(&self, index: u64) -> f64 {
        if index + 1 < self.exact_frames() { index as f64 / self.rate } else { self.duration }
    }

    /// The step at which frame `index` is taken.
    pub(super) fn frame_step(&self, index: u64, h: f64) -> u64 {
        (index as f64 / (self.rate * h)).round() as u64
    }
}
