//! Changes while a simulation runs: parameters, forces, pins.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pliant::constraint::Waypoint;
use pliant::energy::load::ExternalForce;
use pliant::observer::Notes;
use pliant::simulation::{MaterialError, MoveError};
use pliant_scene::assembly::Assembly;
use pyo3::exceptions::{PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};

use super::{Inner, PySimulation, steering};
use crate::arrays;
use crate::material::{PythonMaterial, Spent};

/// Parts added to a simulation after it was assembled, to be added again when parameters change.
#[derive(Default)]
pub(crate) struct Additions {
    pins: Vec<AddedPin>,
    /// Names of pins of the scene that were let go.
    released: Vec<String>,
    force: Option<Py<PyAny>>,
    /// By the names of their bodies.
    materials: Vec<(String, Py<PyAny>)>,
    raised: Raised,
    /// In functions of materials.
    spent: Spent,
    pace: MaterialTiming,
}

/// How long steps with materials in Python have taken.
#[derive(Clone, Copy, Default)]
struct MaterialTiming {
    /// In all.
    steps: Duration,
    /// In functions of materials.
    materials: Duration,
    /// True if it has been said.
    said: bool,
}

/// Steps that took less are too few to be measured.
const MEASURABLE: Duration = Duration::from_millis(50);
/// Materials that take a smaller part of the time of steps are not slow.
const SLOW: f64 = 0.5;

/// Exceptions of functions of the user: the first is kept until the step that called them is over.
pub(crate) type Raised = Arc<Mutex<Option<PyErr>>>;

#[derive(Clone)]
struct AddedPin {
    name: String,
    vertices: Vec<u32>,
    axes: [bool; 3],
}

/// Pins that were added: name, vertices, axes.
type Pins = Vec<(String, Vec<u32>, [bool; 3])>;

/// Names of the notes of a checkpoint.
const PINS: &str = "python.pins";
const FUNCTIONS: &str = "python.functions";

impl AddedPin {
    fn of((name, vertices, axes): (String, Vec<u32>, [bool; 3])) -> Self {
        AddedPin { name, vertices, axes }
    }
}

impl Additions {
    /// The exception of a function, once.
    pub(crate) fn raised(&self) -> Option<PyErr> {
        self.raised.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Forces of the user, where there are any.
    pub(crate) fn force(&self) -> Option<&Py<PyAny>> {
        self.force.as_ref()
    }

    /// Bodies whose material is written in Python.
    pub(crate) fn bodies_with_materials(&self) -> impl Iterator<Item = &str> {
        self.materials.iter().map(|(body, _)| &body[..])
    }

    /// The same for another simulation.
    pub(crate) fn duplicate(&self, py: Python<'_>) -> Self {
        Additions {
            pins: self.pins.clone(),
            released: self.released.clone(),
            force: self.force.as_ref().map(|force| force.clone_ref(py)),
            materials: self.copied_materials(py),
            pace: self.pace,
            ..Additions::default()
        }
    }

    /// The first of what no scene says; `None` without any.
    pub(crate) fn beyond_the_scene(&self) -> Option<&'static str> {
        let kinds = [
            (!self.pins.is_empty(), "pins added by `pin`"),
            (!self.released.is_empty(), "pins released by `release`"),
            (self.force.is_some(), "forces of a function"),
            (!self.materials.is_empty(), "materials written in Python"),
        ];
        kinds.into_iter().find_map(|(is_there, what)| is_there.then_some(what))
    }

