//! Explicit steps of stable neo-Hookean tetrahedra.

use super::beam::{LARGE, SMALL, rate, tets, wavy};
use super::stepping::Stepping;
use super::{BenchmarkCase, BenchmarkPart, BenchmarkRow, PublishedValue};

pub(super) const ROW: BenchmarkRow = BenchmarkRow {
    name: "tet-stable-neo-hookean",
    summary: "full steps of a beam of tetrahedra, stable neo-Hookean with its log term",
    cases,
};

/// Reference: C++ written for this material and mesh, with hand-chosen instruction sets and sums in any
/// order.
const HAND_WRITTEN: &str = "hand-written C++ with AVX-512; 90 % of it is the figure to reach";

fn cases(threads: Option<usize>) -> Vec<BenchmarkCase> {
    let counts = threads.map_or_else(|| vec![1, 2], |n| vec![n]);
    let mut cases = vec![];
    for (cells, reached) in [(SMALL, [208.0, 385.0]), (LARGE, [130.0, 246.0])] {
        for &threads in &counts {
            let reached = reached.get(threads - 1).copied();
            cases.push(BenchmarkCase {
                size: tets(cells),
                items: "tets",
                case: String::new(),
                figure: rate(cells),
                parts: vec![BenchmarkPart::new("", threads, move || {
                    Stepping::new(&wavy(cells, "analytic")?)
                })],
                reference: reached.map(|value| PublishedValue { value, source: HAND_WRITTEN }),
            });
        }
    }
    cases
}
