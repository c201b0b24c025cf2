//! Simulations that run in a page while the kernel goes on.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use pliant_live::{LiveError, LiveOptions, LiveServer, LiveSummary};
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::errors;
use crate::scene::PyScene;
use crate::simulation::PySimulation;

/// A copy of a simulation that is served in a thread of its own.
#[pyclass(name = "LiveRun", frozen, module = "pliant._pliant")]
pub(crate) struct PyLiveRun {
    url: String,
    stop: Arc<AtomicBool>,
    /// `None` once it has been waited for.
    thread: Mutex<Option<JoinHandle<Result<LiveSummary, LiveError>>>>,
}

fn failure(py: Python<'_>, error: LiveError) -> PyErr {
    match error {
        LiveError::Scene(error) => errors::scene(py, &error),
        LiveError::Record(error) => errors::record(&error),
        LiveError::System { .. } => PyOSError::new_err(error.to_string()),
        error => PyRuntimeError::new_err(error.to_string()),
    }
}

/// Serves a copy of `simulation` on loopback, at the address that `url` says.
#[pyfunction]
pub(crate) fn _live(py: Python<'_>, simulation: &Bound<'_, PySimulation>) -> PyResult<PyLiveRun> {
    let (scene, state) = simulation.get().for_live()?;
    let options = LiveOptions { state: Some(state), in_frames: true, ..LiveOptions::default() };
    let source = (*scene.source).clone();
    let server = py.detach(|| LiveServer::new(source, &options)).map_err(|error| failure(py, error))?;
    let (url, stop) = (server.url(), Arc::new(AtomicBool::new(false)));
    let flag = Arc::clone(&stop);
    let thread = std::thread::Builder::new().name("live".to_owned()).spawn(move || server.run(&flag))?;
    Ok(PyLiveRun { url, stop, thread: Mutex::new(Some(thread)) })
}

#[pymethods]
impl PyLiveRun {
    #[getter]
    fn url(&self) -> &str {
        &self.url
    }

    #[getter]
    fn is_running(&self) -> bool {
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner);
        thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Ends it: the simulation where it was, with the changes of the page.
    fn stop(&self, py: Python<'_>) -> PyResult<PySimulation> {
        self.stop.store(true, Ordering::Relaxed);
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take();
        let thread = thread.ok_or_else(|| PyRuntimeError::new_err("it has been stopped before"))?;
        let ended = py.detach(|| thread.join());
        let ended = ended.map_err(|_| PyRuntimeError::new_err("the thread of the page has panicked"))?;
        let LiveSummary { source, state, .. } = ended.map_err(|error| failure(py, error))?;
        PySimulation::at(py, PyScene::of(py, source)?, &state)
    }
}

/// Drop ends the thread, and does not wait for it.
impl Drop for PyLiveRun {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

impl PySimulation {
    /// What a page needs to go on from here.
    fn for_live(&self) -> PyResult<(PyScene, pliant::simulation::Snapshot)> {
        let inner = self.lock()?;
        if let Some(what) = inner.additions.beyond_the_scene() {
            return Err(PyValueError::new_err(format!(
                "a page runs what the scene says, and this simulation has {what}; put that into the scene"
            )));
        }
        Ok((inner.scene.clone(), inner.simulation.snapshot()))
    }

    /// A simulation of `scene` in this state.
    fn at(py: Python<'_>, scene: PyScene, state: &pliant::simulation::Snapshot) -> PyResult<Self> {
        let simulation = PySimulation::assembled(py, scene)?;
        let restored = simulation.lock()?.simulation.restore(state);
        restored.map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(simulation)
    }
}