    /// That materials in Python are slow, once, when steps that took `wall` more have shown it.
    pub(crate) fn slowness(&mut self, wall: Duration) -> Option<String> {
        if self.materials.is_empty() || self.pace.said {
            return None;
        }
        let MaterialTiming { steps, materials, said } = &mut self.pace;
        (*steps, *materials) = (*steps + wall, *materials + self.spent.take());
        let part = (materials.as_secs_f64() / steps.as_secs_f64()).min(1.0);
        *said = *steps >= MEASURABLE && part >= SLOW;
        let bodies: Vec<&str> = self.materials.iter().map(|(body, _)| body.as_str()).collect();
        said.then(|| {
            format!(
                "the material in Python of {} is slow: its functions took {:.0} % of the time of the steps \
                 so far ({:.2} of {:.2} s), what is compiled the rest; a material of this library would \
                 make steps up to {:.0} times as fast",
                bodies.join(", "),
                100.0 * part,
                materials.as_secs_f64(),
                steps.as_secs_f64(),
                steps.as_secs_f64()
                    / (steps.as_secs_f64() - materials.as_secs_f64()).max(1e-3 * steps.as_secs_f64()),
            )
        })
    }

    fn copied_materials(&self, py: Python<'_>) -> Vec<(String, Py<PyAny>)> {
        self.materials.iter().map(|(body, material)| (body.clone(), material.clone_ref(py))).collect()
    }

    pub(crate) fn set_materials(&mut self, materials: &Bound<'_, PyDict>) -> PyResult<()> {
        for (body, material) in materials {
            self.materials.push((body.extract()?, material.unbind()));
        }
        Ok(())
    }

    /// As a tuple that pickles if the functions in it do.
    pub(crate) fn pickled<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let pins: Vec<_> =
            self.pins.iter().map(|pin| (pin.name.clone(), pin.vertices.clone(), pin.axes)).collect();
        let force = self.force.as_ref().map(|force| force.clone_ref(py));
        (pins, self.released.clone(), force, self.copied_materials(py)).into_pyobject(py)
    }

    /// Notes them in a checkpoint: pins as text, functions and materials pickled.
    pub(crate) fn note(&self, py: Python<'_>, notes: &mut Notes) -> PyResult<()> {
        let pins: Vec<_> = self.pins.iter().map(|pin| (&pin.name, &pin.vertices, pin.axes)).collect();
        let text = serde_json::to_vec(&(pins, &self.released));
        notes.insert(PINS.into(), text.map_err(|error| PyValueError::new_err(error.to_string()))?);
        if self.force.is_some() || !self.materials.is_empty() {
            let force = self.force.as_ref().map(|force| force.clone_ref(py));
            let pickled =
                py.import("pickle")?.call_method1("dumps", ((force, self.copied_materials(py)),))?;
            notes.insert(FUNCTIONS.into(), pickled.extract()?);
        }
        Ok(())
    }

    /// Back from these notes; nothing was added where there are none.
    pub(crate) fn noted(py: Python<'_>, notes: &Notes) -> PyResult<Self> {
        let mut additions = Additions::default();
        if let Some(text) = notes.get(PINS) {
            let noted = serde_json::from_slice::<(Pins, Vec<String>)>(text);
            let (pins, released) = noted.map_err(|error| PyValueError::new_err(error.to_string()))?;
            (additions.pins, additions.released) = (pins.into_iter().map(AddedPin::of).collect(), released);
        }
        if let Some(pickled) = notes.get(FUNCTIONS) {
            let tuple = py.import("pickle")?.call_method1("loads", (PyBytes::new(py, pickled),))?;
            (additions.force, additions.materials) = tuple.extract()?;
        }
        Ok(additions)
    }

    /// Back from that tuple.
    pub(crate) fn unpickled(tuple: &Bound<'_, PyTuple>) -> PyResult<Self> {
        type Parts = (Pins, Vec<String>, Option<Py<PyAny>>, Vec<(String, Py<PyAny>)>);
        let (pins, released, force, materials): Parts = tuple.extract()?;
        let pins = pins.into_iter().map(AddedPin::of);
        Ok(Additions { pins: pins.collect(), released, force, materials, ..Additions::default() })
    }
}

