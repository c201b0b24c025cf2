//! Moments of a simulation.

use pliant::quantity::counted;
use pliant::simulation::Snapshot;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};

use crate::arrays::{self, Doubles};

/// State of a simulation, from which it can continue.
///
/// It is the value of `Simulation.state`, and can be pickled. Continued explicit runs are bit-identical,
/// implicit ones agree to the tolerance of their solver. Parameters (materials, forces, pins) are not part of
/// it.
#[pyclass(name = "State", frozen, module = "pliant")]
pub(crate) struct PyState {
    pub(crate) snapshot: Snapshot,
    pub(crate) dimension: usize,
}

#[pymethods]
impl PyState {
    /// int: Number of steps.
    #[getter]
    fn step(&self) -> u64 {
        self.snapshot.step
    }

    /// float: Simulated time [s].
    #[getter]
    fn time(&self) -> f64 {
        self.snapshot.time
    }

    /// ndarray of float64, shape (n, dim): Positions [m].
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Doubles<'py>> {
        self.rows(py, &self.snapshot.x)
    }

    /// ndarray of float64, shape (n, dim): Velocities [m/s].
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Doubles<'py>> {
        self.rows(py, &self.snapshot.v)
    }

    fn __repr__(&self) -> String {
        let Snapshot { step, time, x, .. } = &self.snapshot;
        let steps = counted(*step, "step", "steps");
        let vertices = counted((x.len() / self.dimension) as u64, "vertex", "vertices");
        format!("<pliant.State after {steps}, t = {time} s, {vertices}>")
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.snapshot == other.snapshot
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let this = slf.get();
        let text = serde_json::to_vec(&this.snapshot).map_err(broken)?;
        let state = (this.dimension, PyBytes::new(slf.py(), &text)).into_pyobject(slf.py())?;
        Ok((slf.get_type().getattr("_restore")?, state))
    }

    /// What pickle calls.
    #[staticmethod]
    fn _restore(dimension: usize, text: &[u8]) -> PyResult<Self> {
        Ok(PyState { snapshot: serde_json::from_slice(text).map_err(broken)?, dimension })
    }
}

impl PyState {
    fn rows<'py>(&self, py: Python<'py>, rows: &[f64]) -> PyResult<Doubles<'py>> {
        arrays::array(py, rows.to_vec(), &[rows.len() / self.dimension, self.dimension])
    }
}

fn broken(error: serde_json::Error) -> PyErr {
    PyValueError::new_err(format!("the state cannot be kept: {error}"))
}
