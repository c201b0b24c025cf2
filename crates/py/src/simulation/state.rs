//! Where a simulation is, and how that is changed.

use std::path::{Path, PathBuf};

use numpy::{IntoPyArray, PyArray1, PyArray2};
use pliant::observer::Notes;
use pliant::simulation::{Checkpoint, Simulation as Core};
use pliant_record::checkpoint::{CheckpointContent, CheckpointError, CheckpointFile, SavedScene};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyList, PyTuple};

use super::{Inner, PySimulation, View};
use crate::arrays::Doubles;
use crate::scene::PyScene;
use crate::state::PyState;
use crate::{arrays, errors, topology};

#[pymethods]
impl PySimulation {
    /// Scene: The scene, including changes by `set`.
    #[getter]
    fn scene(&self) -> PyResult<PyScene> {
        Ok(self.lock()?.scene.clone())
    }

    /// float: Simulated time [s].
    #[getter]
    fn time(&self) -> PyResult<f64> {
        Ok(self.lock()?.simulation.state().time)
    }

    /// int: Number of steps.
    #[getter]
    fn steps(&self) -> PyResult<u64> {
        Ok(self.lock()?.simulation.state().step)
    }

    /// float: Time step [s]; if it is adaptive, the next one to try.
    #[getter]
    fn step_size(&self) -> PyResult<f64> {
        Ok(self.lock()?.simulation.step_size())
    }

    /// int: Space dimension, 2 or 3.
    #[getter]
    fn dimension(&self) -> usize {
        self.dimension
    }

    /// int: Number of vertices.
    #[getter]
    fn vertex_count(&self) -> usize {
        self.vertices
    }