impl Inner {
    /// Adds again what was added, to a simulation that has none of it.
    pub(crate) fn apply_additions(&mut self, py: Python<'_>) -> PyResult<()> {
        for (body, material) in &self.additions.materials {
            let (raised, spent) = (self.additions.raised.clone(), self.additions.spent.clone());
            let material = PythonMaterial::new(material.bind(py), self.topology.dimension, raised, spent)?;
            let set = self.simulation.set_material(&self.topology, body, Box::new(material));
            set.map_err(|error| match error {
                MaterialError::NoBody { .. } => PyKeyError::new_err(error.to_string()),
                _ => PyValueError::new_err(error.to_string()),
            })?;
        }
        for name in &self.additions.released {
            self.simulation.release(name);
        }
        for pin in &self.additions.pins {
            self.simulation.pin(&pin.name, &pin.vertices, pin.axes);
        }
        let force = self.additions.force.as_ref().map(|force| force.clone_ref(py));
        let force = force.map(|force| self.external_force(force.bind(py))).transpose()?.flatten();
        if force.is_some() {
            self.simulation.set_external_forces(force);
        }
        Ok(())
    }

    /// Forces from what a user gives: nothing, an array, a function.
    pub(crate) fn external_force(&self, force: &Bound<'_, PyAny>) -> PyResult<Option<ExternalForce>> {
        let shape = [self.topology.vertex_count, self.topology.dimension];
        if force.is_none() {
            return Ok(None);
        }
        if !force.is_callable() {
            let rows = arrays::finite_rows(force, &shape, "external forces")?;
            return Ok(Some(ExternalForce::Constant(rows)));
        }
        let (function, raised) = (force.clone().unbind(), self.additions.raised.clone());
        let call = move |time: f64, x: &[f64], f: &mut [f64]| {
            Python::attach(|py| match called(function.bind(py), time, x, &shape) {
                Ok(force) => {
                    f.copy_from_slice(&force);
                    true
                }
                Err(error) => {
                    *raised.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                    false
                }
            })
        };
        Ok(Some(ExternalForce::Function(Box::new(call))))
    }

    /// Goes on with the scene changed so.
    pub(crate) fn change(&mut self, changes: &Bound<'_, PyDict>) -> PyResult<()> {
        let py = changes.py();
        let scene = self.scene.changed(changes)?;
        for (i, (new, old)) in scene.scene.body.iter().zip(&self.scene.scene.body).enumerate() {
            let start = [
                ("mesh", new.mesh == old.mesh),
                ("position", new.position == old.position),
                ("velocity", new.velocity == old.velocity),
            ];
            if let Some((key, _)) = start.iter().find(|(_, same)| !same) {
                let message = format!("body.{i}.{key} says how a simulation starts: make a new one");
                return Err(PyValueError::new_err(message));
            }
        }
        let Assembly { mut simulation, topology, probes, report } = scene.assemble(py)?;
        if topology.vertex_count != self.topology.vertex_count
            || topology.dimension != self.topology.dimension
        {
            let message = "the changed scene has other vertices: make a new simulation";
            return Err(PyValueError::new_err(message));
        }
        // Before velocities of what is held are taken away.
        for name in &self.additions.released {
            simulation.release(name);
        }
        let drives = self.simulation.drives();
        let adopted = self.simulation.adopt(simulation);
        adopted.map_err(|error| PyValueError::new_err(error.to_string()))?;
        (self.scene, self.topology, self.probes, self.report) = (scene, Arc::new(topology), probes, report);
        self.apply_additions(py)?;
        // Of pins that were added, too.
        self.simulation.set_drives(&drives);
        Ok(())
    }
}

/// What a function of time and positions gives for forces.
fn called(function: &Bound<'_, PyAny>, time: f64, x: &[f64], shape: &[usize]) -> PyResult<Vec<f64>> {
    let x = arrays::array(function.py(), x.to_vec(), shape)?;
    arrays::finite_rows(&function.call1((time, x))?, shape, "external forces of a function")
}

