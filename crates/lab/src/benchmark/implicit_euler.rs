//! Steps of implicit Euler, solved to convergence.

use super::beam::falling;
use super::stepping::Stepping;
use super::{BenchmarkCase, BenchmarkPart, BenchmarkRow, Metric, goal};

pub(super) const ROW: BenchmarkRow = BenchmarkRow {
    name: "implicit-euler",
    summary: "steps of 0.01 s of a beam of tetrahedra that falls, stable neo-Hookean with its log term, by \
              the solver chosen for its size",
    cases,
};

fn cases(threads: Option<usize>) -> Vec<BenchmarkCase> {
    let mut cases = vec![];
    // Number of cells across the beam, and the target for a step on the reference machine [us].
    for (n, reach) in [(6, 4e3), (11, 25e3), (16, 95e3)] {
        let counts = threads.map_or_else(|| if n == 16 { vec![1, 2] } else { vec![1] }, |t| vec![t]);
        for threads in counts {
            cases.push(BenchmarkCase {
                size: 24 * n * n * n,
                items: "tets",
                case: String::new(),
                figure: Metric::StepTime,
                parts: vec![BenchmarkPart::new("", threads, move || Stepping::new(&falling(n as usize)?))],
                reference: if threads == 1 { goal(reach) } else { None },
            });
        }
    }
    cases
}
