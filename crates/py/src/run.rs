//! Whole runs: frames to files and to functions.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use pliant::diagnostics::Diagnostics;
use pliant::observer::{self, Observer, ObserverError};
use pliant::run::{self, Outcome, Plan};
use pliant_record::{LogLevel, MAX_LOSS, McapRecorder, Options, RecordError};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::Doubles;
use crate::simulation::{Inner, PySimulation};
use crate::{arrays, errors, threads};

/// State of a run at a frame, passed to the ``callback`` of `Simulation.run`.
#[pyclass(name = "Frame", frozen, module = "pliant")]
pub(crate) struct PyFrame {
    index: u64,
    step: u64,
    time: f64,
    x: Vec<f64>,
    v: Vec<f64>,
    diagnostics: Option<Diagnostics>,
    dimension: usize,
}

impl PyFrame {
    /// A state without its energies.
    pub(crate) fn state(
        index: u64,
        step: u64,
        time: f64,
        (x, v): (&[f64], &[f64]),
        dimension: usize,
    ) -> Self {
        PyFrame { index, step, time, x: x.to_vec(), v: v.to_vec(), diagnostics: None, dimension }
    }
}

#[pymethods]
impl PyFrame {
    /// int: Number of the frame, from 0.
    #[getter]
    fn index(&self) -> u64 {
        self.index
    }

    /// int: Number of steps.
    #[getter]
    fn step(&self) -> u64 {
        self.step
    }

    /// float: Simulated time [s].
    #[getter]
    fn time(&self) -> f64 {
        self.time
    }

    /// ndarray of float64, shape (n, dim): Positions [m].
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Doubles<'py>> {
        arrays::array(py, self.x.clone(), &[self.x.len() / self.dimension, self.dimension])
    }

    /// ndarray of float64, shape (n, dim): Velocities [m/s].
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Doubles<'py>> {
        arrays::array(py, self.v.clone(), &[self.v.len() / self.dimension, self.dimension])
    }

    /// dict of str to float: Energies [J], as in `Simulation.energy`.
    #[getter]
    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        match &self.diagnostics {
            Some(measured) => crate::simulation::energies(py, measured),
            None => Ok(PyDict::new(py)),
        }
    }

    fn __repr__(&self) -> String {
        format!("<pliant.Frame {} at t = {} s>", self.index, self.time)
    }
}

/// Shows frames to functions in Python.
struct Callback {
    functions: Vec<Py<PyAny>>,
    raised: Mutex<Option<PyErr>>,
}

impl Callback {
    fn raised(&self) -> Option<PyErr> {
        self.raised.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// A function raised something; what, is kept elsewhere.
#[derive(Debug)]
struct Raised;

impl std::fmt::Display for Raised {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("it raised an exception")
    }
}

impl std::error::Error for Raised {}

impl Observer for &Callback {
    fn quantities(&self) -> observer::Quantities {
        observer::Quantities::DIAGNOSTICS
    }

    fn frame(&mut self, frame: &observer::Frame<'_>) -> Result<(), ObserverError> {
        let shown = PyFrame {
            index: frame.index,
            step: frame.step,
            time: frame.time,
            x: frame.x.to_vec(),
            v: frame.v.to_vec(),
            diagnostics: frame.diagnostics.cloned(),
            dimension: frame.dimension,
        };
        let show = |py: Python<'_>| {
            let shown = Bound::new(py, shown)?;
            self.functions.iter().try_for_each(|function| function.call1(py, (&shown,)).map(drop))
        };
        Python::attach(show).map_err(|error| {
            *self.raised.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            ObserverError { what: "showing a frame to a function".into(), source: Box::new(Raised) }
        })
    }
}