#[pymethods]
impl PySimulation {
    /// Change parameters of the scene, and continue from the current state.
    ///
    /// Parameters
    /// ----------
    /// changes : dict
    ///     New values by path, as for `Scene.with_changes`: ``{"body.0.elastic.corotated.young": 1e5}``,
    ///     ``{"world.gravity": [0.0, 0.0]}``, ``{"time.step": 1e-4}``.
    ///
    /// Raises
    /// ------
    /// SceneError
    ///     The changed scene cannot be simulated, for example because its step is above the stability limit.
    ///     Nothing has changed then.
    /// ValueError
    ///     A change concerns the start of a simulation (meshes, initial positions and velocities), or enables
    ///     contact of bodies that overlap now. Nothing has changed then.
    ///
    /// Notes
    /// -----
    /// The scene is assembled anew, which takes as long as making a simulation; setting forces and pins does
    /// not. The energy balance (``balance.*`` in `energy`) restarts. A pin with a new motion continues from
    /// its current position, by the increments of the new motion from now on.
    ///
    /// Examples
    /// --------
    /// >>> simulation.set({"world.ether_drag": 2.0, "body.beam.elastic.poisson": 0.2})
    /// >>> simulation.set({"body.beam.elastic.young": np.linspace(5e4, 1e5, 8)})
    /// >>> float(simulation.scene.with_changes({})._value("body.0.elastic_factor.0"))
    /// 0.5
    fn set(&self, changes: &Bound<'_, PyDict>) -> PyResult<()> {
        let mut inner = self.lock()?;
        inner.change(changes)?;
        inner.publish(changes.py())
    }

