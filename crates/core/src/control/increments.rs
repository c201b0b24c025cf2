//! Increments of statics, whose size follows how hard they are to solve.
//!
//! An increment that is not solved is taken back, and a quarter of it is tried. Two in a row that were easy
//! make the next one half as large again, one that was hard makes it a quarter smaller: the rules, and the
//! numbers, of the automatic increments of Abaqus (Analysis User's Guide, "Convergence criteria for
//! nonlinear problems"). It counts iterations, each with a matrix of its own. Here it is the matrices that
//! count: the iterations between them go on with the last one, to smaller tolerances, and cost little.

/// Matrices up to which an increment was easy.
const EASY: u64 = 4;
/// Matrices above which one was hard.
const HARD: u64 = 10;
/// Easy increments in a row before the next one is larger.
const EASY_IN_A_ROW: u32 = 2;
/// How much larger.
const GROWTH: f64 = 1.5;
/// An increment after a hard one.
const AFTER_HARD: f64 = 0.75;
/// An increment that was cut short below this part of the one planned, to land on a time, says nothing of
/// that.
const TELLING: f64 = 0.5;

/// Increments of a run of statics, in counts and sizes that do not depend on the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Increments {
    /// Increments that were solved.
    pub accepted: u64,
    /// Increments that were not, and were taken back.
    pub cut_back: u64,
    /// The least of those that were solved [s]; 0 before the first.
    pub least: f64,
    /// The largest of them [s].
    pub largest: f64,
}

/// Memory of the size of increments.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct IncrementPace {
    accepted: u64,
    least: f64,
    largest: f64,
    /// Easy increments since the last that was not.
    easy: u32,
}

impl IncrementPace {
    /// Counts so far, `cut_back` increments taken back.
    pub(super) fn counts(&self, cut_back: u64) -> Increments {
        let IncrementPace { accepted, least, largest, .. } = *self;
        Increments { accepted, cut_back, least, largest }
    }

    /// The size of the increment [s] after one of `h` [s], of `planned` [s], that took so many `matrices`.
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

    /// An increment was taken back.
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