    /// ndarray of float64, shape (n, dim): Positions [m]: a read-only copy. Assign an array of this shape to
    /// change them, for example a changed ``simulation.positions.copy()``: prescribed motion keeps its own
    /// positions, and other pinned vertices are fixed at the new ones. Raises ValueError, without a change,
    /// if surfaces of ``[contact]`` would cross or overlap.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Doubles<'py>> {
        let positions = self.lock()?.simulation.positions().into_owned();
        arrays::read_only(arrays::array(py, positions, &self.shape())?)
    }

    #[setter]
    fn set_positions(&self, py: Python<'_>, positions: &Bound<'_, PyAny>) -> PyResult<()> {
        let x = arrays::finite_rows(positions, &self.shape(), "positions")?;
        let mut inner = self.lock()?;
        place(&mut inner.simulation, &x)?;
        inner.publish(py)
    }

    /// ndarray of float64, shape (n, dim): Velocities [m/s]: a read-only copy. Assign an array of this shape
    /// to change them; velocities of pinned degrees of freedom do not change.
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Doubles<'py>> {
        let velocities = self.lock()?.simulation.velocities().into_owned();
        arrays::read_only(arrays::array(py, velocities, &self.shape())?)
    }

    #[setter]
    fn set_velocities(&self, py: Python<'_>, velocities: &Bound<'_, PyAny>) -> PyResult<()> {
        let v = arrays::finite_rows(velocities, &self.shape(), "velocities")?;
        let mut inner = self.lock()?;
        inner.simulation.set_velocities(&v);
        inner.publish(py)
    }

    /// ndarray of float64, shape (n, dim): Positions [m], read only: the same array each time, without a copy
    /// on access. Calls that change the state update it, and it outlives the simulation.
    #[getter]
    fn positions_view<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut inner = self.lock()?;
        if inner.views.positions.is_none() {
            inner.views.positions = Some(View::new(py, self.shape())?);
            inner.publish(py)?;
        }
        let view = inner.views.positions.as_ref().expect("it was made above");
        Ok(view.shown.bind(py).clone())
    }

    /// ndarray of float64, shape (n, dim): Velocities [m/s], like `positions_view`.
    #[getter]
    fn velocities_view<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut inner = self.lock()?;
        if inner.views.velocities.is_none() {
            inner.views.velocities = Some(View::new(py, self.shape())?);
            inner.publish(py)?;
        }
        let view = inner.views.velocities.as_ref().expect("it was made above");
        Ok(view.shown.bind(py).clone())
    }

    /// ndarray of float64, shape (n, dim): Reference positions [m].
    #[getter]
    fn rest_positions<'py>(&self, py: Python<'py>) -> PyResult<Doubles<'py>> {
        let rest = self.lock()?.topology.rest_positions.clone();
        arrays::array(py, rest, &self.shape())
    }

    /// ndarray of float64, shape (n,): Lumped mass of every vertex [kg].
    #[getter]
    fn masses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(self.lock()?.topology.masses.clone().into_pyarray(py))
    }

    /// list of dict: Bodies: ``name``, ``kind``, ``vertices`` (first, and one past the last), and cells as
    /// rows of vertex numbers: ``edges``, ``triangles``, ``tetrahedra``, ``quadrilaterals``, ``hexahedra``,
    /// second-order ``quad8``, ``quad9``, ``hex20``, ``hex27``, ``surface``, and the mid-edge nodes of
    /// second-order triangles and tetrahedra.
    #[getter]
    fn bodies<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let topology = self.lock()?.topology.clone();
        topology::bodies(py, &topology)
    }

    /// State: Current state. Assign a state of this scene to return to it.
    #[getter]
    fn state(&self) -> PyResult<PyState> {
        Ok(PyState { snapshot: self.lock()?.simulation.snapshot(), dimension: self.dimension })
    }

    #[setter]
    fn set_state(&self, py: Python<'_>, state: &PyState) -> PyResult<()> {
        let mut inner = self.lock()?;
        let restored = inner.simulation.restore(&state.snapshot);
        restored.map_err(|error| PyValueError::new_err(error.to_string()))?;
        inner.publish(py)
    }

    /// Return to the initial state of the scene, at time 0. Parameters, forces and pins do not change.
    ///
    /// Examples
    /// --------
    /// >>> simulation.step(3)
    /// >>> simulation.reset()
    /// >>> simulation.time
    /// 0.0
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        let mut inner = self.lock()?;
        let start = inner.start.clone();
        let restored = inner.simulation.restore(&start);
        restored.map_err(|error| PyValueError::new_err(error.to_string()))?;
        inner.publish(py)
    }

    /// Make a second, independent simulation in the current state.
    ///
    /// Returns
    /// -------
    /// Simulation
    ///     Simulation in the same state, with the same parameters, forces and pins.
    ///
    /// Examples
    /// --------
    /// >>> other = simulation.clone()
    /// >>> other.step()
    /// >>> other.steps, simulation.steps
    /// (1, 0)
    fn clone(&self, py: Python<'_>) -> PyResult<Self> {
        let (scene, checkpoint, additions) = self.lock()?.parts(py);
        PySimulation::rebuilt(py, scene, &checkpoint, additions)
    }

    fn __copy__(&self, py: Python<'_>) -> PyResult<Self> {
        self.clone(py)
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.clone(py)
    }

    /// Write the current state to a file, from which `restore` continues bit-identically in any process.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     File to write; an existing one is replaced atomically.
    ///
    /// Raises
    /// ------
    /// OSError
    ///     The file cannot be written.
    ///
    /// Notes
    /// -----
    /// The file contains the scene, the state, additions (pins, forces, materials) and a checksum, but not
    /// the mesh files of the scene. Solvers of implicit integrators are reset, both here and in the restored
    /// simulation, so that both continue bit-identically.
    ///
    /// Examples
    /// --------
    /// >>> simulation.save("a.checkpoint")
    /// >>> Simulation.restore("a.checkpoint").state == simulation.state
    /// True
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let mut inner = self.lock()?;
        let mut notes = Notes::new();
        inner.additions.note(py, &mut notes)?;
        let Inner { simulation, scene, .. } = &mut *inner;
        let written = py.detach(|| written(simulation, scene, &notes, |content| content.write(&path)));
        written.map_err(|error| errors::checkpoint(&error))
    }

    /// Restore a simulation from a file written by `save` or ``pliant run --checkpoint``.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     File to read. It may contain pickled functions and materials: only read files that you trust.
    ///
    /// Returns
    /// -------
    /// Simulation
    ///     Simulation in the same state, with the same parameters, forces and pins.
    ///
    /// Raises
    /// ------
    /// OSError
    ///     The file cannot be read.
    /// ValueError
    ///     The file is not a checkpoint, damaged, or of another version of pliant; or a mesh file has
    ///     changed.
    ///
    /// Examples
    /// --------
    /// >>> simulation.step(5)
    /// >>> simulation.save("a.checkpoint")
    /// >>> Simulation.restore("a.checkpoint").steps
    /// 5
    #[staticmethod]
    fn restore(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let file = py.detach(|| CheckpointFile::read(&path)).map_err(|error| errors::checkpoint(&error))?;
        let additions = super::Additions::noted(py, &file.notes)?;
        PySimulation::rebuilt(py, PyScene::of(py, file.scene.source())?, &file.simulation, additions)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, this) = (slf.py(), slf.get());
        let (bytes, additions) = {
            let mut inner = this.lock()?;
            let Inner { simulation, scene, .. } = &mut *inner;
            let bytes = written(simulation, scene, &Notes::new(), |content| {
                let path = || PathBuf::from("a pickle");
                content.to_bytes().map_err(|source| CheckpointError::Write { path: path(), source })
            });
            (bytes.map_err(|error| errors::checkpoint(&error))?, inner.additions.pickled(py)?)
        };
        let state = (PyBytes::new(py, &bytes), additions).into_pyobject(py)?;
        Ok((slf.get_type().getattr("_restore")?, state))
    }

    /// What pickle calls.
    #[staticmethod]
    fn _restore(py: Python<'_>, bytes: &[u8], additions: &Bound<'_, PyTuple>) -> PyResult<Self> {
        let file = CheckpointFile::from_bytes(Path::new("the pickle"), bytes);
        let file = file.map_err(|error| errors::checkpoint(&error))?;
        let additions = super::Additions::unpickled(additions)?;
        PySimulation::rebuilt(py, PyScene::of(py, file.scene.source())?, &file.simulation, additions)
    }
}

