//! Explicit steps of corotated tetrahedra, whose rotations cost more the stronger they are deformed.

use super::beam::{SMALL, noisy, rate, tets};
use super::stepping::Stepping;
use super::{BenchmarkCase, BenchmarkPart, BenchmarkRow, goal};

pub(super) const ROW: BenchmarkRow = BenchmarkRow {
    name: "tet-corotated",
    summary: "full steps of a beam of tetrahedra, corotated, held in a state of deformation",
    cases,
};

fn cases(threads: Option<usize>) -> Vec<BenchmarkCase> {
    let states = [("mild: 3 % noise, turned", 0.03, 100.0), ("strong: 50 % noise, 6 % inverted", 0.5, 85.0)];
    let case = |(state, noise, reference): (&str, f64, f64)| BenchmarkCase {
        size: tets(SMALL),
        items: "tets",
        case: state.into(),
        figure: rate(SMALL),
        parts: vec![BenchmarkPart::new("", threads.unwrap_or(1), move || {
            Stepping::new(&noisy(SMALL, noise)?)
        })],
        reference: goal(reference).filter(|_| threads.unwrap_or(1) == 1),
    };
    states.map(case).into()
}
