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

    /// A clamped block of so many cells along x, with these keys of time.
    fn block(cells: usize, time: &str) -> crate::simulation::Simulation {
        let text = format!(
            "dimension = 3\ntime = {{ {time}, step = 1e-3, duration = 1.0 }}\nworld = {{ gravity = [0, 0, -9.81] }}\n\
             [[body]]\nmesh = {{ grid = {{ cells = [{cells}, 2, 2], spacing = 0.5 }} }}\n\
             elastic = {{ neo-hookean = {{ young = 1e5, poisson = 0.3 }} }}\nmass = {{ density = 1000.0 }}\n\
             pin = [{{ half_space = {{ normal = [1, 0, 0], offset = 0 }} }}]\n"
        );
        let scene = Scene::from_toml(&text).unwrap();
        scene.assemble(crate::assembly::UnstableStep::Refuse).unwrap().simulation
    }

    /// Set beforehand, the flag ends them; taken back, they find what they look for.
    #[test]
    fn searches_end_where_they_are_stopped() {
        let mut simulation = block(20, "integrator = 'velocity-verlet'");
        let stop = Arc::new(AtomicBool::new(true));
        simulation.set_stop(Some(Arc::clone(&stop)));
        assert_eq!(simulation.stability_limit(1.0).unwrap_err(), Stopped);
        assert_eq!(simulation.modes(4).unwrap_err(), crate::modes::ModesError::Stopped);
        stop.store(false, Ordering::Relaxed);
        assert!(simulation.stability_limit(1.0).unwrap().step.is_finite());
        assert_eq!(simulation.modes(4).unwrap().modes.len(), 4);
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
        fn bytes(&self) -> usize {
            0
        }
    }

    /// By every linear solver, multigrid with its set-up.
    #[test]
    fn steps_that_are_stopped_say_so_by_every_linear_solver() {
        for linear in ["cholesky", "cg", "multigrid", "matrix-free"] {
            let time = format!("integrator = 'implicit-euler', solver = {{ linear = '{linear}' }}");
            let mut simulation = block(4, &time);
            simulation.set_stop(Some(Arc::new(AtomicBool::new(true))));
            let error = simulation.step().unwrap_err();
            let stopped = matches!(error, StepError::Unsolved { verdict: Verdict::Stopped, .. });
            assert!(stopped, "{linear}: {error}");
        }
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
