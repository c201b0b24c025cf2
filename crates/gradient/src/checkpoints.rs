//! Binomial checkpointing: which states to keep of a run that does not fit into memory.
//!
//! The run is divided into `n` pieces, and each is propagated back once its states are available. States
//! before pieces are kept in a few slots, and the pieces between are run again. With `s` slots, and no
//! piece run more than `r` times, `C(s + r, s)` pieces can be propagated back; Griewank, Walther 2000,
//! "Algorithm 799: revolve", ACM Trans. Math. Software 26, 19.

/// Number of pieces that can be propagated back with these slots, one of them for the initial state, if
/// none is run more than `runs` times.
fn reach(slots: usize, runs: usize) -> u128 {
    // Each quotient is a binomial coefficient: exact.
    (1..=slots as u128).fold(1_u128, |product, i| product.saturating_mul(runs as u128 + i) / i)
}

/// Number of pieces before the next state to be kept, of `pieces` (at least two), with `slots` (at least
/// one) left in addition to that of the initial state.
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

    /// Total number of piece runs, those of recording included.
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

    // With s slots in all, and no piece run more than r = 2 times: (s + 1)(s + 2)/2 pieces.
    #[test]
    fn no_piece_is_run_more_often_than_binomial_checkpoints_do() {
        assert_eq!((reach(3, 2), reach(1, 5), reach(4, 0)), (10, 6, 1));
        for (pieces, slots, at_most) in [(10, 2, 3), (4, 2, 2), (35, 3, 4), (70, 3, 5)] {
            let mean = runs(pieces, slots) as f64 / pieces as f64;
            assert!(mean <= at_most as f64, "{pieces} pieces with {slots} slots: {mean} runs each");
        }
        // Without slots the run starts again for each piece.
        assert_eq!(runs(10, 0), 55);
        assert!(runs(200, 4) < 200 * 6, "{}", runs(200, 4));
    }
}
