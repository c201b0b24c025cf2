//! Where work is done: without the lock of the interpreter, on rayon's threads.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pliant::simulation::StepError;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::simulation::PySimulation;
use crate::{arguments, errors};

/// How long Ctrl-C waits at most to be seen.
const BETWEEN_LOOKS: Duration = Duration::from_millis(50);

/// How many forks led to this process: rayon's threads are those of the first.
static FORKS: AtomicU64 = AtomicU64::new(0);

/// Function that `os.register_at_fork` calls in a child.
#[pyfunction]
pub(crate) fn _after_fork() {
    FORKS.fetch_add(1, Ordering::Relaxed);
}

/// Number of forks that led to this process.
pub(crate) fn forks() -> u64 {
    FORKS.load(Ordering::Relaxed)
}

/// Does `work` on threads that are there: those of rayon, but for the child of a fork, which has one of its
/// own.
pub(crate) fn run<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    static OWN: Mutex<Option<(u64, Arc<ThreadPool>)>> = Mutex::new(None);
    let forks = forks();
    if forks == 0 {
        return work();
    }
    let pool = {
        let mut own = OWN.lock().unwrap_or_else(PoisonError::into_inner);
        if own.as_ref().is_none_or(|(of, _)| *of != forks) {
            // The threads of the parent's are not here to be ended.
            std::mem::forget(own.take());
            let made = ThreadPoolBuilder::new().num_threads(1).build().ok();
            *own = made.map(|pool| (forks, Arc::new(pool)));
        }
        own.as_ref().map(|(_, pool)| pool.clone())
    };
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

/// Takes `steps` steps of each of these simulations on `threads` threads, 0 for as many as there are
/// processors, and returns for each whether, and else why, a step could not be taken.
#[pyfunction]
pub(crate) fn _rollout(
    py: Python<'_>,
    simulations: Vec<Py<PySimulation>>,
    #[pyo3(from_py_with = arguments::count)] steps: u64,
    #[pyo3(from_py_with = arguments::count)] threads: usize,
) -> PyResult<Vec<Option<PyErr>>> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| PyRuntimeError::new_err(format!("cannot start threads: {error}")))?;
    let shared: Vec<&PySimulation> = simulations.iter().map(Py::get).collect();
    let mut locked = shared.iter().map(|one| one.lock()).collect::<PyResult<Vec<_>>>()?;
    let steppers: Vec<&mut pliant::simulation::Simulation> =
        locked.iter_mut().map(|one| &mut one.simulation).collect();
    let stop = AtomicBool::new(false);
    let mut signal = None;
    let ends = interruptible(py, &stop, &mut signal, || pool.install(|| all(steppers, steps, &stop)))?;
    let mut errors = vec![];
    for (inner, end) in locked.iter_mut().zip(ends) {
        inner.publish(py)?;
        errors.push(end.err().map(|error| inner.failed(py, errors::step(&error))));
    }
    signal.map_or(Ok(errors), Err)
}

/// Each by one task, as long as they come: a simulation that takes long does not hold up others.
fn all(
    steppers: Vec<&mut pliant::simulation::Simulation>,
    steps: u64,
    stop: &AtomicBool,
) -> Vec<Result<(), StepError>> {
    use rayon::prelude::*;
    let one = |stepper: &mut pliant::simulation::Simulation| {
        (0..steps).take_while(|_| !stop.load(Ordering::Relaxed)).try_for_each(|_| stepper.step())
    };
    steppers.into_par_iter().with_max_len(1).map(one).collect()
}

/// Does `work` on a thread of its own, while this one looks for signals: what the handler of one raised is
/// written to `signal`, and `stop` is set, which `work` shall heed.
///
/// # Errors
/// `work` panicked.
pub(crate) fn interruptible<T: Send>(
    py: Python<'_>,
    stop: &AtomicBool,
    signal: &mut Option<PyErr>,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    std::thread::scope(|scope| {
        let (tell, mut told) = std::sync::mpsc::sync_channel(1);
        scope.spawn(move || tell.send(run(work)));
        // The lock of the interpreter is free until there is something to do with it: `work` may need it.
        loop {
            let told = &mut told;
            match py.detach(move || told.recv_timeout(BETWEEN_LOOKS)) {
                Ok(done) => return Ok(done),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(PyRuntimeError::new_err("a thread of the simulation ended in a panic"));
                }
            }
            if let Err(error) = py.check_signals() {
                stop.store(true, Ordering::Relaxed);
                *signal = Some(error);
            }
        }
    })
}