    /// Change Young's modulus or Poisson's ratio of a body, and continue from the current state.
    ///
    /// Parameters
    /// ----------
    /// body : str or int
    ///     Name, or index from 0.
    /// young : float or str, optional
    ///     Young's modulus [Pa].
    /// poisson : float, optional
    ///     Poisson's ratio.
    ///
    /// Raises
    /// ------
    /// SceneError, ValueError
    ///     As for `set`.
    /// KeyError
    ///     There is no such body.
    ///
    /// Examples
    /// --------
    /// >>> simulation.set_material("beam", young="200 kPa")
    /// >>> simulation.step()
    #[pyo3(
        signature = (body, *, young = None, poisson = None, **others),
        text_signature = "($self, body, *, young=None, poisson=None)"
    )]
    fn set_material(
        &self,
        py: Python<'_>,
        body: &Bound<'_, PyAny>,
        young: Option<Bound<'_, PyAny>>,
        poisson: Option<Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        if let Some((name, _)) = others.and_then(|others| others.iter().next()) {
            let name: String = name.extract()?;
            let remedy = match pliant_scene::meant(&name, &["young", "poisson"]) {
                Some(meant) => format!("did you mean `{meant}`?"),
                None => "it has `young` and `poisson`, and `set` changes all else".to_owned(),
            };
            return Err(PyTypeError::new_err(format!("set_material has no argument `{name}`: {remedy}")));
        }
        let mut inner = self.lock()?;
        let bodies = &inner.scene.scene.body;
        let index = match body.extract::<usize>() {
            Ok(index) => Some(index).filter(|index| *index < bodies.len()),
            Err(_) => {
                let name: String = body.extract()?;
                bodies.iter().enumerate().position(|(i, body)| body.name_or_default(i) == name)
            }
        };
        let index = index.ok_or_else(|| PyKeyError::new_err(format!("there is no body {body}")))?;
        let written = serde_json::to_value(&bodies[index].elastic).unwrap_or_default();
        let Some(kind) = written.as_object().and_then(|table| table.keys().next()) else {
            return Err(PyValueError::new_err(format!("body {body} is not elastic: it has no `elastic`")));
        };
        let changes = PyDict::new(py);
        for (key, value) in [("young", young), ("poisson", poisson)] {
            if let Some(value) = value {
                changes.set_item(format!("body.{index}.elastic.{kind}.{key}"), value)?;
            }
        }
        inner.change(&changes)?;
        inner.publish(py)
    }

    /// ndarray or callable or None, shape (n, dim): Forces on all vertices [N], added to those of the scene:
    /// an array, which acts until it is replaced, or a function ``f(time, positions)`` that returns one,
    /// called at every evaluation of the force. Their work is external work.
    #[getter]
    fn external_forces(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        Ok(self.lock()?.additions.force.as_ref().map(|force| force.clone_ref(py)))
    }

    #[setter]
    fn set_external_forces(&self, force: &Bound<'_, PyAny>) -> PyResult<()> {
        let mut inner = self.lock()?;
        let term = inner.external_force(force)?;
        // An array is copied: what its owner does with it is no force.
        let kept: Option<Py<PyAny>> = match &term {
            None => None,
            Some(ExternalForce::Constant(rows)) => {
                Some(arrays::array(force.py(), rows.clone(), &self.shape())?.into_any().unbind())
            }
            Some(_) => Some(force.clone().unbind()),
        };
        inner.additions.force = kept;
        inner.simulation.set_external_forces(term);
        Ok(())
    }

    /// Pin vertices at their current positions.
    ///
    /// Parameters
    /// ----------
    /// vertices : array_like of int, or of bool with shape (n,)
    ///     The vertices.
    /// axes : str, default "xyz"
    ///     Axes to pin.
    /// name : str, optional
    ///     Name for `release` and `move`.
    ///
    /// Returns
    /// -------
    /// str
    ///     Name of the pin.
    ///
    /// Notes
    /// -----
    /// Use `move` to move the pin.
    ///
    /// Examples
    /// --------
    /// >>> simulation.pin([9], axes="y", name="hand")
    /// 'hand'
    /// >>> simulation.pins
    /// ['beam/left', 'hand']
    #[pyo3(signature = (vertices, *, axes = "xyz", name = None))]
    fn pin(
        &self,
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        axes: &str,
        name: Option<String>,
    ) -> PyResult<String> {
        let vertices = arrays::vertices(vertices, self.vertices)?;
        let known = &"xyz"[..self.dimension];
        if axes.is_empty() || axes.chars().any(|axis| !"xyz".contains(axis)) {
            return Err(PyValueError::new_err(format!("axes are letters of {known:?}, got {axes:?}")));
        }
        if vertices.is_empty() {
            return Err(PyValueError::new_err("no vertices to hold"));
        }
        let mut inner = self.lock()?;
        let mut number = inner.additions.pins.len();
        let taken = |inner: &Inner, name: &str| inner.simulation.pin_names().iter().any(|pin| pin == name);
        let name = name.unwrap_or_else(|| {
            while taken(&inner, &format!("pin{number}")) {
                number += 1;
            }
            format!("pin{number}")
        });
        if taken(&inner, &name) {
            return Err(PyValueError::new_err(format!("there is a pin {name:?} already")));
        }
        let axes = ['x', 'y', 'z'].map(|axis| axes.contains(axis));
        inner.simulation.pin(&name, &vertices, axes);
        inner.additions.pins.push(AddedPin { name: name.clone(), vertices, axes });
        inner.publish(py)?;
        Ok(name)
    }

    /// Move a pin from its current pose and velocity to a pose, and continue with a velocity.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Name returned by `pin`, or ``body/pin`` for a pin of the scene.
    /// pose : array_like, optional
    ///     Displacement [m], of shape (dim,), or a homogeneous matrix of shape (dim + 1, dim + 1), relative
    ///     to the initial positions of the vertices of the pin, about their mean. A pin without motion starts
    ///     at its first `move`. Default: the pose reached with `velocity`.
    /// velocity : array_like or tuple, optional
    ///     Velocity on arrival [m/s], of shape (dim,), or a pair of it and the angular velocity [rad/s], one
    ///     number in 2D, three in 3D. Default: zero.
    /// over : float, optional
    ///     Duration of the motion [s]; default: one step.
    ///
    /// Raises
    /// ------
    /// KeyError
    ///     There is no such pin, or it is released.
    /// ValueError
    ///     A shape is wrong, a number is not finite, a matrix is not a rotation, or `over` is not positive.
    ///
    /// Notes
    /// -----
    /// Position and velocity of the pin are continuous: its path is the cubic polynomial between both ends,
    /// and so is its rotation vector. It continues with `velocity` until the next `move`. Checkpoints and
    /// copies contain it; `restore` of an earlier state ends it.
    ///
    /// Examples
    /// --------
    /// >>> simulation.move("beam/left", [0.0, 0.1], over=0.02)
    /// >>> simulation.step(20)
    /// >>> simulation.positions[0].round(9)
    /// array([0. , 0.1])
    #[pyo3(name = "move", signature = (name, pose = None, velocity = None, *, over = None))]
    fn move_pin(
        &self,
        py: Python<'_>,
        name: &str,
        pose: Option<&Bound<'_, PyAny>>,
        velocity: Option<&Bound<'_, PyAny>>,
        over: Option<f64>,
    ) -> PyResult<()> {
        let mut inner = self.lock()?;
        let over = over.unwrap_or_else(|| inner.simulation.step_size());
        let mut target = steering::rates(velocity, self.dimension)?;
        target.pose = match (pose, inner.simulation.pin_waypoint(name)) {
            (Some(pose), _) => steering::pose(pose, self.dimension)?,
            (None, Some(now)) => Waypoint { pose: now.pose, ..target }.after(over).pose,
            // Which is said below.
            (None, None) => target.pose,
        };
        inner.simulation.move_pin(name, target, over).map_err(|error| match error {
            MoveError::NoPin { .. } => PyKeyError::new_err(error.to_string()),
            _ => PyValueError::new_err(error.to_string()),
        })?;
        inner.publish(py)
    }

    /// Release a pin.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Name returned by `pin`, or ``body/pin`` for a pin of the scene.
    ///
    /// Raises
    /// ------
    /// KeyError
    ///     There is no such pin, or it is already released.
    ///
    /// Examples
    /// --------
    /// >>> simulation.release("beam/left")
    /// >>> simulation.pins
    /// []
    fn release(&self, name: &str) -> PyResult<()> {
        let mut inner = self.lock()?;
        if !inner.simulation.release(name) {
            let names = inner.simulation.pin_names();
            let message = format!("there is no pin {name:?}; there are {names:?}");
            return Err(PyKeyError::new_err(message));
        }
        let before = inner.additions.pins.len();
        inner.additions.pins.retain(|pin| pin.name != name);
        if inner.additions.pins.len() == before {
            inner.additions.released.push(name.to_owned());
        }
        Ok(())
    }

    /// list of str: Names of the active pins.
    #[getter]
    fn pins(&self) -> PyResult<Vec<String>> {
        Ok(self.lock()?.simulation.pin_names())
    }

    /// list of float: Gravity of the scene [m/s^2], or texts if it is a formula of time; default: zero. An
    /// assignment changes ``world.gravity``, as by `set`.
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let inner = self.lock()?;
        let gravity = serde_json::to_value(&inner.scene.scene.world).unwrap_or_default();
        match gravity.get("gravity") {
            Some(gravity) => crate::document::from_json(py, gravity),
            None => Ok(vec![0.0; self.dimension].into_pyobject(py)?),
        }
    }

    #[setter]
    fn set_gravity(&self, py: Python<'_>, gravity: &Bound<'_, PyAny>) -> PyResult<()> {
        if gravity.is_none() {
            return Err(PyTypeError::new_err("gravity takes one number per axis"));
        }
        let changes = PyDict::new(py);
        changes.set_item("world.gravity", gravity)?;
        self.set(&changes)
    }
}