/// A checkpoint of `simulation`, which `write` writes.
fn written<T>(
    simulation: &mut Core,
    scene: &PyScene,
    notes: &Notes,
    write: impl FnOnce(&CheckpointContent<'_>) -> Result<T, CheckpointError>,
) -> Result<T, CheckpointError> {
    let scene = SavedScene::new(&scene.source, &scene.scene)?;
    let simulation = simulation.checkpoint();
    write(&CheckpointContent { scene: &scene, simulation: &simulation, run: None, notes })
}

impl PySimulation {
    /// A simulation of `scene` that goes on from a checkpoint, with what was added to another.
    fn rebuilt(
        py: Python<'_>,
        scene: PyScene,
        checkpoint: &Checkpoint,
        additions: super::Additions,
    ) -> PyResult<Self> {
        let simulation = PySimulation::assembled(py, scene)?;
        simulation.lock()?.go_on_from(py, checkpoint, additions)?;
        Ok(simulation)
    }
}

impl Inner {
    /// Parts that another simulation goes on from here with.
    pub(crate) fn parts(&mut self, py: Python<'_>) -> (PyScene, Checkpoint, super::Additions) {
        (self.scene.clone(), self.simulation.checkpoint(), self.additions.duplicate(py))
    }

    /// Goes on from a checkpoint of another simulation of this scene, with what was added to that.
    pub(crate) fn go_on_from(
        &mut self,
        py: Python<'_>,
        checkpoint: &Checkpoint,
        additions: super::Additions,
    ) -> PyResult<()> {
        self.additions = additions;
        // Before the state, so that what energies remember fits the terms that there are.
        self.apply_additions(py)?;
        let resumed = self.simulation.resume(checkpoint);
        resumed.map_err(|error| PyValueError::new_err(error.to_string()))
    }
}

/// Puts the vertices at `x`, flat [m].
///
/// # Errors
/// ValueError where surfaces would cross or overlap.
pub(crate) fn place(simulation: &mut Core, x: &[f64]) -> PyResult<()> {
    match simulation.conflict_at(x) {
        Some(conflict) => {
            Err(PyValueError::new_err(format!("{conflict} at these positions: move them apart")))
        }
        None => {
            simulation.set_positions(x);
            Ok(())
        }
    }
}
