//! Gradients of runs.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use numpy::{IntoPyArray, PyArrayMethods};
use pliant_gradient::{
    ContactEvents, GradientError, HessianProduct, Loss, LossCurvature, LossFrame, ParameterSelection,
    RunDirection, RunGradient, RunTangent, UNLIMITED, WallEvent, frequency_gradient, gauss_newton_product,
    hessian_product, tangent_along,
};
use pyo3::exceptions::{PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use super::{Inner, PySimulation};
use crate::run::PyFrame;
use crate::{arguments, arrays, errors, threads};

/// A loss that is a function in Python.
struct PythonLoss<'a> {
    function: &'a Py<PyAny>,
    shape: [usize; 2],
    /// Step at which the run began.
    first: u64,
    stop: &'a AtomicBool,
    raised: Option<PyErr>,
}

impl PythonLoss<'_> {
    /// Value of the function, and what it says of derivatives.
    fn call(&self, frame: &LossFrame<'_>, x_bar: &mut [f64], v_bar: &mut [f64]) -> PyResult<f64> {
        let index = frame.step - self.first;
        Python::attach(|py| {
            let shown = PyFrame::state(index, frame.step, frame.time, (frame.x, frame.v), self.shape[1]);
            let said = self.function.bind(py).call1((Bound::new(py, shown)?,))?;
            if said.is_none() {
                return Ok(0.0);
            }
            let parts = said.cast::<PyTuple>().ok().filter(|parts| matches!(parts.len(), 2 | 3));
            let parts = parts.ok_or_else(|| {
                PyTypeError::new_err(
                    "a loss returns None, or (value, by positions), or (value, by positions, by velocities)",
                )
            })?;
            let names = ["derivative by positions", "derivative by velocities"];
            for (i, bar) in [x_bar, v_bar].into_iter().enumerate().take(parts.len() - 1) {
                let by = parts.get_item(i + 1)?;
                if !by.is_none() {
                    let by = arrays::shaped(&by, &self.shape, names[i])?;
                    bar.copy_from_slice(by.readonly().as_slice()?);
                }
            }
            parts.get_item(0)?.extract()
        })
    }
}

impl Loss for PythonLoss<'_> {
    fn frame(&mut self, frame: &LossFrame<'_>, x_bar: &mut [f64], v_bar: &mut [f64]) -> f64 {
        match self.call(frame, x_bar, v_bar) {
            Ok(value) => value,
            Err(error) => {
                self.raised.get_or_insert(error);
                self.stop.store(true, Ordering::Relaxed);
                0.0
            }
        }
    }
}

/// Second derivatives of a loss that are a function in Python.
struct PythonCurvature<'a> {
    function: &'a Py<PyAny>,
    shape: [usize; 2],
    /// Step at which the run began.
    first: u64,
    stop: &'a AtomicBool,
    raised: Option<PyErr>,
}

impl PythonCurvature<'_> {
    /// What the function says.
    fn call(
        &self,
        frame: &LossFrame<'_>,
        change: &RunTangent,
        [x_bar, v_bar]: [&mut [f64]; 2],
    ) -> PyResult<()> {
        let index = frame.step - self.first;
        Python::attach(|py| {
            let shown = PyFrame::state(index, frame.step, frame.time, (frame.x, frame.v), self.shape[1]);
            let rows = |rows: &[f64]| arrays::array(py, rows.to_vec(), &self.shape);
            let changes = (rows(&change.position)?, rows(&change.velocity)?);
            let said = self.function.bind(py).call1((Bound::new(py, shown)?, changes.0, changes.1))?;
            let parts = match said.cast::<PyTuple>() {
                Ok(parts) if parts.len() == 2 => vec![parts.get_item(0)?, parts.get_item(1)?],
                Ok(_) => {
                    let message = "a curvature returns None, by_positions, or (by_positions, by_velocities)";
                    return Err(PyTypeError::new_err(message));
                }
                Err(_) => vec![said],
            };
            let names = ["product by positions", "product by velocities"];
            for ((part, bar), name) in parts.iter().zip([x_bar, v_bar]).zip(names) {
                if !part.is_none() {
                    bar.copy_from_slice(&arrays::finite_rows(part, &self.shape, name)?);
                }
            }
            Ok(())
        })
    }
}

