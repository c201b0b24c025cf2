//! Where to keep states of a run that does not fit memory.
//!
//! Of `n` pieces of a run, each is taken back once its states are there; states before pieces are kept in a
//! few slots, and the pieces between are run again. With `s` slots and no piece run more than `r` times
//! `C(s + r, s)` pieces can be taken back; Griewank, Walther 2000, "Algorithm 799: revolve", ACM Trans.
//! Math. Software 26, 19.

/// Pieces that can be taken back with so many slots, the state at the beginning in one of them, if none is
/// run more than `runs` times.
fn reach(slots: usize, runs: usize) -> u128 {
    // Each quotient is a binomial coefficient: exact.
    (1..=slots as u128).fold(1_u128, |product, i| product.saturating_mul(runs as u128 + i) / i)
}

/// Of `pieces` pieces, two at least, how many are before the next state to be kept, with so many slots left
/// beside that at the beginning, one at least.
pub(crate) fn split(pieces: usize, slots: usize) -> usize {
    let all = slots + 1;
    let runs = (1..).find(|runs| reach(all, *runs) >= pieces as u128).unwrap_or(1);
    let right = reach(all - 1, runs).min(pieces as u128) as usize;
    let most = reach(all, runs - 1).min(pieces as u128 - 1) as usize;
    pieces.saturating_sub(right).clamp(1, most.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pieces that are run to take all back, those of recording included.
    fn runs(pieces: usize, slots: usize) -> usize {
        if pieces == 1 {
            return 1;
        }
        if slots == 0 {
            return (1..=pieces).sum();
        }
        let left = split(pieces, slots);
        left + runs(pieces - left, slots - 1) + runs(left, slots)
    }

    // With s slots in all and r = 2 runs of no piece more than twice: (s + 1)(s + 2)/2 pieces.
    #[test]
    fn no_piece_is_run_more_often_than_binomial_checkpoints_do() {
        assert_eq!((reach(3, 2), reach(1, 5), reach(4, 0)), (10, 6, 1));
        for (pieces, slots, at_most) in [(10, 2, 3), (4, 2, 2), (35, 3, 4), (70, 3, 5)] {
            let mean = runs(pieces, slots) as f64 / pieces as f64;
            assert!(mean <= at_most as f64, "{pieces} pieces with {slots} slots: {mean} runs each");
        }
        // Without slots the run begins anew for each piece.
        assert_eq!(runs(10, 0), 55);
        assert!(runs(200, 4) < 200 * 6, "{}", runs(200, 4));
    }
}
