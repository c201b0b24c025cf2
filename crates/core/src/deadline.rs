//! Work that ends in time.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// How often it is looked whether the time is over.
const LOOK: Duration = Duration::from_millis(10);

/// Flag that ends work in progress once it is set; without one, nothing does.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stop(Option<Arc<AtomicBool>>);

impl Stop {
    pub(crate) fn new(flag: Option<Arc<AtomicBool>>) -> Self {
        Stop(flag)
    }

    /// Whether there is a flag.
    pub(crate) fn is_there(&self) -> bool {
        self.0.is_some()
    }

    /// Whether work is to end.
    pub(crate) fn is_set(&self) -> bool {
        self.0.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}

/// Work that ended because it was asked to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stopped before it was done")]
pub struct Stopped;

/// Does `work` with a flag that is set as soon as `over` says so, which is asked every ten milliseconds on a thread of its own: a single
/// step, or a solve in it, can take longer than there is time.
pub(crate) fn until<T>(over: impl Fn() -> bool + Sync, work: impl FnOnce(&Arc<AtomicBool>) -> T) -> T {
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
    use crate::scene::Scene;
    use crate::simulation::StepError;
    use crate::solver::Verdict;

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

    // A solve that has begun ends too, and leaves the state as it was.
    #[test]
    fn a_simulation_that_is_stopped_solves_no_more() {
        for (name, pace) in [
            ("'implicit-euler'", "step = 0.01"),
            ("'gauss2'", "step = 0.01"),
            ("{ ias15 = {} }", "step = 0.001"),
            ("'tr-bdf2'", "adaptive = { tolerance = 1e-3 }"),
            ("'bogacki-shampine3'", "adaptive = { tolerance = 1e-3 }"),
        ] {
            let mut simulation = Scene::from_toml(&format!(
                "dimension = 2\ntime = {{ integrator = {name}, {pace}, duration = 1.0 }}\nworld = {{ gravity = [0, -9.81] }}\n\
                 [[body]]\nmesh = {{ grid = {{ cells = [3, 1], spacing = 0.5 }} }}\n\
                 elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000.0 }}\n\
                 pin = [{{ vertices = [0] }}]\n"
            ))
            .unwrap()
            .assemble(crate::assembly::UnstableStep::Accept)
            .unwrap()
            .simulation;
            simulation.step().unwrap();
            let before = (simulation.state().time, simulation.positions().into_owned());
            let stop = Arc::new(AtomicBool::new(true));
            simulation.system_mut().set_stop(Some(Arc::clone(&stop)));
            let error = simulation.step().unwrap_err();
            assert!(
                matches!(error, StepError::Unsolved { verdict: Verdict::Stopped, .. }),
                "{name}: {error}"
            );
            assert_eq!((simulation.state().time, simulation.positions().into_owned()), before, "{name}");
            stop.store(false, Ordering::Relaxed);
            simulation.step().unwrap();
        }
    }
}