impl LossCurvature for PythonCurvature<'_> {
    fn product(&mut self, frame: &LossFrame<'_>, change: &RunTangent, x_bar: &mut [f64], v_bar: &mut [f64]) {
        if let Err(error) = self.call(frame, change, [x_bar, v_bar]) {
            self.raised.get_or_insert(error);
            self.stop.store(true, Ordering::Relaxed);
        }
    }
}

/// Rows of numbers of this shape that were given, zero where there are none.
fn change(rows: Option<&Bound<'_, PyAny>>, shape: &[usize; 2], what: &str) -> PyResult<Vec<f64>> {
    match rows {
        None => Ok(vec![0.0; shape[0] * shape[1]]),
        Some(rows) => arrays::finite_rows(rows, shape, what),
    }
}

/// Changes of the numbers of the parameters of a selection of these names, over so many steps.
fn changes(
    selection: &mut ParameterSelection,
    steps: u64,
    names: &[String],
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<Vec<Vec<f64>>> {
    let of_forces = names.iter().filter(|name| !matches!(&name[..], "position" | "velocity"));
    let mut changes = vec![];
    for (name, parameter) in of_forces.zip(selection.parameters()) {
        parameter.begin(steps);
        let Some(rows) = given.map(|given| given.get_item(name)).transpose()?.flatten() else { continue };
        let numbers = rows.py().import("numpy")?.call_method1("ravel", (rows,))?;
        changes.push(arrays::finite_rows(&numbers, &[parameter.len()], name)?);
    }
    Ok(changes)
}

/// As Python's exceptions.
fn error(error: &GradientError) -> PyErr {
    match error {
        GradientError::Step(step) => errors::step(step),
        GradientError::Parameter { .. } => PyKeyError::new_err(error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

impl Inner {
    /// Parameters of these names.
    fn selection(&self, names: &[String]) -> PyResult<ParameterSelection> {
        for body in self.additions.bodies_with_materials() {
            let elastic = format!("body.{body}.elastic.");
            if let Some(name) = names.iter().find(|name| name.starts_with(&elastic)) {
                let message =
                    format!("`{name}` has no derivative: the material of `{body}` is written in Python");
                return Err(PyKeyError::new_err(message));
            }
        }
        let numbering = self.simulation.numbering();
        ParameterSelection::new(&self.scene.scene, &self.topology, numbering, names)
            .map_err(|fault| error(&fault))
    }

    /// Steps that are left of the duration of the scene, where all are of one size.
    fn steps_left(&self) -> PyResult<u64> {
        if self.simulation.step_control().is_some() {
            return Err(PyValueError::new_err("give `steps`: the step size is adaptive"));
        }
        let left = self.scene.scene.time.duration - self.simulation.state().time;
        Ok((left / self.simulation.step_size()).round().max(0.0) as u64)
    }
}

#[pymethods]
impl PySimulation {
    /// Run steps, and compute derivatives of a loss over the states from the current one to the last.
    ///
    /// They are exact derivatives of the computed steps, from one forward and one backward sweep, for any
    /// number of parameters. The simulation is in the last state afterwards.
    ///
    /// Parameters
    /// ----------
    /// loss : callable
    ///     Called with a `Frame` for each state, from the last to the first. It returns the contribution of
    ///     the state to the loss and its derivatives, ``(value, by_positions)`` or ``(value, by_positions,
    ///     by_velocities)``, arrays of shape (n, dim) or None for zero; or None for no contribution.
    /// with_respect_to : str or list of str
    ///     Names of variables: ``"position"``, ``"velocity"``, ``"world.gravity"``,
    ///     ``"body.NAME.elastic.young"``. ``"forces"`` are forces on the vertices in each step, of shape
    ///     (steps, n, dim); ``"pins"`` displacements of pinned vertices from each state on, (steps + 1, n,
    ///     dim). An unknown name raises an error that lists the valid ones.
    /// steps : int, optional
    ///     Number of steps; default: the rest of the scene's duration.
    /// times : sequence of float, optional
    ///     Alternative to `steps`: ascending times [s] that steps hit; the run ends at the last. Steps of
    ///     fixed size hit the nearest times.
    /// memory : int, optional
    ///     Bytes for stored states; if they do not fit, parts of the run are repeated. Default: store all.
    ///
    /// Returns
    /// -------
    /// Gradient
    ///     Loss, and its derivatives by name.
    ///
    /// Raises
    /// ------
    /// KeyError
    ///     A name has no derivative.
    /// ValueError
    ///     The integrator, or something in the scene, has no derivative; the loss is not finite; the
    ///     derivatives overflow; both `steps` and `times` are given; times do not ascend, or are not after
    ///     the current one.
    /// StepError
    ///     A step fails.
    /// KeyboardInterrupt
    ///     Ctrl-C.
    ///
    /// Notes
    /// -----
    /// With an adaptive step size, a preceding run determines the step sizes, which are then fixed.
    ///
    /// Examples
    /// --------
    /// >>> def height_of_the_tip(frame):
    /// ...     if frame.index < 20:
    /// ...         return None
    /// ...     by_positions = np.zeros_like(frame.positions)
    /// ...     by_positions[9, 1] = 1.0
    /// ...     return frame.positions[9, 1], by_positions
    /// >>> found = simulation.gradient(height_of_the_tip, ["body.beam.elastic.young"], steps=20)
    /// >>> list(found), found["body.beam.elastic.young"] != 0.0
    /// (['body.beam.elastic.young'], True)
    #[pyo3(signature = (loss, with_respect_to, *, steps = None, times = None, memory = None))]
    fn gradient<'py>(
        &self,
        py: Python<'py>,
        loss: Py<PyAny>,
        #[pyo3(from_py_with = arguments::names)] with_respect_to: Vec<String>,
        #[pyo3(from_py_with = arguments::optional_count)] steps: Option<u64>,
        times: Option<Vec<f64>>,
        #[pyo3(from_py_with = arguments::optional_count)] memory: Option<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut inner = self.lock()?;
        let mut selection = inner.selection(&with_respect_to)?;
        if steps.is_some() && times.is_some() {
            return Err(PyValueError::new_err("give `steps` or `times`, not both"));
        }
        if let Some(times) = &times {
            check_times(times, inner.simulation.state().time)?;
        }
        let times = times.unwrap_or_else(|| vec![inner.scene.scene.time.duration]);
        let first = inner.simulation.state().step;
        let stop = Arc::new(AtomicBool::new(false));
        let simulation = &mut inner.simulation;
        simulation.set_stop(Some(Arc::clone(&stop)));
        let mut loss = PythonLoss { function: &loss, shape: self.shape(), first, stop: &stop, raised: None };
        let mut signal = None;
        let (loss_used, parameters) = (&mut loss, selection.parameters());
        let work = move || {
            let memory = memory.unwrap_or(UNLIMITED);
            match steps {
                Some(steps) => pliant_gradient::gradient(simulation, steps, loss_used, parameters, memory),
                None => pliant_gradient::gradient_to(simulation, &times, loss_used, parameters, memory),
            }
        };
        let found = threads::interruptible(py, &stop, &mut signal, work);
        let raised = loss.raised.take();
        inner.simulation.set_stop(None);
        inner.publish(py)?;
        if let Some(raised) = signal.or(raised) {
            return Err(raised);
        }
        let found = found?.map_err(|fault| inner.failed(py, error(&fault)))?;
        self.shown(py, &with_respect_to, &selection, &found)
    }

    /// Run steps, and compute the change of the last state by a change of the current one.
    ///
    /// It is the directional derivative of the computed steps (the product of their Jacobian with a vector):
    /// the transpose of `gradient`, and equally exact. The simulation is in the last state afterwards.
    ///
    /// Parameters
    /// ----------
    /// position : array_like, optional
    ///     Change of the positions, shape (n, dim) [m per unit of the variable]; default: zero. Pinned
    ///     vertices move with their pins.
    /// velocity : array_like, optional
    ///     Change of the velocities, shape (n, dim) [m/s per unit]; default: zero. Zero at pinned vertices.
    /// parameters : dict of str to float or array_like, optional
    ///     Changes of parameters by name, with the names and shapes of `gradient`.
    /// steps : int, optional
    ///     Number of steps; default: the rest of the scene's duration.
    ///
    /// Returns
    /// -------
    /// tuple of ndarray
    ///     Change of the last positions [m per unit] and velocities [m/s per unit], float64 of shape (n,
    ///     dim).
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     The integrator, or something in the scene, has no derivative: as for `gradient`, and damping in
    ///     fully implicit integrators; the changes overflow; an array has the wrong shape.
    /// KeyError
    ///     A parameter has no derivative.
    /// StepError
    ///     A step fails.
    /// KeyboardInterrupt
    ///     Ctrl-C.
    ///
    /// Examples
    /// --------
    /// >>> change = np.zeros((10, 2))
    /// >>> change[9, 1] = 1.0
    /// >>> by_position, by_velocity = simulation.jvp(velocity=change, steps=1)
    /// >>> by_position[9]
    /// array([0.   , 0.001])
    /// >>> by_position, _ = simulation.jvp(parameters={"world.gravity": [0.0, 1.0]}, steps=10)
    /// >>> by_position.shape
    /// (10, 2)
    #[pyo3(signature = (position = None, velocity = None, *, parameters = None, steps = None))]
    fn jvp<'py>(
        &self,
        py: Python<'py>,
        position: Option<&Bound<'py, PyAny>>,
        velocity: Option<&Bound<'py, PyAny>>,
        parameters: Option<&Bound<'py, PyDict>>,
        #[pyo3(from_py_with = arguments::optional_count)] steps: Option<u64>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let shape = self.shape();
        let (x, v) = (
            change(position, &shape, "change of positions")?,
            change(velocity, &shape, "change of velocities")?,
        );
        let mut inner = self.lock()?;
        let steps = steps.map_or_else(|| inner.steps_left(), Ok)?;
        let names: Vec<String> =
            parameters.map(|given| given.keys().extract()).transpose()?.unwrap_or_default();
        let mut selection = inner.selection(&names)?;
        let changes = changes(&mut selection, steps, &names, parameters)?;
        let stop = Arc::new(AtomicBool::new(false));
        let simulation = &mut inner.simulation;
        simulation.set_stop(Some(Arc::clone(&stop)));
        let mut signal = None;
        let parameters = selection.parameters();
        let work = move || {
            let direction = RunDirection { position: &x, velocity: &v, parameters: &changes };
            tangent_along(simulation, steps, direction, parameters, &mut |_, _| {})
        };
        let found = threads::interruptible(py, &stop, &mut signal, work);
        inner.simulation.set_stop(None);
        inner.publish(py)?;
        if let Some(raised) = signal {
            return Err(raised);
        }
        let found = found?.map_err(|fault| inner.failed(py, error(&fault)))?;
        let parts = [found.position, found.velocity].map(|part| arrays::array(py, part, &shape));
        let [position, velocity] = parts;
        PyTuple::new(py, [position?, velocity?])
    }

    /// Run steps twice, and compute the product of the Gauss-Newton matrix of a loss with a direction.
    ///
    /// For a loss ``sum of l_k(x_k, v_k)`` it is ``G d = sum of J_k^T (d2 l_k) J_k d``, with the Jacobians of
    /// the states: the Hessian if residuals are zero, as used by least-squares solvers, without second
    /// derivatives of states. The simulation is in the last state afterwards.
    ///
    /// Parameters
    /// ----------
    /// curvature : callable
    ///     Called with a `Frame`, the change of its positions [m per unit] and of its velocities [m/s per
    ///     unit], shape (n, dim), for each state from the first to the last. It returns the product of the
    ///     second derivatives of the state's contribution to the loss with these changes, ``by_positions`` or
    ///     ``(by_positions, by_velocities)``; or None for no contribution.
    /// direction : dict of str to float or array_like
    ///     Changes by name, with the names and shapes of `gradient`; the product has the same names.
    /// steps : int, optional
    ///     Number of steps; default: the rest of the scene's duration.
    /// memory : int, optional
    ///     Bytes for stored states, as for `gradient`.
    ///
    /// Returns
    /// -------
    /// Gradient
    ///     Product by name; its ``value`` is ``d . G d``.
    ///
    /// Raises
    /// ------
    /// KeyError
    ///     A name has no derivative.
    /// ValueError
    ///     As for `jvp` and `gradient`.
    /// StepError
    ///     A step fails.
    /// KeyboardInterrupt
    ///     Ctrl-C.
    ///
    /// Examples
    /// --------
    /// >>> def half_the_square_of_the_last(frame, by_positions, by_velocities):
    /// ...     return by_positions if frame.index == 20 else None
    /// >>> young = "body.beam.elastic.young"
    /// >>> found = simulation.gauss_newton_product(half_the_square_of_the_last, {young: 1e5}, steps=20)
    /// >>> found.value > 0.0, bool(np.isclose(found[young] * 1e5, found.value))
    /// (True, True)
    #[pyo3(signature = (curvature, direction, *, steps = None, memory = None))]
    fn gauss_newton_product<'py>(
        &self,
        py: Python<'py>,
        curvature: Py<PyAny>,
        direction: &Bound<'py, PyDict>,
        #[pyo3(from_py_with = arguments::optional_count)] steps: Option<u64>,
        #[pyo3(from_py_with = arguments::optional_count)] memory: Option<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let shape = self.shape();
        let names: Vec<String> = direction.keys().extract()?;
        let start = |name: &str| change(direction.get_item(name)?.as_ref(), &shape, name);
        let (x, v) = (start("position")?, start("velocity")?);
        let mut inner = self.lock()?;
        let mut selection = inner.selection(&names)?;
        let (steps, first) = (steps.map_or_else(|| inner.steps_left(), Ok)?, inner.simulation.state().step);
        let changes = changes(&mut selection, steps, &names, Some(direction))?;
        let stop = Arc::new(AtomicBool::new(false));
        let simulation = &mut inner.simulation;
        simulation.set_stop(Some(Arc::clone(&stop)));
        let mut curvature = PythonCurvature { function: &curvature, shape, first, stop: &stop, raised: None };
        let mut signal = None;
        let (curvature_used, parameters) = (&mut curvature, selection.parameters());
        let work = move || {
            let direction = RunDirection { position: &x, velocity: &v, parameters: &changes };
            let memory = memory.unwrap_or(UNLIMITED);
            gauss_newton_product(simulation, steps, direction, curvature_used, parameters, memory)
        };
        let found = threads::interruptible(py, &stop, &mut signal, work);
        let raised = curvature.raised.take();
        inner.simulation.set_stop(None);
        inner.publish(py)?;
        if let Some(raised) = signal.or(raised) {
            return Err(raised);
        }
        let found = found?.map_err(|fault| inner.failed(py, error(&fault)))?;
        self.shown(py, &names, &selection, &found)
    }

    /// Compute the product of the Hessian of a loss with a direction, from differences of gradients.
    ///
    /// Runs from states moved along the direction give exact gradients, whose central differences are
    /// extrapolated (Richardson). Unlike `gradient`, the result is not exact, but has error estimates. The
    /// simulation does not change.
    ///
    /// Parameters
    /// ----------
    /// loss : callable
    ///     As for `gradient`.
    /// direction : dict of str to float or array_like
    ///     Changes by name: ``"position"``, ``"velocity"``, and keys of the scene known to `gradient` that
    ///     are one number or a vector. Their magnitude does not matter. The product has the same names.
    /// steps : int, optional
    ///     Number of steps of a run; default: the rest of the scene's duration.
    /// times : sequence of float, optional
    ///     Alternative to `steps`: ascending times [s] that steps hit, as for `gradient`. With an adaptive
    ///     step size each run chooses its own steps, and the errors are larger.
    /// memory : int, optional
    ///     Bytes for stored states, as for `gradient`.
    /// reach : float, default 0.01
    ///     Largest relative change of the size of the scene, of velocities, of parameters. The loss must be
    ///     smooth over that range.
    ///
    /// Returns
    /// -------
    /// HessianProduct
    ///     Product by name, with error estimates; its ``value`` is ``d . H d``.
    ///
    /// Raises
    /// ------
    /// KeyError
    ///     A name has no derivative, or is not a number of the scene.
    /// ValueError
    ///     As for `gradient`; an array has the wrong shape; `reach` is not positive.
    /// StepError
    ///     A step fails.
    /// KeyboardInterrupt
    ///     Ctrl-C.
    ///
    /// Notes
    /// -----
    /// It takes two gradients for each of at most five step lengths. Solve implicit steps to a small
    /// ``tolerance``, since its noise is divided by the length.
    ///
    /// Examples
    /// --------
    /// >>> def square_of_the_last(frame):
    /// ...     return (np.sum(frame.positions**2), 2 * frame.positions) if frame.index == 20 else None
    /// >>> young = "body.beam.elastic.young"
    /// >>> found = simulation.hessian_product(square_of_the_last, {young: 1e5}, steps=20)
    /// >>> bool(found.errors[young] < 1e-3 * abs(found[young]))
    /// True
    #[pyo3(signature = (loss, direction, *, steps = None, times = None, memory = None, reach = 1e-2))]
    fn hessian_product<'py>(
        slf: &Bound<'py, Self>,
        loss: Py<PyAny>,
        direction: &Bound<'py, PyDict>,
        #[pyo3(from_py_with = arguments::optional_count)] steps: Option<u64>,
        times: Option<Vec<f64>>,
        #[pyo3(from_py_with = arguments::optional_count)] memory: Option<usize>,
        reach: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        if !(reach > 0.0 && reach.is_finite()) {
            return Err(PyValueError::new_err(format!("reach must be above zero; got {reach}")));
        }
        let runs = slf.py().import("pliant.gradients")?.getattr("_MovedRuns")?;
        let runs = runs.call1((slf, loss, direction, steps, times, memory))?;
        let gradient_at = |h: f64| -> PyResult<Vec<f64>> { runs.call_method1("gradient", (h,))?.extract() };
        let HessianProduct { product, errors } = hessian_product(reach, gradient_at)?;
        runs.call_method1("shown", (product, errors))
    }

    /// Compute the lowest natural frequencies about the current state, and their derivatives.
    ///
    /// That state must be the reference configuration, without forces such as gravity or loads. A derivative
    /// by the reference shape moves the state with it.
    ///
    /// Parameters
    /// ----------
    /// with_respect_to : str or list of str
    ///     Names of moduli, densities, masses, reference shapes and spring stiffnesses, as for `gradient`.
    /// count : int, default 1
    ///     Number of frequencies, from the lowest.
    ///
    /// Returns
    /// -------
    /// FrequencyGradient
    ///     Frequencies, and the derivatives of their squares by name.
    ///
    /// Raises
    /// ------
    /// KeyError
    ///     A name has no derivative, or frequencies do not depend on it differentiably.
    /// ValueError
    ///     A force acts; there are fewer frequencies than `count`.
    ///
    /// Examples
    /// --------
    /// >>> unloaded = Simulation(scene.with_changes({"world.gravity": [0, 0]}))
    /// >>> found = unloaded.frequency_gradient(["body.beam.mass.density", "body.beam.rest"], 2)
    /// >>> found["body.beam.mass.density"].shape, found["body.beam.rest"].shape
    /// ((2,), (2, 20))
    /// >>> bool(np.allclose(found["body.beam.mass.density"], -found.omega**2 / 1000.0))
    /// True
    #[pyo3(signature = (with_respect_to, count = 1))]
    fn frequency_gradient<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = arguments::names)] with_respect_to: Vec<String>,
        #[pyo3(from_py_with = arguments::count)] count: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let none_by = |name: &str| {
            PyKeyError::new_err(format!(
                "natural frequencies have no derivative by `{name}`: moduli, densities, masses, rest shapes \
                 and the stiffness of springs have one, masses and shapes where all elements are of first \
                 order"
            ))
        };
        if let Some(name) = with_respect_to.iter().find(|name| matches!(&name[..], "position" | "velocity")) {
            return Err(none_by(name));
        }
        let mut inner = self.lock()?;
        let mut selection = inner.selection(&with_respect_to)?;
        let (simulation, parameters) = (&mut inner.simulation, selection.parameters());
        let found = py.detach(|| threads::run(|| frequency_gradient(simulation, count, parameters)));
        let found = found.map_err(|fault| match fault {
            GradientError::FrequencyParameter { number } => none_by(&with_respect_to[number]),
            fault => error(&fault),
        })?;
        let by = PyDict::new(py);
        for (number, name) in with_respect_to.iter().enumerate() {
            let rows: Vec<f64> = found.squares.iter().flat_map(|squares| squares[number].clone()).collect();
            let width = rows.len() / count.max(1);
            let shape = if width == 1 { &[count][..] } else { &[count, width][..] };
            by.set_item(name, arrays::array(py, rows, shape)?)?;
        }
        let omega = arrays::array(py, found.omega, &[count])?;
        let alike: Vec<i64> = found.alike.iter().map(|alike| *alike as i64).collect();
        py.import("pliant.gradients")?.getattr("FrequencyGradient")?.call1((
            omega,
            by,
            alike.into_pyarray(py),
        ))
    }

    /// List the names of variables of `gradient`.
    ///
    /// Returns
    /// -------
    /// list of str
    ///     Keys of the scene, with the names of its bodies; ``"position"`` and ``"velocity"`` of the current
    ///     state. Empty if the integrator, or something in the scene, has no derivative: `gradient` says
    ///     what.
    ///
    /// Examples
    /// --------
    /// >>> "body.beam.elastic.young" in simulation.gradient_names()
    /// True
    fn gradient_names(&self) -> PyResult<Vec<String>> {
        let mut inner = self.lock()?;
        if pliant_gradient::check(&mut inner.simulation).is_err() {
            return Ok(vec![]);
        }
        Ok(pliant_gradient::names(&inner.scene.scene, &inner.topology))
    }
}

