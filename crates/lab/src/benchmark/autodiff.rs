//! Cost of automatic differentiation of the energy, compared with the analytical stress.

use super::beam::{SMALL, tets, wavy};
use super::stepping::Stepping;
use super::{BenchmarkCase, BenchmarkPart, BenchmarkRow, Metric, goal};

pub(super) const ROW: BenchmarkRow = BenchmarkRow {
    name: "autodiff",
    summary: "time of a step with stress by automatic differentiation, over that with analytical stress",
    cases,
};

fn cases(threads: Option<usize>) -> Vec<BenchmarkCase> {
    let part =
        |name| BenchmarkPart::new(name, threads.unwrap_or(1), move || Stepping::new(&wavy(SMALL, name)?));
    vec![BenchmarkCase {
        size: tets(SMALL),
        items: "tets",
        case: "stable neo-Hookean".into(),
        figure: Metric::Slowdown,
        parts: vec![part("autodiff"), part("analytic")],
        reference: goal(3.0),
    }]
}
