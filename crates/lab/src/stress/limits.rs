//! Time limits of cases, and the outcome within them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::{Case, CaseResult};

/// Maximum time of a case, as a multiple of its share of the remaining time: most cases take less.
const GREED: f64 = 2.0;

/// Limits within which a case may run.
pub(super) struct Limits<'a> {
    pub(super) deadline: Option<Instant>,
    /// Set by another thread to stop.
    pub(super) interrupt: &'a AtomicBool,
}

impl Limits<'_> {
    /// True if the case must end.
    pub(super) fn are_over(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed)
            || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

/// Progress of a suite, reported before each case.
#[derive(Clone, Copy, Debug)]
pub struct Progress<'a> {
    /// The next case.
    pub case: &'a Case,
    /// Number of finished cases.
    pub finished: usize,
    /// Total number of cases.
    pub count: usize,
    /// Estimate of the remaining seconds; `None` before the first case.
    pub left: Option<f64>,
}

/// Runs cases in turn, within `budget` seconds if given: each may take twice its share of the remaining
/// time. Cases of a [scene](super::scene_cases) and long ones are then cut short, which their notes say;
/// other cases run to their end, and cases that would begin after the budget are omitted. `known` results
/// of earlier runs replace new ones; a result that was cut short does so only if there is no more time
/// now, or if the new run gets less far. `seen` is called before each case and with its result.
pub fn run_all(
    cases: Vec<Case>,
    budget: Option<f64>,
    interrupt: &AtomicBool,
    known: &dyn Fn(&Case) -> Option<CaseResult>,
    seen: &mut dyn FnMut(Progress<'_>, Option<&CaseResult>),
) -> Vec<(Case, CaseResult)> {
    let start = Instant::now();
    let count = cases.len();
    let mut results: Vec<(Case, CaseResult)> = vec![];
    for case in cases {
        let elapsed = start.elapsed().as_secs_f64();
        let to_come = (count - results.len()) as f64;
        let share = budget.map(|budget| (GREED * (budget - elapsed) / to_come).min(budget - elapsed));
        let enough =
            |known: &CaseResult| !known.cut_short || share.is_some_and(|share| share <= known.seconds);
        let earlier = known(&case);
        if let Some(known) = earlier.clone().filter(enough) {
            results.push((case, known));
            continue;
        }
        if interrupt.load(Ordering::Relaxed) || budget.is_some_and(|budget| elapsed >= budget) {
            break;
        }
        let finished = results.len();
        let left = (finished > 0).then(|| elapsed / finished as f64 * to_come);
        let left = left.map(|left| budget.map_or(left, |budget| left.min(budget - elapsed)));
        let progress = Progress { case: &case, finished, count, left };
        seen(progress, None);
        let findings = case.run_within(share.map(Duration::from_secs_f64), interrupt);
        // The result with more steps counts: on a busy machine that may be the earlier one.
        let farther = |earlier: &CaseResult| findings.cut_short && earlier.steps > findings.steps;
        let findings = earlier.filter(farther).unwrap_or(findings);
        seen(progress, Some(&findings));
        // An interrupted case has no result.
        if !interrupt.load(Ordering::Relaxed) {
            results.push((case, findings));
        }
    }
    results
}
