//! Natural modes, the exact motion that they add up to, and how a blow sounds.

use numpy::{IntoPyArray, PyArray1};
use pliant::modes::{Modes, ModesError, Oscillator, SoundError, Strike, Superposition as Core};
use pliant::quantity::counted;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use serde_json::json;

use super::PySimulation;
use crate::arrays::Doubles;
use crate::document::from_json;
use crate::{arguments, arrays, threads};

/// A document and an array.
type Found<'py, A> = (Bound<'py, PyAny>, A);

/// Exact motion of a linear scene as a sum of its modes; returned by `Simulation.superposition`.
///
/// It solves ``M u'' + C u' + K u = f`` from the state at its creation, each mode in closed form: a reference
/// for errors of time integration.
#[pyclass(name = "Superposition", frozen, module = "pliant")]
pub(crate) struct PySuperposition {
    core: Core,
    vertices: usize,
}

#[pymethods]
impl PySuperposition {
    /// Return positions and velocities at a time.
    ///
    /// Parameters
    /// ----------
    /// time : float
    ///     Time since its creation [s], 0 or more.
    ///
    /// Returns
    /// -------
    /// positions : ndarray of float64, shape (n, dim)
    ///     Positions [m].
    /// velocities : ndarray of float64, shape (n, dim)
    ///     Velocities [m/s].
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     The time is negative, or not a number.
    ///
    /// Examples
    /// --------
    /// >>> positions, velocities = Simulation(linear).superposition().at(0.25)
    /// >>> positions.shape
    /// (10, 2)
    fn at<'py>(&self, py: Python<'py>, time: f64) -> PyResult<(Doubles<'py>, Doubles<'py>)> {
        if !(time >= 0.0 && time.is_finite()) {
            return Err(PyValueError::new_err(format!("time must be 0 or more, got {time}")));
        }
        let shape = [self.vertices, self.core.dimension()];
        let (mut x, mut v) = (vec![0.0; shape[0] * shape[1]], vec![0.0; shape[0] * shape[1]]);
        py.detach(|| self.core.state_at(time, &mut x, &mut v));
        Ok((arrays::array(py, x, &shape)?, arrays::array(py, v, &shape)?))
    }

    /// ndarray of float64, shape (k,): Angular frequencies of the undamped modes [rad/s], 0 for rigid motion.
    #[getter]
    fn omega<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let omega = |oscillator: &Oscillator| oscillator.square.max(0.0).sqrt();
        self.core.oscillators().iter().map(omega).collect::<Vec<f64>>().into_pyarray(py)
    }

    /// ndarray of float64, shape (k, n, dim): Mode shapes, ``shape^T M shape = 1`` [kg^-1/2].
    #[getter]
    fn shapes<'py>(&self, py: Python<'py>) -> PyResult<Doubles<'py>> {
        let count = self.core.oscillators().len();
        let shapes = (0..count).flat_map(|j| self.core.shape(j).iter().copied()).collect();
        arrays::array(py, shapes, &[count, self.vertices, self.core.dimension()])
    }

    /// float: Relative deviation of the forces of the scene from linear ones, a quarter of the longest period
    /// later: round-off for a linear scene; if it is larger, this is the motion of the linearised scene.
    #[getter]
    fn nonlinearity(&self) -> f64 {
        self.core.nonlinearity()
    }

    /// dict of str to float: Energies of the omitted modes [J]: ``kinetic`` of ``kinetic_total``, ``elastic``
    /// of ``elastic_total``.
    #[getter]
    fn residual<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        from_json(py, &json!(self.core.residual()))
    }

    fn __repr__(&self) -> String {
        let modes = counted(self.core.oscillators().len() as u64, "mode", "modes");
        let vertices = counted(self.vertices as u64, "vertex", "vertices");
        format!("<pliant.Superposition of {modes} of {vertices} in {}D>", self.core.dimension())
    }
}

#[pymethods]
impl PySimulation {
    /// Compute the exact motion of the system linearised at the current state, as a sum of its modes.
    ///
    /// Parameters
    /// ----------
    /// count : int, optional
    ///     Number of modes, from the lowest; default: all.
    ///
    /// Returns
    /// -------
    /// Superposition
    ///     Positions and velocities at any time.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     Something changes with time or is not linear: walls, pins that move or are released, loads that
    ///     change.
    /// RuntimeError
    ///     The state is not a stable equilibrium; damping couples the modes.
    ///
    /// Examples
    /// --------
    /// >>> motion = Simulation(linear).superposition()
    /// >>> motion.omega.shape
    /// (16,)
    #[pyo3(signature = (count = None))]
    fn superposition(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = arguments::optional_count)] count: Option<usize>,
    ) -> PyResult<PySuperposition> {
        let mut inner = self.lock()?;
        let simulation = &mut inner.simulation;
        let found = py.detach(|| threads::run(|| simulation.superposition(count)));
        Ok(PySuperposition { core: found.map_err(modes_error)?, vertices: self.vertices })
    }

    /// Natural modes about the present state, as a dictionary of columns, shapes last.
    fn _modes<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = arguments::count)] count: usize,
    ) -> PyResult<Found<'py, Doubles<'py>>> {
        let mut inner = self.lock()?;
        let simulation = &mut inner.simulation;
        let found: Modes = py.detach(|| threads::run(|| simulation.modes(count))).map_err(modes_error)?;
        let shapes = found.modes.iter().flat_map(|mode| mode.shape.iter().copied()).collect();
        let shapes = arrays::array(py, shapes, &[found.modes.len(), self.vertices, self.dimension])?;
        Ok((from_json(py, &json!(found))?, shapes))
    }

    /// Tones of a blow, and samples of what is heard.
    #[allow(clippy::too_many_arguments, reason = "a blow, who listens, and what is written")]
    fn _sound<'py>(
        &self,
        py: Python<'py>,
        count: usize,
        vertex: usize,
        direction: Vec<f64>,
        listen: Option<usize>,
        rayleigh: Option<(f64, f64)>,
        seconds: f64,
        rate: f64,
    ) -> PyResult<Found<'py, Bound<'py, PyArray1<f64>>>> {
        let strike = Strike { vertex, direction, listen, rayleigh };
        let mut inner = self.lock()?;
        let simulation = &mut inner.simulation;
        let heard = py.detach(|| {
            let sound = threads::run(|| simulation.sound(count, &strike, rate))?;
            let samples = sound.samples(seconds, PEAK);
            Ok((sound, samples))
        });
        let (sound, samples) = heard.map_err(|error| match error {
            SoundError::Modes(error) => modes_error(error),
            error @ SoundError::Silence { .. } => PyRuntimeError::new_err(error.to_string()),
            error => PyValueError::new_err(error.to_string()),
        })?;
        let tones = json!({ "partials": sound.partials, "silent": sound.silent });
        Ok((from_json(py, &tones)?, samples.into_pyarray(py)))
    }
}

/// The largest sample, a decibel below what a file can hold.
const PEAK: f64 = 0.891_250_938;

fn modes_error(error: ModesError) -> PyErr {
    match error {
        ModesError::NotLinear { .. } => PyValueError::new_err(error.to_string()),
        error => PyRuntimeError::new_err(error.to_string()),
    }
}