impl PySimulation {
    /// A `pliant.Gradient`: numbers as floats, rows of vertices in two axes.
    fn shown<'py>(
        &self,
        py: Python<'py>,
        names: &[String],
        selection: &ParameterSelection,
        found: &RunGradient,
    ) -> PyResult<Bound<'py, PyAny>> {
        let by = PyDict::new(py);
        for (name, part) in names.iter().zip(selection.parts(found)) {
            match (&name[..], &part[..]) {
                ("position" | "velocity", _) => by.set_item(name, arrays::array(py, part, &self.shape())?)?,
                ("forces" | "pins", _) => {
                    let [n, d] = self.shape();
                    let count = part.len() / (n * d).max(1);
                    by.set_item(name, arrays::array(py, part, &[count, n, d])?)?;
                }
                (_, [number]) => by.set_item(name, number)?,
                _ => {
                    let count = part.len();
                    by.set_item(name, arrays::array(py, part, &[count])?)?;
                }
            }
        }
        let gradients = py.import("pliant.gradients")?;
        let event = gradients.getattr("WallEvent")?;
        let events = found
            .wall_events
            .iter()
            .map(|WallEvent { step, vertex, wall, has_come }| event.call1((step, vertex, wall, has_come)));
        let events = PyTuple::new(py, events.collect::<PyResult<Vec<_>>>()?)?;
        let ContactEvents { come, left, slid, stuck } = found.contact_events;
        let of_contact = gradients.getattr("ContactEvents")?.call1((come, left, slid, stuck))?;
        let parts = (found.value, by, found.growth, found.unsettled, events, of_contact);
        gradients.getattr("Gradient")?.call1(parts)
    }
}

/// Refuses times that no run ends at which goes on from `now` [s].
fn check_times(times: &[f64], now: f64) -> PyResult<()> {
    let problem = if times.is_empty() {
        Some("`times` must name at least one time".to_owned())
    } else if let Some(pair) = times.windows(2).find(|pair| pair[0] >= pair[1]) {
        Some(format!("times must ascend; got {} before {}", pair[0], pair[1]))
    } else {
        let outside = times.iter().find(|time| !(time.is_finite() && **time >= now));
        outside
            .map(|time| format!("times must be finite, and not before the present one, {now} s; got {time}"))
    };
    problem.map_or(Ok(()), |problem| Err(PyValueError::new_err(problem)))
}
