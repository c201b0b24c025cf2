//! The stepper.

mod gradient;
mod measure;
mod parameters;
mod state;
mod steering;
mod vibration;

use std::sync::{Arc, Mutex, MutexGuard, TryLockError};
use std::time::{Duration, Instant};

use numpy::{PyArray2, PyArrayMethods};
use pliant::numbering::Numbering;
use pliant::probe::Probe;
use pliant::quantity::counted;
use pliant::simulation::{Simulation as Core, Snapshot, StepError};
use pliant::topology::Topology;
use pliant_scene::assembly::{Assembly, Report};
use pyo3::exceptions::{PyRuntimeError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::Doubles;
use crate::scene::PyScene;
use crate::{arguments, arrays, errors, threads};
pub(crate) use measure::{contacts_table, energies};
pub(crate) use parameters::{Additions, Raised};
pub(crate) use state::place;
pub(crate) use vibration::PySuperposition;

/// Steps are taken in batches of about this long; Ctrl-C is looked for between them.
const BATCH: Duration = Duration::from_millis(20);

/// Simulation of a scene, which advances in time, ``(x_n, v_n) -> (x_{n+1}, v_{n+1})``.
///
/// Its steps are bit-identical to those of ``pliant run``. Other Python threads run during steps; only one
/// thread at a time can use a simulation.
///
/// Parameters
/// ----------
/// scene : Scene
///     The scene.
/// materials : dict of str to Material, optional
///     Materials written in Python, by name of the body, instead of those of the scene. They are slower;
///     see `Material`.
///
/// Raises
/// ------
/// SceneError
///     The scene cannot be simulated: a mesh, a selection, a mass, or a time step above the stability limit.
///
/// Examples
/// --------
/// >>> simulation = Simulation(Scene.from_toml("scenes/cantilever_fem_2d.toml"))
/// >>> simulation.step(100)
/// >>> simulation.positions.shape
/// (80, 2)
#[pyclass(name = "Simulation", frozen, module = "pliant", weakref)]
pub(crate) struct PySimulation {
    inner: Mutex<Inner>,
    dimension: usize,
    vertices: usize,
}

/// All that changes.
pub(crate) struct Inner {
    pub(crate) simulation: Core,
    pub(crate) scene: PyScene,
    pub(crate) topology: Arc<Topology>,
    pub(crate) probes: Vec<Probe>,
    pub(crate) report: Report,
    /// How it began.
    start: Snapshot,
    pub(crate) additions: Additions,
    views: Views,
}

/// Arrays that Python sees, and that show the state after each call.
#[derive(Default)]
struct Views {
    positions: Option<View>,
    velocities: Option<View>,
}

/// An array and what Python sees of it, which cannot be written.
struct View {
    array: Py<PyArray2<f64>>,
    shown: Py<PyArray2<f64>>,
}

impl View {
    fn new(py: Python<'_>, shape: [usize; 2]) -> PyResult<Self> {
        let array = PyArray2::zeros(py, shape, false);
        let shown = array.call_method0("view")?.cast_into::<PyArray2<f64>>()?;
        arrays::freeze(&shown)?;
        Ok(View { array: array.unbind(), shown: shown.unbind() })
    }

    /// Shows these rows, which are in the order of the simulation.
    fn show(&self, py: Python<'_>, numbering: &Numbering, rows: &[f64], dimension: usize) -> PyResult<()> {
        numbering.write_original(rows, dimension, self.array.bind(py).try_readwrite()?.as_slice_mut()?);
        Ok(())
    }
}

impl Inner {
    pub(crate) fn new(scene: PyScene, assembly: Assembly) -> Self {
        let Assembly { simulation, topology, probes, report } = assembly;
        Inner {
            start: simulation.snapshot(),
            simulation,
            scene,
            topology: Arc::new(topology),
            probes,
            report,
            additions: Additions::default(),
            views: Views::default(),
        }
    }

    /// Shows the present state to those who look.
    pub(crate) fn publish(&self, py: Python<'_>) -> PyResult<()> {
        let (state, numbering) = (self.simulation.state(), self.simulation.numbering());
        let (views, dimension) = (&self.views, self.topology.dimension);
        for (view, rows) in [(&views.positions, state.x()), (&views.velocities, state.v())] {
            if let Some(view) = view {
                view.show(py, numbering, rows, dimension)?;
            }
        }
        Ok(())
    }

    /// What a function of the user raised, if that is why a step failed.
    pub(crate) fn failed(&self, py: Python<'_>, error: PyErr) -> PyErr {
        match self.additions.raised() {
            Some(raised) => {
                raised.set_cause(py, Some(error));
                raised
            }
            None => error,
        }
    }
}

impl PySimulation {
    pub(crate) fn assembled(py: Python<'_>, scene: PyScene) -> PyResult<Self> {
        let assembly = scene.assemble(py)?;
        Ok(PySimulation::of(Inner::new(scene, assembly)))
    }

    pub(crate) fn of(inner: Inner) -> Self {
        let (dimension, vertices) = (inner.topology.dimension, inner.topology.vertex_count);
        PySimulation { inner: Mutex::new(inner), dimension, vertices }
    }

    /// The simulation, for one thread.
    pub(crate) fn lock(&self) -> PyResult<MutexGuard<'_, Inner>> {
        match self.inner.try_lock() {
            Ok(inner) => Ok(inner),
            // A step that panicked is not a state to go on from, but one to look at.
            Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => Err(PyRuntimeError::new_err(
                "the simulation is in the middle of a step: it is used by another thread, or by a function \
                 that it calls itself",
            )),
        }
    }

    fn shape(&self) -> [usize; 2] {
        [self.vertices, self.dimension]
    }
}

