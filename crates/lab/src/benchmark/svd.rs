//! Signed singular value decompositions, in cache.

use std::hint::black_box;
use std::time::{Duration, Instant};

use super::scatter::Scatter;
use super::{BenchmarkCase, BenchmarkError, BenchmarkPart, BenchmarkRow, Metric, Workload, goal};
use pliant::algebra::{Mat, signed_svd};
use pliant::lanes::{Kernel, Lanes, Pair, WIDTH, dispatch};

pub(super) const ROW: BenchmarkRow = BenchmarkRow {
    name: "svd",
    summary: "signed singular value decompositions of 3 x 3 matrices, in cache",
    cases,
};

/// Number of matrices of one repetition: 36 kB of matrices, 84 kB of results.
const COUNT: usize = 512;
/// Size of a group: two packs, side by side.
const GROUP: usize = 2 * WIDTH;

/// A group of matrices, entry by entry.
type Matrices = [[f64; GROUP]; 9];
/// `U`, the singular values and `V` of a group.
type Decomposed = [[f64; GROUP]; 21];

struct Decompositions {
    from: Vec<Matrices>,
    to: Vec<Decomposed>,
}

impl Decompositions {
    /// Random matrices with entries uniform in -1 to 1: half of them are inverted, as for independent
    /// normal entries.
    fn new() -> Decompositions {
        let mut random = Scatter::new(7);
        let mut from = vec![[[0.0; GROUP]; 9]; COUNT / GROUP];
        from.as_flattened_mut().as_flattened_mut().iter_mut().for_each(|x| *x = random.symmetric());
        Decompositions { from, to: vec![[[0.0; GROUP]; 21]; COUNT / GROUP] }
    }
}

impl Workload for Decompositions {
    fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError> {
        let start = Instant::now();
        for _ in 0..repetitions {
            dispatch(SvdKernel(black_box(&self.from), black_box(&mut self.to)));
        }
        Ok(start.elapsed())
    }
}

struct SvdKernel<'a>(&'a [Matrices], &'a mut [Decomposed]);

impl Kernel for SvdKernel<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        for (from, to) in self.0.iter().zip(self.1) {
            if L::PAIRS_PAY {
                decompose::<Pair<L>, L>(from, to, 0);
            } else {
                decompose::<L, L>(from, to, 0);
                decompose::<L, L>(from, to, WIDTH);
            }
        }
    }
}

/// One or two packs, loaded from and stored to arrays.
trait Packs<L: Lanes>: pliant::scalar::Real {
    fn read(from: &[f64; GROUP], at: usize) -> Self;
    fn write(self, to: &mut [f64; GROUP], at: usize);
}

impl<L: Lanes> Packs<L> for L {
    #[inline(always)]
    fn read(from: &[f64; GROUP], at: usize) -> Self {
        L::load(&from.as_chunks().0[at / WIDTH])
    }
    #[inline(always)]
    fn write(self, to: &mut [f64; GROUP], at: usize) {
        self.store(&mut to.as_chunks_mut().0[at / WIDTH]);
    }
}

impl<L: Lanes> Packs<L> for Pair<L> {
    #[inline(always)]
    fn read(from: &[f64; GROUP], _: usize) -> Self {
        let chunks = from.as_chunks().0;
        Pair(L::load(&chunks[0]), L::load(&chunks[1]))
    }
    #[inline(always)]
    fn write(self, to: &mut [f64; GROUP], _: usize) {
        let chunks = to.as_chunks_mut().0;
        self.0.store(&mut chunks[0]);
        self.1.store(&mut chunks[1]);
    }
}

#[inline(always)]
fn decompose<P: Packs<L>, L: Lanes>(from: &Matrices, to: &mut Decomposed, at: usize) {
    let mut F = Mat::<P, 3>::zero();
    for i in 0..3 {
        for j in 0..3 {
            F[i][j] = P::read(&from[3 * i + j], at);
        }
    }
    let d = signed_svd(&F);
    for i in 0..3 {
        for j in 0..3 {
            d.u[i][j].write(&mut to[3 * i + j], at);
            d.v[i][j].write(&mut to[12 + 3 * i + j], at);
        }
        d.sigma[i].write(&mut to[9 + i], at);
    }
}

/// Cases, always on one thread: the work is not distributed.
fn cases(_: Option<usize>) -> Vec<BenchmarkCase> {
    vec![BenchmarkCase {
        size: COUNT as u64,
        items: "matrices",
        case: String::new(),
        figure: Metric::Rate { per_repetition: COUNT as f64, scale: 1e-6, unit: "M/s" },
        parts: vec![BenchmarkPart::new("", 1, || Ok(Decompositions::new()))],
        reference: goal(35.0),
    }]
}

#[cfg(test)]
mod tests {
    use super::*;

    // The timed code is a decomposition: U diag(sigma) V^T restores the matrix.
    #[test]
    fn the_results_are_decompositions() {
        let mut work = Decompositions::new();
        work.time(1).unwrap();
        for (from, to) in work.from.iter().zip(&work.to) {
            for l in 0..GROUP {
                for i in 0..3 {
                    for j in 0..3 {
                        let term = |k: usize| to[3 * i + k][l] * to[9 + k][l] * to[12 + 3 * j + k][l];
                        let product = term(0) + term(1) + term(2);
                        assert!((product - from[3 * i + j][l]).abs() < 1e-14, "{product}");
                    }
                }
            }
        }
    }
}
