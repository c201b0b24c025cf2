//! Pseudorandom numbers of workloads: the same on every machine.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

/// Pseudorandom sequence.
pub(super) struct Scatter(Pcg64);

impl Scatter {
    pub(super) fn new(seed: u64) -> Scatter {
        Scatter(Pcg64::new(u128::from(seed), 1))
    }

    /// Uniform number in -1 to 1.
    pub(super) fn symmetric(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (2.0 / (1_u64 << 53) as f64) - 1.0
    }

    /// Numbers below `n`, shuffled (Fisher and Yates).
    pub(super) fn permutation(&mut self, n: usize) -> Vec<u32> {
        let mut order: Vec<u32> = (0..n as u32).collect();
        for i in (1..n).rev() {
            // The bias of the remainder, n / 2^64, is negligible.
            order.swap(i, (self.0.next_u64() % (i as u64 + 1)) as usize);
        }
        order
    }
}