#[pymethods]
impl PySimulation {
    /// Run to a time, showing frames at the rate of the scene's ``[output]``.
    ///
    /// Parameters
    /// ----------
    /// until : float, optional
    ///     Simulated time to reach [s]; default: the scene's duration.
    /// record : str or os.PathLike, optional
    ///     File to write, for `load`, Foxglove, Rerun; byte-identical to that of ``pliant run``.
    /// overwrite : bool, default False
    ///     True to replace an existing file.
    /// progress : bool, default False
    ///     True to show the progress on standard error.
    /// callback : callable, optional
    ///     Called with a `Frame` at every frame, starting with the current state. An exception ends the run.
    ///
    /// Returns
    /// -------
    /// Summary
    ///     Summary of the run.
    ///
    /// Raises
    /// ------
    /// StepError
    ///     A step fails, or the energy grows beyond any physical cause; the file is complete up to the last
    ///     valid frame.
    /// FileExistsError
    ///     The file `record` exists.
    /// KeyboardInterrupt
    ///     Ctrl-C; the file is complete up to that time.
    ///
    /// Examples
    /// --------
    /// >>> summary = simulation.run(until=0.05, record="run.mcap")
    /// >>> summary.steps, summary.path.name
    /// (50, 'run.mcap')
    #[pyo3(signature = (until = None, *, record = None, overwrite = false, progress = false, callback = None))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        until: Option<f64>,
        record: Option<PathBuf>,
        overwrite: bool,
        progress: bool,
        callback: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut inner = self.lock()?;
        let (now, before) = (inner.simulation.state().time, inner.simulation.state().step);
        let until = until.unwrap_or(inner.scene.scene.time.duration);
        if !(until.is_finite() && until >= now) {
            let message = format!("the run ends at {until} s, and the simulation is at {now} s");
            return Err(PyValueError::new_err(message));
        }
        let mut recorder = record.map(|path| recorder(&inner, path, overwrite)).transpose()?;
        let plan = Plan { duration: until - now, rate: inner.scene.scene.output.rate };
        let module = py.import("pliant._run")?;
        let bar = progress.then(|| module.call_method1("Progress", (now, until))).transpose()?;
        let functions: Vec<Py<PyAny>> = bar.iter().map(|bar| bar.clone().unbind()).chain(callback).collect();
        let callback = (!functions.is_empty()).then(|| Callback { functions, raised: Mutex::new(None) });
        let stop = Arc::new(AtomicBool::new(false));
        let simulation = &mut inner.simulation;
        simulation.set_stop(Some(Arc::clone(&stop)));
        let work = || {
            let mut shown = callback.as_ref();
            let mut observers: Vec<&mut dyn Observer> = vec![];
            observers.extend(recorder.as_mut().map(|recorder| recorder as &mut dyn Observer));
            observers.extend(shown.as_mut().map(|callback| callback as &mut dyn Observer));
            run::run(simulation, &plan, &mut observers, &stop)
        };
        // A signal ends the run well: the file is finished before its exception is raised.
        let mut signal = None;
        let started = Instant::now();
        let summary = threads::interruptible(py, &stop, &mut signal, work);
        inner.simulation.set_stop(None);
        let summary = summary?;
        let slow = inner.additions.slowness(started.elapsed());
        if let Some(bar) = bar {
            bar.call_method0("close")?;
        }
        inner.publish(py)?;
        let mut report = inner.report.clone();
        report.frames = match inner.simulation.step_control() {
            Some(_) => plan.exact_frames(),
            None => plan.frames(inner.simulation.step_size()),
        };
        let closing = pliant_cli::closing(&inner.scene.scene, &report, &summary);
        let unwritten =
            matches!(&summary.outcome, Outcome::ObserverFailed(error) if error.source.is::<RecordError>());
        let recorder = recorder.filter(|_| !unwritten);
        let finished = recorder.map(|recorder| finish(py, recorder, &closing)).transpose();
        if let Some(signal) = signal {
            return Err(signal);
        }
        match &summary.outcome {
            Outcome::Done | Outcome::Interrupted => {}
            Outcome::Failed(error) => return Err(inner.failed(py, errors::step(error))),
            Outcome::ObserverFailed(error) => {
                let raised = callback.as_ref().and_then(Callback::raised);
                return Err(raised.unwrap_or_else(|| match error.source.downcast_ref() {
                    Some(error) => errors::record(error),
                    None => PyRuntimeError::new_err(error.to_string()),
                }));
            }
        }
        let report = PyDict::new(py);
        report.set_item("frames", summary.frames)?;
        report.set_item("steps", inner.simulation.state().step - before)?;
        report.set_item("start", crate::simulation::energies(py, &summary.start)?)?;
        report.set_item("end", crate::simulation::energies(py, &summary.end)?)?;
        report.set_item("energy_drift", summary.relative_energy_drift())?;
        report.set_item("energy_error", summary.relative_energy_error())?;
        let Inner { simulation, topology, .. } = &mut *inner;
        let statics = serde_json::to_value(simulation.static_state(topology)).unwrap_or_default();
        report.set_item("statics", crate::document::from_json(py, &statics)?)?;
        report.set_item("path", finished?)?;
        let warnings = closing.0.into_iter().filter(|(level, _)| *level == LogLevel::Warning);
        let warnings: Vec<String> = warnings.map(|(_, text)| text).chain(slow).collect();
        report.set_item("warnings", warnings)?;
        module.call_method("Summary", (), Some(&report))
    }
}

fn recorder(inner: &Inner, path: PathBuf, overwrite: bool) -> PyResult<McapRecorder> {
    let options = Options {
        overwrite,
        channels: inner.scene.scene.output.channels.clone(),
        title: inner.scene.scene.title.clone(),
        probes: inner.probes.clone(),
        reactions: inner.simulation.reaction_names(),
        scene_text: inner.scene.source.text().to_owned(),
        max_loss: MAX_LOSS,
        ..Options::default()
    };
    McapRecorder::create(&path, &options, &inner.topology).map_err(|error| errors::record(&error))
}

/// Ends a file, whatever the run came to; where writing it failed, it keeps its temporary name.
fn finish(
    py: Python<'_>,
    mut recorder: McapRecorder,
    (messages, outcome): &(Vec<(LogLevel, String)>, pliant_record::RecordedOutcome),
) -> PyResult<PathBuf> {
    let finish = || {
        messages.iter().try_for_each(|(level, text)| recorder.log(*level, text, outcome.time))?;
        recorder.finish_with(outcome)
    };
    Ok(py.detach(finish).map_err(|error| errors::record(&error))?.path)
}
