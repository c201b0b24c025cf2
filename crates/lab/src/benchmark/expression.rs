//! Cost of an energy that is a formula of the scene, compared with a built-in model.

use super::beam::{SMALL, falling_of, tets, wavy_of};
use super::stepping::Stepping;
use super::{BenchmarkCase, BenchmarkPart, BenchmarkRow, Metric, goal};

pub(super) const ROW: BenchmarkRow = BenchmarkRow {
    name: "expression",
    summary: "time of a step with the energy as a formula, over the same built-in model: stable neo-Hookean",
    cases,
};

/// Hand-written models without and with the logarithm.
pub(super) const BY_HAND: [&str; 2] = [
    "stable-neo-hookean = { young = 5e5, poisson = 0.4 }",
    "stable-neo-hookean-log = { young = 5e5, poisson = 0.4 }",
];

/// These energies as formulas, `mu = E / (2 (1 + nu))` and `lambda = E nu / ((1 + nu) (1 - 2 nu))`.
pub(super) const FORMULAS: [&str; 2] = [
    "expression = { psi = 'mu/2*(I1 - 3) - mu*(J - 1) + (lambda + mu)/2*(J - 1)^2', \
     parameters = { mu = 178571.42857142858, lambda = 714285.7142857143 } }",
    "expression = { psi = '2*mu/3*(I1 - 3 - ln((I1 + 1)/4)) + (lambda + 5*mu/6)/2*(J - 1)^2 - mu*(J - 1)', \
     parameters = { mu = 178571.42857142858, lambda = 714285.7142857143 } }",
];

/// Number of cells across the beam of the implicit steps.
const ACROSS: usize = 6;

fn cases(threads: Option<usize>) -> Vec<BenchmarkCase> {
    let threads = threads.unwrap_or(1);
    let mut cases = vec![];
    for (case, by_hand, formula) in
        [("explicit", BY_HAND[0], FORMULAS[0]), ("explicit, with log", BY_HAND[1], FORMULAS[1])]
    {
        let part = |name, elastic: &'static str| {
            BenchmarkPart::new(name, threads, move || Stepping::new(&wavy_of(SMALL, elastic, "analytic")?))
        };
        cases.push(BenchmarkCase {
            size: tets(SMALL),
            items: "tets",
            case: case.into(),
            figure: Metric::Slowdown,
            parts: vec![part("formula", formula), part("by hand", by_hand)],
            reference: goal(4.0),
        });
    }
    let part = |name, elastic: &'static str| {
        BenchmarkPart::new(name, threads, move || Stepping::new(&falling_of(ACROSS, elastic)?))
    };
    cases.push(BenchmarkCase {
        size: 24 * (ACROSS * ACROSS * ACROSS) as u64,
        items: "tets",
        case: "implicit".into(),
        figure: Metric::Slowdown,
        parts: vec![part("formula", FORMULAS[1]), part("by hand", BY_HAND[1])],
        reference: goal(1.5),
    });
    cases
}
