//! Speedup by a second thread.

use super::beam::{SMALL, tets, wavy};
use super::nbody_direct::galaxy;
use super::stepping::Stepping;
use super::{BenchmarkCase, BenchmarkError, BenchmarkPart, BenchmarkRow, Metric, goal};

pub(super) const ROW: BenchmarkRow = BenchmarkRow {
    name: "threads",
    summary: "time of a step on one thread, over that on two (or --threads)",
    cases,
};

fn cases(threads: Option<usize>) -> Vec<BenchmarkCase> {
    let many = threads.unwrap_or(2);
    type Build = fn() -> Result<Stepping, BenchmarkError>;
    let case = |(size, items, case, build): (u64, &'static str, &str, Build)| BenchmarkCase {
        size,
        items,
        case: case.into(),
        figure: Metric::Speedup,
        parts: vec![BenchmarkPart::new("one", 1, build), BenchmarkPart::new("many", many, build)],
        reference: goal(1.85).filter(|_| many == 2),
    };
    let tetrahedra: Build = || Stepping::new(&wavy(SMALL, "analytic")?);
    let bodies: Build = || Stepping::new(&galaxy(20_000)?);
    vec![
        case((tets(SMALL), "tets", "stable neo-Hookean", tetrahedra)),
        case((20_000, "bodies", "direct sum", bodies)),
    ]
}