#[pymethods]
impl PySimulation {
    #[new]
    #[pyo3(signature = (scene, *, materials = None))]
    fn new(py: Python<'_>, scene: &Bound<'_, PyAny>, materials: Option<Bound<'_, PyDict>>) -> PyResult<Self> {
        let simulation = PySimulation::assembled(py, given(scene)?)?;
        if let Some(materials) = materials {
            let mut inner = simulation.lock()?;
            inner.additions.set_materials(&materials)?;
            inner.apply_additions(py)?;
            inner.start = inner.simulation.snapshot();
        }
        Ok(simulation)
    }

    /// Advance by a number of steps.
    ///
    /// Parameters
    /// ----------
    /// n : int, default 1
    ///     Number of steps.
    ///
    /// Raises
    /// ------
    /// StepError
    ///     A step fails; the state is the last valid one.
    ///
    /// Examples
    /// --------
    /// >>> simulation.step(10)
    /// >>> simulation.steps
    /// 10
    #[pyo3(signature = (n = 1))]
    fn step(&self, py: Python<'_>, #[pyo3(from_py_with = arguments::count)] n: u64) -> PyResult<()> {
        let mut inner = self.lock()?;
        let started = Instant::now();
        let end = step(py, &mut inner.simulation, n);
        let slow = inner.additions.slowness(started.elapsed());
        inner.publish(py)?;
        if let Some(text) = slow {
            errors::warn(py, &text)?;
        }
        match end {
            Ok(signal) => signal,
            Err(error) => Err(inner.failed(py, errors::step(&error))),
        }
    }

    /// Compute one step from a given state, without side effects: ``x1, v1 = simulation.advance(x0, v0)``.
    ///
    /// Parameters
    /// ----------
    /// positions : array_like, shape (n, dim)
    ///     Positions at the start of the step [m].
    /// velocities : array_like, shape (n, dim)
    ///     Velocities [m/s]; those of pinned coordinates count as zero.
    ///
    /// Returns
    /// -------
    /// positions : ndarray of float64, shape (n, dim)
    ///     Positions at the end of the step [m].
    /// velocities : ndarray of float64, shape (n, dim)
    ///     Velocities at the end of the step [m/s].
    ///
    /// Raises
    /// ------
    /// StepError
    ///     The step fails.
    ///
    /// Notes
    /// -----
    /// Time-dependent quantities are evaluated at `time`. The simulation itself does not change.
    ///
    /// Examples
    /// --------
    /// >>> x, v = simulation.advance(simulation.positions, simulation.velocities)
    /// >>> x.shape, simulation.time
    /// ((10, 2), 0.0)
    fn advance<'py>(
        &self,
        py: Python<'py>,
        positions: &Bound<'py, PyAny>,
        velocities: &Bound<'py, PyAny>,
    ) -> PyResult<(Doubles<'py>, Doubles<'py>)> {
        let mut x = arrays::finite_rows(positions, &self.shape(), "positions")?;
        let mut v = arrays::finite_rows(velocities, &self.shape(), "velocities")?;
        let mut inner = self.lock()?;
        let simulation = &mut inner.simulation;
        let end = py.detach(|| threads::run(|| simulation.advanced(&mut x, &mut v)));
        end.map_err(|error| inner.failed(py, errors::step(&error)))?;
        Ok((arrays::array(py, x, &self.shape())?, arrays::array(py, v, &self.shape())?))
    }

    fn __repr__(&self) -> PyResult<String> {
        let inner = self.lock()?;
        let state = inner.simulation.state();
        Ok(format!(
            "<pliant.Simulation of {}: {} in {}D, t = {} s after {}>",
            inner.scene.source.name(),
            counted(self.vertices as u64, "vertex", "vertices"),
            self.dimension,
            state.time,
            counted(state.step, "step", "steps")
        ))
    }
}

/// Takes `n` steps; inside, what a signal's handler raised between two of them.
fn step(py: Python<'_>, simulation: &mut Core, n: u64) -> Result<PyResult<()>, StepError> {
    if n == 1 {
        return py.detach(|| threads::run(|| simulation.step())).map(Ok);
    }
    let (mut left, mut batch) = (n, 1);
    while left > 0 {
        let count = left.min(batch);
        let started = Instant::now();
        py.detach(|| threads::run(|| (0..count).try_for_each(|_| simulation.step())))?;
        left -= count;
        let taken = started.elapsed();
        if taken < BATCH / 2 {
            batch *= 2;
        } else if taken > 2 * BATCH {
            batch = (batch / 2).max(1);
        }
        if let Err(signal) = py.check_signals() {
            return Ok(Err(signal));
        }
    }
    Ok(Ok(()))
}

/// The scene that a simulation is made of.
///
/// # Errors
/// `TypeError`, with what reads files, of anything but a scene.
fn given(scene: &Bound<'_, PyAny>) -> PyResult<PyScene> {
    let no_scene = |_| {
        let message = match scene.get_type().name() {
            Ok(name) => format!("a simulation is of a `Scene`, got `{name}`"),
            Err(error) => return error,
        };
        PyTypeError::new_err(message + "; `Scene.from_toml(path)` reads one")
    };
    Ok(scene.cast::<PyScene>().map_err(no_scene)?.get().clone())
}
