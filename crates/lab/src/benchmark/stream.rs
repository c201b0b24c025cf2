//! Memory bandwidth, measured by STREAM's triad.

use std::hint::black_box;
use std::time::Instant;

use rayon::prelude::*;

use pliant::lanes::{Kernel, Lanes, WIDTH, dispatch};

/// Length of an array: three arrays of 128 MiB exceed the caches.
const COUNT: usize = 1 << 24;
/// Length of a task: short enough to balance any number of threads.
const TASK: usize = 1 << 16;

/// Memory bandwidth of `a = b + 3 c` on the threads of the current pool [bytes/s], with 24 bytes counted
/// per number (McCalpin, "Memory bandwidth and machine balance in current high performance computers",
/// 1995); the best of ten.
pub fn triad() -> f64 {
    let (mut a, b, c) = (vec![1.0; COUNT], vec![2.0; COUNT], vec![0.5; COUNT]);
    let mut best = f64::INFINITY;
    for _ in 0..10 {
        let start = Instant::now();
        let sources = b.par_chunks(TASK).zip(c.par_chunks(TASK));
        a.par_chunks_mut(TASK).zip(sources).for_each(|(a, (b, c))| dispatch(Triad { a, b, c }));
        best = best.min(start.elapsed().as_secs_f64());
        black_box(&mut a);
    }
    (24 * COUNT) as f64 / best
}

struct Triad<'a> {
    a: &'a mut [f64],
    b: &'a [f64],
    c: &'a [f64],
}

impl Kernel for Triad<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let factor = L::splat(3.0);
        let (a, _) = self.a.as_chunks_mut::<WIDTH>();
        let (b, _) = self.b.as_chunks::<WIDTH>();
        let (c, _) = self.c.as_chunks::<WIDTH>();
        for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
            factor.mul_add(L::load(c), L::load(b)).store(a);
        }
    }
}
