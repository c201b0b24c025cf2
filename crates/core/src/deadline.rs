//! Work with a time limit.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Interval between checks of the time limit.
const LOOK: Duration = Duration::from_millis(10);

/// Optional flag that ends work in progress once it is set.
#[derive(Clone, Debug, Default)]
pub struct Stop(Option<Arc<AtomicBool>>);

impl Stop {
    pub(crate) fn new(flag: Option<Arc<AtomicBool>>) -> Self {
        Stop(flag)
    }

    /// True if there is a flag.
    pub(crate) fn is_there(&self) -> bool {
        self.0.is_some()
    }

    /// True if the work must end.
    pub(crate) fn is_set(&self) -> bool {
        self.0.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}

/// Error of work that was stopped by its flag.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stopped before it was done")]
pub struct Stopped;

/// Runs `work` with a flag that is set as soon as `over` returns true. A separate thread calls `over` every
/// ten milliseconds, because a single step, or a solve in it, can exceed the limit.
pub fn until<T>(over: impl Fn() -> bool + Sync, work: impl FnOnce(&Arc<AtomicBool>) -> T) -> T {
    let stop = Arc::new(AtomicBool::new(over()));
    let (done, ended) = channel::<()>();
    let (over, stop) = (&over, &stop);
    std::thread::scope(|scope| {
        // Without a thread to be had the work is only looked at where it looks itself.
        let _ = std::thread::Builder::new().spawn_scoped(scope, move || {
            while ended.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                if over() {
                    stop.store(true, Ordering::Relaxed);
                    break;
                }
            }
        });
        let result = work(stop);
        drop(done);
        result
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_told_when_its_time_is_over() {
        // Does not come back otherwise.
        until(|| true, |stop| while !stop.load(Ordering::Relaxed) {});
        assert!(!until(|| false, |stop| stop.load(Ordering::Relaxed)));
    }

    // The time is over only after work has begun: it is looked again and again, not once before.
    #[test]
    fn work_in_progress_is_told_when_its_time_is_over() {
        let (begun, over) = (AtomicBool::new(false), AtomicBool::new(false));
        let ended = until(
            || begun.load(Ordering::Relaxed) && over.load(Ordering::Relaxed),
            |stop| {
                assert!(!stop.load(Ordering::Relaxed), "nothing is over before work begins");
                begun.store(true, Ordering::Relaxed);
                over.store(true, Ordering::Relaxed);
                // Ten milliseconds, on a machine that is busy more: a minute is a deadline that does not end
                // anything.
                let start = std::time::Instant::now();
                while !stop.load(Ordering::Relaxed) && start.elapsed() < Duration::from_secs(60) {
                    std::thread::sleep(Duration::from_millis(1));
                }
                stop.load(Ordering::Relaxed)
            },
        );
        assert!(ended);
    }

    #[test]
    fn conjugate_gradients_end_where_they_are_stopped() {
        use crate::solver::conjugate_gradients::{CgEnd, ConjugateGradients};
        let stop = Arc::new(AtomicBool::new(false));
        let mut cg = ConjugateGradients::default();
        cg.set_stop(Stop::new(Some(Arc::clone(&stop))));
        let mut products = 0;
        let product = |p: &[f64], q: &mut [f64]| {
            products += 1;
            stop.store(products == 3, Ordering::Relaxed);
            (0..p.len()).for_each(|i| q[i] = (i + 1) as f64 * p[i]);
        };
        let (right, mut x) = (vec![1.0; 40], vec![0.0; 40]);
        let report = cg.solve::<1>(product, &mut Same, &right, &mut x, 1e-12, 1000);
        assert_eq!((report.end, report.iterations), (CgEnd::Stopped, 3));
    }

    struct Same;

    impl crate::solver::conjugate_gradients::Preconditioner<1> for Same {
        fn update(
            &mut self,
            _: &crate::solver::block_matrix::BlockMatrix<1>,
        ) -> Result<(), crate::solver::cholesky::NotPositiveDefinite> {
            Ok(())
        }
        fn apply(&mut self, r: &[f64], z: &mut [f64]) {
            z.copy_from_slice(r);
        }
    }
}
