//! How the iterations of a linear solve grow with the mesh.

use std::time::{Duration, Instant};

use super::beam::tets;
use super::solve::System;
use super::{BenchmarkError, Case, Figure, Part, Row, Workload, goal};

pub(super) const ROW: Row = Row {
    name: "solve-growth",
    summary: "iterations of conjugate gradients with multigrid to 1e-6, 255,552 tets over 31,944",
    cases,
};

struct Counting {
    system: System,
    iterations: u64,
}

impl Counting {
    fn new(n: usize) -> Result<Counting, BenchmarkError> {
        Ok(Counting { system: System::new(n)?, iterations: 0 })
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

fn cases(threads: Option<usize>) -> Vec<Case> {
    let threads = threads.unwrap_or(1);
    vec![Case {
        size: tets([88, 22, 22]),
        items: "tets",
        case: "iterations".into(),
        figure: Figure::Slowdown,
        parts: vec![
            Part::new("large", threads, || Counting::new(22)),
            Part::new("small", threads, || Counting::new(11)),
        ],
        reference: goal(1.3),
    }]
}
