//! Time limits of cases, and the outcome within them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::{Case, CaseResult};

/// A case may take so many times its share of what is left: most take less.
const GREED: f64 = 2.0;

/// Until when a case may run.
pub(super) struct Limits<'a> {
    pub(super) deadline: Option<Instant>,
    /// Set from elsewhere to stop.
    pub(super) interrupt: &'a AtomicBool,
}

impl Limits<'_> {
    /// True if it has to end.
    pub(super) fn are_over(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed)
            || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

/// Progress of a suite, before each case.
#[derive(Clone, Copy, Debug)]
pub struct Progress<'a> {
    /// The case that begins.
    pub case: &'a Case,
    /// Cases finished.
    pub finished: usize,
    /// Cases in all.
    pub count: usize,
    /// Seconds that are likely left, once anything is known.
    pub left: Option<f64>,
}

/// Runs cases in turn, in `budget` seconds together where there is one: each may take twice its share of
/// what is left. Cases of a [scene](super::scene_cases) and long ones are cut short then, which they say;
/// others end as they do, and those that would begin after the time is over are left out. Results that are
/// `known` of earlier runs are taken instead; those that were cut short only where there is no more time now,
/// or where another run comes less far. `seen` is told before each case, and of what came of it.
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
        // The one that came farther counts: on a busy machine that may be the earlier one.
        let farther = |earlier: &CaseResult| findings.cut_short && earlier.steps > findings.steps;
        let findings = earlier.filter(farther).unwrap_or(findings);
        seen(progress, Some(&findings));
        // What was interrupted has found nothing.
        if !interrupt.load(Ordering::Relaxed) {
            results.push((case, findings));
        }
    }
    results
}
