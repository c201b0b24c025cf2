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
    /// Scene: What is simulated, changes by `set` included.
    #[getter]
    fn scene(&self) -> PyResult<PyScene> {
        Ok(self.lock()?.scene.clone())
    }

    /// float: Simulated time [s].
    #[getter]
    fn time(&self) -> PyResult<f64> {
        Ok(self.lock()?.simulation.state().time)
    }

    /// int: Steps taken.
    #[getter]
    fn steps(&self) -> PyResult<u64> {
        Ok(self.lock()?.simulation.state().step)
    }

    /// float: Time step [s]; where it follows the error, that to be tried next.
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

    /// ndarray of float64, shape (n, dim): Positions [m]: a copy, read only. What is assigned must have this
    /// shape; prescribed motion keeps its own, and what is pinned is held where it is put. To change some,
    /// change a copy and assign it: ``x = simulation.positions.copy()``. ValueError where surfaces of
    /// ``[contact]`` would cross or overlap: nothing is changed then.
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

    /// ndarray of float64, shape (n, dim): Velocities [m/s]: a copy, read only. What is assigned must have
    /// this shape; velocities of pinned coordinates stay what they are.
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

    /// ndarray of float64, shape (n, dim): Positions [m], read only: the same array each time, without a
    /// copy when it is asked for. It shows the state after the last call that changed it, which wrote it
    /// there, and outlives the simulation.
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

    /// ndarray of float64, shape (n, dim): Velocities [m/s], as `positions_view`.
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

    /// ndarray of float64, shape (n, dim): Rest positions [m].
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

    /// list of dict: The bodies: ``name``, ``kind``, ``vertices`` (first, and one behind the last), and
    /// their cells by rows of vertex numbers: ``edges``, ``triangles``, ``tetrahedra``, ``quadrilaterals``,
    /// ``hexahedra``, of second order ``quad8``, ``quad9``, ``hex20``, ``hex27``, ``surface``, and the nodes
    /// in the middle of the edges of triangles and tetrahedra of second order.
    #[getter]
    fn bodies<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let topology = self.lock()?.topology.clone();
        topology::bodies(py, &topology)
    }

    /// State: This moment, to go back to. What is assigned must be a state of this scene.
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

    /// Go back to how the scene starts, at time 0. Parameters, forces and pins stay as they are now.
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

    /// Make a second simulation that goes on from here on its own.
    ///
    /// Returns
    /// -------
    /// Simulation
    ///     In the same state with the same parameters, forces and pins.
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

    /// Write this moment to a file, to go on from in another process with the same bits: `restore`.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     The file; one that is there is replaced, at once and as a whole.
    ///
    /// Raises
    /// ------
    /// OSError
    ///     The file cannot be written.
    ///
    /// Notes
    /// -----
    /// It holds the scene, the state, what was added (pins, forces, materials) and a checksum; meshes that
    /// the scene names by their files stay where they are. Solvers of implicit schemes forget what they
    /// have learnt from earlier steps, here as in the simulation that is restored: both go on with the same
    /// bits.
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

    /// Go on from a file that `save`, or ``pliant run --checkpoint``, has written.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     The file. Functions and materials of Python in it are pickled: read only files that you trust.
    ///
    /// Returns
    /// -------
    /// Simulation
    ///     In the same state with the same parameters, forces and pins.
    ///
    /// Raises
    /// ------
    /// OSError
    ///     The file cannot be read.
    /// ValueError
    ///     It is no checkpoint, damaged, or of another version of pliant; or a mesh file has changed since.
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
