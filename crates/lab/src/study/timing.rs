//! Repeated timings of the same run.

/// Relative scatter of repeated timings on a quiet machine.
pub(super) const NOISE: f64 = 0.05;

/// Statistics of the times of several runs [s].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Timing {
    pub(super) min: f64,
    pub(super) median: f64,
    /// Interquartile range.
    pub(super) iqr: f64,
    pub(super) repeats: usize,
}

impl Timing {
    /// Statistics of at least one run.
    pub(super) fn of(seconds: &[f64]) -> Timing {
        let mut sorted = seconds.to_vec();
        sorted.sort_by(f64::total_cmp);
        Timing {
            min: sorted.first().copied().unwrap_or(f64::NAN),
            median: quantile(&sorted, 0.5),
            iqr: quantile(&sorted, 0.75) - quantile(&sorted, 0.25),
            repeats: sorted.len(),
        }
    }

    /// True if the interquartile range exceeds [`NOISE`].
    pub(super) fn is_noisy(&self) -> bool {
        self.iqr > NOISE * self.median
    }
}

/// Quantile by linear interpolation.
fn quantile(sorted: &[f64], part: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let place = part * last as f64;
    let (low, high) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
    low + (place - place.floor()) * (high - low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_are_between_the_nearest_runs() {
        let timing = Timing::of(&[4.0, 1.0, 2.0, 3.0, 5.0]);
        assert_eq!((timing.min, timing.median, timing.iqr, timing.repeats), (1.0, 3.0, 2.0, 5));
        assert_eq!(Timing::of(&[2.0, 1.0]).median, 1.5);
        assert!(timing.is_noisy() && !Timing::of(&[1.0, 1.01, 1.02]).is_noisy());
    }
}
