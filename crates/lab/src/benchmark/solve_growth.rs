//! Growth of the iterations of a linear solve with the size of the mesh.

use std::time::{Duration, Instant};

use super::beam::tets;
use super::solve::LinearSystem;
use super::{BenchmarkCase, BenchmarkError, BenchmarkPart, BenchmarkRow, Metric, Workload, goal};

pub(super) const ROW: BenchmarkRow = BenchmarkRow {
    name: "solve-growth",
    summary: "iterations of conjugate gradients with multigrid to 1e-6, 255,552 tets over 31,944",
    cases,
};

struct Counting {
    system: LinearSystem,
    iterations: u64,
}

impl Counting {
    fn new(n: usize) -> Result<Counting, BenchmarkError> {
        Ok(Counting { system: LinearSystem::new(n)?, iterations: 0 })
    }
}

impl Workload for Counting {
    fn time(&mut self, repetitions: u64) -> Result<Duration, BenchmarkError> {
        let start = Instant::now();
        for _ in 0..repetitions {
            self.iterations = self.system.solve()?;
        }
        Ok(start.elapsed())
    }

    fn quantity(&self, _: f64) -> f64 {
        self.iterations as f64
    }
}

fn cases(threads: Option<usize>) -> Vec<BenchmarkCase> {
    let threads = threads.unwrap_or(1);
    vec![BenchmarkCase {
        size: tets([88, 22, 22]),
        items: "tets",
        case: "iterations".into(),
        figure: Metric::Slowdown,
        parts: vec![
            BenchmarkPart::new("large", threads, || Counting::new(22)),
            BenchmarkPart::new("small", threads, || Counting::new(11)),
        ],
        reference: goal(1.3),
    }]
}
