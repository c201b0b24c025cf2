//! Static increments, whose size depends on the cost of their solves.
//!
//! A failed increment is retried with a quarter of its size. After two easy increments in a row the next
//! one is half as large again; after a hard one it is a quarter smaller. These are the rules and numbers
//! of the automatic increments of Abaqus (Analysis User's Guide, "Convergence criteria for nonlinear
//! problems"). Abaqus counts iterations, each with its own matrix. Here matrices are counted: the
//! iterations between them reuse the last one, to smaller tolerances, and cost little.

/// Matrices up to which an increment is easy.
const EASY: u64 = 4;
/// Matrices above which an increment is hard.
const HARD: u64 = 10;
/// Easy increments in a row before the size grows.
const EASY_IN_A_ROW: u32 = 2;
/// Growth factor.
const GROWTH: f64 = 1.5;
/// Reduction factor after a hard increment.
const AFTER_HARD: f64 = 0.75;
/// An increment cut below this fraction of the planned one, to end at a given time, does not count as
/// easy.
const TELLING: f64 = 0.5;

/// Increments of a static run, in machine-independent counts and sizes.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Increments {
    /// Solved increments.
    pub accepted: u64,
    /// Failed increments, which were retried.
    pub cut_back: u64,
    /// Smallest solved increment [s]; 0 before the first.
    pub least: f64,
    /// Largest solved increment [s].
    pub largest: f64,
}

/// State of the increment control.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct IncrementPace {
    accepted: u64,
    least: f64,
    largest: f64,
    /// Easy increments since the last other one.
    easy: u32,
}

impl IncrementPace {
    /// Returns the counts so far, with `cut_back` failed increments.
    pub(super) fn counts(&self, cut_back: u64) -> Increments {
        let IncrementPace { accepted, least, largest, .. } = *self;
        Increments { accepted, cut_back, least, largest }
    }

    /// Returns the next increment [s] after one of `h` [s], of `planned` [s], that took `matrices`.
    pub(super) fn accept(&mut self, h: f64, planned: f64, matrices: u64) -> f64 {
        self.least = if self.accepted == 0 { h } else { self.least.min(h) };
        self.largest = self.largest.max(h);
        self.accepted += 1;
        if matrices > HARD {
            self.easy = 0;
            return planned.min(AFTER_HARD * h);
        }
        if h < TELLING * planned {
            return planned;
        }
        self.easy = if matrices <= EASY { self.easy + 1 } else { 0 };
        if self.easy >= EASY_IN_A_ROW { planned.max(GROWTH * h) } else { planned }
    }

    /// Records a failed increment.
    pub(super) fn reject(&mut self) {
        self.easy = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::IncrementPace;

    #[test]
    fn two_easy_increments_in_a_row_make_the_next_larger_and_a_hard_one_smaller() {
        let mut pace = IncrementPace::default();
        assert_eq!(pace.accept(0.1, 0.1, 4), 0.1);
        assert_eq!(pace.accept(0.1, 0.1, 3), 0.1 * 1.5);
        assert_eq!(pace.accept(0.15, 0.15, 5), 0.15, "neither easy nor hard");
        assert_eq!(pace.accept(0.15, 0.15, 1), 0.15, "the first in a row");
        pace.reject();
        assert_eq!(pace.accept(0.0375, 0.0375, 1), 0.0375, "the first after one that was taken back");
        assert_eq!(pace.accept(0.0375, 0.0375, 11), 0.75 * 0.0375);
        let counts = pace.counts(1);
        assert_eq!((counts.accepted, counts.cut_back, counts.least, counts.largest), (6, 1, 0.0375, 0.15));
    }

    #[test]
    fn increments_cut_short_to_land_on_a_time_say_nothing_of_larger_ones() {
        let mut pace = IncrementPace::default();
        for _ in 0..4 {
            assert_eq!(pace.accept(0.04, 0.1, 1), 0.1);
        }
        assert_eq!(pace.accept(0.06, 0.1, 1), 0.1);
        assert_eq!(pace.accept(0.07, 0.1, 1), 0.07 * 1.5);
    }
}
